//! Datagrams to the service manager (`sd_notify(3)`).
//!
//! The library's own `notify` blocks until the service manager has read earlier messages. A hanging service manager
//! must not stop the diagnosis, so a message that cannot be sent at once is dropped; a later one will supersede it.

use std::ffi::OsString;
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{SocketAddr, UnixDatagram};

use sd_notify::NotifyState;

/// The environment variable with the address of the service manager.
const VARIABLE: &str = "NOTIFY_SOCKET";
/// The first letter of an address in the abstract namespace.
const ABSTRACT: u8 = b'@';

/// The socket to the service manager.
#[derive(Debug)]
pub(super) struct Notification {
    socket: UnixDatagram,
    to: SocketAddr,
}

impl Notification {
    /// The socket named in the environment; `None` without a service manager.
    ///
    /// # Errors
    /// The variable is not a valid address, or the socket cannot be created.
    pub(super) fn from_environment() -> io::Result<Option<Self>> {
        std::env::var_os(VARIABLE).map(|address| Self::to(&address)).transpose()
    }

    fn to(address: &OsString) -> io::Result<Self> {
        let to = match address.as_bytes() {
            [ABSTRACT, name @ ..] => SocketAddr::from_abstract_name(name)?,
            _ => SocketAddr::from_pathname(address)?,
        };
        let socket = UnixDatagram::unbound()?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, to })
    }

    /// Sends all states in one datagram.
    ///
    /// # Errors
    /// The receiver does not exist, or its buffer is full.
    pub(super) fn send(&self, states: &[NotifyState<'_>]) -> io::Result<()> {
        let lines: String = states.iter().map(|state| format!("{state}\n")).collect();
        self.socket.send_to_addr(lines.as_bytes(), &self.to).map(|_| ())
    }
}

#[cfg(test)]
pub(super) mod testing {
    use super::*;

    /// The service manager's end of the socket.
    pub(in super::super) struct Manager {
        socket: UnixDatagram,
        _directory: tempfile::TempDir,
    }

    impl Manager {
        pub(in super::super) fn new() -> (Self, Notification) {
            let directory = tempfile::tempdir().unwrap();
            let file = directory.path().join("notify");
            let socket = UnixDatagram::bind(&file).unwrap();
            socket.set_nonblocking(true).unwrap();
            let notification = Notification::to(&file.into_os_string()).unwrap();
            (Self { socket, _directory: directory }, notification)
        }

        /// The next datagram, if any.
        pub(in super::super) fn heard(&self) -> Option<String> {
            let mut buffer = [0; 1024];
            let length = self.socket.recv(&mut buffer).ok()?;
            Some(String::from_utf8(buffer[..length].to_vec()).unwrap())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::testing::Manager;
    use super::*;

    #[test]
    fn a_datagram_has_a_line_for_each_state() {
        let (manager, notification) = Manager::new();
        notification.send(&[NotifyState::Ready, NotifyState::Status("in service")]).unwrap();
        assert_eq!(manager.heard().as_deref(), Some("READY=1\nSTATUS=in service\n"));
    }

    #[test]
    fn an_address_may_be_no_file() {
        let name = format!("trusswatch-test-{}", std::process::id());
        let address = SocketAddr::from_abstract_name(&name).unwrap();
        let manager = UnixDatagram::bind_addr(&address).unwrap();
        let notification = Notification::to(&format!("@{name}").into()).unwrap();
        notification.send(&[NotifyState::Watchdog]).unwrap();
        let mut buffer = [0; 64];
        let length = manager.recv(&mut buffer).unwrap();
        assert_eq!(&buffer[..length], b"WATCHDOG=1\n");
    }

    #[test]
    fn a_manager_that_takes_nothing_does_not_block() {
        let (_manager, notification) = Manager::new();
        let refused = (0..100_000).find_map(|_| notification.send(&[NotifyState::Watchdog]).err());
        assert_eq!(refused.map(|error| error.kind()), Some(io::ErrorKind::WouldBlock));
    }
}
