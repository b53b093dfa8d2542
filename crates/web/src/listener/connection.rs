//! One connection of a browser, which may be slow, silent, hostile or gone.

use std::net::SocketAddr;
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
use shell::occurrences::Occurrences;
use shell::shutdown::Shutdown;
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::TcpStream;
use tokio::sync::Semaphore;
use tokio::time::timeout;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::server::TlsStream;

/// A head of a request, or the beginning of TLS, that has not come by then ends the connection.
const HEAD_WITHIN: Duration = Duration::from_secs(10);
/// Longest head of a request.
const LONGEST_HEAD: usize = 16 * 1024;
/// A browser that reads nothing for so long is gone or stalled; its connection is closed.
const TAKES_WITHIN_MS: u32 = 30_000;
/// What is not done by then, once the end is asked for, is broken off.
const END_WITHIN: Duration = Duration::from_secs(2);

/// What a request has come over.
#[derive(Debug, Clone)]
pub(crate) struct Connection {
    /// The address here.
    pub(crate) local: SocketAddr,
    /// The browser's or the proxy's.
    pub(crate) peer: SocketAddr,
    /// Whose certificate was shown, if one was: TLS has verified it.
    pub(crate) shown: Option<Issued>,
}

/// What all connections have in common.
pub(super) struct Shared {
    pub(super) router: Router,
    pub(super) tls: Option<TlsAcceptor>,
    pub(super) places: Arc<Semaphore>,
    /// Connections that did not become any.
    pub(super) failed: Occurrences,
}

/// Serves a connection until it ends.
pub(super) async fn attend(
    stream: TcpStream,
    peer: SocketAddr,
    shared: &Shared,
    mut shutdown: Shutdown,
) {
    // Without these it is only slower to be rid of a stalled browser, and to answer.
    let _ = setsockopt(&stream, TcpUserTimeout, &TAKES_WITHIN_MS);
    let _ = stream.set_nodelay(true);
    let Ok(local) = stream.local_addr() else { return };
    let plain = Connection { local, peer, shown: None };
    let Some(acceptor) = &shared.tls else {
        return serve(stream, plain, shared.router.clone(), shutdown).await;
    };
    let begun = tokio::select! {
        begun = handshake(acceptor, stream) => begun,
        () = shutdown.requested() => return,
    };
    match begun {
        Ok(stream) => {
            let connection = Connection { shown: shown(&stream), ..plain };
            serve(stream, connection, shared.router.clone(), shutdown).await;
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

/// Of several certificates the first is the holder's.
fn shown(stream: &TlsStream<TcpStream>) -> Option<Issued> {
    let certificate = stream.get_ref().1.peer_certificates()?.first()?;
    let name: CommonName = Certificate::common_name_in(certificate)?.parse().ok()?;
    Some(name.issued)
}

async fn serve(
    stream: impl AsyncRead + AsyncWrite + Unpin,
    connection: Connection,
    router: Router,
    mut shutdown: Shutdown,
) {
    let pages = TowerToHyperService::new(router);
    let service = service_fn(move |mut request: Request<Incoming>| {
        request.extensions_mut().insert(connection.clone());
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
            // Given up by dropping it.
            timeout(END_WITHIN, served).await.unwrap_or(Ok(()))
        }
    };
    if let Err(error) = ended {
        tracing::debug!("a connection failed: {error}");
    }
}
