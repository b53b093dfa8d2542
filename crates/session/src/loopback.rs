//! Reserves ports of this machine for processes that connect to each other.
//!
//! A port assigned by the kernel is not free for long: it comes from the range of outgoing connections, and clients
//! that retry a process that does not listen yet make those all the time. Reserved ports are therefore outside that
//! range. Each is claimed until this process ends by an abstract socket name, which is exclusive and, like a port,
//! belongs to a network namespace.

use std::fs;
use std::io;
use std::net::TcpListener;
use std::ops::Range;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use parking_lot::Mutex;

/// Lower ports are more likely to be in use by well-known services.
const LOWEST: u16 = 10_000;

/// The kernel's default range for outgoing connections, and the file that states the actual one.
const OUTGOING: Range<u16> = 32_768..61_000;
const OUTGOING_FILE: &str = "/proc/sys/net/ipv4/ip_local_port_range";

/// The claims of this process.
static CLAIMS: Mutex<Vec<UnixDatagram>> = Mutex::new(Vec::new());

/// Endpoints on reserved ports, for processes started by this one.
///
/// # Errors
/// No ports are left.
pub fn endpoints<const COUNT: usize>() -> io::Result<[String; COUNT]> {
    let count = u16::try_from(COUNT).map_err(io::Error::other)?;
    let mut ports = reserve(count)?;
    Ok([(); COUNT].map(|()| format!("tcp/127.0.0.1:{}", ports.next().unwrap_or_default())))
}

/// Reserves this many consecutive free ports until this process ends; processes started by it may use them.
///
/// # Errors
/// No such ports are left.
pub fn reserve(count: u16) -> io::Result<Range<u16>> {
    let ports = outside(outgoing());
    let blocks = ports.len() as u32 / u32::from(count.max(1));
    // Processes that search at the same time start at different positions.
    let start = std::process::id().wrapping_mul(7919);
    for turn in 0..blocks {
        let block = start.wrapping_add(turn) % blocks;
        // Fits a port number, because the block begins within the range.
        let first = ports.start + block as u16 * count;
        if let Some(claims) = claim(first..first + count) {
            CLAIMS.lock().extend(claims);
            return Ok(first..first + count);
        }
    }
    let missing =
        format!("no {count} ports in a row are free from {} to {}", ports.start, ports.end);
    Err(io::Error::new(io::ErrorKind::AddrNotAvailable, missing))
}

/// Claims all ports or none.
fn claim(mut ports: Range<u16>) -> Option<Vec<UnixDatagram>> {
    ports.try_fold(Vec::new(), |mut claims, port| {
        let name = SocketAddr::from_abstract_name(format!("trusswatch/port/{port}")).ok()?;
        claims.push(UnixDatagram::bind_addr(&name).ok()?);
        TcpListener::bind(("127.0.0.1", port)).ok()?;
        Some(claims)
    })
}

/// The kernel's range for outgoing connections.
fn outgoing() -> Range<u16> {
    let text = fs::read_to_string(OUTGOING_FILE).unwrap_or_default();
    let mut ends = text.split_whitespace().map_while(|end| end.parse::<u16>().ok());
    match (ends.next(), ends.next()) {
        (Some(lowest), Some(highest)) => lowest..highest.saturating_add(1),
        _ => OUTGOING,
    }
}

/// The longer range below or above the outgoing ports. If those cover all ports, their own range is the only choice.
fn outside(outgoing: Range<u16>) -> Range<u16> {
    let below = LOWEST..outgoing.start;
    let above = outgoing.end.max(LOWEST)..u16::MAX;
    let longer = if below.len() >= above.len() { below } else { above };
    if longer.is_empty() { LOWEST..u16::MAX } else { longer }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_given_twice() {
        let [first, second, third] = endpoints().unwrap();
        assert!(first != second && second != third && first != third);
        assert!(first.starts_with("tcp/127.0.0.1:"));
        let (four, again) = (reserve(4).unwrap(), reserve(4).unwrap());
        assert!(four.len() == 4 && again.len() == 4);
        assert!(four.end <= again.start || again.end <= four.start, "{four:?} {again:?}");
    }

    #[test]
    fn a_claim_holds_against_others_and_a_listener_against_a_claim() {
        let port = reserve(1).unwrap().start;
        assert!(claim(port..port + 1).is_none());
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let taken = listener.local_addr().unwrap().port();
        assert!(claim(taken..taken + 1).is_none());
        drop(listener);
        assert!(claim(taken..taken + 1).is_some());
    }

    #[test]
    fn outgoing_connections_have_other_ports() {
        assert_eq!(outside(OUTGOING), LOWEST..32_768);
        assert_eq!(outside(1024..20_000), 20_000..u16::MAX);
        assert_eq!(outside(1024..u16::MAX), LOWEST..u16::MAX);
        let given = outgoing();
        let ours = reserve(1).unwrap().start;
        assert!(!given.contains(&ours) || outside(given) == (LOWEST..u16::MAX));
    }
}
