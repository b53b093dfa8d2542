//! `trusswatch follow`: verdicts, phases and presence as they are published, one line each.

mod line;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};

use names::{ComponentPath, StructureName};
use observer::{Feed, News};
use shell::shutdown::{self, ShutdownFlags};
use wire::FaultTransition;

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::paint::Paint;
use crate::versioned;

/// Print events as they happen, one line each, until interrupted
///
/// Every change of a verdict, every change of a module's phase, and every diagnoser that comes or goes; at
/// the start the latest of each. Diagnosers that are absent or disappear are waited for.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Print one JSON object a line
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    link::block_on(follow(arguments))
}

async fn follow(arguments: &Arguments) -> Result<(), Failure> {
    let mut shutdown = shutdown::on_request(ShutdownFlags::default())
        .map_err(|error| Failure::runtime(format!("signals cannot be received: {error}")))?;
    let link = &arguments.link.target()?;
    let session = link.open().await?;
    let mut feed = Feed::open(&session, link.structure.as_ref()).await.map_err(link::refused)?;
    let mut last_reported = LastReported::default();
    let outcome = loop {
        let event = tokio::select! {
            event = feed.next() => event,
            () = shutdown.requested() => break Ok(()),
        };
        let Some(event) = event else {
            break Err(Failure::network("the session was closed".to_owned()));
        };
        if last_reported.is_new(&event)
            && let Err(failure) = print(arguments, &event)
        {
            break Err(failure);
        }
    };
    session::close(&session).await;
    outcome
}

fn print(arguments: &Arguments, event: &News) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", versioned::line(&line::Document::of(event))?)?;
    } else {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        writeln!(out, "{}", line::line(event, paint))?;
    }
    Ok(out.flush()?)
}

/// The last report of each component: a module that reconnects publishes it again.
#[derive(Debug, Default)]
struct LastReported(BTreeMap<(StructureName, ComponentPath), FaultTransition>);

impl LastReported {
    fn is_new(&mut self, event: &News) -> bool {
        let News::Fault(transition) = event else { return true };
        let place = (transition.structure.clone(), transition.component.clone());
        self.0.insert(place, (**transition).clone()).as_ref() != Some(&**transition)
    }
}
