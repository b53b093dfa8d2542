//! Which modules a reference knows.

use diagnosis::ModuleSetup;
use diagnosis::state::{CommissioningError, Reference, Snippet, commission};

/// The rate of false alarms of a module that thresholds are usually for \[1/h\].
pub const FALSE_ALARMS_PER_HOUR: f64 = 0.001;

/// Learns the reference of the module at place `own` from its own values and those of its peers. The setups are
/// those of the snippets' modules, in their order; modules that it does not ask are left out. The thresholds are for so
/// many false alarms of the module an hour at most, with 95 % confidence.
///
/// # Errors
/// Too few snippets, or none that differ.
pub fn learn(
    setups: &[ModuleSetup],
    own: usize,
    snippets: &[Snippet],
    false_alarms_per_hour: f64,
) -> Result<Reference, CommissioningError> {
    let is_known =
        |place: &usize| *place == own || setups[own].peers.contains(&setups[*place].module);
    let known: Vec<usize> = (0..setups.len()).filter(is_known).collect();
    let place = known.iter().take_while(|place| **place != own).count();
    let of_known = |snippet: &Snippet| Snippet {
        label: snippet.label.clone(),
        modules: known.iter().map(|place| snippet.modules[*place].clone()).collect(),
    };
    let snippets: Vec<Snippet> = snippets.iter().map(of_known).collect();
    let setups: Vec<ModuleSetup> = known.iter().map(|place| setups[*place].clone()).collect();
    commission(&setups, place, &snippets, false_alarms_per_hour)
}
