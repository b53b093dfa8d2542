//! `trusswatch follow`: prints verdicts, kinds of faults, phases and presence as they are published, one line each.

use std::time::Duration;

use observer::{EventLine, News, ObservedEvent};
use serde::Serialize;
use serde_json::json;
use session::client::Live;
use shell::shutdown::{self, ShutdownFlags};
use tokio::sync::{mpsc, oneshot};
use tokio::time::timeout;
use vocabulary::StructureName;

use crate::failure::Failure;
use crate::link::{self, Link};
use crate::output;
use crate::paint::{Paint, tone_colour};
use vocabulary::words::{NOTHING, utc};

/// How long the last lines may take once the process is to end.
const LAST_LINES: Duration = Duration::from_millis(500);

/// Print events as they happen, one line each, until interrupted
///
/// Starts with what is so at present, by the time since when: diagnosers that are running, each with its phase, alarms,
/// and components whose alarm is shelved or suppressed. Then prints changes of verdicts, new identifications of faults,
/// changes of modules' phases, diagnosers that appear or disappear, and modules with several processes. Waits for absent
/// diagnosers.
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
    let mut live = Live::events(&session, link.structure.clone()).await?;
    let (lines, mut printed) = printer();
    let outcome = loop {
        let event = tokio::select! {
            event = live.next_event() => event,
            () = shutdown.requested() => break Ok(()),
            done = &mut printed => break done.unwrap_or(Ok(())),
        };
        let Some(event) = event else {
            break Err(Failure::network("the session was closed".to_owned()));
        };
        if !event.news.is_shown() {
            continue;
        }
        let text = text(arguments.json, link.structure.is_none(), &event)?;
        tokio::select! {
            // Only an error ends the printer before its queue; it is reported in the next round.
            _ = lines.send(text) => {}
            () = shutdown.requested() => break Ok(()),
        }
    };
    session::close(&session).await;
    drop(lines);
    if !printed.is_terminated()
        && let Ok(Ok(Err(failure))) = timeout(LAST_LINES, printed).await
    {
        return Err(failure);
    }
    outcome
}

/// Prints on a thread of its own: standard output may stall, which must not keep the process from ending.
fn printer() -> (mpsc::Sender<String>, oneshot::Receiver<Result<(), Failure>>) {
    let (lines, mut queue) = mpsc::channel::<String>(1);
    let (done, printed) = oneshot::channel();
    std::thread::spawn(move || {
        let mut outcome = Ok(());
        while let (Ok(()), Some(text)) = (&outcome, queue.blocking_recv()) {
            outcome = output::print(&text);
        }
        // The receiver is gone when the process ends.
        let _ = done.send(outcome);
    });
    (lines, printed)
}

fn text(json: bool, names_structure: bool, event: &ObservedEvent) -> Result<String, Failure> {
    Ok(if json {
        output::line(&document(event))?
    } else {
        line(&EventLine::of(event), names_structure, Paint::of_stdout()) + "\n"
    })
}

/// The JSON document of an event. A message includes its own time.
fn document(event: &ObservedEvent) -> impl Serialize {
    let has_time = matches!(
        event.news,
        News::Fault(_) | News::Present(_) | News::Identification(_) | News::Phase(_)
    );
    let time = if has_time { json!({}) } else { json!({ "time_unix_ns": event.time_unix_ns }) };
    output::with(&event.news, time)
}

/// The line of an event: time, structure if several may occur, subject, event, reason.
fn line(event: &EventLine, names_structure: bool, paint: Paint) -> String {
    let EventLine { time_unix_ns, who, what, why, tone, .. } = event;
    let place = event.structure.as_ref().map_or(NOTHING, StructureName::as_str);
    let place = if names_structure { format!("{place:<10}  ") } else { String::new() };
    let text = format!("{}  {place}{who:<20}  {what:<14}  {why}", utc(*time_unix_ns));
    let text = text.trim_end();
    tone_colour(*tone).map_or_else(|| text.to_owned(), |colour| paint.in_colour(colour, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_a_line_and_an_object_with_its_time() {
        let (structure, module) = ("tower".parse().unwrap(), "m1".parse().unwrap());
        let (from, to, reason) = (3, 4, "refused".to_owned());
        let news = News::Missed { structure, module, from, to, reason };
        let event = ObservedEvent { number: 1, time_unix_ns: 7, news };
        let text = |names| line(&EventLine::of(&event), names, Paint::NONE);
        let expected = "m1                    MISSED          transitions 3 to 4 could not be fetched: refused";
        assert_eq!(text(false), format!("1970-01-01T00:00:00.000Z  {expected}"));
        assert_eq!(text(true), format!("1970-01-01T00:00:00.000Z  tower       {expected}"));
        let expected = "{\"v\":1,\"news\":\"missed\",\"structure\":\"tower\",\"module\":\"m1\",\"from\":3,\
                        \"to\":4,\"reason\":\"refused\",\"time_unix_ns\":7}\n";
        assert_eq!(output::line(&document(&event)).unwrap(), expected);
    }
}
