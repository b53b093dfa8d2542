//! `trusswatch history`: what the modules' journals hold.

mod document;
mod reading;
mod report;

use std::io::{self, Write};

use observer::Journals;
use vocabulary::{ComponentPath, ModuleName};

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::paint::Paint;
use crate::table::WidthArguments;
use crate::versioned;
use reading::Reading;

/// Show what the modules' journals hold: every transition of every component, and what kinds of faults they are
///
/// Reads the journals over the network and merges them by time, or by the steps that the modules count together
/// if their clocks contradict these. Notes such clocks, modules that do not answer,
/// journals that no longer reach back to their beginning, and transitions that are missing.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Only these modules
    #[arg(long = "module", value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    modules: Vec<ModuleName>,
    /// Only these components, e.g. `module1/sensor/g2`
    #[arg(long = "component", value_name = "COMPONENT", num_args = 1.., value_delimiter = ',')]
    components: Vec<ComponentPath>,
    /// Only from this sequence number of each module on
    #[arg(long, value_name = "SEQ", default_value_t = 1)]
    from: u64,
    /// Only the latest N of those
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
    /// The modules that are asked for by name; empty means all.
    fn named(&self) -> Vec<ModuleName> {
        let of_components = self.components.iter().map(|component| component.module.clone());
        let mut named: Vec<ModuleName> =
            self.modules.iter().cloned().chain(of_components).collect();
        named.sort();
        named.dedup();
        named
    }

    /// A component that is named, any of a module that is named alone, any at all if nothing is named.
    fn wants(&self, component: &ComponentPath) -> bool {
        let names_others = self.components.iter().any(|c| c.module == component.module);
        let nothing_is_named = self.modules.is_empty() && self.components.is_empty();
        nothing_is_named
            || self.components.contains(component)
            || (self.modules.contains(&component.module) && !names_others)
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let link = &arguments.link.target()?;
    let reading = link::block_on(async {
        let session = link.open().await?;
        let reading = reading::read(&session, link, &arguments.named(), arguments.from).await;
        session::close(&session).await;
        reading
    })?;
    // For people, silent modules are printed once: as errors.
    if arguments.json || reading.is_of_anybody() {
        print(arguments, &reading)?;
    }
    if reading.is_of_anybody() { Ok(()) } else { Err(reading.nothing_read(link)) }
}

fn print(arguments: &Arguments, reading: &Reading) -> Result<(), Failure> {
    let mut journals = Journals::merge(&reading.histories);
    journals.entries.retain(|entry| arguments.wants(entry.component()));
    let skipped = arguments.limit.map_or(0, |most| journals.entries.len().saturating_sub(most));
    journals.entries.drain(..skipped);
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", versioned::text(&document::document(reading, &journals))?)?;
    } else {
        let paint = Paint::of_stdout();
        let width = arguments.width.limit();
        write!(out, "{}", report::report(reading, &journals, width, paint))?;
    }
    Ok(out.flush()?)
}
