//! The sign-out page.

use std::sync::Arc;

use axum::extract::State;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use maud::html;

use super::{Access, Viewer, plain};

/// Asks for confirmation, because loading a page must not change anything.
pub(super) async fn page(viewer: Viewer) -> Response {
    let content = html! {
        @match &viewer.person {
            Some(person) => {
                p { "You are signed in as " strong { (vocabulary::printable(&person.name)) } "." }
                form method="post" action="/sign-out" {
                    input type="hidden" name="token" value=(person.form_token);
                    button type="submit" { "Sign out" }
                }
            },
            None => p { "You are not signed in." },
        }
        p { a href="/" { "To the overview" } }
    };
    plain(StatusCode::OK, "Sign out", &content)
}

/// Ends the session.
pub(super) async fn leave(State(access): State<Arc<Access>>, viewer: Viewer) -> Response {
    if let Some(session) = &viewer.session {
        access.sessions.end(session);
    }
    if let Some(person) = &viewer.person {
        tracing::info!("{} has signed out", vocabulary::printable(&person.name));
    }
    let mut response = StatusCode::SEE_OTHER.into_response();
    response.headers_mut().insert(header::LOCATION, HeaderValue::from_static("/"));
    if let Some(cleared) = access.cookie().clear() {
        response.headers_mut().insert(header::SET_COOKIE, cleared);
    }
    response
}
