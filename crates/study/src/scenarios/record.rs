//! The result of a run.

use diagnosis::Verdict;
use serde::{Deserialize, Serialize};
use vocabulary::ModulePhase;
use vocabulary::{Component, ComponentPath, Step, fault::FaultKind};

use super::paper_table::PaperTable;
use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::group::{Diagnosed, RigEvent};
use crate::rig::{Rig, TimedFault};
use crate::system::System;
use crate::system::gage_length_m;

/// A gage's healthy reading is averaged over this many steps before the fault.
const READING_STEPS: u64 = 20;

/// The messages exchanged by modules in a run.
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

/// The largest divergence of a run without a fault, in units of its channel's threshold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Closest {
    /// The channel's component.
    pub component: ComponentPath,
    /// The step.
    pub step: Step,
    /// D/γ; 1 is a change.
    pub ratio: f64,
}

/// The result of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ScenarioRow {
    /// Seed of its plant.
    pub seed: u64,
    /// Its fault, which is permanent; `None` in a nominal run.
    pub injection: Option<TimedFault>,
    /// Steps of the run.
    pub steps: u64,
    /// Base wind speed \[m/s\].
    pub base_speed_m_per_s: f64,
    /// For the fault of a gage: the size of its healthy reading right before the fault over its noise.
    pub reading_over_noise: Option<f64>,
    /// In a nominal run: the largest ratio of divergence to threshold, if any channel was watched.
    pub closest: Option<Closest>,
    /// All components declared faulty, in order.
    pub diagnosed: Vec<Diagnosed>,
    /// The messages exchanged by modules.
    pub conversation: Conversation,
}

impl ScenarioRow {
    pub(crate) fn of<K>(
        system: &System,
        case: &CampaignCase<K>,
        run: &mut CaseRun,
    ) -> Result<Self, StudyError> {
        let injection = case.faults.first();
        let mut reading = injection.and_then(|fault| GageReading::new(system, fault));
        let mut closest = None;
        while run.step()? {
            if let Some(reading) = &mut reading {
                reading.follow(&run.rig);
            }
            if injection.is_none() {
                follow_closest(&mut closest, &run.rig);
            }
        }
        Ok(Self {
            seed: case.seed,
            injection: injection.cloned(),
            steps: case.steps,
            base_speed_m_per_s: run.rig.plant().conditions().base_speed_m_per_s,
            reading_over_noise: reading.map(|reading| reading.over_noise()),
            closest,
            diagnosed: run.diagnosed(),
            conversation: conversation(&run.occurrences),
        })
    }

    /// Kind of the fault.
    #[must_use]
    pub fn kind(&self) -> Option<FaultKind> {
        self.injection.as_ref().map(|injection| injection.fault.kind())
    }

    /// First step with the fault; the end of a nominal run.
    #[must_use]
    pub fn onset(&self) -> Step {
        self.injection.as_ref().map_or(Step(self.steps), |injection| injection.at)
    }

    fn is_faulty(&self, component: &ComponentPath) -> bool {
        self.injection.as_ref().is_some_and(|injection| injection.component == *component)
    }

    /// Whether exactly the faulty components were named, and none before the fault.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        !self.is_false_alarm() && self.named().is_some() && self.wrong().next().is_none()
    }

    /// Whether any component was declared faulty before the fault began.
    #[must_use]
    pub fn is_false_alarm(&self) -> bool {
        self.diagnosed.iter().any(|diagnosed| diagnosed.detection < self.onset())
    }

    /// Whether any component was declared faulty after the fault had begun.
    #[must_use]
    pub fn is_detected(&self) -> bool {
        self.diagnosed.iter().any(|diagnosed| diagnosed.detection >= self.onset())
    }

    /// The verdict on the faulty component, if it was named after the fault had begun.
    #[must_use]
    pub fn named(&self) -> Option<&Diagnosed> {
        let onset = self.onset();
        self.diagnosed.iter().find(|d| self.is_faulty(&d.component) && d.detection >= onset)
    }

    /// Healthy components that were named.
    pub fn wrong(&self) -> impl Iterator<Item = &Diagnosed> {
        self.diagnosed.iter().filter(|diagnosed| !self.is_faulty(&diagnosed.component))
    }

    /// Steps from the fault to the change of the faulty component that named it.
    #[must_use]
    pub fn detection_delay(&self) -> Option<u64> {
        self.named().map(|diagnosed| diagnosed.detection.since(self.onset()))
    }

    /// Steps from the fault to the verdict on the faulty component.
    #[must_use]
    pub fn verdict_delay(&self) -> Option<u64> {
        self.named().map(|diagnosed| diagnosed.decided.since(self.onset()))
    }

    /// Samples with and without a fault, flagged and not: the paper's measure, in which any flag counts from its
    /// verdict on (Table 1).
    #[must_use]
    pub fn samples(&self) -> PaperTable<u64> {
        let first = self.diagnosed.iter().map(|diagnosed| diagnosed.decided.0).min();
        let flagged_from = first.unwrap_or(self.steps).min(self.steps);
        let onset = self.onset().0.min(self.steps);
        PaperTable::of([
            self.steps - onset.max(flagged_from),
            onset.max(flagged_from) - onset,
            onset.saturating_sub(flagged_from),
            onset.min(flagged_from),
        ])
    }
}

/// The reading of a gage right before its fault.
#[derive(Debug)]
pub(crate) struct GageReading {
    /// Index of its module, and its own.
    at: (usize, usize),
    noise_m: f64,
    onset: Step,
    mean_m: f64,
}

impl GageReading {
    /// `None` for an actuator.
    pub(crate) fn new(system: &System, fault: &TimedFault) -> Option<Self> {
        let System { structure, parameters, .. } = system;
        let TimedFault { at: onset, component: path, .. } = fault;
        let Component::Sensor(gage) = &path.component else { return None };
        let mut modules = structure.equipped().enumerate();
        let (place, module) = modules.find(|(_, module)| module.name == path.module)?;
        let at = (place, module.gages.iter().position(|other| other.name == *gage)?);
        let noise_m = parameters.gages.noise_strain * gage_length_m(structure, path);
        Some(Self { at, noise_m, onset: *onset, mean_m: 0.0 })
    }

    /// Processes the latest step.
    pub(crate) fn follow(&mut self, rig: &Rig) {
        let Some(sample) = rig.samples().get(self.at.0) else { return };
        let before = self.onset.minus(READING_STEPS) <= sample.step && sample.step < self.onset;
        if before {
            self.mean_m += sample.elongations_m[self.at.1] / READING_STEPS as f64;
        }
    }

    /// Its size over the gage's noise.
    pub(crate) fn over_noise(&self) -> f64 {
        self.mean_m.abs() / self.noise_m
    }
}

/// Processes the latest step of the modules that watch all their channels.
fn follow_closest(closest: &mut Option<Closest>, rig: &Rig) {
    for diagnoser in rig.diagnosers() {
        if diagnoser.phase() != ModulePhase::InService {
            continue;
        }
        for (component, evidence) in diagnoser.components().iter().zip(diagnoser.evidence()) {
            let (step, ratio) = (evidence.step, evidence.ratio());
            if ratio > closest.as_ref().map_or(0.0, |largest| largest.ratio) {
                let (module, component) = (diagnoser.module().clone(), component.clone());
                *closest =
                    Some(Closest { component: ComponentPath { module, component }, step, ratio });
            }
        }
    }
}

fn conversation(occurrences: &[RigEvent]) -> Conversation {
    let mut conversation = Conversation::default();
    for occurrence in occurrences {
        match occurrence {
            RigEvent::Identified { .. } => {}
            RigEvent::Change { .. } => conversation.changes += 1,
            RigEvent::Question { .. } => conversation.questions += 1,
            RigEvent::Transition { module, transition } => {
                if let Verdict::Explained { by, .. } = &transition.verdict {
                    conversation.explained += 1;
                    conversation.explained_by_peer += u64::from(by.module != *module);
                }
            }
        }
    }
    conversation
}
