//! A commissioned plant and its diagnosers go through a case.

use diagnosis::state::Condition;
use diagnosis::{Doubt, ModuleSetup, Verdict};
use names::{ComponentPath, RunId, Step};
use serde::Serialize;

use super::draw::{Case, Situation};
use crate::commissioning::Site;
use crate::error::StudyError;
use crate::rig::{Occurrence, Rig};

/// How a faulty component stands at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// It is declared faulty.
    Named,
    /// It is the likeliest of several that may be.
    Likeliest,
    /// It is another one of several.
    InAGroup,
    /// Its change is explained by another fault, unconfirmed, or it cannot be compared.
    CannotTell,
    /// It passes for healthy.
    Normal,
}

/// What came of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseRecord {
    /// Its number.
    pub number: u64,
    /// How its faults hide.
    pub situation: Situation,
    /// Its faulty components with their fault in words, how each stands at the end, and when it was named.
    pub faulty: Vec<(ComponentPath, String, Standing, Option<Step>)>,
    /// Healthy components that were declared faulty, and when.
    pub healthy_named: Vec<(ComponentPath, Step)>,
    /// Healthy components that are suspected at the end, or cannot be compared.
    pub healthy_doubted: usize,
    /// Questions put to peers.
    pub questions: u64,
    /// Its length in steps.
    pub steps: u64,
}

/// Goes through a case and shows `each_step` what happened in each step.
///
/// # Errors
/// A plant or diagnosers that cannot be made.
pub fn run_case(
    site: &Site,
    setups: &[ModuleSetup],
    case: &Case,
    mut each_step: impl FnMut(&Rig, &[Occurrence]),
) -> Result<CaseRecord, StudyError> {
    let plant = site.plant(case.seed)?;
    let mut rig = Rig::new(plant, setups.to_vec(), case.schedule(), RunId(case.seed))?;
    let mut named: Vec<(ComponentPath, Step)> = Vec::new();
    for _ in 0..case.steps {
        let step = rig.plant().next_step();
        if let Some(blind) = case.blind.filter(|blind| blind.restarted && blind.until == step) {
            rig.restart(blind.place)?;
        }
        let blind = case.blind.filter(|blind| (blind.from..blind.until).contains(&step));
        rig.step_without(|place| blind.is_some_and(|blind| blind.place == place))?;
        let latest = rig.take_occurrences();
        each_step(&rig, &latest);
        named.extend(latest.iter().filter_map(latched));
    }
    Ok(record(case, &rig, named))
}

fn latched(occurrence: &Occurrence) -> Option<(ComponentPath, Step)> {
    let Occurrence::Transition { module, transition } = occurrence else { return None };
    let component = transition.component.clone();
    let path = ComponentPath { module: module.clone(), component };
    (transition.verdict == Verdict::Latched).then_some((path, transition.decided))
}

fn record(case: &Case, rig: &Rig, named: Vec<(ComponentPath, Step)>) -> CaseRecord {
    let is_faulty =
        |path: &ComponentPath| case.injections.iter().any(|fault| fault.component == *path);
    let standings = || {
        rig.diagnosers().iter().flat_map(|diagnoser| {
            let module = diagnoser.module().clone();
            diagnoser.verdicts().zip(diagnoser.conditions()).map(
                move |((component, verdict), condition)| {
                    let component = component.clone();
                    let path = ComponentPath { module: module.clone(), component };
                    let standing = standing(&path, verdict, condition);
                    (path, standing)
                },
            )
        })
    };
    let of = |path: &ComponentPath| {
        standings().find(|(other, _)| other == path).map_or(Standing::CannotTell, |(_, s)| s)
    };
    let faulty = case.injections.iter().map(|injection| {
        let path = injection.component.clone();
        let when = named.iter().find(|(other, _)| *other == path).map(|(_, step)| *step);
        (path.clone(), injection.fault.to_string(), of(&path), when)
    });
    let doubted = standings().filter(|(path, s)| !is_faulty(path) && *s != Standing::Normal);
    CaseRecord {
        number: case.number,
        situation: case.situation,
        faulty: faulty.collect(),
        healthy_doubted: doubted.count(),
        healthy_named: named.iter().filter(|(path, _)| !is_faulty(path)).cloned().collect(),
        questions: rig.diagnosers().iter().map(|d| d.counters().questions_asked).sum(),
        steps: case.steps,
    }
}

/// How a component stands of which this is known.
pub(crate) fn standing(path: &ComponentPath, verdict: &Verdict, condition: &Condition) -> Standing {
    let of_group = |suspects: &[ComponentPath]| match suspects.first() {
        Some(likeliest) if likeliest == path => Standing::Likeliest,
        _ => Standing::InAGroup,
    };
    match (verdict, condition) {
        (Verdict::Latched | Verdict::Acknowledged, _) => Standing::Named,
        (Verdict::Unconfirmed { doubt: Doubt::OneOf(_) }, Condition::OneOf { components, .. }) => {
            of_group(components)
        }
        (Verdict::Unconfirmed { doubt: Doubt::OneOf(suspects) }, _) => of_group(suspects),
        (Verdict::Normal, Condition::Agrees { .. } | Condition::NotVerified) => Standing::Normal,
        _ => Standing::CannotTell,
    }
}
