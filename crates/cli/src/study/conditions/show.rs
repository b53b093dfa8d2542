//! What happens in one case, step by step.

use std::collections::BTreeMap;
use std::io::{self, Write};

use diagnosis::Transition;
use diagnosis::state::{Condition, WindowLength};
use names::ComponentPath;
use study::conditions::{Case, CommissionedPlant, ConditionCampaign, run_case};
use study::{Occurrence, Rig};

use super::super::runs::unusable;
use super::Arguments;
use crate::failure::Failure;

/// Of a component of which nothing else is known.
const AGREES: &str = "agrees with its reference";

/// Prints the first case.
pub(super) fn case(
    arguments: &Arguments,
    campaign: &ConditionCampaign,
    plant: &CommissionedPlant,
) -> Result<(), Failure> {
    let case = campaign.case(plant, arguments.from).map_err(|error| unusable(&error))?;
    let mut out = io::stdout().lock();
    heading(&case, plant, &mut out)?;
    let mut conditions = Conditions::default();
    let mut failed = Ok(());
    let record = run_case(&plant.site, &plant.setups, &case, |rig, occurrences| {
        if failed.is_ok() {
            let mut each = occurrences.iter();
            failed = each
                .try_for_each(|occurrence| occurred(occurrence, &mut out))
                .and_then(|()| conditions.changed(rig, &mut out));
        }
    });
    let record = record.map_err(|error| unusable(&error))?;
    failed?;
    for (component, _, standing, named) in &record.faulty {
        let named = named.map_or_else(String::new, |step| format!(", named at step {step}"));
        writeln!(out, "at the end {component}: {standing:?}{named}")?;
    }
    out.flush()?;
    if record.healthy_named.is_empty() || arguments.alone {
        return Ok(());
    }
    Err(Failure::runtime(super::defect(arguments, &record, 1)))
}

fn heading(case: &Case, plant: &CommissionedPlant, out: &mut impl Write) -> io::Result<()> {
    let situation = case.situation.as_str();
    writeln!(
        out,
        "case {}, {situation}, plant {}, seed {}, {} steps",
        case.number, plant.number, case.seed, case.steps
    )?;
    for injection in &case.injections {
        let (at, fault) = (injection.at, injection.fault);
        writeln!(out, "  from step {at}: {}, {fault}", injection.component)?;
    }
    let Some(blind) = case.blind else { return Ok(()) };
    let then = if blind.restarted { "is down" } else { "sees nothing" };
    let module = &plant.setups[blind.place].module;
    writeln!(out, "  {module} {then} from step {} to {}", blind.from, blind.until.minus(1))
}

fn occurred(occurrence: &Occurrence, out: &mut impl Write) -> io::Result<()> {
    match occurrence {
        Occurrence::Change { module, change } => {
            let (step, ratio) = (change.step.0, change.ratio);
            writeln!(out, "step {step:>7}  change      {module}/{} {ratio:.1}", change.component)
        }
        Occurrence::Transition { module, transition } => {
            let Transition { decided, component, verdict, detection, onset, symptom, .. } =
                transition.as_ref();
            let decided = decided.0;
            writeln!(
                out,
                "step {decided:>7}  verdict     {module}/{component} {verdict:?} {symptom:?} (onset \
                 {onset}, detected {detection})"
            )
        }
        Occurrence::Question { .. } | Occurrence::Identified { .. } => Ok(()),
    }
}

/// What was printed last of the conditions of components.
#[derive(Default)]
struct Conditions {
    latest: BTreeMap<ComponentPath, String>,
}

impl Conditions {
    /// Prints those that have changed, once a window has ended; that nothing is wrong goes without saying.
    fn changed(&mut self, rig: &Rig, out: &mut impl Write) -> io::Result<()> {
        let step = rig.samples().first().map_or(0, |sample| sample.step.0);
        for diagnoser in rig.diagnosers().iter().filter(|d| d.window(WindowLength::Long).is_some())
        {
            for (component, condition) in diagnoser.components().iter().zip(diagnoser.conditions())
            {
                let (module, component) = (diagnoser.module().clone(), component.clone());
                let path = ComponentPath { module, component };
                let now = in_words(condition);
                let before = self.latest.get(&path).map_or(AGREES, String::as_str);
                if before != now {
                    writeln!(out, "step {step:>7}  condition   {path} {now}")?;
                    self.latest.insert(path, now);
                }
            }
        }
        Ok(())
    }
}

fn in_words(condition: &Condition) -> String {
    match condition {
        Condition::NotVerified => "is not verified".to_owned(),
        Condition::NotCompared | Condition::Agrees { .. } => AGREES.to_owned(),
        Condition::Doubtful { .. } => "departed once".to_owned(),
        Condition::Departed { .. } => "has departed from its reference".to_owned(),
        Condition::OneOf { components, .. } => {
            let names: Vec<String> = components.iter().map(ToString::to_string).collect();
            format!("is one of {}", names.join(", "))
        }
        Condition::CannotTell { obstacle } => format!("cannot be compared: {obstacle}"),
    }
}
