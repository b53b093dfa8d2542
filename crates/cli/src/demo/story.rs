//! The faults of the demo, one after the other, each in a different component.

use serde::Serialize;
use vocabulary::{ComponentError, ComponentPath, Step, fault::Fault};

/// Time from the injection of a fault to its repair, in seconds of the plant: for a fault that causes an immediate
/// change, and for one that only the means over two whole seconds reveal.
const REPAIRED_AFTER_S: f64 = 1.2;
const CREPT_AFTER_S: f64 = 3.2;

/// Description, component, fault and duration \[s\] of each story, in order.
const STORIES: [(&str, &str, Fault, f64); 7] = [
    (
        "a gage reads too much; no other module knows of a cause, so the gage is faulty",
        "module1/sensor/g2",
        Fault::Bias { offset_m: 1.5e-4 },
        REPAIRED_AFTER_S,
    ),
    (
        "oil leaks from one chamber of a cylinder into the other",
        "module1/actuator/a3",
        Fault::InternalLeakage { area_m2: 3e-7 },
        REPAIRED_AFTER_S,
    ),
    (
        "a cylinder leaks to the outside",
        "module2/actuator/a4",
        Fault::ExternalLeakageA { area_m2: 3e-7 },
        REPAIRED_AFTER_S,
    ),
    (
        "a valve stands fully open; what the gages of both modules see of it, now and when it closes, \
         is explained by the module with the valve",
        "module1/actuator/a1",
        Fault::HardOver {},
        REPAIRED_AFTER_S,
    ),
    (
        "a gage reads far too much; the controller reacts, forces and other gages follow, and the \
         first change explains them all",
        "module2/sensor/g1",
        Fault::Bias { offset_m: -6e-4 },
        REPAIRED_AFTER_S,
    ),
    (
        "a gage drifts at random",
        "module1/sensor/g7",
        Fault::RandomWalk { drift_m_per_s: 2e-4, increment_m: 2e-5 },
        REPAIRED_AFTER_S,
    ),
    (
        "a gage creeps, too slowly for a change to show; compared with what the healthy module \
         measured, it is found all the same",
        "module2/sensor/g3",
        Fault::Drift { drift_m_per_s: 9e-5 },
        CREPT_AFTER_S,
    ),
];

/// Durations in steps that determine the times of the stories.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DemoTiming {
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    /// The duration of warm-up.
    pub(super) warm_up: u64,
    /// The duration of effects.
    pub(super) effects: u64,
    /// The memory of the statistics.
    pub(super) interval: u64,
}

impl DemoTiming {
    fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.step_s).round() as u64
    }

    /// The start of the first story, a while after the warm-up.
    fn first(&self) -> Step {
        Step(self.warm_up + self.steps(0.6))
    }

    /// The time from a repair until the statistics have forgotten the fault. While they do, the component may change
    /// once more.
    fn forgotten(&self) -> u64 {
        self.interval + self.steps(0.1)
    }
}

/// A fault with its description and its times.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Act {
    #[serde(skip)]
    pub(super) title: &'static str,
    pub(super) component: ComponentPath,
    pub(super) fault: Fault,
    /// The first step with the fault.
    #[serde(rename = "step")]
    pub(super) injected: Step,
    /// The first step without the fault.
    #[serde(rename = "repaired_step")]
    pub(super) repaired: Step,
    /// The first step at which the statistics have forgotten the fault.
    #[serde(skip)]
    pub(super) over: Step,
}

/// Schedules the stories.
///
/// # Errors
/// A component path is invalid.
pub(super) fn acts(timing: &DemoTiming) -> Result<Vec<Act>, ComponentError> {
    let mut next = timing.first();
    let act = |(title, path, fault, lasts_s)| {
        let injected = next;
        let repaired = injected.plus(timing.steps(lasts_s));
        let over = repaired.plus(timing.forgotten());
        // The statistics have forgotten the fault, which does not explain changes any more.
        next = over.plus(timing.effects);
        Ok(Act { title, component: str::parse(path)?, fault, injected, repaired, over })
    };
    STORIES.into_iter().map(act).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const TIMING: DemoTiming =
        DemoTiming { step_s: 1e-3, warm_up: 3000, effects: 250, interval: 2000 };

    #[test]
    fn every_story_has_a_component_of_its_own_that_can_have_the_fault() {
        let acts = acts(&TIMING).unwrap();
        let components: BTreeSet<_> = acts.iter().map(|act| &act.component).collect();
        assert_eq!(components.len(), acts.len());
        for act in &acts {
            assert_eq!(act.component.component.kind(), act.fault.kind().component_kind());
            act.fault.check().unwrap();
        }
    }

    #[test]
    fn a_story_is_forgotten_and_explains_nothing_any_more_when_the_next_begins() {
        let acts = acts(&TIMING).unwrap();
        assert!(acts[0].injected.0 > TIMING.warm_up);
        for pair in acts.windows(2) {
            assert!(pair[1].injected.since(pair[0].repaired) > TIMING.interval + TIMING.effects);
            assert!(pair[0].repaired < pair[0].over && pair[0].over < pair[1].injected);
        }
    }

    #[test]
    fn a_creeping_fault_lasts_for_two_whole_seconds_wherever_they_begin() {
        const MINIMUM_ISOLABLE_STRAIN_PER_S: f64 = 270e-6;
        const SHORTEST_GAGE_M: f64 = 3.0;
        for Act { fault, injected, repaired, .. } in acts(&TIMING).unwrap() {
            let Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 } = fault else {
                continue;
            };
            assert!(drift_m_per_s.abs() < 0.2 * MINIMUM_ISOLABLE_STRAIN_PER_S * SHORTEST_GAGE_M);
            assert!(repaired.since(injected) > 3000);
        }
    }
}
