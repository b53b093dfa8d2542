//! `trusswatch history`: shows the modules' journals.

mod reading;
mod report;

use std::time::SystemTime;

use observer::{JournalEntry, Journals, ModuleHistory};
use serde_json::{Value, json};
use vocabulary::words::{parse_utc_or_ago, utc};
use vocabulary::{ComponentPath, ModuleName};

use crate::failure::Failure;
use crate::link::Link;
use crate::output;
use crate::paint::Paint;
use crate::table::WidthArguments;
use reading::JournalReading;

/// Show the modules' journals: every transition of every component, and the identified kinds of faults
///
/// Reads the journals over the network and merges them by time, or by the modules' common step count where clocks
/// contradict it. Reports such clocks, modules that do not answer, journals whose oldest entries were deleted, and
/// missing transitions.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Only these modules
    #[arg(long = "module", value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    modules: Vec<ModuleName>,
    /// Only these components, e.g. `module1/sensor/g2`
    #[arg(long = "component", value_name = "COMPONENT", num_args = 1.., value_delimiter = ',')]
    components: Vec<ComponentPath>,
    /// Only from this time on: UTC, e.g. `2026-11-21T10:00:00Z`, or a duration before now, e.g. `2h`
    #[arg(long, value_name = "TIME", value_parser = time)]
    since: Option<u64>,
    /// Only up to this time
    #[arg(long, value_name = "TIME", value_parser = time)]
    until: Option<u64>,
    /// Only from this sequence number of each module on
    #[arg(long, value_name = "SEQ", default_value_t = 1)]
    from: u64,
    /// Only the latest N selected entries
    #[arg(long, value_name = "N")]
    limit: Option<usize>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    width: WidthArguments,
    #[command(flatten)]
    link: Link,
}

impl Arguments {
    /// The modules named in the arguments; empty means all.
    fn named(&self) -> Vec<ModuleName> {
        let of_components = self.components.iter().map(|component| component.module.clone());
        let mut named: Vec<ModuleName> =
            self.modules.iter().cloned().chain(of_components).collect();
        named.sort();
        named.dedup();
        named
    }

    /// Whether the arguments select an entry: by its time, and by its component, by its module without components, or
    /// because there are none.
    fn wants(&self, entry: &JournalEntry<'_>) -> bool {
        let time = entry.time_unix_ns();
        if self.since.is_some_and(|since| time < since) || self.until.is_some_and(|end| time > end)
        {
            return false;
        }
        let module = entry.module();
        let names_others = self.components.iter().any(|c| c.module == *module);
        let nothing_is_named = self.modules.is_empty() && self.components.is_empty();
        nothing_is_named
            || self.components.iter().any(|component| entry.concerns(component))
            || (self.modules.contains(module) && !names_others)
    }
}

fn time(text: &str) -> Result<u64, String> {
    parse_utc_or_ago(text, SystemTime::now())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let link = &arguments.link.target()?;
    let reading = link.with_session(async |session| {
        reading::read(session, link, &arguments.named(), arguments.from).await
    })?;
    // In readable output, silent modules are printed once, as errors.
    if arguments.json || reading.is_of_anybody() {
        print(arguments, &reading)?;
    }
    if reading.is_of_anybody() { Ok(()) } else { Err(reading.nothing_read(link)) }
}

fn print(arguments: &Arguments, reading: &JournalReading) -> Result<(), Failure> {
    let mut journals = Journals::merge(&reading.histories);
    journals.entries.retain(|entry| arguments.wants(entry));
    let skipped = arguments.limit.map_or(0, |most| journals.entries.len().saturating_sub(most));
    journals.entries.drain(..skipped);
    output::print(&if arguments.json {
        output::text(&document(reading, &journals))?
    } else {
        report::report(reading, &journals, arguments.width.limit(), Paint::of_stdout())
    })
}

/// The JSON document: the journals, their entries and their gaps.
fn document(reading: &JournalReading, journals: &Journals<'_>) -> Value {
    let (mut transitions, mut identifications, mut phases) = (Vec::new(), Vec::new(), Vec::new());
    for entry in &journals.entries {
        let time = json!({ "time": utc(entry.time_unix_ns()) });
        match *entry {
            JournalEntry::Transition(transition) => {
                transitions.push(output::with(transition, time))
            }
            JournalEntry::Identification(found) => identifications.push(output::with(found, time)),
            JournalEntry::Phase(change) => phases.push(output::with(change, time)),
            JournalEntry::Observed(..) => {}
        }
    }
    let module = |history: &ModuleHistory| {
        json!({
            "structure": history.structure,
            "module": history.module,
            // The lowest sequence number in the journal.
            "first_sequence": history.first_sequence,
            "next_sequence": history.next_sequence,
            // The number of transitions read, including those filtered out.
            "read": history.transitions.len(),
            // The error that ended reading early.
            "broken_off": history.broken_off.as_ref().map(ToString::to_string),
        })
    };
    let gaps = reading.histories.iter().flat_map(|history| {
        history.gaps().into_iter().map(|gap| {
            json!({
                "structure": history.structure,
                "module": history.module,
                "from_sequence": gap.from,
                "to_sequence": gap.to,
            })
        })
    });
    let contradictions = journals.contradictions.iter().map(|found| {
        json!({
            "structure": found.structure,
            "ahead": found.ahead,
            "behind": found.behind,
            "at_least_s": found.by.as_secs(),
        })
    });
    json!({
        "modules": reading.histories.iter().map(module).collect::<Vec<_>>(),
        "transitions": transitions,
        "identifications": identifications,
        "phases": phases,
        "silent": reading.silent,
        "gaps": gaps.collect::<Vec<_>>(),
        // Modules whose times contradict the order of their steps.
        "clocks": contradictions.collect::<Vec<_>>(),
    })
}
