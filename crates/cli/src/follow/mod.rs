//! `trusswatch follow`: verdicts, kinds of faults, phases and presence as they are published, one line each.

mod line;

use std::collections::BTreeMap;
use std::io::{self, IsTerminal, Write};

use names::{ComponentPath, StructureName};
use observer::{Feed, News};
use shell::shutdown::{self, ShutdownFlags};
use wire::{FaultTransition, Identification};

use crate::failure::Failure;
use crate::link::{self, Link, Target};
use crate::paint::Paint;
use crate::versioned;

/// Print events as they happen, one line each, until interrupted
///
/// Every change of a verdict, every material change of what is known of a fault, every change of a module's phase, every diagnoser
/// that comes or goes, and every module as which several processes run; at the start the latest of each. Diagnosers that are absent or disappear are waited for.
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
            && let Err(failure) = print(arguments, link, &event)
        {
            break Err(failure);
        }
    };
    session::close(&session).await;
    outcome
}

fn print(arguments: &Arguments, link: &Target, event: &News) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    if arguments.json {
        write!(out, "{}", versioned::line(&line::Document::of(event))?)?;
    } else {
        let paint = Paint::for_terminal(io::stdout().is_terminal());
        let names_structure = link.structure.is_none();
        writeln!(out, "{}", line::line(event, names_structure, paint))?;
    }
    Ok(out.flush()?)
}

/// The last report of each component: a module that reconnects publishes it again.
#[derive(Debug, Default)]
struct LastReported(BTreeMap<(StructureName, ComponentPath), Report>);

#[derive(Debug, Default)]
struct Report {
    transition: Option<FaultTransition>,
    identification: Option<Identification>,
}

impl LastReported {
    fn is_new(&mut self, event: &News) -> bool {
        match event {
            News::Fault(transition) => {
                let last = self.of(&transition.structure, &transition.component);
                last.transition.replace((**transition).clone()).as_ref() != Some(&**transition)
            }
            News::Identification(found) => {
                let last = self.of(&found.structure, &found.component);
                last.identification.replace((**found).clone()).as_ref() != Some(&**found)
                    && !last.is_over(found)
            }
            _ => true,
        }
    }

    fn of(&mut self, structure: &StructureName, component: &ComponentPath) -> &mut Report {
        self.0.entry((structure.clone(), component.clone())).or_default()
    }
}

impl Report {
    /// The latest word on a fault that has been reset is of the past.
    fn is_over(&self, found: &Identification) -> bool {
        let after = |transition: &&FaultTransition| transition.sequence > found.sequence;
        let later = self.transition.as_ref().filter(after);
        later.is_some_and(|transition| !transition.state().is_fault())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faults::testing::{identification, state};
    use wire::FaultState;

    #[test]
    fn what_a_module_publishes_again_is_not_reported_again() {
        let mut reported = LastReported::default();
        let latched = state("m1/sensor/g2", FaultState::Latched);
        let latched = News::Fault(Box::new(FaultTransition { sequence: 1, ..latched }));
        let found = News::Identification(Box::new(identification(true, &["bias"])));
        for event in [&latched, &found] {
            assert!(reported.is_new(event) && !reported.is_new(event), "{event:?}");
        }
        let other = News::Identification(Box::new(identification(true, &["drift"])));
        assert!(reported.is_new(&other));
    }

    #[test]
    fn what_a_fault_was_that_has_been_reset_is_not_reported() {
        let mut reported = LastReported::default();
        let normal = state("m1/sensor/g2", FaultState::Normal);
        let normal = News::Fault(Box::new(FaultTransition { sequence: 2, ..normal }));
        assert!(reported.is_new(&normal));
        let found = News::Identification(Box::new(identification(true, &["bias"])));
        assert!(!reported.is_new(&found));
    }
}
