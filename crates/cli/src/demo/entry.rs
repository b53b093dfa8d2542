//! What the demo reports, one entry at a time: for people a line, for machines a JSON object.

use names::fault::Fault;
use names::{ComponentPath, ModuleName, Step};
use serde::Serialize;
use wire::{Candidate, Symptom};

/// A process of the demo.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub(super) struct Process {
    pub(super) name: String,
    pub(super) pid: u32,
}

/// Something to report.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(super) enum Entry {
    /// The processes run.
    Started { structure: String, processes: Vec<Process>, endpoint: String },
    /// A process is there.
    Ready { process: String },
    /// Some channels are not watched yet.
    WarmingUp { step: Step, of_step: Step },
    /// Every channel of a module is watched.
    InService { module: ModuleName, since_step: Step },
    /// Every module has compared its components with their references; so many of them agree.
    Compared { step: Step, agree: u64, of: u64 },
    /// A component got a fault.
    Injected { step: Step, component: ComponentPath, fault: Fault, story: &'static str },
    /// A component lost its fault.
    Repaired { step: Step, component: ComponentPath },
    /// A channel's divergence reached its threshold.
    Change { step: Step, component: ComponentPath, ratio: f64 },
    /// Peers have not answered a module.
    Unanswered { step: Step, module: ModuleName, questions: u64 },
    /// A module found something about a component.
    Verdict(Verdict),
    /// An alarm is set aside, or counts again.
    SetAside {
        step: Step,
        component: ComponentPath,
        /// What was ordered, or is over.
        what: String,
    },
    /// A module knows what kind of fault a component has.
    Identified { step: Step, component: ComponentPath, found: Candidate },
    /// Something is not as it should be.
    Trouble { text: String },
    /// What came of it.
    Summary(Summary),
}

impl Entry {
    /// The step that the entry is about.
    pub(super) fn step(&self) -> Option<Step> {
        match self {
            Entry::WarmingUp { step, .. }
            | Entry::Compared { step, .. }
            | Entry::Injected { step, .. }
            | Entry::Repaired { step, .. }
            | Entry::Change { step, .. }
            | Entry::Unanswered { step, .. }
            | Entry::Identified { step, .. }
            | Entry::SetAside { step, .. }
            | Entry::Verdict(Verdict { step, .. }) => Some(*step),
            Entry::InService { since_step, .. } => Some(*since_step),
            Entry::Started { .. }
            | Entry::Ready { .. }
            | Entry::Trouble { .. }
            | Entry::Summary(_) => None,
        }
    }
}

/// What a module found about a component.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Verdict {
    pub(super) step: Step,
    pub(super) component: ComponentPath,
    #[serde(flatten)]
    pub(super) verdict: wire::Verdict,
    pub(super) detection_step: Option<Step>,
    /// What it rests on.
    pub(super) symptom: Symptom,
    /// If it departs from its reference, what was measured and what was expected, in the unit of the symptom.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) departure: Option<Departure>,
}

/// How a component departs from its reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(super) struct Departure {
    pub(super) measured: f64,
    pub(super) expected: f64,
    /// Whether its divergence has reached its threshold since the latest injection.
    pub(super) changed: bool,
}

/// What was injected against what was diagnosed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Summary {
    pub(super) injected: Vec<InjectedFault>,
    pub(super) diagnosed: Vec<DiagnosedFault>,
    /// Every injected fault was named in its time, and nothing else was.
    pub(super) exact: bool,
    /// The process ids of the plant and the diagnosers.
    pub(super) pids: Vec<u32>,
}

/// A fault that was injected.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct InjectedFault {
    pub(super) component: ComponentPath,
    pub(super) fault: Fault,
    pub(super) step: Step,
    pub(super) repaired_step: Step,
}

/// A fault that was diagnosed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct DiagnosedFault {
    pub(super) component: ComponentPath,
    pub(super) onset_step: Option<Step>,
    pub(super) detection_step: Option<Step>,
    pub(super) decided_step: Option<Step>,
    /// From the injection to the detection; `null` if nothing was injected there before \[ms\].
    pub(super) delay_ms: Option<f64>,
    /// From the injection to the verdict \[ms\].
    pub(super) verdict_delay_ms: Option<f64>,
    /// Its kind and size, as far as that was decided before the repair.
    pub(super) identified: Option<Candidate>,
}
