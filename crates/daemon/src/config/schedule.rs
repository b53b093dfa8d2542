//! Faults to inject at given steps.

use std::path::Path;

use serde::{Deserialize, Serialize};
use vocabulary::{ComponentPath, Step, fault::Fault};

use settings::{ConfigErrors, SettingsFile};

/// A schedule, e.g.
///
/// ```toml
/// [[faults]]
/// at_step = 4000
/// until_step = 6000
/// component = "module1/sensor/g5"
/// fault = { kind = "bias", offset_m = 5e-5 }
/// ```
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Schedule {
    /// The faults, in any order.
    #[serde(default)]
    pub faults: Vec<ScheduledFault>,
}

/// One fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduledFault {
    /// The first step with the fault.
    pub at_step: Step,
    /// The first step without the fault; by default the fault stays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_step: Option<Step>,
    /// The component.
    pub component: ComponentPath,
    /// Its fault.
    pub fault: Fault,
}

/// Reads a schedule.
///
/// # Errors
/// The file cannot be read or is not a schedule.
pub fn load_schedule(file: &Path) -> Result<Schedule, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let schedule: Schedule = document.parse()?;
    let mut errors = ConfigErrors(Vec::new());
    for fault in &schedule.faults {
        if fault.until_step.is_some_and(|until| until <= fault.at_step) {
            let problem = format!(
                "the fault of `{}` ends at `until_step`, not after `at_step` {}; use a later step",
                fault.component, fault.at_step
            );
            errors.add(file, None, problem);
        }
    }
    document.check_numbers(&mut errors);
    errors.or(schedule)
}
