//! The same run in one process, on a virtual clock.

use std::collections::BTreeSet;

use study::{Injection, Occurrence, Rig, Schedule};
use truss::ids::RunId;

use crate::deployment::Deployment;
use crate::verdict::Reached;

/// The verdicts of a run in one process, from the very files that the processes read.
#[must_use]
pub fn verdicts(deployment: &Deployment, seed: u64, run: RunId, steps: u64) -> BTreeSet<Reached> {
    let config = deployment.plant_config(seed);
    let injections = config.schedule.faults.iter().map(|fault| Injection {
        at: fault.at_step,
        until: fault.until_step,
        component: fault.component.clone(),
        fault: fault.fault,
    });
    let setups = deployment.diagnoser_configs().iter().map(|c| c.module_setup()).collect();
    let plant = config.make_plant().unwrap();
    let mut rig = Rig::new(plant, setups, Schedule::new(injections.collect()), run).unwrap();
    rig.run(steps).unwrap();
    let reached = rig.take_occurrences().into_iter().filter_map(|occurrence| match occurrence {
        Occurrence::Transition { module, transition } => {
            Reached::of_transition(&module, &transition)
        }
        _ => None,
    });
    reached.collect()
}
