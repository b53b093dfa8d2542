//! The same run in one process, on a virtual clock.

use std::collections::BTreeSet;

use study::{Rig, RigEvent, TimedFault};
use vocabulary::{ComponentPath, RunId};

use crate::deployment::Deployment;
use crate::held::Held;
use crate::timeline::Timeline;
use crate::verdict::Reached;

/// The verdicts of a run in one process, from the very files that the processes read.
#[must_use]
pub fn verdicts(deployment: &Deployment, seed: u64, run: RunId, steps: u64) -> BTreeSet<Reached> {
    final_verdicts(occurrences(deployment, seed, run, steps))
}

fn final_verdicts(occurrences: Vec<RigEvent>) -> BTreeSet<Reached> {
    let reached = occurrences.into_iter().filter_map(|occurrence| match occurrence {
        RigEvent::Transition { module, transition } => Reached::of_transition(&module, &transition),
        _ => None,
    });
    reached.collect()
}

/// The same with other faults than those of the deployment's schedule.
#[must_use]
pub fn verdicts_with(
    deployment: &Deployment,
    faults: &daemon::config::Schedule,
    seed: u64,
    run: RunId,
    steps: u64,
) -> BTreeSet<Reached> {
    final_verdicts(occurrences_with(deployment, faults, seed, run, steps))
}

/// What was held of each component at each step of such a run.
#[must_use]
pub fn timeline(deployment: &Deployment, seed: u64, run: RunId, steps: u64) -> Timeline {
    let mut timeline = Timeline::default();
    for occurrence in occurrences(deployment, seed, run, steps) {
        if let RigEvent::Transition { module, transition } = occurrence {
            let component = ComponentPath { module, component: transition.component };
            timeline.note(component, transition.decided, Held::of_verdict(&transition.verdict));
        }
    }
    timeline
}

fn occurrences(deployment: &Deployment, seed: u64, run: RunId, steps: u64) -> Vec<RigEvent> {
    let faults = deployment.plant_config(seed).schedule;
    occurrences_with(deployment, &faults, seed, run, steps)
}

fn occurrences_with(
    deployment: &Deployment,
    faults: &daemon::config::Schedule,
    seed: u64,
    run: RunId,
    steps: u64,
) -> Vec<RigEvent> {
    let config = deployment.plant_config(seed);
    let injections = faults.faults.iter().map(|fault| TimedFault {
        at: fault.at_step,
        until: fault.until_step,
        component: fault.component.clone(),
        fault: fault.fault,
    });
    let setups = deployment.diagnoser_configs().iter().map(|c| c.module_setup()).collect();
    let plant = config.make_plant().unwrap();
    let mut rig = Rig::new(plant, setups, injections.collect(), run).unwrap();
    rig.run(steps).unwrap();
    rig.take_occurrences()
}
