//! Metrics and the health of the process.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use axum::extract::State;
use axum::response::Response;
use shell::health::{ProcessReport, condition_response, live, metrics_response, render};
use shell::supervision::Pulse;

use crate::app::Shared;

/// Counters since the start of the process, and its progress.
#[derive(Debug)]
pub(crate) struct Metrics {
    pub(crate) requests: AtomicU64,
    pub(crate) streams_refused: AtomicU64,
    pub(crate) updates: AtomicU64,
    pulse: Arc<Pulse>,
}

impl Metrics {
    pub(crate) fn new(pulse: Arc<Pulse>) -> Self {
        let [requests, streams_refused, updates] = Default::default();
        Self { requests, streams_refused, updates, pulse }
    }
}

/// Counts one more.
pub(crate) fn count(counter: &AtomicU64) {
    counter.fetch_add(1, Ordering::Relaxed);
}

/// `/metrics`, in the text format of OpenMetrics.
pub(crate) async fn metrics(State(app): State<Shared>) -> Response {
    let Metrics { requests, streams_refused, updates, pulse } = &app.metrics;
    let counters = [requests, streams_refused, updates];
    let [requests, refused, updates] = counters.map(|counter| counter.load(Ordering::Relaxed));
    let (process, streams) = (ProcessReport::read(pulse.sign(Instant::now())), app.streams.open());
    let until_unix_s = app.certificates.until_unix_s();
    metrics_response(render(Vec::new(), move |sheet| {
        process.write(sheet)?;
        sheet.certificate_expiry(until_unix_s)?;
        sheet.counter("trusswatch_web_requests", "Requests.", requests)?;
        sheet.gauge("trusswatch_web_streams", "Pages that are kept up to date.", streams)?;
        let help = "Streams refused because too many were open.";
        sheet.counter("trusswatch_web_streams_refused", help, refused)?;
        sheet.counter("trusswatch_web_updates", "Updates sent to pages.", updates)
    }))
}

/// `/healthz`: whether the process is live. Whether the structure is observable, the page shows.
pub(crate) async fn healthz(State(app): State<Shared>) -> Response {
    condition_response(&live(app.metrics.pulse.sign(Instant::now())))
}
