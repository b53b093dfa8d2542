//! Changed parts of pages: rendered once for all viewers of a page ([`rendering`]), sent only if changed, and to each
//! browser only the latest: as server-sent events (`/stream`), or to clients that poll (`/fragments`).

mod rendering;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream::{Stream, unfold};
use shell::shutdown::Shutdown;
use tokio::sync::OwnedSemaphorePermit;
use tokio::sync::watch::Receiver;

use crate::access::{CHECK_EVERY, SessionWatch, Viewer};
use crate::app::Shared;
use crate::live_page::PageParameters;
use crate::metrics::count;
use crate::part::{MOST, Parts};

/// Timeout for the first rendering.
const FIRST_WITHIN: Duration = Duration::from_secs(2);

/// Seconds after which a refused client may retry \[s\].
const AGAIN_S: u64 = 30;
/// Interval of comments that keep proxies from closing the connection.
const HEARTBEAT: Duration = Duration::from_secs(15);

/// `/stream`
pub(crate) async fn stream(
    State(app): State<Shared>,
    Query(parameters): Query<PageParameters>,
    session: SessionWatch,
    viewer: Viewer,
) -> Response {
    let page = match parameters.page(&app.observed.scene()) {
        Ok(page) => page,
        Err(problem) => return (StatusCode::NOT_FOUND, problem).into_response(),
    };
    let Some(place) = app.streams.place() else {
        count(&app.metrics.streams_refused);
        let words = format!("{MOST} streams are open: poll, or try again in {AGAIN_S} s");
        let again = [(header::RETRY_AFTER, AGAIN_S.to_string())];
        return (StatusCode::SERVICE_UNAVAILABLE, again, words).into_response();
    };
    let parts = rendering::subscribe(&app, &page);
    let shutdown = app.shutdown.clone();
    let person = Some(rendering::person(&app, &viewer));
    let viewing = Viewing { parts, person, sent: 0, session, shutdown, app, _place: place };
    let events = Sse::new(events(viewing)).keep_alive(KeepAlive::new().interval(HEARTBEAT));
    // Tells a buffering proxy to pass events on at once.
    ([(header::HeaderName::from_static("x-accel-buffering"), "no")], events).into_response()
}

/// The viewer of a page.
struct Viewing {
    parts: Receiver<Arc<Parts>>,
    /// Who is signed in, until sent.
    person: Option<String>,
    /// The version last sent.
    sent: u64,
    session: SessionWatch,
    shutdown: Shutdown,
    app: Shared,
    _place: OwnedSemaphorePermit,
}

/// The changes since the last event, whenever the browser is ready for one. Ends with the process, and
/// with the session: then the browser asks again, and the guard decides.
fn events(viewing: Viewing) -> impl Stream<Item = Result<Event, Infallible>> {
    unfold(viewing, |mut viewing| async move {
        loop {
            if viewing.session.is_over(Instant::now()) {
                return None;
            }
            if let Some(person) = viewing.person.take() {
                return Some((Ok(Event::default().data(format!("[{person}]"))), viewing));
            }
            let parts = Arc::clone(&viewing.parts.borrow_and_update());
            if let Some(changed) = parts.since(viewing.sent) {
                viewing.sent = parts.version();
                count(&viewing.app.metrics.updates);
                return Some((Ok(Event::default().data(changed)), viewing));
            }
            tokio::select! {
                changed = viewing.parts.changed() => if changed.is_err() { return None },
                () = viewing.shutdown.requested() => return None,
                () = tokio::time::sleep(CHECK_EVERY) => {}
            }
        }
    })
}

/// `/fragments`
pub(crate) async fn fragments(
    State(app): State<Shared>,
    Query(parameters): Query<PageParameters>,
    viewer: Viewer,
) -> Response {
    let page = match parameters.page(&app.observed.scene()) {
        Ok(page) => page,
        Err(problem) => return (StatusCode::NOT_FOUND, problem).into_response(),
    };
    let mut parts = rendering::subscribe(&app, &page);
    let is_there = |parts: &Arc<Parts>| parts.version() > 0;
    let first = tokio::time::timeout(FIRST_WITHIN, parts.wait_for(is_there)).await;
    let Some(all) = first.ok().and_then(Result::ok).and_then(|parts| parts.since(0)) else {
        return (StatusCode::SERVICE_UNAVAILABLE, "not rendered yet: try again").into_response();
    };
    let head = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")];
    let all = format!("[{},{}", rendering::person(&app, &viewer), &all[1..]);
    (head, all).into_response()
}
