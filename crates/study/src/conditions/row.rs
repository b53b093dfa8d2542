//! The result of a case.

use diagnosis::state::Condition;
use diagnosis::{Doubt, Verdict};
use serde::{Deserialize, Serialize};
use vocabulary::{ComponentPath, Step};

use super::situation::Situation;
use crate::case::{CampaignCase, CaseRun};
use crate::group::Diagnosed;

/// The verdict on a faulty component at the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Standing {
    /// It is declared faulty.
    Named,
    /// It is the likeliest of several suspects.
    Likeliest,
    /// It is another one of several suspects.
    InAGroup,
    /// Its change is explained by another fault, unconfirmed, or it cannot be compared.
    CannotTell,
    /// It is considered healthy.
    Normal,
}

/// A faulty component.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Faulty {
    /// The component.
    pub component: ComponentPath,
    /// Its fault in words.
    pub fault: String,
    /// The verdict at the end.
    pub standing: Standing,
    /// The step as of which it was first named after its fault had begun.
    pub named: Option<Step>,
}

/// The result of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConditionRow {
    /// The situation.
    pub situation: Situation,
    /// Seed of its plant's run.
    pub seed: u64,
    /// Whether samples were lost or diagnosers restarted.
    pub disturbed: bool,
    /// Its faulty components, in the order of onset.
    pub faulty: Vec<Faulty>,
    /// Components that were named but had never been faulty. A fault that begins while an earlier change awaits
    /// judgement counts in that judgement.
    pub healthy_named: Vec<Diagnosed>,
    /// Healthy components that are suspected at the end, or cannot be compared.
    pub healthy_doubted: usize,
    /// Changes that could not be judged in the end.
    pub unconfirmed: usize,
    /// Questions put to peers.
    pub questions: u64,
    /// Its length in steps.
    pub steps: u64,
}

impl ConditionRow {
    /// The result of a case that has ended.
    pub(super) fn of(case: &CampaignCase<Situation>, run: &CaseRun) -> Self {
        let named = run.diagnosed();
        let was_faulty = |path: &ComponentPath, until: Step| {
            case.faults.iter().any(|fault| fault.component == *path && fault.at <= until)
        };
        let diagnosers = run.rig.diagnosers();
        let standings: Vec<(ComponentPath, Standing)> = diagnosers
            .iter()
            .flat_map(|diagnoser| {
                diagnoser.verdicts().zip(diagnoser.conditions()).map(
                    |((own, verdict), condition)| {
                        let (module, component) = (diagnoser.module().clone(), own.clone());
                        let path = ComponentPath { module, component };
                        let standing = standing(&path, verdict, condition);
                        (path, standing)
                    },
                )
            })
            .collect();
        let of = |path: &ComponentPath| {
            let found = standings.iter().find(|(other, _)| other == path);
            found.map_or(Standing::CannotTell, |(_, standing)| *standing)
        };
        let mut faulty: Vec<Faulty> = Vec::new();
        for injection in &case.faults {
            let component = &injection.component;
            if faulty.iter().any(|known| known.component == *component) {
                continue;
            }
            let mut rightly = named.iter().filter(|n| was_faulty(&n.component, n.decided));
            faulty.push(Faulty {
                component: component.clone(),
                fault: injection.fault.to_string(),
                standing: of(component),
                named: rightly.find(|n| n.component == *component).map(|n| n.decided),
            });
        }
        let doubted = standings.iter().filter(|(path, standing)| {
            *standing != Standing::Normal && !was_faulty(path, Step(u64::MAX))
        });
        let unconfirmed = diagnosers.iter().flat_map(|diagnoser| diagnoser.verdicts());
        Self {
            situation: case.kind,
            seed: case.seed,
            disturbed: !case.gaps.is_empty(),
            healthy_doubted: doubted.count(),
            unconfirmed: unconfirmed
                .filter(|(_, verdict)| matches!(verdict, Verdict::Unconfirmed { .. }))
                .count(),
            questions: diagnosers.iter().map(|d| d.counters().questions_asked).sum(),
            steps: case.steps,
            healthy_named: named
                .iter()
                .filter(|n| !was_faulty(&n.component, n.decided))
                .cloned()
                .collect(),
            faulty,
        }
    }
}

/// The standing of a component with this verdict and condition.
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
