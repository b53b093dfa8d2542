//! Logs clients refused by TLS and access control.
//!
//! Zenoh reports them in its own log only: refused connections with a misleading hint, refused messages
//! among the traces of all accepted ones. Here they are extracted and logged as warnings, each once a
//! minute.
//!
//! This reads the words of Zenoh 1.10.2, whose version is pinned, for it reports refusals in no other way:
//! its access control counts nothing, calls nothing back, is in no part of the admin space, and no other
//! interceptor can be added. Other words would end these warnings silently, if the system tests `security`
//! and `fleet` did not wait for them in the logs of real routers and peers.
//!
//! Access control judges a key expression for every kind of message as soon as it is declared, long
//! before a message comes; only judgements of an actual message are logged. They come in a
//! row after the line `caching permissions`, on the same thread.

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

use crate::occurrences::Occurrences;

/// Where Zenoh judges messages.
const ACCESS_CONTROL: &str = "zenoh::net::routing::interceptor::access_control";
/// Where Zenoh accepts TLS connections.
const TLS: &str = "zenoh_link_tls";
/// Where Zenoh connects to others.
const CONNECTING: &str = "zenoh::net::runtime::orchestrator";

/// Different refusals that are remembered; a flood of ever new ones forgets the older ones.
const REMEMBERED: usize = 256;
/// Refusals that may wait to be logged. More are dropped.
const WAITING: usize = 256;

/// The layer that logs refusals.
pub(super) fn layer<S>() -> impl Layer<S>
where
    S: Subscriber + for<'a> LookupSpan<'a>,
{
    let (sender, receiver) = sync_channel(WAITING);
    // Without the thread no refusal is logged, and the process has greater problems.
    let _ = std::thread::Builder::new().name("refusals".into()).spawn(move || log(&receiver));
    let interesting = Targets::new()
        .with_target(ACCESS_CONTROL, LevelFilter::TRACE)
        .with_target(TLS, LevelFilter::WARN)
        .with_target(CONNECTING, LevelFilter::DEBUG);
    RefusalLayer { sender, names: Mutex::default() }.with_filter(interesting)
}

/// Extracts refusals from Zenoh's log.
struct RefusalLayer {
    sender: SyncSender<String>,
    names: Mutex<Names>,
}

impl<S: Subscriber> Layer<S> for RefusalLayer {
    fn on_event(&self, event: &Event<'_>, _context: Context<'_, S>) {
        let target = event.metadata().target();
        let refusal = if target == ACCESS_CONTROL {
            JUDGEMENTS.with_borrow_mut(|judgements| judgements.judge(event, &self.names))
        } else if target.starts_with(TLS) {
            refused_connection(&words_of(event))
        } else {
            failed_connection(&words_of(event))
        };
        if let Some(refusal) = refusal {
            // A flood must not hold up the network.
            let _ = self.sender.try_send(refusal);
        }
    }
}

/// The text of an event.
struct Words(String);

impl Visit for Words {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // Writing to a text does not fail.
            let _ = write!(self.0, "{value:?}");
        }
    }
}

fn words_of(event: &Event<'_>) -> String {
    let mut words = Words(String::new());
    event.record(&mut words);
    words.0
}

/// By which common name each of those who were refused something is known.
#[derive(Default)]
struct Names(HashMap<String, String>);

impl Names {
    /// `ZID on INTERFACE+CertCommonName(NAME)+PROTOCOL+ZID`, or the first of these if the rest was logged
    /// before.
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

/// What the judgements on one thread are about.
#[derive(Default)]
struct Judgements {
    /// The key expression that is being judged before any message has come.
    ahead: Option<String>,
    /// Places in Zenoh's source that say only what was allowed. They log every message that passes.
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
        // Keeps the name of a client refused ahead for when a message comes.
        let refusal = refused(words, names);
        if ahead { None } else { refusal }
    }
}

/// `WHO is unauthorized to WHAT (ingress) on KEY`. What is not let out (egress) was not attempted by a client.
fn refused(judgement: &str, names: &mut Names) -> Option<String> {
    let (who, attempt) = judgement.split_once(" is unauthorized to ")?;
    let (what, key) = attempt.split_once(" (ingress) on ")?;
    Some(format!("access control refused {what} on {key} by {}", names.of(who)))
}

/// TLS's reason for a refusal, without times of day, which differ each time.
fn refused_connection(words: &str) -> Option<String> {
    let reason = words.split(". Hint:").next()?;
    let reason = reason.split(": verification time").next()?;
    Some(format!("a connection was refused: {reason}"))
}

/// A peer that cannot be reached yet has not refused anything; one with a wrong identity is refused.
fn failed_connection(words: &str) -> Option<String> {
    let refused = ["certificate", "fatal alert", "corrupt message"];
    let (attempt, _) = words.split_once(". Retry in")?;
    let (_, attempt) = attempt.split_once("Unable to connect to configured peer ")?;
    let is_refused = refused.iter().any(|word| attempt.contains(word));
    is_refused.then(|| format!("no connection to {attempt}"))
}

/// Logs each refusal once a minute.
fn log(refusals: &Receiver<String>) {
    let mut logged: HashMap<String, Occurrences> = HashMap::new();
    while let Ok(refusal) = refusals.recv() {
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
        let failed =
            |why| format!("Unable to connect to configured peer tls/a:1! {why}. Retry in 1s.");
        assert!(failed_connection(&failed("invalid peer certificate: UnknownIssuer")).is_some());
        assert_eq!(failed_connection(&failed("Connection refused (os error 111)")), None);
    }
}
