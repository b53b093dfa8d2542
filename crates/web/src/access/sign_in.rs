//! The pages to sign in and out. Opening a link is not enough, so that programs that preview links in messages do not consume it:
//! the user has to press the button.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::Instant;

use axum::Router;
use axum::extract::{Extension, Query, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use maud::{Markup, html};

use super::form::Fields;
use super::guard::SIGN_IN;
use super::refusals::RefusedAccess;
use super::secret::Secret;
use super::sessions::SignedIn;
use super::{Access, Viewer, certificate, one_time_link, plain};
use crate::listener::{Connection, source};

/// Instructions for a user without a link.
const HOW: &str = "Ask the administrator of this page for a one-time link (`trusswatch web link`).";

/// Routes of the pages to sign in and out.
pub(crate) fn routes<S>(access: Arc<Access>) -> Router<S> {
    Router::new()
        .route(SIGN_IN, get(page).post(enter))
        .route("/sign-out", get(confirm_sign_out).post(leave))
        .with_state(access)
}

/// Offers the ways to sign in that are open to this browser.
async fn page(
    State(access): State<Arc<Access>>,
    Extension(connection): Extension<Connection>,
    viewer: Viewer,
    Query(query): Query<Vec<(String, String)>>,
) -> Response {
    let link = query.iter().find(|(name, _)| name == "link");
    let link = link.and_then(|(_, text)| Secret::from_text(text));
    let revoked = access.settings.revoked.as_ref();
    let shown = connection.shown.as_ref();
    let by_certificate = shown.map(|shown| certificate::person(shown, revoked));
    let content = html! {
        @if let Some(person) = &viewer.person {
            p { "You are signed in as " strong { (vocabulary::printable(&person.name)) } "." }
        }
        @if let Some(link) = &link {
            (button("Sign in by the link", Some(link)))
        }
        @match &by_certificate {
            Some(Ok(person)) => (button(&format!("Sign in as {}, by certificate", person.name), None)),
            Some(Err(refusal)) => p { (refusal.to_string()) },
            None if link.is_none() => p { (HOW) },
            None => {},
        }
        p { a href="/" { "To the overview" } }
    };
    plain(StatusCode::OK, "Sign in", &content)
}

fn button(words: &str, link: Option<&Secret>) -> Markup {
    html! {
        form method="post" action=(SIGN_IN) {
            @if let Some(link) = link {
                input type="hidden" name="link" value=(link.as_str());
                label.check { input type="checkbox" name="keep" value="true"; "Keep this device signed in for 30 days" }
            }
            button type="submit" { (words) }
        }
    }
}

/// Signs a user in under a new session; the browser's former session ends.
async fn enter(
    State(access): State<Arc<Access>>,
    Extension(connection): Extension<Connection>,
    viewer: Viewer,
    fields: Fields,
) -> Response {
    let address = connection.client;
    let let_in = match fields.get("link") {
        Some(link) => by_link(&access, link).await,
        None => by_certificate(&access, &connection),
    };
    let signed_in = match let_in {
        Ok(signed_in) => signed_in,
        // Only after a failure: a valid link signs in whatever others have tried from the same address.
        Err(words) => {
            let (source, now) = (source(address), Instant::now());
            if access.attempts.is_exhausted(source, now) {
                let words = "too many attempts; wait a minute";
                return refuse(&access, address, StatusCode::TOO_MANY_REQUESTS, words);
            }
            access.attempts.failed(source, now);
            return refuse(&access, address, StatusCode::FORBIDDEN, &words);
        }
    };
    if let Some(former) = &viewer.session {
        access.sessions.end(former);
    }
    let way = if signed_in.certificate.is_some() { "certificate" } else { "link" };
    let person = vocabulary::printable(&signed_in.name);
    let may_order = signed_in.may_order;
    // A certificate is on its device anyway.
    let is_kept = fields.filled("keep").is_some() && signed_in.certificate.is_none();
    let now = Instant::now();
    let session = if is_kept {
        access.sessions.begin_kept(signed_in, now)
    } else {
        access.sessions.begin(signed_in, now).map_err(Into::into)
    };
    let session = session.inspect_err(|error| tracing::error!("{person} cannot sign in: {error}"));
    let Some(cookie) = session.ok().and_then(|session| access.cookie().set(&session, is_kept))
    else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    tracing::info!(%address, may_order, "{person} has signed in by {way}");
    let overview = HeaderValue::from_static("/");
    (StatusCode::SEE_OTHER, [(header::LOCATION, overview), (header::SET_COOKIE, cookie)])
        .into_response()
}

async fn by_link(access: &Access, link: &str) -> Result<SignedIn, String> {
    let refused = || format!("the link was used, has expired, or is invalid. {HOW}");
    let state = access.settings.state.clone().ok_or_else(refused)?;
    let secret = Secret::from_text(link).ok_or_else(refused)?;
    // Deleting the file durably blocks on the disk.
    let invitation = tokio::task::spawn_blocking(move || one_time_link::accept(&state, &secret));
    let invitation = invitation.await.ok().flatten().ok_or_else(refused)?;
    let (name, may_order) = (invitation.person, invitation.may_order);
    Ok(SignedIn { name, may_order, certificate: None })
}

fn by_certificate(access: &Access, connection: &Connection) -> Result<SignedIn, String> {
    let shown = connection.shown.as_ref();
    let shown = shown.ok_or_else(|| format!("the browser showed no certificate. {HOW}"))?;
    let revoked = access.settings.revoked.as_ref();
    certificate::person(shown, revoked).map_err(|refusal| refusal.to_string())
}

fn refuse(access: &Access, address: IpAddr, status: StatusCode, words: &str) -> Response {
    access.refusals.note(RefusedAccess::SignIn, address, words);
    let content = html! {
        p { (vocabulary::printable(words)) }
        p { a href=(SIGN_IN) { "Sign in another way" } }
    };
    plain(status, "Not signed in", &content)
}

/// Asks for confirmation, because loading a page must not change anything.
async fn confirm_sign_out(viewer: Viewer) -> Response {
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
async fn leave(State(access): State<Arc<Access>>, viewer: Viewer) -> Response {
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
