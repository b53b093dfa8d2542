//! Metrics and the health of the process.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use shell::health::{ProcessReport, Sheet, live, render};
use shell::supervision::Pulse;

const TEXT: &str = "text/plain; charset=utf-8";
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// Counters since the start of the process.
#[derive(Debug, Default)]
struct WebCounters {
    requests: AtomicU64,
    streams_opened: AtomicU64,
    streams_closed: AtomicU64,
    streams_refused: AtomicU64,
    updates: AtomicU64,
}

/// The counters, and the process's progress.
#[derive(Debug, Clone)]
pub(crate) struct Metrics {
    counters: Arc<WebCounters>,
    pulse: Arc<Pulse>,
}

impl Metrics {
    pub(crate) fn new(pulse: Arc<Pulse>) -> Self {
        Self { counters: Arc::default(), pulse }
    }

    pub(crate) fn request(&self) {
        self.counters.requests.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_opened(&self) {
        self.counters.streams_opened.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_closed(&self) {
        self.counters.streams_closed.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_refused(&self) {
        self.counters.streams_refused.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn update(&self) {
        self.counters.updates.fetch_add(1, Ordering::Relaxed);
    }

    /// The number of open streams.
    pub(crate) fn streams(&self) -> u64 {
        let closed = self.counters.streams_closed.load(Ordering::Relaxed);
        self.counters.streams_opened.load(Ordering::Relaxed).saturating_sub(closed)
    }
}

/// The metrics at one moment.
struct WebReport {
    process: ProcessReport,
    requests: u64,
    streams: u64,
    streams_refused: u64,
    updates: u64,
}

impl WebReport {
    fn write(&self, sheet: &mut Sheet<'_>) -> fmt::Result {
        self.process.write(sheet)?;
        sheet.counter("trusswatch_web_requests", "Requests.", self.requests)?;
        sheet.gauge("trusswatch_web_streams", "Pages that are kept up to date.", self.streams)?;
        let help = "Streams refused because too many were open.";
        sheet.counter("trusswatch_web_streams_refused", help, self.streams_refused)?;
        sheet.counter("trusswatch_web_updates", "Updates sent to pages.", self.updates)
    }
}

/// `/metrics`, in the text format of OpenMetrics.
pub(crate) async fn metrics(State(metrics): State<Metrics>) -> Response {
    let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    let report = WebReport {
        process: ProcessReport::read(metrics.pulse.sign(Instant::now())),
        requests: read(&metrics.counters.requests),
        streams: metrics.streams(),
        streams_refused: read(&metrics.counters.streams_refused),
        updates: read(&metrics.counters.updates),
    };
    match render(Vec::new(), move |sheet| report.write(sheet)) {
        Ok(text) => ([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

/// `/healthz`: whether the process is live. Whether the structure is observable, the page shows.
pub(crate) async fn healthz(State(metrics): State<Metrics>) -> Response {
    let condition = live(metrics.pulse.sign(Instant::now()));
    let status = if condition.well { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, [(header::CONTENT_TYPE, TEXT)], format!("{}\n", condition.words)).into_response()
}
