//! `trusswatch faults`: the present picture of a whole structure.

mod check;
mod component_table;
mod document;
mod module_table;
mod report;
#[cfg(test)]
mod testing;

use std::io::{self, IsTerminal, Write};

use daemon::observer::{Picture, present};
use daemon::session;
use truss::ids::ModuleName;

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::paint::Paint;

/// Show which components are faulty at present, and how the modules are
///
/// Asks every diagnoser for the state of its components and shows those that are other than normal.
/// Modules that are expected, or that another module names as its peer, and do not answer are shown as
/// not answering: nothing is known of their components.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Show every component, normal ones too
    #[arg(long)]
    all: bool,
    /// Modules that should be there
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// End with exit code 1 unless all is well: every module answers and is in service, and no component
    /// is latched, acknowledged or unconfirmed
    #[arg(long)]
    check: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    link::block_on(look(arguments))
}

async fn look(arguments: &Arguments) -> Result<(), Failure> {
    let link = &arguments.link;
    let session = link.open().await?;
    let looked = present(&session, link.structure.as_ref(), &arguments.expect, link.timeout).await;
    session::close(&session).await;
    let picture = looked.map_err(link::refused)?;
    tell(arguments, &picture)?;
    if !picture.is_of_anybody() {
        return Err(link.nobody());
    }
    if arguments.check && !check::all_is_well(&picture) {
        return Err(Failure::told());
    }
    Ok(())
}

fn tell(arguments: &Arguments, picture: &Picture) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        serde_json::to_writer_pretty(&mut out, &document::document(picture, arguments.all))?;
        writeln!(out)?;
    } else if !picture.modules.is_empty() {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        write!(out, "{}", report::report(picture, arguments.all, paint))?;
    }
    Ok(out.flush()?)
}
