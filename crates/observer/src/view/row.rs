//! A row of a list: the state of a component or a module, with the reason.

use serde::Serialize;
use vocabulary::words::Tone;
use vocabulary::{ComponentPath, ModuleName, RunId, Step, StructureName};

use super::id::{ComponentId, ModuleId, RowId};

/// The urgency of a row, highest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
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

/// A component or a module, and its state; of a fault the whole incident.
#[derive(Debug, Clone, PartialEq, Serialize)]
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
    #[serde(skip)]
    pub tone: Tone,
    /// The name of the sign for its state.
    #[serde(skip)]
    pub sign: &'static str,
    /// Its state in words.
    pub state: String,
    /// Whether its alarm is shelved or suppressed.
    #[serde(rename = "set_aside")]
    pub is_set_aside: bool,
    /// Whether another row stands for it: that of its module, or of the fault that it belongs to.
    #[serde(skip)]
    pub is_covered: bool,
    /// Since when it has been in this state \[ns since 1970\], if known.
    pub since_unix_ns: Option<u64>,
    /// The kind of its fault; for a module, what is unknown about its components. May be empty.
    pub kind: String,
    /// The reason; may be empty.
    pub why: String,
    /// The components that belong to the same incident. Their own rows are covered.
    pub groups: Vec<RowGroup>,
    /// The number of its incident, the same in every view and message: `STRUCTURE/COMPONENT@RUN-STEP`, with the step at
    /// which the change was detected. `None` without a fault or a possible fault.
    pub incident: Option<String>,
    /// For a component, the measurements.
    #[serde(skip)]
    pub measured: DetectionFacts,
}

/// So many components are named in a sentence.
const NAMED: usize = 2;

/// How components belong to an incident.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(tag = "group", rename_all = "snake_case")]
pub enum Belonging {
    /// The fault explains their changes.
    Effects,
    /// They cannot be compared with their references at present.
    NotComparable {
        /// Why, in words.
        reason: String,
    },
    /// One of these has the fault instead.
    Candidates,
    /// Their module does not monitor them.
    NotMonitored,
}

/// Components that belong to an incident in the same way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowGroup {
    /// How.
    #[serde(flatten)]
    pub belonging: Belonging,
    /// The components, by name.
    pub components: Vec<ComponentPath>,
}

impl RowGroup {
    /// How many, and why, with the names of a few effects: `1 effect: m2/sensor/g5`.
    #[must_use]
    pub fn words(&self) -> String {
        let heading = self.heading();
        match self.belonging {
            Belonging::Effects | Belonging::Candidates if self.components.len() <= NAMED => {
                let names: Vec<String> = self.components.iter().map(ToString::to_string).collect();
                format!("{heading}: {}", names.join(", "))
            }
            _ => heading,
        }
    }

    /// How many, and why: `9 effects`.
    #[must_use]
    pub fn heading(&self) -> String {
        let count = self.components.len();
        let many = |one: &str| format!("{count} {one}{}", if count == 1 { "" } else { "s" });
        match &self.belonging {
            Belonging::Effects => many("effect"),
            Belonging::NotComparable { reason } => {
                format!("{} not comparable: {reason}", many("component"))
            }
            Belonging::Candidates => format!("or one of {}", many("other")),
            Belonging::NotMonitored => format!("{} unknown", many("component")),
        }
    }
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

    /// The kind of the fault, and what belongs to the incident: `bias of +45 µm; 9 effects`.
    #[must_use]
    pub fn what(&self) -> String {
        let parts = [self.kind.clone(), self.extent()];
        parts.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("; ")
    }

    /// What belongs to the incident: `9 effects`.
    #[must_use]
    pub fn extent(&self) -> String {
        // The kind of a module's row says how many of its components are unknown.
        let groups = self.groups.iter().filter(|group| group.belonging != Belonging::NotMonitored);
        groups.map(RowGroup::words).collect::<Vec<_>>().join("; ")
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
