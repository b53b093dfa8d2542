//! Sends one health request and reads the answer.

use std::time::Duration;

use http_body_util::{BodyExt, Empty, Limited};
use hyper::body::Bytes;
use hyper::client::conn::http1;
use hyper::header::HOST;
use hyper::{Request, StatusCode};
use hyper_util::rt::TokioIo;
use tokio::net::TcpStream;
use vocabulary::printable;

use super::condition::HealthCondition;

/// Longest answer read, in bytes.
const LONGEST_BODY: usize = 4096;

/// The request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbeKind {
    /// Liveness.
    Live,
    /// Readiness.
    Ready,
}

impl ProbeKind {
    fn path(self) -> &'static str {
        match self {
            ProbeKind::Live => "/healthz",
            ProbeKind::Ready => "/readyz",
        }
    }
}

/// Why the process did not give a usable answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ProbeError {
    /// No process listens at the address, or the connection failed.
    #[error("{address}: {reason}")]
    Connection {
        /// The address.
        address: String,
        /// The cause.
        reason: String,
    },
    /// No answer in time.
    #[error("{address}: no answer within {timeout:?}")]
    Silent {
        /// The address.
        address: String,
        /// The timeout.
        timeout: Duration,
    },
    /// Another program listens there.
    #[error("{address}: answers {status} on {path}; use the address that `[health]` names")]
    Foreign {
        /// The address.
        address: String,
        /// The requested path.
        path: &'static str,
        /// The status of the answer.
        status: u16,
    },
}

/// Asks the process that serves health at `address`, a `HOST:PORT`.
///
/// # Errors
/// The process did not answer, or another program answered.
pub async fn probe(
    address: &str,
    kind: ProbeKind,
    timeout: Duration,
) -> Result<HealthCondition, ProbeError> {
    let path = kind.path();
    let asked = tokio::time::timeout(timeout, get(address, path)).await;
    let asked = asked.map_err(|_| ProbeError::Silent { address: address.into(), timeout })?;
    let (status, words) = asked.map_err(|error| ProbeError::Connection {
        address: address.into(),
        reason: error.to_string(),
    })?;
    let well = match status {
        StatusCode::OK => true,
        StatusCode::SERVICE_UNAVAILABLE => false,
        other => {
            let (address, status) = (address.into(), other.as_u16());
            return Err(ProbeError::Foreign { address, path, status });
        }
    };
    Ok(HealthCondition { well, words: printable(words.trim_end()) })
}

type Broken = Box<dyn std::error::Error + Send + Sync>;

async fn get(address: &str, path: &str) -> Result<(StatusCode, String), Broken> {
    let stream = TcpStream::connect(address).await?;
    let (mut sender, connection) = http1::handshake(TokioIo::new(stream)).await?;
    let request = Request::get(path).header(HOST, address).body(Empty::<Bytes>::new())?;
    let exchange = async {
        let response = sender.send_request(request).await?;
        let status = response.status();
        let body = Limited::new(response.into_body(), LONGEST_BODY).collect().await?;
        Ok((status, String::from_utf8_lossy(&body.to_bytes()).into_owned()))
    };
    tokio::pin!(exchange);
    // The exchange progresses only while the connection is polled.
    tokio::select! {
        biased;
        done = &mut exchange => done,
        ended = connection => {
            ended?;
            exchange.await
        }
    }
}
