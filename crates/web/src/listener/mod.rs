//! Accepts connections of browsers: addresses, TLS, limits.
//!
//! | file | what |
//! |---|---|
//! | `settings` | addresses and protocol; rejects unsafe combinations |
//! | `tls` | the server certificate, and client certificates |
//! | `site` | the names of this site |
//! | `connection` | one connection from start to end |
//! | `sources` | where requests come from; limits the connections of one source |

mod connection;
mod settings;
mod site;
mod sources;
#[cfg(test)]
mod tests;
mod tls;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Instant;

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
pub use site::{PageAddress, PageAddressError};
pub(crate) use sources::source;

/// Most connections at a time; further ones wait.
const CONNECTIONS: usize = 1024;
/// Most connections of one source, so that one client cannot take the places of all; further ones are closed. A declared
/// proxy has no such limit, because all clients connect through it.
const OF_SOURCE: usize = CONNECTIONS / 8;

/// The bound addresses, before anything is served on them.
pub(crate) struct Listener {
    sockets: Vec<TcpListener>,
    tls: Option<TlsAcceptor>,
    is_behind_proxy: bool,
}

impl Listener {
    /// Binds the addresses.
    ///
    /// # Errors
    /// Unsafe settings, unusable files, or an address that cannot be bound; then no address is listened on.
    pub(crate) async fn bind(settings: &ListenerSettings) -> Result<Self, ListenError> {
        settings.check()?;
        let tls = settings.tls.as_ref().map(tls::acceptor).transpose()?;
        let mut sockets = Vec::new();
        for address in &settings.listen {
            let socket = TcpListener::bind(address).await;
            sockets
                .push(socket.map_err(|error| ListenError::Address { address: *address, error })?);
        }
        Ok(Self { sockets, tls, is_behind_proxy: settings.behind_proxy.is_some() })
    }

    /// The addresses, with the actual port if the system chose it.
    pub(crate) fn addresses(&self) -> Vec<SocketAddr> {
        self.sockets.iter().filter_map(|socket| socket.local_addr().ok()).collect()
    }

    /// The URL scheme of the addresses.
    pub(crate) fn scheme(&self) -> &'static str {
        if self.tls.is_some() { "https" } else { "http" }
    }

    /// Serves until shutdown, then waits at most 2 s for responses in progress.
    pub(crate) async fn serve(self, router: Router, mut shutdown: Shutdown) {
        let mut accepting = JoinSet::new();
        let shared = Arc::new(Shared {
            router,
            tls: self.tls,
            places: Arc::new(Semaphore::new(CONNECTIONS)),
            sources: Arc::default(),
            is_behind_proxy: self.is_behind_proxy,
            crowded: Occurrences::default(),
            failed: Occurrences::default(),
        });
        let connections = shared.places.clone();
        for socket in self.sockets {
            accepting.spawn(accept(socket, shared.clone(), shutdown.clone()));
        }
        shutdown.requested().await;
        accepting.shutdown().await;
        // Every connection ends on its own within its time limit.
        let _ = connections.acquire_many(CONNECTIONS as u32).await;
    }
}

async fn accept(socket: TcpListener, shared: Arc<Shared>, shutdown: Shutdown) {
    // The semaphore is never closed.
    while let Ok(place) = shared.places.clone().acquire_owned().await {
        match socket.accept().await {
            Ok((stream, peer)) => {
                let most = if shared.is_behind_proxy { CONNECTIONS } else { OF_SOURCE };
                let Some(of_source) = shared.sources.enter(source(peer.ip()), most) else {
                    if let Some(times) = shared.crowded.note(Instant::now()) {
                        tracing::warn!(
                            from = %peer.ip(), times,
                            "a connection was refused: {most} of this address are open"
                        );
                    }
                    continue;
                };
                let (shared, shutdown) = (shared.clone(), shutdown.clone());
                tokio::spawn(async move {
                    let _places = (place, of_source);
                    attend(stream, peer, &shared, shutdown).await;
                });
            }
            Err(error) => {
                tracing::debug!("a connection failed: {error}");
                // Out of file descriptors, the next attempt would fail immediately, too.
                tokio::time::sleep(std::time::Duration::from_millis(50)).await;
            }
        }
    }
}
