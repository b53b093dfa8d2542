//! The configured endpoints that do not answer, cannot be resolved or are not authenticated. Zenoh retries them for
//! ever and says so in its own log only.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::{SocketAddr, ToSocketAddrs};
use std::os::fd::RawFd;
use std::time::{Duration, Instant};

use nix::sys::socket::{Shutdown, SockaddrStorage, getpeername, shutdown};
use parking_lot::Mutex;

/// Processes that start together find each other within this time.
const PATIENCE: Duration = Duration::from_secs(5);
/// Words of Zenoh and TLS about a process that is not the expected one: waiting does not help.
const REFUSALS: [&str; 3] = ["certificate", "fatal alert", "corrupt message"];

/// Zenoh's words when the process at an endpoint refuses another link because it has one to this process.
const LINKED: &str = "(reason MAX_LINKS)";

static OUTAGES: Mutex<Outages> = Mutex::new(Outages::new());

/// The endpoints without a connection.
#[derive(Debug)]
struct Outages {
    outages: BTreeMap<String, Outage>,
    /// The endpoints to which Zenoh connected last time.
    connected: BTreeSet<String>,
}

#[derive(Debug)]
struct Outage {
    since: Instant,
    reason: String,
    /// Whether this reason was logged.
    is_logged: bool,
    /// Whether the latest attempt was refused as a second link, and nothing was done about it yet.
    is_linked: bool,
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

/// Takes note of such words; logs an outage once, and its end. Closes a link that is open on one side only.
pub(super) fn note(words: &str, now: Instant) {
    let news = OUTAGES.lock().note(words, now);
    let connected = |endpoint| tracing::info!("connected to {endpoint}");
    match news {
        Some(EndpointNews::Lost(lost)) => tracing::warn!("{lost}; trying again"),
        Some(EndpointNews::Connected(endpoint)) => connected(endpoint),
        Some(EndpointNews::Linked { endpoint, address, others }) => {
            match close_links_to(address, &others) {
                Ok(0) => {
                    if OUTAGES.lock().end(&endpoint).is_some() {
                        connected(endpoint);
                    }
                }
                Ok(_) => tracing::warn!("the link to {endpoint} was open on one side only: closed"),
                Err(error) => {
                    tracing::warn!("the link to {endpoint} is open on one side only: {error}")
                }
            }
        }
        None => {}
    }
}

/// Closes this process's TCP connections to an address unless one of the other endpoints is that address; how many
/// were closed. Zenoh then opens a link again.
fn close_links_to(address: SocketAddr, others: &[String]) -> io::Result<usize> {
    let mut open = Vec::new();
    for entry in std::fs::read_dir("/proc/self/fd")? {
        let name = entry?.file_name();
        let Some(file) = name.to_str().and_then(|name| name.parse::<RawFd>().ok()) else {
            continue;
        };
        if peer_of(file) == Some(address) {
            open.push(file);
        }
    }
    let is_address = |endpoint: &String| {
        let known = endpoint.split_once('/').and_then(|(_, name)| name.to_socket_addrs().ok());
        known.is_some_and(|mut addresses| addresses.any(|known| known == address))
    };
    if open.is_empty() || others.iter().any(is_address) {
        return Ok(0);
    }
    for file in &open {
        shutdown(*file, Shutdown::Both)?;
    }
    Ok(open.len())
}

/// The other end of a TCP connection.
fn peer_of(file: RawFd) -> Option<SocketAddr> {
    let peer = getpeername::<SockaddrStorage>(file).ok()?;
    let v4 = peer.as_sockaddr_in().map(|peer| (peer.ip(), peer.port()).into());
    v4.or_else(|| peer.as_sockaddr_in6().map(|peer| (peer.ip(), peer.port()).into()))
}

/// What Zenoh's words say of an endpoint.
#[derive(Debug, PartialEq)]
enum EndpointNews {
    /// An outage is to be logged.
    Lost(String),
    /// The end of a logged outage of this endpoint.
    Connected(String),
    /// The process at this address refuses another link for the second time because it has one to this process: by
    /// another endpoint, or open on its side only. `others` are the connected endpoints.
    ///
    /// Zenoh 1.10.2 (`TransportManager::open_transport_unicast`) gives a handshake up even between its last message
    /// and the start of reading. It then keeps alive a link from which it never reads, and every further attempt is
    /// refused. A process that stands still for the lease and the timeout for opening together, 7 s, causes it.
    Linked { endpoint: String, address: SocketAddr, others: Vec<String> },
}

impl Outages {
    const fn new() -> Self {
        Self { outages: BTreeMap::new(), connected: BTreeSet::new() }
    }

    fn note(&mut self, words: &str, now: Instant) -> Option<EndpointNews> {
        if let Some((_, endpoint)) = words.split_once("Successfully connected to configured peer ")
        {
            self.connected.insert(endpoint.to_owned());
            return self.end(endpoint);
        }
        let (_, attempt) = words.split_once("Unable to connect to configured peer ")?;
        let (endpoint, reason) = attempt.split_once("! ")?;
        self.connected.remove(endpoint);
        let address = if reason.contains(LINKED) { destination(reason) } else { None };
        let reason =
            reason_of(endpoint, reason.rsplit_once(". Retry in").map_or(reason, |(r, _)| r));
        let outage = self.outages.entry(endpoint.to_owned()).or_insert_with(|| Outage {
            since: now,
            reason: String::new(),
            is_logged: false,
            is_linked: false,
        });
        let is_linked_still = address.is_some() && outage.is_linked;
        outage.is_linked = address.is_some() && !outage.is_linked;
        if let Some(address) = address {
            outage.reason = reason;
            let others = self.connected.iter().cloned().collect();
            return is_linked_still.then(|| EndpointNews::Linked {
                endpoint: endpoint.to_owned(),
                address,
                others,
            });
        }
        if outage.reason != reason {
            (outage.is_logged, outage.reason) = (false, reason);
        }
        let is_refused = REFUSALS.iter().any(|word| outage.reason.contains(word));
        let is_due = is_refused || now.duration_since(outage.since) >= PATIENCE;
        let is_news = is_due && !outage.is_logged;
        outage.is_logged |= is_due;
        is_news.then(|| EndpointNews::Lost(no_connection(endpoint, &outage.reason)))
    }

    /// The end of an outage.
    fn end(&mut self, endpoint: &str) -> Option<EndpointNews> {
        let ended = self.outages.remove(endpoint);
        ended
            .filter(|outage| outage.is_logged)
            .map(|_| EndpointNews::Connected(endpoint.to_owned()))
    }

    fn logged(&self) -> Vec<String> {
        let logged = self.outages.iter().filter(|(_, outage)| outage.is_logged);
        logged.map(|(endpoint, outage)| no_connection(endpoint, &outage.reason)).collect()
    }
}

/// The address in Zenoh's description of a link.
fn destination(words: &str) -> Option<SocketAddr> {
    let (_, rest) = words.split_once("dst: ")?;
    let (_, address) = rest.split(',').next()?.split_once('/')?;
    address.parse().ok()
}

fn no_connection(endpoint: &str, reason: &str) -> String {
    format!("no connection to {endpoint}: {reason}")
}

/// The reason without places in Zenoh's source, the time of the attempt, and what repeats the endpoint.
fn reason_of(endpoint: &str, words: &str) -> String {
    let kept = session::without_source_locations(words);
    let reason = kept.split(": verification time").next().unwrap_or(&kept);
    let reason = reason.split(" on: TransportLink").next().unwrap_or(reason);
    let reason = reason.split_once(": [").map_or(reason, |(_, inner)| inner);
    let address = endpoint.split_once('/').map_or(endpoint, |(_, address)| address);
    let own = reason.strip_prefix(address).and_then(|rest| rest.strip_prefix(": "));
    own.unwrap_or(reason).trim_end_matches([' ', '.', ']']).to_owned()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{TcpListener, TcpStream};

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
        let (mut outages, start) = (Outages::new(), Instant::now());
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
        assert_eq!(note(REFUSED, 5), Some(EndpointNews::Lost(refused.clone())));
        assert_eq!(note(UNKNOWN, 6), Some(EndpointNews::Lost(unknown.clone())));
        assert!((7..7000).all(|s| note(REFUSED, s).is_none() && note(UNKNOWN, s).is_none()));
        let connected = "Successfully connected to configured peer tcp/127.0.0.1:1";
        assert_eq!(
            note(connected, 7000),
            Some(EndpointNews::Connected("tcp/127.0.0.1:1".to_owned()))
        );
        assert_eq!(note(connected, 7001), None);
        assert!(note(REFUSED, 8000).is_none(), "another outage has time of its own");
        assert_eq!(outages.logged(), [unknown]);
    }

    #[test]
    fn a_foreign_process_is_logged_at_once_and_another_reason_again() {
        let (mut outages, now) = (Outages::new(), Instant::now());
        let foreign = "no connection to tls/a:1: invalid peer certificate: UnknownIssuer";
        assert_eq!(outages.note(FOREIGN, now), Some(EndpointNews::Lost(foreign.to_owned())));
        assert_eq!(outages.note(FOREIGN, now), None);
        let expired =
            FOREIGN.replace("UnknownIssuer", "certificate expired: verification time 1795 (UNIX)");
        let expired_later = expired.replace("1795", "1796");
        let Some(EndpointNews::Lost(logged)) = outages.note(&expired, now) else {
            panic!("not logged")
        };
        assert!(logged.ends_with("certificate expired"), "{logged}");
        assert_eq!(outages.note(&expired_later, now), None);
    }

    #[test]
    fn an_endpoint_of_a_process_that_is_linked_already_is_no_outage() {
        let (mut outages, start) = (Outages::new(), Instant::now());
        let mut note = |words: &str, s: u64| outages.note(words, start + Duration::from_secs(s));
        let gone =
            "Unable to connect to configured peer tcp/b:2! deadline has elapsed. Retry in 500ms.";
        let linked = "Unable to connect to configured peer tcp/b:2! Received a close message (reason MAX_LINKS) in \
            response to an OpenSyn on: TransportLinkUnicast { link: Link { src: tcp/10.0.0.1:44886, dst: \
            tcp/10.0.0.2:2, mtu: 65480 } } at /a/open.rs:499.. Retry in 500ms.";
        assert_eq!(note("Successfully connected to configured peer tcp/b:1", 0), None);
        assert_eq!(note(gone, 0), None);
        assert!(note(gone, 6).is_some());
        assert_eq!(note(linked, 7), None, "it may be the end of an earlier link");
        let later = linked.replace("44886", "44888");
        let (endpoint, address) = ("tcp/b:2".to_owned(), "10.0.0.2:2".parse().unwrap());
        let others = vec!["tcp/b:1".to_owned()];
        assert_eq!(note(&later, 8), Some(EndpointNews::Linked { endpoint, address, others }));
        let shown = "no connection to tcp/b:2: Received a close message (reason MAX_LINKS) in response to an OpenSyn";
        assert_eq!(outages.logged(), [shown]);
        assert_eq!(outages.end("tcp/b:2"), Some(EndpointNews::Connected("tcp/b:2".to_owned())));
        assert_eq!(outages.logged(), Vec::<String>::new());
    }

    #[test]
    fn only_links_to_the_address_are_closed() {
        let [there, elsewhere] = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").unwrap());
        let [address, other] = [&there, &elsewhere].map(|listener| listener.local_addr().unwrap());
        let [mut link, mut kept] = [address, other].map(|to| TcpStream::connect(to).unwrap());
        let others = |to: SocketAddr| vec![format!("tcp/{to}")];
        assert_eq!(close_links_to(address, &others(address)).unwrap(), 0, "another endpoint's");
        assert_eq!(close_links_to(address, &others(other)).unwrap(), 1);
        assert_eq!(link.read(&mut [0]).unwrap(), 0, "the end");
        assert!(link.write_all(&[0]).is_err());
        kept.write_all(&[7]).unwrap();
        let mut received = [0];
        elsewhere.accept().unwrap().0.read_exact(&mut received).unwrap();
        assert_eq!(received, [7]);
    }
}
