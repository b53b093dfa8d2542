//! The configured endpoints that do not answer, cannot be resolved or are not authenticated. Zenoh retries them for
//! ever and says so in its own log only.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

/// Processes that start together find each other within this time.
const PATIENCE: Duration = Duration::from_secs(5);
/// Words of Zenoh and TLS about a process that is not the expected one: waiting does not help.
const REFUSALS: [&str; 3] = ["certificate", "fatal alert", "corrupt message"];

static OUTAGES: Mutex<Outages> = Mutex::new(Outages(BTreeMap::new()));

/// The endpoints without a connection.
#[derive(Debug, Default)]
struct Outages(BTreeMap<String, Outage>);

#[derive(Debug)]
struct Outage {
    since: Instant,
    reason: String,
    /// Whether this reason was logged.
    is_logged: bool,
}

/// Each configured endpoint that has had no connection for five seconds or is refused, with the reason.
fn unreachable() -> Vec<String> {
    OUTAGES.lock().logged()
}

/// A status, followed by those endpoints.
pub(crate) fn with_unreachable(status: &str, separator: &str) -> String {
    let unreachable = unreachable();
    std::iter::once(status)
        .chain(unreachable.iter().map(String::as_str))
        .collect::<Vec<_>>()
        .join(separator)
}

/// Whether these words of Zenoh tell of a connection to a configured endpoint.
pub(super) fn concern(words: &str) -> bool {
    words.contains(" configured peer ")
}

/// Takes note of such words; logs an outage once, and its end.
pub(super) fn note(words: &str, now: Instant) {
    match OUTAGES.lock().note(words, now) {
        Some(Err(lost)) => tracing::warn!("{lost}; trying again"),
        Some(Ok(endpoint)) => tracing::info!("connected to {endpoint}"),
        None => {}
    }
}

impl Outages {
    /// An outage to be logged, or the endpoint of one that has ended.
    fn note(&mut self, words: &str, now: Instant) -> Option<Result<String, String>> {
        if let Some((_, endpoint)) = words.split_once("Successfully connected to configured peer ")
        {
            let ended = self.0.remove(endpoint);
            return ended.filter(|outage| outage.is_logged).map(|_| Ok(endpoint.to_owned()));
        }
        let (_, attempt) = words.split_once("Unable to connect to configured peer ")?;
        let (endpoint, reason) = attempt.split_once("! ")?;
        let reason =
            reason_of(endpoint, reason.rsplit_once(". Retry in").map_or(reason, |(r, _)| r));
        let outage = self.0.entry(endpoint.to_owned()).or_insert_with(|| Outage {
            since: now,
            reason: String::new(),
            is_logged: false,
        });
        if outage.reason != reason {
            (outage.is_logged, outage.reason) = (false, reason);
        }
        let is_refused = REFUSALS.iter().any(|word| outage.reason.contains(word));
        let is_due = is_refused || now.duration_since(outage.since) >= PATIENCE;
        let is_news = is_due && !outage.is_logged;
        outage.is_logged |= is_due;
        is_news.then(|| Err(no_connection(endpoint, &outage.reason)))
    }

    fn logged(&self) -> Vec<String> {
        let logged = self.0.iter().filter(|(_, outage)| outage.is_logged);
        logged.map(|(endpoint, outage)| no_connection(endpoint, &outage.reason)).collect()
    }
}

fn no_connection(endpoint: &str, reason: &str) -> String {
    format!("no connection to {endpoint}: {reason}")
}

/// The reason without places in Zenoh's source, the time of the attempt, and what repeats the endpoint.
fn reason_of(endpoint: &str, words: &str) -> String {
    let kept = session::without_source_locations(words);
    let reason = kept.split(": verification time").next().unwrap_or(&kept);
    let reason = reason.split_once(": [").map_or(reason, |(_, inner)| inner);
    let address = endpoint.split_once('/').map_or(endpoint, |(_, address)| address);
    let own = reason.strip_prefix(address).and_then(|rest| rest.strip_prefix(": "));
    own.unwrap_or(reason).trim_end_matches([' ', '.', ']']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const REFUSED: &str = "Unable to connect to configured peer tcp/127.0.0.1:1! Can not create a new TCP link bound \
        to tcp/127.0.0.1:1: [127.0.0.1:1: Connection refused (os error 111) at /a/tcp.rs:105.] at /a/tcp.rs:133. at \
        /b/unicast.rs:287.. Retry in 100ms.";
    const UNKNOWN: &str = "Unable to connect to configured peer tcp/none.invalid:7447! failed to lookup address \
        information: Name or service not known at /a/lib.rs:62.. Retry in 500ms.";
    const FOREIGN: &str = "Unable to connect to configured peer tls/a:1! invalid peer certificate: UnknownIssuer. \
        Retry in 1s.";

    #[test]
    fn an_endpoint_that_does_not_answer_is_logged_once_with_its_reason_and_when_it_does() {
        let (mut outages, start) = (Outages::default(), Instant::now());
        let mut note = |words: &str, s: u64| outages.note(words, start + Duration::from_secs(s));
        let refused =
            "no connection to tcp/127.0.0.1:1: Connection refused (os error 111)".to_owned();
        let unknown =
            "no connection to tcp/none.invalid:7447: failed to lookup address information: \
            Name or service not known"
                .to_owned();
        for words in [REFUSED, UNKNOWN] {
            assert!([0, 1, 4].into_iter().all(|s| note(words, s).is_none()), "it may come");
        }
        assert_eq!(note(REFUSED, 5), Some(Err(refused.clone())));
        assert_eq!(note(UNKNOWN, 6), Some(Err(unknown.clone())));
        assert!((7..7000).all(|s| note(REFUSED, s).is_none() && note(UNKNOWN, s).is_none()));
        let connected = "Successfully connected to configured peer tcp/127.0.0.1:1";
        assert_eq!(note(connected, 7000), Some(Ok("tcp/127.0.0.1:1".to_owned())));
        assert_eq!(note(connected, 7001), None);
        assert!(note(REFUSED, 8000).is_none(), "another outage has time of its own");
        assert_eq!(outages.logged(), [unknown]);
    }

    #[test]
    fn a_foreign_process_is_logged_at_once_and_another_reason_again() {
        let (mut outages, now) = (Outages::default(), Instant::now());
        let foreign = "no connection to tls/a:1: invalid peer certificate: UnknownIssuer";
        assert_eq!(outages.note(FOREIGN, now), Some(Err(foreign.to_owned())));
        assert_eq!(outages.note(FOREIGN, now), None);
        let expired =
            FOREIGN.replace("UnknownIssuer", "certificate expired: verification time 1795 (UNIX)");
        let expired_later = expired.replace("1795", "1796");
        let logged = outages.note(&expired, now).unwrap().unwrap_err();
        assert!(logged.ends_with("certificate expired"), "{logged}");
        assert_eq!(outages.note(&expired_later, now), None);
    }
}
