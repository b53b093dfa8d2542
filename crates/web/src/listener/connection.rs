//! One connection of a browser, which may be slow, silent, hostile or gone.

use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use hyper::Request;
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use nix::sys::socket::setsockopt;
use nix::sys::socket::sockopt::TcpUserTimeout;
use pki::{Certificate, CommonName, Issued};
use shell::shutdown::Shutdown;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;
use vocabulary::Occurrences;

use super::sources::{self, Sources};

/// Timeout for the TLS handshake and for the head of a request.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Longest head of a request, in bytes.
const LONGEST_HEAD: usize = 16 * 1024;
/// A connection is closed if the browser acknowledges no data for this long.
const TAKES_WITHIN_MS: u32 = 30_000;
/// Time to finish responses during shutdown; then connections are dropped.
const END_WITHIN: Duration = Duration::from_secs(2);

/// The connection of a request.
#[derive(Debug, Clone)]
pub(crate) struct Connection {
    /// The local address.
    pub(crate) local: SocketAddr,
    /// The source of the request: the browser, as the declared proxy names it, or the other end of the connection.
    pub(crate) client: IpAddr,
    /// The client certificate, if one was shown and verified by TLS.
    pub(crate) shown: Option<Issued>,
}

/// State shared by all connections.
pub(super) struct Shared {
    pub(super) router: Router,
    pub(super) tls: Option<TlsAcceptor>,
    pub(super) places: Arc<Semaphore>,
    /// The open connections of each source.
    pub(super) sources: Arc<Sources>,
    /// Whether the other end of each connection is the declared proxy.
    pub(super) is_behind_proxy: bool,
    /// Connections refused because their source has too many.
    pub(super) crowded: Occurrences,
    /// Connections that failed before they were established.
    pub(super) failed: Occurrences,
}

/// Serves a connection until it ends.
pub(super) async fn attend(
    stream: TcpStream,
    peer: SocketAddr,
    shared: &Shared,
    mut shutdown: Shutdown,
) {
    // Optional: without these, stalled browsers are detected later and responses are slower.
    let _ = setsockopt(&stream, TcpUserTimeout, &TAKES_WITHIN_MS);
    let _ = stream.set_nodelay(true);
    let Ok(local) = stream.local_addr() else { return };
    let plain = Connection { local, client: peer.ip(), shown: None };
    let Some(acceptor) = &shared.tls else {
        return serve(stream, plain, shared, shutdown).await;
    };
    let begun = tokio::select! {
        begun = handshake(acceptor, stream) => begun,
        () = shutdown.requested() => return,
    };
    match begun {
        Ok(stream) => {
            let connection = Connection { shown: shown(&stream), ..plain };
            serve(stream, connection, shared, shutdown).await;
        }
        Err(why) => {
            if let Some(times) = shared.failed.note(Instant::now()) {
                let why = vocabulary::printable(&why);
                tracing::info!(from = %peer.ip(), times, "a connection over TLS failed: {why}");
            }
        }
    }
}

async fn handshake(
    acceptor: &TlsAcceptor,
    stream: TcpStream,
) -> Result<TlsStream<TcpStream>, String> {
    match timeout(HEAD_WITHIN, acceptor.accept(stream)).await {
        Ok(done) => done.map_err(|error| error.to_string()),
        Err(_) => Err(format!("it did not begin within {HEAD_WITHIN:?}")),
    }
}

/// The first certificate of the chain is the holder's.
fn shown(stream: &TlsStream<TcpStream>) -> Option<Issued> {
    let certificate = stream.get_ref().1.peer_certificates()?.first()?;
    let name: CommonName = Certificate::common_name_in(certificate)?.parse().ok()?;
    Some(name.issued)
}

async fn serve(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    connection: Connection,
    shared: &Shared,
    mut shutdown: Shutdown,
) {
    let is_behind_proxy = shared.is_behind_proxy;
    let pages = TowerToHyperService::new(shared.router.clone());
    let service = service_fn(move |mut request: Request<Incoming>| {
        let mut connection = connection.clone();
        if is_behind_proxy {
            connection.client = sources::forwarded(request.headers()).unwrap_or(connection.client);
        }
        request.extensions_mut().insert(connection);
        pages.call(request)
    });
    let served = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_WITHIN)
        .max_buf_size(LONGEST_HEAD)
        .serve_connection(TokioIo::new(stream), service);
    let mut served = std::pin::pin!(served);
    let ended = tokio::select! {
        ended = served.as_mut() => Some(ended),
        () = shutdown.requested() => None,
    };
    let ended = match ended {
        Some(ended) => ended,
        None => {
            served.as_mut().graceful_shutdown();
            // Dropping the future closes the connection.
            timeout(END_WITHIN, served).await.unwrap_or(Ok(()))
        }
    };
    if let Err(error) = ended {
        tracing::debug!("a connection failed: {error}");
    }
}
