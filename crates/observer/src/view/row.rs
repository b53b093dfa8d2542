//! A row of a list: the state of a component or a module, with the reason.

use vocabulary::words::Tone;
use vocabulary::{ComponentPath, ModuleName, RunId, Step, StructureName};

use super::id::{ComponentId, ModuleId, RowId};

/// The urgency of a row, highest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Urgency {
    /// A fault that no operator has acknowledged.
    Latched,
    /// A module whose verdicts are missing or unreliable.
    Unreliable,
    /// A possible fault.
    Unconfirmed,
    /// A component in an unknown state.
    Unknown,
    /// A fault that an operator has acknowledged.
    Acknowledged,
    /// Any of these with a shelved or suppressed alarm.
    SetAside,
    /// A change that another component's fault explains.
    Explained,
    /// A change that is not judged yet.
    Tentative,
    /// Normal.
    Normal,
}

impl Urgency {
    /// Whether an operator has to act now.
    #[must_use]
    pub fn needs_attention(self) -> bool {
        self < Urgency::SetAside
    }
}

/// A component or a module, and its state.
#[derive(Debug, Clone, PartialEq)]
pub struct StateRow {
    /// `None` if the module is only expected and its structure is not known.
    pub structure: Option<StructureName>,
    /// The module.
    pub module: ModuleName,
    /// `None` if the row is about the module.
    pub component: Option<ComponentPath>,
    /// Its urgency.
    pub urgency: Urgency,
    /// The colour of its state.
    pub tone: Tone,
    /// The name of the sign for its state.
    pub sign: &'static str,
    /// Its state in words.
    pub state: String,
    /// Whether its alarm is shelved or suppressed.
    pub is_set_aside: bool,
    /// Whether the row of its module states the same.
    pub is_covered: bool,
    /// Since when it has been in this state \[ns since 1970\], if known.
    pub since_unix_ns: Option<u64>,
    /// The kind of its fault; for a module, what is unknown about its components. May be empty.
    pub kind: String,
    /// The reason; may be empty.
    pub why: String,
    /// For a module, its components that are unknown for this reason.
    pub unknown: Vec<ComponentPath>,
    /// For a component, the measurements.
    pub measured: DetectionFacts,
}

/// Measurements of a component, and the step of the decision.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DetectionFacts {
    /// The run that the steps belong to.
    pub run: Option<RunId>,
    /// The onset of the change.
    pub onset_step: Option<Step>,
    /// When the divergence reached its threshold.
    pub detection_step: Option<Step>,
    /// The step as of which the state was found.
    pub decided_step: Option<Step>,
    /// What was measured at the detection with its unit, and the test's statistic in thresholds; each with its name.
    pub at_detection: Option<[(&'static str, String); 2]>,
    /// The comparison with its reference.
    pub reference: Option<String>,
}

impl StateRow {
    /// The measurements by name.
    #[must_use]
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let DetectionFacts { run, onset_step, detection_step, decided_step, .. } = &self.measured;
        let step = |step: &Option<Step>| step.map(|step| step.to_string());
        let at_detection = self.measured.at_detection.iter().flatten();
        let at_detection =
            at_detection.map(|(name, text)| (*name, Some(format!("{text} at detection"))));
        let facts = [
            ("onset step", step(onset_step)),
            ("detection step", step(detection_step)),
            ("decided as of step", step(decided_step)),
            ("run", run.map(|run| run.to_string())),
        ];
        let reference = [("reference", self.measured.reference.clone())];
        facts
            .into_iter()
            .chain(at_detection)
            .chain(reference)
            .filter_map(|(name, fact)| Some((name, fact?)))
            .collect()
    }

    /// The subject of the row.
    #[must_use]
    pub fn id(&self) -> RowId {
        match (&self.structure, &self.component) {
            (Some(structure), Some(component)) => {
                let (structure, component) = (structure.clone(), component.clone());
                RowId::Component(ComponentId { structure, component })
            }
            (structure, _) => {
                let (structure, module) = (structure.clone(), self.module.clone());
                RowId::Module(ModuleId { structure, module })
            }
        }
    }

    /// The name of the component or the module.
    #[must_use]
    pub fn name(&self) -> String {
        self.component.as_ref().map_or_else(|| self.module.to_string(), ToString::to_string)
    }
}
