//! `trusswatch follow`: verdicts, phases and presence as they are told, one line each.

mod line;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};

use daemon::observer::{Feed, News};
use daemon::shutdown::{self, ShutdownFlags};
use daemon::{environment, session};
use truss::ids::{ComponentPath, StructureName};
use wire::FaultTransition;

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::paint::Paint;

/// Tell what happens, one line each, until interrupted
///
/// Every change of a verdict, every change of a module's phase, and every diagnoser that comes or goes; at
/// the start the latest of each. Whoever is not there yet, or goes away, is waited for.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Print one JSON object a line
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    environment::provide();
    link::block_on(follow(arguments))
}

async fn follow(arguments: &Arguments) -> Result<(), Failure> {
    let mut shutdown = shutdown::on_request(ShutdownFlags::default())
        .map_err(|error| Failure::runtime(format!("signals cannot be received: {error}")))?;
    let link = &arguments.link;
    let session = link.open().await?;
    let mut feed = Feed::open(&session, link.structure.as_ref()).await.map_err(link::refused)?;
    let mut told = Told::default();
    let outcome = loop {
        let news = tokio::select! {
            news = feed.next() => news,
            () = shutdown.requested() => break Ok(()),
        };
        let Some(news) = news else {
            break Err(Failure::network("the session was closed".to_owned()));
        };
        if told.is_new(&news)
            && let Err(failure) = tell(arguments, &news)
        {
            break Err(failure);
        }
    };
    session::close(&session).await;
    outcome
}

fn tell(arguments: &Arguments, news: &News) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        serde_json::to_writer(&mut out, &line::Document::of(news))?;
        writeln!(out)?;
    } else {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        writeln!(out, "{}", line::line(news, paint))?;
    }
    Ok(out.flush()?)
}

/// What was told last of each component: whoever comes back tells it again.
#[derive(Debug, Default)]
struct Told(BTreeMap<(StructureName, ComponentPath), FaultTransition>);

impl Told {
    fn is_new(&mut self, news: &News) -> bool {
        let News::Fault(transition) = news else { return true };
        let place = (transition.structure.clone(), transition.component.clone());
        self.0.insert(place, (**transition).clone()).as_ref() != Some(&**transition)
    }
}
