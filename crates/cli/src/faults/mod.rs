//! `trusswatch faults`: the present picture of a whole structure.

mod document;
mod report;
#[cfg(test)]
pub(crate) mod testing;

use std::io::{self, Write};

use observer::{Scene, all_is_well, present};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::paint::Paint;
use crate::table::WidthArguments;
use crate::versioned;

/// Show which components are faulty at present, and how the modules are
///
/// Asks every diagnoser for the state of its components and shows those that are other than normal, or whose alarm is
/// shelved or suppressed: by whom, why and until when.
/// Components of a module that does not monitor them, because no samples come or for another reason, are
/// unknown. Modules that are expected, or that another module names as its peer, and do not answer are shown as
/// not answering: nothing is known of their components. Of several structures, each has a line in a table, the most
/// urgent first, and those in which all is well have nothing else.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Show every component, normal ones too, and every structure
    #[arg(long)]
    all: bool,
    /// Modules that should be there
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// End with exit code 1 unless all is well: every module is one process that answers, is in service and writes its
    /// journal, and no component is latched, acknowledged, unconfirmed or unknown. Components whose alarm is shelved or suppressed do not
    /// count, nor does it that a module is not in service while all its components are suppressed; one that does not answer
    /// counts. Behind a gateway, which passes no statuses on, every
    /// module has to be named by `--expect`, with its `--structure`: no peer names one that is down
    #[arg(long)]
    exit_code: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    width: WidthArguments,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    link::block_on(look(arguments))
}

async fn look(arguments: &Arguments) -> Result<(), Failure> {
    let link = &arguments.link.target()?;
    let session = link.open().await?;
    let looked = present(&session, link.structure.as_ref(), &arguments.expect, link.timeout).await;
    session::close(&session).await;
    let scene = looked.map_err(link::refused)?;
    print(arguments, &scene)?;
    if !scene.has_heard_a_module() {
        return Err(link.no_module());
    }
    if arguments.exit_code && !all_is_well(&scene) {
        return Err(Failure::reported());
    }
    Ok(())
}

fn print(arguments: &Arguments, scene: &Scene) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", versioned::text(&document::document(scene, arguments.all))?)?;
    } else if !scene.modules.is_empty() {
        let paint = Paint::of_stdout();
        let width = arguments.width.limit();
        write!(out, "{}", report::report(scene, arguments.all, width, paint))?;
    }
    Ok(out.flush()?)
}
