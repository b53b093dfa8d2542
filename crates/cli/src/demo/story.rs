//! The faults of the demo, one after the other, each in a different component.

use diagnosis::ModuleSetup;
use serde::Serialize;
use vocabulary::{Component, ComponentPath, Step, fault::Fault};

/// Time from the injection of a fault to its repair, in seconds of the plant: for a fault that causes an immediate
/// change, and for one that only the means over two whole seconds reveal.
const REPAIRED_AFTER_S: f64 = 1.2;
const CREPT_AFTER_S: f64 = 3.2;

/// Noise of the tower's gages, as strain.
const TOWERS_NOISE_STRAIN: f64 = 0.3e-6;

/// Description, module and component (each by its place, counted on from the first after the last), fault and duration
/// \[s\] of each story, in order. Faults of gages are those of a gage of one metre with the tower's noise.
const STORIES: [(&str, usize, usize, Fault, f64); 7] = [
    (
        "a gage reads too much; no other module knows of a cause, so the gage is faulty",
        0,
        1,
        Fault::Bias { offset_m: 5e-5 },
        REPAIRED_AFTER_S,
    ),
    (
        "oil leaks from one chamber of a cylinder into the other",
        0,
        2,
        Fault::InternalLeakage { area_m2: 3e-7 },
        REPAIRED_AFTER_S,
    ),
    (
        "a cylinder leaks to the outside",
        1,
        3,
        Fault::ExternalLeakageA { area_m2: 3e-7 },
        REPAIRED_AFTER_S,
    ),
    (
        "a valve stands fully open; what gages of any module see of it, now and when it closes, \
         is explained by the module with the valve",
        0,
        0,
        Fault::HardOver {},
        REPAIRED_AFTER_S,
    ),
    (
        "a gage reads far too much; the controller reacts, forces and other gages follow, and the \
         first change explains them all",
        1,
        0,
        Fault::Bias { offset_m: -2e-4 },
        REPAIRED_AFTER_S,
    ),
    (
        "a gage drifts at random",
        0,
        6,
        Fault::RandomWalk { drift_m_per_s: 2e-5, increment_m: 4e-6 },
        REPAIRED_AFTER_S,
    ),
    (
        "a gage creeps; where no change shows, the comparison with what the healthy module measured \
         finds it",
        1,
        2,
        Fault::Drift { drift_m_per_s: 3e-5 },
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

/// Schedules the stories: each in a component of its own, and none for which no component is left.
pub(super) fn acts(timing: &DemoTiming, setups: &[ModuleSetup]) -> Vec<Act> {
    let mut next = timing.first();
    let mut acts: Vec<Act> = Vec::new();
    for (title, module, place, fault, lasts_s) in STORIES {
        let is_free = |path: &ComponentPath| acts.iter().all(|act| act.component != *path);
        let found = turned(setups, module).find_map(|setup| {
            let mut components = setup.components();
            components.retain(|component| component.kind() == fault.kind().component_kind());
            let mut paths = turned(&components, place).map(|component| ComponentPath {
                module: setup.module.clone(),
                component: component.clone(),
            });
            paths.find(is_free).map(|path| (setup, path))
        });
        let Some((setup, component)) = found else { continue };
        let fault = scaled(fault, setup, &component.component);
        let injected = next;
        let repaired = injected.plus(timing.steps(lasts_s));
        let over = repaired.plus(timing.forgotten());
        // The statistics have forgotten the fault, which does not explain changes any more.
        next = over.plus(timing.effects);
        acts.push(Act { title, component, fault, injected, repaired, over });
    }
    acts
}

/// All of a list, from this place on and then from its beginning.
fn turned<T>(list: &[T], first: usize) -> impl Iterator<Item = &T> {
    list.iter().cycle().skip(first).take(list.len())
}

/// The fault in a gage of its length, and as far above its noise as in the tower's.
fn scaled(fault: Fault, setup: &ModuleSetup, component: &Component) -> Fault {
    let module = setup.structure.module(&setup.module);
    let gage = module.and_then(|m| {
        m.gages.iter().find(|gage| *component == Component::Sensor(gage.name.clone()))
    });
    let length_m = gage.map_or(1.0, |gage| setup.structure.gage_length_m(gage));
    let factor = length_m * (setup.gage_noise_strain / TOWERS_NOISE_STRAIN).max(1.0);
    match fault {
        Fault::Bias { offset_m } => Fault::Bias { offset_m: factor * offset_m },
        Fault::Drift { drift_m_per_s } => Fault::Drift { drift_m_per_s: factor * drift_m_per_s },
        Fault::RandomWalk { drift_m_per_s, increment_m } => Fault::RandomWalk {
            drift_m_per_s: factor * drift_m_per_s,
            // The spread of a walk grows with the square root of time.
            increment_m: factor * increment_m * (setup.step_s / 1e-3).sqrt(),
        },
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use daemon::config::load_diagnoser;

    use super::*;
    use crate::shipped::{MODULES, OTHERS, Shipped};

    const TIMING: DemoTiming =
        DemoTiming { step_s: 1e-3, warm_up: 3000, effects: 250, interval: 2000 };

    /// The tower's modules.
    fn tower() -> Vec<ModuleSetup> {
        let place = tempfile::tempdir().unwrap();
        for file in OTHERS {
            file.write(place.path()).unwrap();
        }
        let load = |module: Shipped| {
            load_diagnoser(&module.write(place.path()).unwrap()).unwrap().module_setup()
        };
        MODULES.map(load).into()
    }

    #[test]
    fn every_story_has_a_component_of_its_own_that_can_have_the_fault() {
        let acts = acts(&TIMING, &tower());
        let components: BTreeSet<_> = acts.iter().map(|act| &act.component).collect();
        assert_eq!((components.len(), acts.len()), (STORIES.len(), STORIES.len()));
        for act in &acts {
            assert_eq!(act.component.component.kind(), act.fault.kind().component_kind());
            act.fault.check().unwrap();
        }
    }

    #[test]
    fn a_story_is_forgotten_and_explains_nothing_any_more_when_the_next_begins() {
        let acts = acts(&TIMING, &tower());
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
        for Act { fault, injected, repaired, .. } in acts(&TIMING, &tower()) {
            let Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 } = fault else {
                continue;
            };
            assert!(drift_m_per_s.abs() < 0.2 * MINIMUM_ISOLABLE_STRAIN_PER_S * SHORTEST_GAGE_M);
            assert!(repaired.since(injected) > 3000);
        }
    }

    #[test]
    fn a_structure_with_few_components_has_fewer_stories() {
        let mut setup = tower().remove(0);
        let whole = &mut setup.structure;
        let place = whole.modules.iter().position(|module| module.name == setup.module).unwrap();
        whole.modules[place].actuators.clear();
        whole.modules[place].gages.truncate(2);
        let acts = acts(&TIMING, &[setup]);
        let gages: Vec<_> = acts.iter().map(|act| act.component.component.name()).collect();
        assert_eq!(gages, ["g2", "g1"]);
    }
}
