//! Where browsers connect: addresses, TLS, limits.
//!
//! | file | what |
//! |---|---|
//! | `settings` | where, and over what; what must not be |
//! | `tls` | the certificate that is shown, and those that are asked for |
//! | `site` | the names under which the page is reached |
//! | `connection` | one connection from beginning to end |

mod connection;
mod settings;
mod site;
#[cfg(test)]
mod tests;
mod tls;

use std::net::SocketAddr;
use std::sync::Arc;

use axum::Router;
use shell::occurrences::Occurrences;
use shell::shutdown::Shutdown;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio::task::JoinSet;
use tokio_rustls::TlsAcceptor;

pub(crate) use connection::Connection;
use connection::{Shared, attend};
pub use settings::{ListenError, ListenerSettings, TlsFiles};
pub(crate) use site::Site;
pub use site::{Origin, OriginError};

/// Connections at a time; further ones wait.
const CONNECTIONS: usize = 1024;

/// Addresses that are taken, before anything is served on them.
pub(crate) struct Listener {
    sockets: Vec<TcpListener>,
    tls: Option<TlsAcceptor>,
}

impl Listener {
    /// Takes the addresses.
    ///
    /// # Errors
    /// Settings that are not safe, files that cannot be used, an address that cannot be had; nothing is listened on then.
    pub(crate) async fn bind(settings: &ListenerSettings) -> Result<Self, ListenError> {
        settings.check()?;
        let tls = settings.tls.as_ref().map(tls::acceptor).transpose()?;
        let mut sockets = Vec::new();
        for address in &settings.listen {
            let socket = TcpListener::bind(address).await;
            sockets
                .push(socket.map_err(|error| ListenError::Address { address: *address, error })?);
        }
        Ok(Self { sockets, tls })
    }

    /// Where it listens; the port that was chosen, if any could be.
    pub(crate) fn addresses(&self) -> Vec<SocketAddr> {
        self.sockets.iter().filter_map(|socket| socket.local_addr().ok()).collect()
    }

    /// The scheme of its addresses.
    pub(crate) fn scheme(&self) -> &'static str {
        if self.tls.is_some() { "https" } else { "http" }
    }

    /// Serves until the end is asked for, and then for no longer than answers that were begun need, 2 s at most.
    pub(crate) async fn serve(self, router: Router, mut shutdown: Shutdown) {
        let mut accepting = JoinSet::new();
        let shared = Arc::new(Shared {
            router,
            tls: self.tls,
            places: Arc::new(Semaphore::new(CONNECTIONS)),
            failed: Occurrences::default(),
        });
        let connections = shared.places.clone();
        for socket in self.sockets {
            accepting.spawn(accept(socket, shared.clone(), shutdown.clone()));
        }
        shutdown.requested().await;
        accepting.shutdown().await;
        // Every connection ends by itself within its time.
        let _ = connections.acquire_many(CONNECTIONS as u32).await;
    }
}

async fn accept(socket: TcpListener, shared: Arc<Shared>, shutdown: Shutdown) {
    // The semaphore is never closed.
    while let Ok(place) = shared.places.clone().acquire_owned().await {
        match socket.accept().await {
            Ok((stream, peer)) => {
                let (shared, shutdown) = (shared.clone(), shutdown.clone());
                tokio::spawn(async move {
                    let _place = place;
                    attend(stream, peer, &shared, shutdown).await;
                });
            }
            Err(error) => {
                tracing::debug!("a connection failed: {error}");
                // Without descriptors the next one would fail at once, too.
                tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            }
        }
    }
}
