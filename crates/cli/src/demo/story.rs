//! The faults that the demo shows, one after the other, each in a component of its own.

use names::fault::Fault;
use names::{ComponentError, ComponentPath, Step};

/// From the injection of a fault to the repair, in seconds of the plant.
const REPAIRED_AFTER_S: f64 = 1.2;

/// One fault and what it shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Story {
    pub(super) title: &'static str,
    pub(super) component: ComponentPath,
    pub(super) fault: Fault,
}

/// The stories in their order.
const STORIES: [(&str, &str, Fault); 6] = [
    (
        "a gage reads too much; no other module knows of a cause, so the gage is faulty",
        "module1/sensor/g2",
        Fault::Bias { offset_m: 1.5e-4 },
    ),
    (
        "a gage drifts at random",
        "module1/sensor/g7",
        Fault::RandomWalk { drift_m_per_s: 2e-4, increment_m: 2e-5 },
    ),
    (
        "oil leaks from one chamber of a cylinder into the other",
        "module1/actuator/a3",
        Fault::InternalLeakage { area_m2: 3e-7 },
    ),
    (
        "a cylinder leaks to the outside",
        "module2/actuator/a4",
        Fault::ExternalLeakageA { area_m2: 3e-7 },
    ),
    (
        "a valve stands fully open; what the gages of both modules see of it, now and when it closes, \
         is explained by the module with the valve",
        "module1/actuator/a1",
        Fault::HardOver {},
    ),
    (
        "a gage reads far too much; the controller reacts, forces and other gages follow, and the \
         first change explains them all",
        "module2/sensor/g1",
        Fault::Bias { offset_m: -6e-4 },
    ),
];

/// The stories.
///
/// # Errors
/// A component's path that is none.
pub(super) fn stories() -> Result<Vec<Story>, ComponentError> {
    let story = |(title, path, fault): &(&'static str, &str, Fault)| {
        Ok(Story { title, component: path.parse()?, fault: *fault })
    };
    STORIES.iter().map(story).collect()
}

/// Lengths in steps that the times of the stories follow from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    /// Length of a step \[s\].
    pub(super) step_s: f64,
    /// When every channel is watched.
    pub(super) warm_up: u64,
    /// How long effects take to show.
    pub(super) effects: u64,
    /// How long the statistics remember.
    pub(super) interval: u64,
}

impl Pace {
    fn steps(&self, seconds: f64) -> u64 {
        (seconds / self.step_s).round() as u64
    }

    /// The first story: a while after the warm-up.
    fn first(&self) -> Step {
        Step(self.warm_up + self.steps(0.6))
    }

    /// From a repair until the statistics have forgotten it. While they forget, the component may
    /// change once more.
    fn forgotten(&self) -> u64 {
        self.interval + self.steps(0.1)
    }

    /// From a story to the next: everything is forgotten and the fault explains nothing any more.
    fn spacing(&self) -> u64 {
        self.steps(REPAIRED_AFTER_S) + self.forgotten() + self.effects
    }
}

/// A story with its times.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Act {
    pub(super) story: Story,
    /// The first step that shows the fault.
    pub(super) injected: Step,
    /// The first step without it.
    pub(super) repaired: Step,
    /// The first step at which nothing of it is left in the statistics.
    pub(super) over: Step,
}

/// Puts the stories in time.
pub(super) fn acts(stories: Vec<Story>, pace: &Pace) -> Vec<Act> {
    let acts = stories.into_iter().enumerate().map(|(place, story)| {
        let injected = pace.first().plus(place as u64 * pace.spacing());
        let repaired = injected.plus(pace.steps(REPAIRED_AFTER_S));
        Act { story, injected, repaired, over: repaired.plus(pace.forgotten()) }
    });
    acts.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const PACE: Pace = Pace { step_s: 1e-3, warm_up: 3000, effects: 250, interval: 2000 };

    #[test]
    fn every_story_has_a_component_of_its_own_that_can_have_the_fault() {
        let stories = stories().unwrap();
        let components: BTreeSet<_> = stories.iter().map(|story| &story.component).collect();
        assert_eq!(components.len(), stories.len());
        for story in &stories {
            assert_eq!(story.component.component.kind(), story.fault.kind().component_kind());
            story.fault.check().unwrap();
        }
    }

    #[test]
    fn a_story_is_forgotten_and_explains_nothing_any_more_when_the_next_begins() {
        let acts = acts(stories().unwrap(), &PACE);
        assert!(acts[0].injected.0 > PACE.warm_up);
        for pair in acts.windows(2) {
            assert!(pair[1].injected.since(pair[0].repaired) > PACE.interval + PACE.effects);
            assert!(pair[0].repaired < pair[0].over && pair[0].over < pair[1].injected);
        }
    }
}
