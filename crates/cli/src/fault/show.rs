//! `trusswatch fault show`: what kind of fault a component has, how large it is, and what was measured of it.

use std::io::{self, IsTerminal, Write};

use names::Mention;
use observer::present;
use serde::Serialize;
use wire::FaultTransition;
use zenoh::Session;

use super::finding::find;
use super::report::report;
use crate::failure::Failure;
use crate::link::{self, Link, Target};
use crate::paint::Paint;
use crate::table::terminal_width;
use crate::versioned;
use crate::wording::{printable, utc};

const EXAMPLES: &str = "\
Examples:
  trusswatch fault show module1/sensor/g3 --connect tcp/127.0.0.1:7447
  trusswatch fault show sensor/g3 --connect tcp/127.0.0.1:7447";

/// Show what kind of fault a component has, and how large it is
///
/// Asks the component's diagnoser for its state and for the latest identification: the kind of fault with its
/// probability and its size with a 95 % interval, or the contenders as long as it is not decided. Below is what was
/// measured around the onset of the fault, and what the most probable kind makes of it. Exit code 1 if there is no such
/// component, and 4 if its diagnoser does not answer.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Component, e.g. `module1/sensor/g3`; without the module if only one has such a component
    #[arg(value_name = "COMPONENT")]
    component: Mention,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

/// The component for machines: its state, in which the identification has its signature.
#[derive(Debug, Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    transition: &'a FaultTransition,
    time: String,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let target = &arguments.link.target()?;
    let found = link::block_on(async {
        let session = target.open().await?;
        let found = look(&session, target, &arguments.component).await;
        session::close(&session).await;
        found
    })?;
    print(arguments, &found)
}

async fn look(
    session: &Session,
    target: &Target,
    component: &Mention,
) -> Result<FaultTransition, Failure> {
    let looked = present(session, target.structure.as_ref(), &[], target.timeout).await;
    let picture = looked.map_err(link::refused)?;
    if !picture.is_of_anybody() {
        return Err(target.no_module());
    }
    let mut found = find(&picture, component)?;
    if found.state.is_fault() {
        let (structure, component) = (&found.structure, &found.component);
        let latest = observer::identification(session, structure, component, target.timeout).await;
        let latest = latest.map_err(|error| {
            Failure::runtime(format!("{component}: {}", printable(&error.to_string())))
        })?;
        found.identification = latest.map(Box::new).or(found.identification);
    }
    Ok(found)
}

fn print(arguments: &Arguments, found: &FaultTransition) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        let document = Document { transition: found, time: utc(found.time_unix_ns) };
        write!(out, "{}", versioned::text(&document)?)?;
    } else {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        write!(out, "{}", report(found, terminal_width(), paint))?;
    }
    Ok(out.flush()?)
}
