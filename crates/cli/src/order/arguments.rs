//! Arguments of the commands that operators send to diagnosers.

use std::time::Duration;

use vocabulary::{ComponentPath, ModuleName, SHELVING_SECONDS};

use crate::link::{Link, seconds};

/// Acknowledge a fault
///
/// The component stays faulty; who acknowledged it and when is recorded in the module's
/// journal. Exit code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or
/// may not have been carried out; check with `trusswatch faults`. Exit code 5 if it was carried out but not
/// saved to the module's disk: a restart may lose it.
#[derive(Debug, clap::Args)]
pub(crate) struct AcknowledgeArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Reset a repaired component and resume monitoring
///
/// Unless --force is given, a diagnoser refuses while the evidence of the fault persists. Exit
/// code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or may not have been
/// carried out; check with `trusswatch faults`. Exit code 5 if it was carried out but not saved to the
/// module's disk: a restart may lose it.
#[derive(Debug, clap::Args)]
pub(crate) struct ResetArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
    /// Reset although the evidence persists
    #[arg(long)]
    pub(super) force: bool,
    /// Reset a component that was replaced: its present reading is taken as correct, and its reference is shifted by the difference
    #[arg(long, conflicts_with = "force")]
    pub(super) re_tare: bool,
    /// Longest time to retry while a diagnoser refuses [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "force")]
    pub(super) wait: Option<Duration>,
}

/// Arguments of commands for components.
#[derive(Debug, clap::Args)]
pub(super) struct ComponentsFlags {
    /// Components, e.g. `module1/sensor/g2`
    #[arg(required = true, value_name = "COMPONENT")]
    pub(super) components: Vec<ComponentPath>,
    /// Reason, recorded with the command
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Option<String>,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// Arguments of every command.
#[derive(Debug, clap::Args)]
pub(super) struct IssuerFlags {
    /// Name of the person who issues the command, if no operator's certificate is used [default: USER@HOST]
    #[arg(long, value_name = "WHO")]
    pub(super) by: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) link: Link,
}

/// Shelve the alarms of components for a time
///
/// Diagnosis of the component continues, but its alarm does not count for `trusswatch faults --exit-code`, in the
/// alerting rules and on the page. The operator, the reason and the end are shown beside its state. Shelving ends by
/// itself, with an event; the module's journal records start and end, and shelving survives a restart. Shelving a
/// component again replaces reason and end. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct ShelveArguments {
    /// Components, e.g. `module1/sensor/g2`
    #[arg(required = true, value_name = "COMPONENT")]
    pub(super) components: Vec<ComponentPath>,
    #[command(flatten)]
    pub(super) set_aside: SetAsideFlags,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// End the shelving of components
///
/// A diagnoser refuses if the component is not shelved. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct UnshelveArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Suppress the alarms of a whole module while it is maintained
///
/// Like `trusswatch fault shelve` for every component of the module. While its diagnoser answers, a suppressed module also
/// need not be in service. Suppressing a module again replaces reason and end; shelved components stay shelved. Exit codes
/// as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct SuppressArguments {
    /// Module
    #[arg(value_name = "MODULE")]
    pub(super) module: ModuleName,
    #[command(flatten)]
    pub(super) set_aside: SetAsideFlags,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// Let the alarms of a suppressed module count again
///
/// A diagnoser refuses if no component of its module is suppressed. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct UnsuppressArguments {
    /// Module
    #[arg(value_name = "MODULE")]
    pub(super) module: ModuleName,
    /// Reason, recorded with the command
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Option<String>,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// Shut off cylinders that are declared faulty
///
/// Both chambers are emptied into the tank, and the controller does without the cylinder. A diagnoser refuses unless the
/// table `[tolerance]` of its configuration permits it, the cylinder's fault is latched, no more cylinders of the structure
/// are shut off than may be, and what its peers have shut off is known. The module's journal records who shut it off and
/// why. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct ShutOffArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Put cylinders back that are shut off
///
/// A cylinder has to be put back before its fault is reset. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct PutBackArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Declare components faulty
///
/// For a fault that a person knows of and the diagnoser does not: a loose gage, a cylinder that will be taken out. It counts
/// like one that was found, until it is acknowledged and reset; a gage's reading is replaced. Exit codes as for
/// `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct DeclareArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Duration and reason of shelving or suppression.
#[derive(Debug, clap::Args)]
pub(super) struct SetAsideFlags {
    /// Duration, e.g. `2h`, `90m` or `1h 30m`; from 1s to 31days
    #[arg(long = "for", value_name = "TIME", value_parser = shelving_seconds)]
    pub(super) for_s: u64,
    /// Reason, shown with the alarm
    #[arg(long, value_name = "TEXT")]
    pub(super) reason: String,
}

/// Parses a duration \[s\].
fn shelving_seconds(text: &str) -> Result<u64, String> {
    let right =
        "use whole seconds, minutes, hours or days from 1s to 31days, e.g. `2h`, `90m` or `1h 30m`";
    let time = humantime::parse_duration(text).map_err(|error| format!("{error}; {right}"))?;
    let is_whole = time.subsec_nanos() == 0 && SHELVING_SECONDS.contains(&time.as_secs());
    is_whole.then_some(time.as_secs()).ok_or_else(|| right.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_duration_has_units_and_at_most_31_days() {
        for (text, expected) in
            [("2h", 7200), ("90m", 5400), ("1h 30m", 5400), ("31days", 2_678_400), ("1s", 1)]
        {
            assert_eq!(shelving_seconds(text), Ok(expected), "{text}");
        }
        for wrong in ["", "2", "soon", "0s", "500ms", "1500ms", "32days", "-2h", "1y"] {
            let problem = shelving_seconds(wrong).unwrap_err();
            assert!(problem.contains("from 1s to 31days, e.g. `2h`"), "{wrong}: {problem}");
        }
    }
}
