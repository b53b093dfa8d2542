//! `/fragments`: all parts of a page at once, for clients that poll.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::rendering;
use crate::access::Viewer;
use crate::app::Shared;
use crate::live_page::PageParameters;
use crate::part::Parts;

/// Timeout for the first rendering.
const FIRST_WITHIN: Duration = Duration::from_secs(2);

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
    let mut parts = rendering::look(&app, &page);
    let is_there = |parts: &Arc<Parts>| parts.version() > 0;
    let first = tokio::time::timeout(FIRST_WITHIN, parts.wait_for(is_there)).await;
    let Some(all) = first.ok().and_then(Result::ok).and_then(|parts| parts.since(0)) else {
        return (StatusCode::SERVICE_UNAVAILABLE, "not rendered yet: try again").into_response();
    };
    let head = [(header::CONTENT_TYPE, "application/json"), (header::CACHE_CONTROL, "no-store")];
    let all = format!("[{},{}", rendering::person(&app, &viewer), &all[1..]);
    (head, all).into_response()
}
