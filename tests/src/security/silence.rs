//! Strangers who connect and say nothing.

use std::net::TcpStream;
use std::time::Duration;

use nix::sys::resource::{Resource, getrlimit, setrlimit};

use super::stand::Stand;

/// More than the descriptors that a process has at first.
const CONNECTIONS: usize = 1500;
/// The backlog of a listener may be full for a moment.
const CONNECTING: Duration = Duration::from_secs(10);

/// Open connections; gone when dropped.
#[must_use]
pub struct Silence(#[expect(dead_code, reason = "closed when dropped")] Vec<TcpStream>);

impl Silence {
    /// At the door of a stand.
    pub fn at(stand: &Stand) -> Self {
        let (_, hard) = getrlimit(Resource::RLIMIT_NOFILE).unwrap();
        setrlimit(Resource::RLIMIT_NOFILE, hard.min(16_384), hard).unwrap();
        let door = stand.door_of("module1").trim_start_matches("tls/").parse().unwrap();
        let connect = |_| TcpStream::connect_timeout(&door, CONNECTING).unwrap();
        Self((0..CONNECTIONS).map(connect).collect())
    }
}
