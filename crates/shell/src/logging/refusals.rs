//! Logs clients refused by TLS and access control.
//!
//! Zenoh reports them only in its own log: refused connections with a misleading hint, refused messages among the
//! traces of all accepted ones. This module extracts them and logs them as warnings, each at most once a minute.
//!
//! It parses the log messages of Zenoh 1.10.2, whose version is pinned, because Zenoh reports refusals in no other way:
//! its access control has no counters, no callbacks and no place in the admin space, and other interceptors cannot be
//! added. A change of its messages would silently end these warnings, were it not that the system tests `security` and
//! `fleet` wait for them in the logs of real routers and peers.
//!
//! Access control evaluates a declared key expression for every kind of message at once, long before any message
//! arrives; only evaluations of an actual message are logged. The former follow the line `caching permissions` on the
//! same thread.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::fmt::{Debug, Write};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Instant;

use parking_lot::Mutex;
use tracing::callsite::Identifier;
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

use super::endpoints;
use vocabulary::Occurrences;

/// The module of Zenoh that evaluates messages.
const ACCESS_CONTROL: &str = "zenoh::net::routing::interceptor::access_control";
/// The crate that accepts TLS connections.
const TLS: &str = "zenoh_link_tls";
/// The module of Zenoh that opens connections.
const CONNECTING: &str = "zenoh::net::runtime::orchestrator";

/// Most distinct refusals remembered; in a flood of new ones the oldest are forgotten.
const REMEMBERED: usize = 256;
/// Capacity of the queue of refusals to be logged; more are dropped.
const WAITING: usize = 256;

/// The layer that logs refusals.
pub(super) fn layer<S>() -> impl Layer<S>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    let (sender, receiver) = sync_channel(WAITING);
    // Without the thread refusals are not logged; a process that cannot start a thread has greater problems.
    let _ = std::thread::Builder::new().name("refusals".into()).spawn(move || log(&receiver));
    let interesting = Targets::new()
        .with_target(ACCESS_CONTROL, LevelFilter::TRACE)
        .with_target(TLS, LevelFilter::WARN)
        .with_target(CONNECTING, LevelFilter::DEBUG);
    RefusalLayer { sender, names: Mutex::default() }.with_filter(interesting)
}

/// An event found in Zenoh's log.
enum Report {
    /// A refusal to be logged.
    Refusal(String),
    /// Zenoh's words on a connection to a configured endpoint.
    Connecting(String),
}

/// Extracts refusals from Zenoh's log.
struct RefusalLayer {
    sender: SyncSender<Report>,
    names: Mutex<Names>,
}

impl<S: Subscriber> Layer<S> for RefusalLayer {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let target = event.metadata().target();
        let report = if target == ACCESS_CONTROL {
            let judge = |judgements: &mut Judgements| judgements.judge(event, &self.names);
            JUDGEMENTS.with_borrow_mut(judge).map(Report::Refusal)
        } else if target.starts_with(TLS) {
            refused_connection(&words_of(event)).map(Report::Refusal)
        } else {
            let words = words_of(event);
            endpoints::concern(&words).then_some(Report::Connecting(words))
        };
        if let Some(report) = report {
            // Dropped if full, because a flood must not delay the network.
            let _ = self.sender.try_send(report);
        }
    }
}

/// The text of a log event.
struct Words(String);

impl Visit for Words {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // Writing to a string does not fail.
            let _ = write!(self.0, "{value:?}");
        }
    }
}

fn words_of(event: &Event<'_>) -> String {
    let mut words = Words(String::new());
    event.record(&mut words);
    words.0
}

/// The common name of each client that was refused.
#[derive(Default)]
struct Names(HashMap<String, String>);

impl Names {
    /// The common name of a client logged as `ZID on INTERFACE+CertCommonName(NAME)+PROTOCOL+ZID`, or as the ZID alone
    /// if the rest was logged before.
    fn of(&mut self, who: &str) -> String {
        let Some((id, subject)) = who.split_once(" on ") else {
            return self.0.get(who).cloned().unwrap_or_else(|| who.to_owned());
        };
        let named = subject.split_once("CertCommonName(");
        let name =
            named.and_then(|(_, rest)| rest.split_once(')')).map_or(subject, |(name, _)| name);
        if self.0.len() >= REMEMBERED {
            self.0.clear();
        }
        self.0.insert(id.to_owned(), name.to_owned());
        name.to_owned()
    }
}

thread_local! {
    static JUDGEMENTS: RefCell<Judgements> = RefCell::default();
}

/// The context of the evaluations logged on one thread.
#[derive(Default)]
struct Judgements {
    /// The key expression being evaluated in advance of any message.
    ahead: Option<String>,
    /// Call sites in Zenoh that only report permitted messages. They log every message.
    allowing: HashSet<Identifier>,
}

impl Judgements {
    fn judge(&mut self, event: &Event<'_>, names: &Mutex<Names>) -> Option<String> {
        let place = event.metadata().callsite();
        if self.ahead.is_none() && self.allowing.contains(&place) {
            return None;
        }
        let words = words_of(event);
        if words.contains(" is authorized to ") {
            self.allowing.insert(place);
        }
        self.refusal(&words, &mut names.lock())
    }

    fn refusal(&mut self, words: &str, names: &mut Names) -> Option<String> {
        if let Some(key) = words.split_once("caching permissions for `") {
            self.ahead = key.1.split_once('`').map(|(key, _)| key.to_owned());
            return None;
        }
        if let Some((who, _)) = words.split_once(" did not match any configured ACL subject") {
            return Some(format!("no access control rule for {who}: all access denied"));
        }
        if let Some(judgement) = words.strip_prefix("Using cached result: ") {
            self.ahead = None;
            return refused(judgement, names);
        }
        let ahead = self.ahead.as_ref().is_some_and(|key| {
            words.strip_suffix(key.as_str()).is_some_and(|rest| rest.ends_with(" on "))
        });
        if !ahead || words.contains(" to Declare Liveliness Subscriber (") {
            self.ahead = None;
        }
        // Also records the name of a client refused in advance, for refusals of its messages.
        let refusal = refused(words, names);
        if ahead { None } else { refusal }
    }
}

/// Parses `WHO is unauthorized to WHAT (ingress) on KEY`. A refusal on egress is not an attempt by a client.
fn refused(judgement: &str, names: &mut Names) -> Option<String> {
    let (who, attempt) = judgement.split_once(" is unauthorized to ")?;
    let (what, key) = attempt.split_once(" (ingress) on ")?;
    Some(format!("access control refused {what} on {key} by {}", names.of(who)))
}

/// The reason why TLS refused a connection, without times of day, which differ each time.
fn refused_connection(words: &str) -> Option<String> {
    let reason = words.split(". Hint:").next()?;
    let reason = reason.split(": verification time").next()?;
    Some(format!("a connection was refused: {reason}"))
}

/// Logs each refusal at most once a minute.
fn log(reports: &Receiver<Report>) {
    let mut logged: HashMap<String, Occurrences> = HashMap::new();
    while let Ok(report) = reports.recv() {
        let refusal = match report {
            Report::Refusal(refusal) => refusal,
            Report::Connecting(words) => {
                endpoints::note(&words, Instant::now());
                continue;
            }
        };
        if logged.len() >= REMEMBERED && !logged.contains_key(&refusal) {
            logged.clear();
        }
        if let Some(times) = logged.entry(refusal.clone()).or_default().note(Instant::now()) {
            match times {
                1 => tracing::warn!("{refusal}"),
                _ => tracing::warn!(times, "{refusal}"),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHO: &str = "ab12 on Interface(lo)+CertCommonName(module2.tower)+Transport(Tls)+ab12";

    fn logged_by(judgements: &mut Judgements, words: &str) -> Option<String> {
        judgements.refusal(words, &mut Names::default())
    }

    #[test]
    fn a_refused_message_is_logged_with_client_and_action() {
        let (mut judgements, mut names) = (Judgements::default(), Names::default());
        let words = "Using cached result: ab12 is unauthorized to Query (ingress) on a/b";
        let logged = judgements.refusal(words, &mut names).unwrap();
        assert_eq!(logged, "access control refused Query on a/b by ab12");
        let named = format!("{WHO} is unauthorized to Put (ingress) on t/tower/module1/fault/x");
        let logged = judgements.refusal(&named, &mut names).unwrap();
        let expected = "access control refused Put on t/tower/module1/fault/x by module2.tower";
        assert_eq!(logged, expected);
        let logged = judgements.refusal(words, &mut names).unwrap();
        assert_eq!(logged, "access control refused Query on a/b by module2.tower");
        assert_eq!(logged_by(&mut judgements, &words.replace("unauthorized", "authorized")), None);
        assert_eq!(logged_by(&mut judgements, &words.replace("ingress", "egress")), None);
    }

    #[test]
    fn judgements_ahead_of_any_message_are_not_logged() {
        let mut judgements = Judgements::default();
        let caching = "ACL (ingress): caching permissions for `a/b` ...";
        assert_eq!(logged_by(&mut judgements, caching), None);
        for what in ["Query", "Put", "Liveliness Query", "Declare Liveliness Subscriber"] {
            let words = format!("{WHO} is unauthorized to {what} (ingress) on a/b");
            assert_eq!(logged_by(&mut judgements, &words), None, "{what}");
        }
        let words = format!("{WHO} is unauthorized to Put (ingress) on a/b");
        assert!(logged_by(&mut judgements, &words).is_some(), "that was a message");
        logged_by(&mut judgements, caching);
        let words = format!("{WHO} is unauthorized to Put (ingress) on a/c");
        assert!(logged_by(&mut judgements, &words).is_some(), "that was about another key");
    }

    #[test]
    fn refused_connections_are_logged_without_misleading_hints() {
        let words = "invalid peer certificate: Expired. Hint: increase the system open file limit.";
        let logged = refused_connection(words).unwrap();
        assert_eq!(logged, "a connection was refused: invalid peer certificate: Expired");
        let timed = "certificate expired: verification time 17952 (UNIX). Hint: none";
        assert!(refused_connection(timed).unwrap().ends_with("certificate expired"));
    }
}
