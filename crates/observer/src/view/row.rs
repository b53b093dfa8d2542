//! A row of a list: a component or a module, how it is, and why.

use vocabulary::words::Tone;
use vocabulary::{ComponentPath, ModuleName, RunId, Step, StructureName};

use super::id::{ComponentId, ModuleId, RowId};

/// From what needs attention most to what needs none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Urgency {
    /// A fault that no operator has acknowledged.
    Latched,
    /// A module whose verdicts are missing or cannot be relied on.
    Unreliable,
    /// Perhaps a fault.
    Unconfirmed,
    /// It is not known whether it is healthy.
    Unknown,
    /// A fault that an operator has acknowledged.
    Acknowledged,
    /// Any of these, but its alarm is shelved or suppressed.
    SetAside,
    /// It changed, and what explains that is known.
    Explained,
    /// It changed a moment ago.
    Tentative,
    /// Nothing.
    Normal,
}

impl Urgency {
    /// Whether an operator has to do something about it now.
    #[must_use]
    pub fn needs_attention(self) -> bool {
        self < Urgency::SetAside
    }
}

/// A component or a module, and how it is.
#[derive(Debug, Clone, PartialEq)]
pub struct StateRow {
    /// None if the module is only expected and it is not clear where.
    pub structure: Option<StructureName>,
    /// The module.
    pub module: ModuleName,
    /// None if the row is about the module.
    pub component: Option<ComponentPath>,
    /// How much attention it needs.
    pub urgency: Urgency,
    /// How its state is coloured.
    pub tone: Tone,
    /// The name of the sign of its state.
    pub sign: &'static str,
    /// Its state in words.
    pub state: String,
    /// Whether its alarm is shelved or suppressed.
    pub is_set_aside: bool,
    /// Whether the row of its module says the same.
    pub is_covered: bool,
    /// Since when it is so \[ns since 1970\], if that is known.
    pub since_unix_ns: Option<u64>,
    /// What kind of fault it is; of a module, what is not known of its components. May be empty.
    pub kind: String,
    /// Why; may be empty.
    pub why: String,
    /// Of a module, its components of which nothing is known for this reason.
    pub unknown: Vec<ComponentPath>,
    /// Of a component, what was measured.
    pub measured: DetectionFacts,
}

/// What was measured of a component, and when it was decided upon.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DetectionFacts {
    /// The run that the steps are counted in.
    pub run: Option<RunId>,
    /// Since when it has been changing.
    pub onset_step: Option<Step>,
    /// When the divergence reached its threshold.
    pub detection_step: Option<Step>,
    /// As of which step the state was found.
    pub decided_step: Option<Step>,
    /// The residual at the detection, with its unit.
    pub residual: Option<String>,
    /// The divergence at the detection, in thresholds.
    pub divergence: Option<String>,
    /// How it compares with its reference.
    pub reference: Option<String>,
}

impl StateRow {
    /// What was measured of it, by name.
    #[must_use]
    pub fn facts(&self) -> Vec<(&'static str, String)> {
        let DetectionFacts { run, onset_step, detection_step, decided_step, .. } = &self.measured;
        let step = |step: &Option<Step>| step.map(|step| step.to_string());
        let facts = [
            ("onset step", step(onset_step)),
            ("detection step", step(detection_step)),
            ("decided as of step", step(decided_step)),
            ("run", run.map(|run| run.to_string())),
            ("residual", self.measured.residual.clone()),
            ("divergence", self.measured.divergence.clone()),
            ("reference", self.measured.reference.clone()),
        ];
        facts.into_iter().filter_map(|(name, fact)| Some((name, fact?))).collect()
    }

    /// What it is about.
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

    /// The component or the module.
    #[must_use]
    pub fn name(&self) -> String {
        self.component.as_ref().map_or_else(|| self.module.to_string(), ToString::to_string)
    }
}
