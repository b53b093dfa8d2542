//! Which faults a run is given, and when.

use names::fault::Fault;
use names::{ComponentPath, Step};
use plant::{InjectError, Plant};

/// One fault of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Injection {
    /// First step with the fault.
    pub at: Step,
    /// First step without it again; `None` if it stays.
    pub until: Option<Step>,
    /// The component.
    pub component: ComponentPath,
    /// The fault.
    pub fault: Fault,
}

/// The faults of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    injections: Vec<Injection>,
}

impl Schedule {
    /// A schedule of these faults.
    #[must_use]
    pub fn new(injections: Vec<Injection>) -> Self {
        Self { injections }
    }

    /// The faults.
    #[must_use]
    pub fn injections(&self) -> &[Injection] {
        &self.injections
    }

    /// Injects and clears what is due at `step`.
    pub(crate) fn apply(&self, step: Step, plant: &mut Plant) -> Result<(), InjectError> {
        for injection in &self.injections {
            if injection.until == Some(step) {
                plant.clear(&injection.component)?;
            }
            if injection.at == step {
                plant.inject(&injection.component, injection.fault)?;
            }
        }
        Ok(())
    }
}
