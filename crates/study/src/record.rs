//! What came of a run.

use diagnosis::Verdict;
use names::fault::{Fault, FaultKind};
use names::{Component, ComponentPath, Step};
use serde::{Deserialize, Serialize};
use truss::Structure;

use crate::closest::{Closest, ClosestSoFar};
use crate::rig::{Occurrence, Rig};
use crate::scenario::Scenario;

/// A gage's healthy reading is averaged over this many steps before the fault.
const READING_STEPS: u64 = 20;

/// Something that was committed as a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnosed {
    /// The component.
    pub component: ComponentPath,
    /// When its divergence reached its threshold.
    pub detection: Step,
    /// As of which step the verdict was found.
    pub decided: Step,
}

/// What the modules exchanged in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Conversation {
    /// Channels that rose to their thresholds.
    pub changes: u64,
    /// Questions asked.
    pub questions: u64,
    /// Changes that another component's fault explained.
    pub explained: u64,
    /// Of those, changes that a fault of another module explained.
    pub explained_by_peer: u64,
}

/// What came of a run with a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScenarioRecord {
    /// Number of the scenario.
    pub number: u64,
    /// Seed of its plant.
    pub seed: u64,
    /// The faulty component.
    pub component: ComponentPath,
    /// Its fault.
    pub fault: Fault,
    /// First step with the fault.
    pub onset: Step,
    /// Steps of the run.
    pub steps: u64,
    /// Base wind speed \[m/s\].
    pub base_speed_m_per_s: f64,
    /// For a gage: the size of its healthy reading right before the fault over its noise.
    pub reading_over_noise: Option<f64>,
    /// Everything that was committed, in order.
    pub diagnosed: Vec<Diagnosed>,
    /// What the modules exchanged.
    pub conversation: Conversation,
}

impl ScenarioRecord {
    /// Kind of the fault.
    #[must_use]
    pub fn kind(&self) -> FaultKind {
        self.fault.kind()
    }

    /// Were exactly the faulty components named, and nothing before the fault?
    #[must_use]
    pub fn is_exact(&self) -> bool {
        !self.is_false_alarm() && self.named().is_some() && self.wrong().next().is_none()
    }

    /// Was anything committed before the fault began?
    #[must_use]
    pub fn is_false_alarm(&self) -> bool {
        self.diagnosed.iter().any(|diagnosed| diagnosed.detection < self.onset)
    }

    /// Was anything committed once the fault had begun?
    #[must_use]
    pub fn is_detected(&self) -> bool {
        self.diagnosed.iter().any(|diagnosed| diagnosed.detection >= self.onset)
    }

    /// The verdict on the faulty component, if it was named after the fault had begun.
    #[must_use]
    pub fn named(&self) -> Option<&Diagnosed> {
        self.diagnosed.iter().find(|d| d.component == self.component && d.detection >= self.onset)
    }

    /// Components that were named and are healthy.
    pub fn wrong(&self) -> impl Iterator<Item = &Diagnosed> {
        self.diagnosed.iter().filter(|diagnosed| diagnosed.component != self.component)
    }

    /// Steps from the fault to the change of the faulty component that named it.
    #[must_use]
    pub fn detection_delay(&self) -> Option<u64> {
        self.named().map(|diagnosed| diagnosed.detection.since(self.onset))
    }

    /// Steps from the fault to the verdict on the faulty component.
    #[must_use]
    pub fn verdict_delay(&self) -> Option<u64> {
        self.named().map(|diagnosed| diagnosed.decided.since(self.onset))
    }

    /// Samples with and without a fault, flagged and not: the paper's measure, in which any flag
    /// counts from its verdict on (Table 1).
    #[must_use]
    pub fn confusion(&self) -> Confusion {
        let first = self.diagnosed.iter().map(|diagnosed| diagnosed.decided.0).min();
        let flagged_from = first.unwrap_or(self.steps).min(self.steps);
        let onset = self.onset.0.min(self.steps);
        Confusion {
            true_positive: self.steps - onset.max(flagged_from),
            false_negative: onset.max(flagged_from) - onset,
            false_positive: onset.saturating_sub(flagged_from),
            true_negative: onset.min(flagged_from),
        }
    }
}

/// Samples by what is the case and what is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Confusion {
    /// Faulty and flagged.
    pub true_positive: u64,
    /// Faulty and not flagged.
    pub false_negative: u64,
    /// Healthy and flagged.
    pub false_positive: u64,
    /// Healthy and not flagged.
    pub true_negative: u64,
}

/// What came of a run without a fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NominalRecord {
    /// Number of the run.
    pub number: u64,
    /// Seed of its plant.
    pub seed: u64,
    /// Base wind speed \[m/s\].
    pub base_speed_m_per_s: f64,
    /// Everything that was committed, in order: false alarms, all of them.
    pub diagnosed: Vec<Diagnosed>,
    /// How near it came to a change, if any channel was watched.
    pub closest: Option<Closest>,
    /// What the modules exchanged.
    pub conversation: Conversation,
}

impl NominalRecord {
    /// The record of a nominal run that is over.
    pub(crate) fn of(
        number: u64,
        seed: u64,
        rig: &Rig,
        occurrences: &[Occurrence],
        closest: &ClosestSoFar,
    ) -> Self {
        let (diagnosed, conversation) = heard(occurrences);
        let base_speed_m_per_s = rig.plant().conditions().base_speed_m_per_s;
        let closest = closest.finish(rig);
        Self { number, seed, base_speed_m_per_s, diagnosed, closest, conversation }
    }

    /// Was anything committed?
    #[must_use]
    pub fn is_false_alarm(&self) -> bool {
        !self.diagnosed.is_empty()
    }
}

/// Follows a scenario for what only shows while it runs.
#[derive(Debug)]
pub(crate) struct Watch {
    /// Module and place of the faulty gage, and its noise \[m\].
    gage: Option<(usize, usize, f64)>,
    onset: Step,
    reading_m: f64,
}

impl Watch {
    pub(crate) fn new(structure: &Structure, scenario: &Scenario, noise_strain: f64) -> Self {
        let path = &scenario.injection.component;
        let gage = structure.equipped().enumerate().find_map(|(index, module)| {
            let place = module.gages.iter().position(|gage| match &path.component {
                Component::Sensor(name) => module.name == path.module && gage.name == *name,
                Component::Actuator(_) => false,
            })?;
            Some((index, place, noise_strain * structure.gage_length_m(&module.gages[place])))
        });
        Self { gage, onset: scenario.injection.at, reading_m: 0.0 }
    }

    /// Looks at the latest step.
    pub(crate) fn follow(&mut self, rig: &Rig) {
        let Some((module, place, _)) = self.gage else { return };
        let Some(sample) = rig.samples().get(module) else { return };
        let before = self.onset.minus(READING_STEPS) <= sample.step && sample.step < self.onset;
        if before {
            self.reading_m += sample.elongations_m[place] / READING_STEPS as f64;
        }
    }

    /// The record of a scenario that is over, in which all this happened.
    pub(crate) fn finish(
        &self,
        scenario: &Scenario,
        rig: &Rig,
        occurrences: &[Occurrence],
        steps: u64,
    ) -> ScenarioRecord {
        let (diagnosed, conversation) = heard(occurrences);
        ScenarioRecord {
            number: scenario.number,
            seed: scenario.seed,
            component: scenario.injection.component.clone(),
            fault: scenario.injection.fault,
            onset: scenario.injection.at,
            steps,
            base_speed_m_per_s: rig.plant().conditions().base_speed_m_per_s,
            reading_over_noise: self.gage.map(|(_, _, noise_m)| self.reading_m.abs() / noise_m),
            diagnosed,
            conversation,
        }
    }
}

/// What the modules committed and exchanged.
fn heard(occurrences: &[Occurrence]) -> (Vec<Diagnosed>, Conversation) {
    let mut diagnosed = Vec::new();
    let mut conversation = Conversation::default();
    for occurrence in occurrences {
        match occurrence {
            Occurrence::Identified { .. } => {}
            Occurrence::Change { .. } => conversation.changes += 1,
            Occurrence::Question { .. } => conversation.questions += 1,
            Occurrence::Transition { module, transition } => match &transition.verdict {
                Verdict::Latched => diagnosed.push(Diagnosed {
                    component: ComponentPath {
                        module: module.clone(),
                        component: transition.component.clone(),
                    },
                    detection: transition.detection,
                    decided: transition.decided,
                }),
                Verdict::Explained { by, .. } => {
                    conversation.explained += 1;
                    conversation.explained_by_peer += u64::from(by.module != *module);
                }
                Verdict::Normal
                | Verdict::Tentative
                | Verdict::Unconfirmed { .. }
                | Verdict::Acknowledged
                | Verdict::Unknown => {}
            },
        }
    }
    (diagnosed, conversation)
}
