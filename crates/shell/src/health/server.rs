//! HTTP on a separate thread and runtime, so that many or slow clients do not affect the diagnosis.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::extract::State;
use axum::http::header::{ALLOW, CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{Method, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpStream;
use tokio::sync::{Semaphore, oneshot};

use super::condition::HealthCondition;
use crate::logging::with_unreachable;

/// Most connections at a time; further ones wait.
const CONNECTIONS: usize = 64;
/// Timeout for receiving a request, so that silent clients do not occupy connections for long.
const REQUEST_WITHIN: Duration = Duration::from_secs(1);
/// Longest duration of a connection, which serves one request.
const LONGEST: Duration = Duration::from_secs(3);
/// Pause between connections: a flood of them gets at most 200 answers a second.
const PAUSE: Duration = Duration::from_millis(5);
/// Longest request line with headers, in bytes.
const LONGEST_HEAD: usize = 8192;

const LIVE: &str = "/healthz";
const READY: &str = "/readyz";
const METRICS: &str = "/metrics";
const TEXT: &str = "text/plain; charset=utf-8";
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// A process that reports its health.
pub trait Subject: Send + Sync + 'static {
    /// Its liveness.
    fn live(&self) -> HealthCondition;
    /// Its readiness.
    fn ready(&self) -> HealthCondition;
    /// Its metrics, in the text format of OpenMetrics.
    ///
    /// # Errors
    /// A metric cannot be written.
    fn metrics(&self) -> Result<String, std::fmt::Error>;
}

/// The address for health is in use, or does not belong to this machine.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("health cannot be served on {address}: {reason}; free the port or choose another address")]
pub struct HealthAddressError {
    /// The address.
    pub address: SocketAddr,
    /// The cause.
    pub reason: String,
}

/// A bound address that is not served yet.
#[derive(Debug)]
pub struct Listening(Option<TcpListener>);

impl Listening {
    /// Binds the address, if one is given.
    ///
    /// # Errors
    /// It is in use, or does not belong to this machine.
    pub fn on(address: Option<SocketAddr>) -> Result<Self, HealthAddressError> {
        let Some(address) = address else { return Ok(Self(None)) };
        let refused =
            |error: std::io::Error| HealthAddressError { address, reason: error.to_string() };
        let listener = TcpListener::bind(address).map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Self(Some(listener)))
    }

    /// Starts serving; without an address, does nothing.
    ///
    /// # Errors
    /// A thread or a runtime cannot be created.
    pub fn serve(self, subject: impl Subject) -> std::io::Result<Option<Server>> {
        self.0.map(|listener| Server::start(listener, Arc::new(subject))).transpose()
    }
}

/// Serves until it is dropped.
#[derive(Debug)]
pub struct Server {
    end: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Server {
    fn start(listener: TcpListener, subject: Arc<dyn Subject>) -> std::io::Result<Self> {
        if let Ok(address) = listener.local_addr() {
            tracing::info!(%address, "serving {LIVE}, {READY} and {METRICS}");
        }
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let listener = {
            let _inside = runtime.enter();
            tokio::net::TcpListener::from_std(listener)?
        };
        let router = router(subject);
        let (end, ended) = oneshot::channel();
        let thread = std::thread::Builder::new().name("health".to_owned()).spawn(move || {
            runtime.block_on(async {
                tokio::select! {
                    () = accept(listener, router) => {}
                    _ = ended => {}
                }
            });
        })?;
        Ok(Self { end: Some(end), thread: Some(thread) })
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // When the sender is dropped, the thread ends at its next await.
        drop(self.end.take());
        if self.thread.take().is_some_and(|thread| thread.join().is_err()) {
            tracing::error!("the thread that serves health has failed");
        }
    }
}

async fn accept(listener: tokio::net::TcpListener, router: Router) {
    let places = Arc::new(Semaphore::new(CONNECTIONS));
    // The semaphore is never closed.
    while let Ok(place) = Arc::clone(&places).acquire_owned().await {
        match listener.accept().await {
            Ok((stream, _)) => {
                let router = router.clone();
                tokio::spawn(async move {
                    let _place = place;
                    attend(stream, router).await;
                });
            }
            Err(error) => tracing::debug!("a connection to health failed: {error}"),
        }
        tokio::time::sleep(PAUSE).await;
    }
}

/// A replacement for `axum::serve`, which has neither these limits nor these timeouts.
async fn attend(stream: TcpStream, router: Router) {
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST_WITHIN)
        .keep_alive(false)
        .max_buf_size(LONGEST_HEAD)
        .serve_connection(TokioIo::new(stream), TowerToHyperService::new(router));
    match tokio::time::timeout(LONGEST, connection).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::debug!("a request for health failed: {error}"),
        Err(_) => tracing::debug!("a request for health took more than {LONGEST:?}"),
    }
}

fn router(subject: Arc<dyn Subject>) -> Router {
    Router::new()
        .route(
            LIVE,
            get(async |State(subject): State<Arc<dyn Subject>>| {
                condition_response(&subject.live())
            }),
        )
        .route(
            READY,
            get(async |State(subject): State<Arc<dyn Subject>>| {
                condition_response(&ready(&*subject))
            }),
        )
        .route(
            METRICS,
            get(async |State(subject): State<Arc<dyn Subject>>| {
                metrics_response(subject.metrics())
            }),
        )
        .fallback(unknown)
        .method_not_allowed_fallback(unknown)
        .with_state(subject)
}

/// Its readiness. A configured endpoint that is not reached is reported, but does not make it unready: others may be
/// reached.
fn ready(subject: &dyn Subject) -> HealthCondition {
    let HealthCondition { well, words } = subject.ready();
    HealthCondition { well, words: with_unreachable(&words, "; ") }
}

/// The response to a request for metrics.
#[must_use]
pub fn metrics_response(metrics: Result<String, std::fmt::Error>) -> Response {
    match metrics {
        Ok(metrics) => respond(StatusCode::OK, OPEN_METRICS, metrics),
        Err(error) => text(StatusCode::INTERNAL_SERVER_ERROR, &error.to_string()),
    }
}

async fn unknown(method: Method) -> Response {
    if matches!(method, Method::GET | Method::HEAD) {
        let words = format!("not found: use {LIVE}, {READY} or {METRICS}");
        return text(StatusCode::NOT_FOUND, &words);
    }
    let refused = text(StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD");
    ([(ALLOW, "GET, HEAD")], refused).into_response()
}

/// The response to a request for a condition: 200 if it is healthy, otherwise 503.
#[must_use]
pub fn condition_response(condition: &HealthCondition) -> Response {
    let status = if condition.well { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    text(status, &condition.words)
}

fn text(status: StatusCode, words: &str) -> Response {
    respond(status, TEXT, format!("{}\n", vocabulary::printable(words)))
}

fn respond(status: StatusCode, kind: &'static str, body: String) -> Response {
    (status, [(CONTENT_TYPE, kind), (CACHE_CONTROL, "no-store")], body).into_response()
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream;
    use std::time::Instant;

    use super::*;

    /// A process that is live and not ready.
    struct Initialising;

    impl Subject for Initialising {
        fn live(&self) -> HealthCondition {
            HealthCondition { well: true, words: "the loop is live".into() }
        }

        fn ready(&self) -> HealthCondition {
            HealthCondition { well: false, words: "initialising: wait".into() }
        }

        fn metrics(&self) -> Result<String, std::fmt::Error> {
            Ok("a 1\n# EOF\n".into())
        }
    }

    fn serve() -> (Server, SocketAddr) {
        let listening = Listening::on(Some("127.0.0.1:0".parse().unwrap())).unwrap();
        let address = listening.0.as_ref().unwrap().local_addr().unwrap();
        (listening.serve(Initialising).unwrap().unwrap(), address)
    }

    fn connect(address: SocketAddr) -> TcpStream {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// Everything that is answered until the connection ends.
    fn said(mut stream: TcpStream) -> String {
        let mut bytes = Vec::new();
        // A client that is cut off while still sending is reset.
        let _ = stream.read_to_end(&mut bytes);
        String::from_utf8(bytes).unwrap()
    }

    fn ask(address: SocketAddr, request: &str) -> String {
        let mut stream = connect(address);
        stream.write_all(format!("{request} HTTP/1.1\r\nHost: x\r\n\r\n").as_bytes()).unwrap();
        said(stream)
    }

    #[test]
    fn each_path_has_its_answer() {
        let (_server, address) = serve();
        for (request, status, end) in [
            ("GET /healthz", "200 OK", "\r\n\r\nthe loop is live\n"),
            ("GET /readyz", "503 Service Unavailable", "\r\n\r\ninitialising: wait\n"),
            ("GET /readyz?verbose", "503 Service Unavailable", "\r\n\r\ninitialising: wait\n"),
            ("GET /metrics", "200 OK", "\r\n\r\na 1\n# EOF\n"),
            ("HEAD /healthz", "200 OK", "\r\n\r\n"),
            ("GET /", "404 Not Found", "use /healthz, /readyz or /metrics\n"),
            ("POST /healthz", "405 Method Not Allowed", "only GET and HEAD\n"),
            ("POST /", "405 Method Not Allowed", "only GET and HEAD\n"),
        ] {
            let answer = ask(address, request);
            assert!(answer.starts_with(&format!("HTTP/1.1 {status}\r\n")), "{request}: {answer}");
            assert!(answer.ends_with(end), "{request}: {answer}");
            assert!(answer.contains("cache-control: no-store\r\n"), "{request}: {answer}");
            assert_eq!(answer.matches("content-type: ").count(), 1, "{request}: {answer}");
            let allowed = answer.matches("allow: GET, HEAD\r\n").count();
            assert_eq!(allowed, usize::from(status.starts_with("405")), "{request}: {answer}");
        }
        let kind = "content-type: application/openmetrics-text; version=1.0.0; charset=utf-8";
        assert!(ask(address, "GET /metrics").contains(kind));
    }

    #[test]
    fn nonsense_and_endless_headers_are_cut_off_and_the_next_is_served() {
        let (_server, address) = serve();
        for nonsense in [
            vec![0xff; 100_000],
            b"GET\r\n\r\n".to_vec(),
            [b"GET / HTTP/1.1\r\nX: ".to_vec(), vec![b'x'; 100_000]].concat(),
        ] {
            let mut stream = connect(address);
            // It may be cut off before all of it is sent.
            let _ = stream.write_all(&nonsense);
            assert!(!said(stream).starts_with("HTTP/1.1 200"));
        }
        assert!(ask(address, "GET /healthz").starts_with("HTTP/1.1 200 OK"));
    }

    #[test]
    fn a_silent_client_holds_a_place_only_for_a_while() {
        let (_server, address) = serve();
        let begin = Instant::now();
        let mut silent: Vec<TcpStream> = (0..CONNECTIONS).map(|_| connect(address)).collect();
        silent[0].write_all(b"GET /healthz HTTP/1.1\r\n").unwrap();
        assert!(ask(address, "GET /healthz").starts_with("HTTP/1.1 200 OK"));
        assert!(begin.elapsed() >= REQUEST_WITHIN, "all places were taken: {:?}", begin.elapsed());
        for stream in silent {
            assert_eq!(said(stream), "");
        }
    }

    #[test]
    fn an_address_is_taken_from_the_start_and_free_at_the_end() {
        let (server, address) = serve();
        let error = Listening::on(Some(address)).unwrap_err().to_string();
        assert!(error.contains(&address.to_string()) && error.contains("in use"), "{error}");
        drop(server);
        Listening::on(Some(address)).unwrap();
    }

    #[test]
    fn without_an_address_nothing_is_served() {
        assert!(Listening::on(None).unwrap().serve(Initialising).unwrap().is_none());
    }
}
