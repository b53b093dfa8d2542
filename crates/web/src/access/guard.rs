//! Checks on every request, for every page, so that pages need not repeat them.

use std::sync::Arc;
use std::time::Instant;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Request, State};
use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Redirect, Response};
use maud::html;

use super::refusals::RefusedAccess;
use super::responses::add_security_headers;
use super::secret::Secret;
use super::{Access, Person, Visit, certificate, form, plain};
use crate::assets::{ALARM_ICON_PATH, ICON_PATH, MANIFEST_PATH};
use crate::listener::{Connection, Site};

/// Path of the sign-in page.
pub(super) const SIGN_IN: &str = "/sign-in";
/// Paths served without sign-in even if pages require it; they reveal nothing about the structure.
const OPEN: [&str; 8] = [
    SIGN_IN,
    "/healthz",
    "/metrics",
    "/page.css",
    "/page.js",
    MANIFEST_PATH,
    ICON_PATH,
    ALARM_ICON_PATH,
];

/// Why a request is refused.
struct Stop {
    refused: RefusedAccess,
    status: StatusCode,
    words: String,
}

impl Stop {
    fn new(refused: RefusedAccess, status: StatusCode, words: impl Into<String>) -> Self {
        Self { refused, status, words: words.into() }
    }
}

/// Refuses requests that do not come from a page of this site, and adds security headers to every response. Requests
/// need the [`Connection`] that [`crate::listener`] attaches.
pub(crate) fn protect(router: Router, access: Arc<Access>) -> Router {
    router.layer(from_fn_with_state(access, guard))
}

async fn guard(State(access): State<Arc<Access>>, request: Request, next: Next) -> Response {
    let Some(connection) = request.extensions().get::<Connection>().cloned() else {
        return StatusCode::INTERNAL_SERVER_ERROR.into_response();
    };
    let (parts, body) = request.into_parts();
    let mut response = match judge(&access, &connection, parts, body).await {
        Ok(PassedGuard::On(request)) => next.run(*request).await,
        Ok(PassedGuard::ToSignIn) => Redirect::to(SIGN_IN).into_response(),
        Err(stop) => {
            access.refusals.note(stop.refused, connection.client, &stop.words);
            answer(&stop)
        }
    };
    add_security_headers(response.headers_mut(), access.site().is_tls);
    if access.site().path().is_empty() {
        response
    } else {
        under_path(access.site(), response).await
    }
}

/// The response as it has to be if a proxy has the site under a path: pages and redirects are made for the root.
async fn under_path(site: &Site, response: Response) -> Response {
    let (mut head, mut body) = response.into_parts();
    let location = head.headers.get(header::LOCATION).and_then(|value| value.to_str().ok());
    let location = location.map(|path| HeaderValue::from_str(&format!("{}{path}", site.path())));
    if let Some(Ok(location)) = location {
        head.headers.insert(header::LOCATION, location);
    }
    let kind = head.headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
    if kind.is_some_and(|kind| kind.starts_with("text/html")) {
        // A page is rendered as a whole and in memory.
        let html = to_bytes(body, usize::MAX).await.unwrap_or_default();
        let html = site.based(&String::from_utf8_lossy(&html));
        head.headers.remove(header::CONTENT_LENGTH);
        body = Body::from(html);
    }
    Response::from_parts(head, body)
}

/// The outcome for a request that was not refused.
enum PassedGuard {
    On(Box<Request>),
    ToSignIn,
}

async fn judge(
    access: &Arc<Access>,
    connection: &Connection,
    mut parts: Parts,
    body: Body,
) -> Result<PassedGuard, Stop> {
    if !matches!(parts.method, Method::GET | Method::HEAD | Method::POST) {
        let words = "unsupported method; use GET, HEAD or POST";
        return Err(Stop::new(RefusedAccess::Method, StatusCode::METHOD_NOT_ALLOWED, words));
    }
    let origin = own_origin(access, connection, &parts)?;
    let visit = visit(access, connection, &parts);
    if parts.method == Method::POST {
        is_from_here(&parts.headers, &origin)?;
        let fields = form::read(&parts, body).await;
        let fields =
            fields.map_err(|(status, words)| Stop::new(RefusedAccess::Form, status, words))?;
        may_send(&parts, &visit, fields.get("token"))?;
        parts.extensions.insert(fields);
    } else if let Some(instead) = may_see(access, &parts, &visit)? {
        return Ok(instead);
    }
    parts.extensions.insert(visit);
    // Handlers do not read the body: the guard has read the fields of the form.
    Ok(PassedGuard::On(Box::new(Request::from_parts(parts, Body::empty()))))
}

/// The origin of the requested page, if it is one of this site's.
fn own_origin(access: &Access, connection: &Connection, parts: &Parts) -> Result<String, Stop> {
    let host = only(&parts.headers, header::HOST);
    // A request line may include a host; it must equal the header.
    let in_line = parts.uri.authority().map(axum::http::uri::Authority::as_str);
    let host = host.filter(|host| in_line.is_none_or(|named| named == *host));
    let origin = host.and_then(|host| access.settings.site.origin(host, connection.local));
    origin.ok_or_else(|| {
        let words = format!(
            "unknown host name `{}`; use the page's address, or add the name with `--page-name`",
            vocabulary::quotation(host.unwrap_or_default(), 200)
        );
        Stop::new(RefusedAccess::Host, StatusCode::MISDIRECTED_REQUEST, words)
    })
}

/// Checks that the form was on a page of this site, according to the browser.
fn is_from_here(headers: &HeaderMap, own: &str) -> Result<(), Stop> {
    let is_own = if headers.contains_key(header::ORIGIN) {
        only(headers, header::ORIGIN).is_some_and(|origin| origin.eq_ignore_ascii_case(own))
    } else {
        headers.get("sec-fetch-site").is_some_and(|site| site == "same-origin")
    };
    let words = "the form was not sent by a page of this site";
    is_own
        .then_some(())
        .ok_or_else(|| Stop::new(RefusedAccess::Origin, StatusCode::FORBIDDEN, words))
}

/// Checks the form token: users who are signed in must send that of their session; others may only sign in.
fn may_send(parts: &Parts, visit: &Visit, token: Option<&String>) -> Result<(), Stop> {
    let is_sign_in = parts.uri.path() == SIGN_IN;
    match &visit.person {
        _ if is_sign_in => Ok(()),
        None => {
            Err(Stop::new(RefusedAccess::Permission, StatusCode::UNAUTHORIZED, "sign in first"))
        }
        Some(person) if has_token(person, token) => Ok(()),
        Some(_) => {
            let words = "the form's session has expired; reload the page";
            Err(Stop::new(RefusedAccess::Token, StatusCode::FORBIDDEN, words))
        }
    }
}

fn has_token(person: &Person, token: Option<&String>) -> bool {
    let secret = |text: &str| Secret::from_text(text).map(|secret| secret.fingerprint());
    let given = token.and_then(|token| secret(token));
    given.is_some() && given == secret(&person.form_token)
}

/// Redirects users who are not signed in to the sign-in page if pages require sign-in.
fn may_see(access: &Access, parts: &Parts, visit: &Visit) -> Result<Option<PassedGuard>, Stop> {
    let path = parts.uri.path();
    let is_open = OPEN.contains(&path);
    if !access.settings.require_sign_in || visit.person.is_some() || is_open {
        return Ok(None);
    }
    if is_page(&parts.headers) {
        return Ok(Some(PassedGuard::ToSignIn));
    }
    Err(Stop::new(RefusedAccess::Permission, StatusCode::UNAUTHORIZED, "sign in first"))
}

/// The session named by the request, if it has not expired and the browser shows the certificate used to sign in.
fn visit(access: &Arc<Access>, connection: &Connection, parts: &Parts) -> Visit {
    let is_use = parts.method == Method::POST || is_page(&parts.headers);
    let session = access.cookie().read(&parts.headers);
    let found = session.as_ref().and_then(|id| access.sessions.find(id, is_use, Instant::now()));
    let anonymous = Visit { access: Arc::clone(access), person: None, session: None };
    let Some(found) = found else { return anonymous };
    let signed_in = found.signed_in;
    if let Some(begun_with) = &signed_in.certificate {
        let revoked = access.settings.revoked.as_ref();
        let is_shown = connection.shown.as_ref() == Some(begun_with);
        if !is_shown || certificate::person(begun_with, revoked).is_err() {
            return anonymous;
        }
    }
    let person = Person {
        name: signed_in.name,
        may_order: signed_in.may_order && access.read_only().is_none(),
        form_token: found.form_token.as_str().to_owned(),
    };
    Visit { person: Some(person), session, ..anonymous }
}

fn is_page(headers: &HeaderMap) -> bool {
    let accepts = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok());
    accepts.is_some_and(|kinds| kinds.contains("text/html"))
}

/// The value of a header that occurs exactly once.
fn only(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    match (values.next(), values.next()) {
        (Some(value), None) => value.to_str().ok(),
        _ => None,
    }
}

fn answer(stop: &Stop) -> Response {
    let words = html! {
        p { (vocabulary::printable(&stop.words)) "." }
        p { a href="/" { "To the overview" } }
    };
    let mut response = plain(stop.status, "Refused", &words);
    if stop.status == StatusCode::METHOD_NOT_ALLOWED {
        response.headers_mut().insert(header::ALLOW, HeaderValue::from_static("GET, HEAD, POST"));
    }
    response
}
