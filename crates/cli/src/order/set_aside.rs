//! What the commands take that set an alarm aside for a time, and those that end it.

use vocabulary::{ComponentPath, ModuleName, OrderKind, SHELVING_SECONDS};

use super::arguments::{Orders, Signature};
use super::carry_out::Manner;
use super::subject::Subject;
use super::{give, run};
use crate::failure::Failure;

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
    components: Vec<ComponentPath>,
    #[command(flatten)]
    span: Span,
    #[command(flatten)]
    signature: Signature,
}

/// Let the alarms of shelved components count again
///
/// A diagnoser refuses for what is not shelved. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct UnshelveArguments {
    #[command(flatten)]
    orders: Orders,
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
    module: ModuleName,
    #[command(flatten)]
    span: Span,
    #[command(flatten)]
    signature: Signature,
}

/// Let the alarms of a suppressed module count again
///
/// A diagnoser refuses if no component of its module is suppressed. Exit codes as for `trusswatch ack`.
#[derive(Debug, clap::Args)]
pub(crate) struct UnsuppressArguments {
    /// Module
    #[arg(value_name = "MODULE")]
    module: ModuleName,
    /// Why
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    #[command(flatten)]
    signature: Signature,
}

/// How long, and why.
#[derive(Debug, clap::Args)]
struct Span {
    /// For how long, e.g. `2h`, `90m` or `1h 30m`; from 1s to 31days
    #[arg(long = "for", value_name = "TIME", value_parser = seconds)]
    for_s: u64,
    /// Why
    #[arg(long, value_name = "TEXT")]
    reason: String,
}

/// Runs `trusswatch fault shelve`.
pub(crate) fn shelve(arguments: &ShelveArguments) -> Result<(), Failure> {
    let ShelveArguments { components, span, signature } = arguments;
    let subjects = components.iter().cloned().map(Subject::Component).collect();
    begin(OrderKind::Shelve, subjects, span, signature)
}

/// Runs `trusswatch fault unshelve`.
pub(crate) fn unshelve(arguments: &UnshelveArguments) -> Result<(), Failure> {
    run(&arguments.orders, Manner::of(OrderKind::Unshelve))
}

/// Runs `trusswatch fault suppress`.
pub(crate) fn suppress(arguments: &SuppressArguments) -> Result<(), Failure> {
    let SuppressArguments { module, span, signature } = arguments;
    begin(OrderKind::Suppress, vec![Subject::Module(module.clone())], span, signature)
}

/// Runs `trusswatch fault unsuppress`.
pub(crate) fn unsuppress(arguments: &UnsuppressArguments) -> Result<(), Failure> {
    let UnsuppressArguments { module, note, signature } = arguments;
    let subjects = [Subject::Module(module.clone())];
    give(&subjects, note.as_ref(), signature, Manner::of(OrderKind::Unsuppress))
}

fn begin(
    kind: OrderKind,
    subjects: Vec<Subject>,
    span: &Span,
    signature: &Signature,
) -> Result<(), Failure> {
    let manner = Manner { for_s: Some(span.for_s), ..Manner::of(kind) };
    give(&subjects, Some(&span.reason), signature, manner)
}

/// Reads how long \[s\].
fn seconds(text: &str) -> Result<u64, String> {
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
            assert_eq!(seconds(text), Ok(expected), "{text}");
        }
        for wrong in ["", "2", "soon", "0s", "500ms", "1500ms", "32days", "-2h", "1y"] {
            let problem = seconds(wrong).unwrap_err();
            assert!(problem.contains("from 1s to 31days, e.g. `2h`"), "{wrong}: {problem}");
        }
    }
}
