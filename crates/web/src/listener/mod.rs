//! Accepts connections of browsers: addresses, TLS, limits.
//!
//! | file | what |
//! |---|---|
//! | `settings` | flags for access to the page; rejects unsafe combinations |
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
use shell::shutdown::Shutdown;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tokio_rustls::TlsAcceptor;
use vocabulary::Occurrences;

pub(crate) use connection::Connection;
use connection::{Shared, attend};
pub use settings::{ListenError, PageAccess};
pub(crate) use site::Site;
pub use site::{PageAddress, PageAddressError};
pub(crate) use sources::source;

/// Most connections at a time; further ones wait.
const CONNECTIONS: usize = 1024;
/// Most connections of one source, so that one client cannot take the places of all; further ones are closed. A declared
/// proxy has no such limit, because all clients connect through it.
const OF_SOURCE: usize = CONNECTIONS / 8;

/// The bound address, before the page is served on it.
pub(crate) struct Listener {
    socket: TcpListener,
    tls: Option<TlsAcceptor>,
    is_behind_proxy: bool,
}

impl Listener {
    /// Binds the address.
    ///
    /// # Errors
    /// Unsafe settings, unusable files, or an address that cannot be bound.
    pub(crate) async fn bind(listen: SocketAddr, access: &PageAccess) -> Result<Self, ListenError> {
        access.check(listen)?;
        let tls = tls::acceptor(access)?;
        let bound = TcpListener::bind(listen).await;
        let socket = bound.map_err(|error| ListenError::Address { address: listen, error })?;
        Ok(Self { socket, tls, is_behind_proxy: access.behind_proxy.is_some() })
    }

    /// The address, with the actual port if the system chose it.
    pub(crate) fn address(&self) -> std::io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// The URL scheme of the page.
    pub(crate) fn scheme(&self) -> &'static str {
        if self.tls.is_some() { "https" } else { "http" }
    }

    /// Serves until shutdown, then waits at most 2 s for responses in progress.
    pub(crate) async fn serve(self, router: Router, mut shutdown: Shutdown) {
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
        let accepting = accept(self.socket, shared, shutdown.clone());
        tokio::select! {
            () = accepting => {}
            () = shutdown.requested() => {}
        }
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
