//! What commands to the diagnosers take.

use std::time::Duration;

use vocabulary::{ComponentPath, ModuleName, SHELVING_SECONDS};

use crate::link::{Link, seconds};

/// Acknowledge a fault
///
/// The component stays faulty; who acknowledged it and when is recorded in the module's
/// journal. Exit code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or
/// may not have been carried out; check with `trusswatch faults`. Exit code 5 if it was carried out, but the
/// module's disk has not got it: then a restart may forget it.
#[derive(Debug, clap::Args)]
pub(crate) struct AcknowledgeArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Reset a repaired component and resume monitoring
///
/// A diagnoser refuses as long as the evidence of the fault is still there, unless it is forced. Exit
/// code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or may not have been
/// carried out; check with `trusswatch faults`. Exit code 5 if it was carried out, but the module's disk has
/// not got it: then a restart may forget it.
#[derive(Debug, clap::Args)]
pub(crate) struct ResetArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
    /// Reset even though the evidence is still there
    #[arg(long)]
    pub(super) force: bool,
    /// Reset a component that was replaced: what it measures now is right, and its reference is shifted by that
    #[arg(long, conflicts_with = "force")]
    pub(super) re_tare: bool,
    /// Longest time to retry while a diagnoser refuses [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "force")]
    pub(super) wait: Option<Duration>,
}

/// What those take that are about components.
#[derive(Debug, clap::Args)]
pub(super) struct ComponentsFlags {
    /// Components, e.g. `module1/sensor/g2`
    #[arg(required = true, value_name = "COMPONENT")]
    pub(super) components: Vec<ComponentPath>,
    /// Why
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Option<String>,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// What every command takes.
#[derive(Debug, clap::Args)]
pub(super) struct IssuerFlags {
    /// Who issued the command, where no operator's certificate says so [default: the user and this machine, USER@HOST]
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
/// The component is diagnosed as before, and what it shows still explains what others show; but its alarm does not count:
/// for `trusswatch faults --exit-code`, in the alerting rules, on the page. Who shelved it, why and until when is shown
/// beside its state. It ends by itself, with an event; both are in the module's journal, and a restart changes nothing.
/// A component that is shelved already is shelved anew. Exit codes as for `trusswatch ack`.
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
/// A diagnoser refuses for what is not shelved. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct UnshelveArguments {
    #[command(flatten)]
    pub(super) orders: ComponentsFlags,
}

/// Suppress the alarms of a whole module while it is maintained
///
/// Like `trusswatch fault shelve` for every component of the module; besides, it does not count that the module is not in
/// service, as long as its diagnoser answers. A module that is suppressed already is suppressed anew, and components that
/// are shelved as well stay so. Exit codes as for `trusswatch ack`.
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
    /// Why
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Option<String>,
    #[command(flatten)]
    pub(super) issuer: IssuerFlags,
}

/// How long, and why.
#[derive(Debug, clap::Args)]
pub(super) struct SetAsideFlags {
    /// For how long, e.g. `2h`, `90m` or `1h 30m`; from 1s to 31days
    #[arg(long = "for", value_name = "TIME", value_parser = shelving_seconds)]
    pub(super) for_s: u64,
    /// Why
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
    fn a_time_is_read_as_people_write_it_and_must_end_in_a_month() {
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
