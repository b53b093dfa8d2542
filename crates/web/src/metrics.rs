//! `/metrics` and `/healthz`.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use shell::health::{ProcessReport, Sheet, live, render};

use crate::app::Shared;

const TEXT: &str = "text/plain; charset=utf-8";
const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

/// What is written of it at one moment.
struct Report {
    process: ProcessReport,
    requests: u64,
    streams: u64,
    streams_refused: u64,
    updates: u64,
}

impl Report {
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
pub(crate) async fn metrics(State(app): State<Shared>) -> Response {
    let read = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
    let report = Report {
        process: ProcessReport::read(app.pulse.sign(Instant::now())),
        requests: read(&app.counters.requests),
        streams: app.counters.streams(),
        streams_refused: read(&app.counters.streams_refused),
        updates: read(&app.counters.updates),
    };
    match render(Vec::new(), move |sheet| report.write(sheet)) {
        Ok(text) => ([(header::CONTENT_TYPE, OPEN_METRICS)], text).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

/// `/healthz`: whether the process is live. Whether anything is known of the structure, the page shows.
pub(crate) async fn healthz(State(app): State<Shared>) -> Response {
    let condition = live(app.pulse.sign(Instant::now()));
    let status = if condition.well { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, [(header::CONTENT_TYPE, TEXT)], format!("{}\n", condition.words)).into_response()
}
