//! Between what a diagnoser takes and gives, and messages. Both ways lose nothing that a verdict depends on: finite
//! numbers come back as the very same bits.

mod configuration;
mod identification;
mod input;

pub use configuration::{from_diagnoser, setup_fingerprint, to_diagnoser, to_setup};
pub use input::{from_taken, to_memory, to_taken};

use crate::{Diagnoser, Transition};
use vocabulary::{
    Component, ComponentPath, FaultTransition, FreezeFrame, FrozenSignals, ModuleName, RunId, Step,
    StructureName, Verdict,
};

/// The publishing module.
#[derive(Debug, Clone)]
pub struct Speaker {
    /// Its structure.
    pub structure: StructureName,
    /// Its name.
    pub module: ModuleName,
    /// What its sequence numbers count in, as it stands in [`FaultTransition::incarnation`].
    pub incarnation: u64,
}

impl Speaker {
    /// One without a journal.
    #[must_use]
    pub fn of(structure: StructureName, module: ModuleName) -> Self {
        Self { structure, module, incarnation: 0 }
    }

    /// The key of one of its topics.
    #[must_use]
    pub fn key(&self, topic: vocabulary::Topic) -> String {
        vocabulary::Key::of_module(&self.structure, &self.module, topic).to_string()
    }

    /// One of its components, with its name before.
    #[must_use]
    pub fn path(&self, component: &Component) -> ComponentPath {
        ComponentPath { module: self.module.clone(), component: component.clone() }
    }

    /// The message on a component that never had a transition.
    #[must_use]
    pub fn untouched(&self, component: &Component, time_unix_ns: u64) -> FaultTransition {
        let (structure, component) = (self.structure.clone(), self.path(component));
        let incarnation = self.incarnation;
        FaultTransition {
            incarnation,
            ..FaultTransition::untouched(structure, component, time_unix_ns)
        }
    }

    /// The message on a transition.
    #[must_use]
    pub fn transition(&self, transition: Transition, time_unix_ns: u64) -> FaultTransition {
        let Transition {
            sequence,
            run,
            run_ended,
            component,
            verdict,
            symptom,
            onset,
            detection,
            decided,
            evidence,
            before_service,
            disputed,
            tare,
            order,
            verdict_order,
            shelved,
            suppressed,
            shut_off,
        } = transition;
        let mut message = self.untouched(&component, time_unix_ns);
        message.sequence = sequence;
        message.run = Some(run);
        message.run_ended = run_ended;
        message.onset_step = Some(onset);
        message.detection_step = Some(detection);
        message.decided_step = Some(decided);
        message.evidence = Some(evidence);
        message.order = order;
        message.state_order = verdict_order;
        message.shelved = shelved.map(|shelving| *shelving);
        message.suppressed = suppressed.map(|shelving| *shelving);
        message.shut_off = shut_off.map(|order| *order);
        message.verdict = verdict;
        message.disputed = disputed;
        message.before_service = before_service;
        message.tare = tare;
        message.symptom = symptom;
        message
    }

    /// The message on a change.
    #[must_use]
    pub fn change(
        &self,
        run: RunId,
        change: &crate::Change,
        evidence: &crate::Evidence,
        time_unix_ns: u64,
    ) -> vocabulary::ChangeReport {
        vocabulary::ChangeReport {
            structure: self.structure.clone(),
            component: self.path(&change.component),
            run,
            step: change.step,
            evidence: *evidence,
            time_unix_ns,
        }
    }

    /// The message on its diagnoser's channels, each with what is known of it at this step, the latest one.
    #[must_use]
    pub fn divergences(
        &self,
        (run, step): (RunId, Step),
        diagnoser: &Diagnoser,
        time_unix_ns: u64,
    ) -> vocabulary::Divergences {
        let (components, evidence) = (diagnoser.components(), diagnoser.evidence());
        let own_unit = diagnoser.channels.learned().is_some();
        let channel = |(component, evidence): (&Component, &crate::Evidence)| vocabulary::Channel {
            component: component.clone(),
            residual: evidence.residual,
            divergence: evidence.divergence,
            threshold: evidence.threshold,
            own_unit,
        };
        vocabulary::Divergences {
            structure: self.structure.clone(),
            module: self.module.clone(),
            run,
            step,
            time_unix_ns,
            channels: components.iter().zip(evidence).map(channel).collect(),
        }
    }

    /// The message on what its diagnoser's gages read, or should read, at this step, the latest one.
    #[must_use]
    pub fn corrected(
        &self,
        (run, step): (RunId, Step),
        diagnoser: &Diagnoser,
        time_unix_ns: u64,
    ) -> vocabulary::Corrected {
        let mut readings = vocabulary::CorrectedReadings::default();
        diagnoser.write_readings(&mut readings);
        let forces_n = diagnoser.forces_n().iter();
        vocabulary::Corrected {
            structure: self.structure.clone(),
            module: self.module.clone(),
            run,
            step,
            time_unix_ns,
            readings,
            forces_n: forces_n.map(|force_n| Some(*force_n).filter(|n| n.is_finite())).collect(),
        }
    }

    /// The message on what was seen of a component around the latching of its fault.
    #[must_use]
    pub fn freeze_frame(
        &self,
        component: &Component,
        signals: FrozenSignals,
        time_unix_ns: u64,
    ) -> FreezeFrame {
        let frame = FreezeFrame {
            structure: self.structure.clone(),
            module: self.module.clone(),
            component: self.path(component),
            incarnation: self.incarnation,
            time_unix_ns,
            signals,
        };
        frame.fitting()
    }
}

/// A transition as it was before it was sent; `None` for a component that never had one.
#[must_use]
pub fn from_transition(message: FaultTransition) -> Option<Transition> {
    let verdict = Some(message.verdict).filter(|verdict| *verdict != Verdict::Unknown)?;
    Some(Transition {
        sequence: message.sequence,
        run: message.run?,
        run_ended: message.run_ended,
        component: message.component.component,
        verdict,
        symptom: message.symptom,
        onset: message.onset_step?,
        detection: message.detection_step?,
        decided: message.decided_step?,
        evidence: message.evidence?,
        before_service: message.before_service,
        disputed: message.disputed,
        tare: message.tare,
        verdict_order: message.state_order,
        order: message.order,
        shelved: message.shelved.map(Box::new),
        suppressed: message.suppressed.map(Box::new),
        shut_off: message.shut_off.map(Box::new),
    })
}
