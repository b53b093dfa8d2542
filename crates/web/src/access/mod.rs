//! Who has opened a page, and what he may do.
//!
//! | file | what |
//! |---|---|
//! | `guard` | what every request has to pass: method, host, origin, form token |
//! | `headers` | what every answer tells a browser |
//! | `form` | the fields of a form |
//! | `sign_in`, `sign_out` | the pages for that |
//! | `one_time_link`, `certificate` | the two ways to sign in |
//! | `person_name` | what a person may be called |
//! | `sessions`, `cookie`, `secret` | what a browser that is signed in has |
//! | `attempts` | who failed to sign in |
//! | `refusals` | requests that were refused, logged |
//! | `read_only` | whether this process may order anything |
//! | `back` | where a browser goes after a form |
//! | `plain` | a page that needs nothing else |

mod attempts;
mod back;
mod certificate;
mod cookie;
mod form;
mod guard;
mod headers;
mod one_time_link;
mod person_name;
mod plain;
mod read_only;
mod refusals;
mod secret;
mod sessions;
mod sign_in;
mod sign_out;
#[cfg(test)]
mod tests;

use std::convert::Infallible;
use std::path::PathBuf;
use std::sync::Arc;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{Method, header};

use crate::listener::Site;
use attempts::Attempts;
use cookie::Cookie;
use refusals::AccessRefusals;
use sessions::Sessions;

pub(crate) use back::destination;
pub(crate) use form::Fields;
pub(crate) use guard::protect;
pub(crate) use plain::plain;
pub(crate) use read_only::read_only;
pub(crate) use sign_in::routes;

pub use one_time_link::{LinkError, VALID, one_time_link};
pub use person_name::{PersonName, PersonNameError};
pub use secret::NoRandomness;

/// What decides on permissions.
#[derive(Debug, Clone, Default)]
pub(crate) struct AccessSettings {
    /// The names under which the page is reached.
    pub(crate) site: Site,
    /// Whether only those who have signed in see anything.
    pub(crate) require_sign_in: bool,
    /// The directory of this process's state, for one-time links; without it there are none.
    pub(crate) state: Option<PathBuf>,
    /// A directory with the certificates that are revoked, such as a copy of `pki/revoked`.
    pub(crate) revoked: Option<PathBuf>,
    /// Why nobody may order anything here, if that is so: this process's certificate is that of an observer.
    pub(crate) read_only: Option<String>,
}

/// Sessions, one-time links, certificates.
#[derive(Debug, Default)]
pub(crate) struct Access {
    settings: AccessSettings,
    sessions: Sessions,
    attempts: Attempts,
    refusals: AccessRefusals,
}

impl Access {
    /// Nobody is signed in.
    pub(crate) fn new(settings: AccessSettings) -> Self {
        Self { settings, ..Self::default() }
    }

    /// Why nobody may order anything here, if that is so; a page says it where the orders would stand.
    pub(crate) fn read_only(&self) -> Option<&str> {
        self.settings.read_only.as_deref()
    }

    /// Leaves a message for the next page of whoever has sent the request.
    pub(crate) fn leave_message(&self, viewer: &Viewer, message: String) {
        if let Some(session) = &viewer.session {
            self.sessions.leave_message(session, message);
        }
    }

    fn cookie(&self) -> Cookie {
        Cookie { is_secure: self.settings.site.is_secure() }
    }
}

/// The person who has opened a page.
#[derive(Debug, Clone, Default)]
pub(crate) struct Viewer {
    /// None if nobody has signed in.
    pub(crate) person: Option<Person>,
    /// The outcome of the latest order, to be shown once.
    pub(crate) message: Option<String>,
    /// Why nobody may order anything here, if that is so.
    pub(crate) read_only: Option<String>,
    session: Option<secret::Secret>,
}

/// Somebody who has signed in.
#[derive(Debug, Clone)]
pub(crate) struct Person {
    /// The name that orders are given in.
    pub(crate) name: String,
    /// Whether he may order anything, as far as this page is concerned.
    pub(crate) may_order: bool,
    /// What every form of his has in the hidden field `token`.
    pub(crate) form_token: String,
}

/// Who has sent a request, as far as it says.
#[derive(Debug, Clone)]
struct Visit {
    access: Arc<Access>,
    person: Option<Person>,
    /// The session, also of a person whose certificate is not shown any more.
    session: Option<secret::Secret>,
}

impl<S: Sync> FromRequestParts<S> for Viewer {
    type Rejection = Infallible;

    /// What [`protect`] has found out of the request; nobody is signed in where that has not seen it. The message is
    /// taken by pages alone, not by what they load.
    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let Some(Visit { access, person, session }) = parts.extensions.get().cloned() else {
            return Ok(Self::default());
        };
        let accepts = parts.headers.get(header::ACCEPT).and_then(|value| value.to_str().ok());
        let is_page =
            parts.method == Method::GET && accepts.is_none_or(|kinds| kinds.contains("text/html"));
        let session_of_page = session.as_ref().filter(|_| is_page);
        let message = session_of_page.and_then(|session| access.sessions.take_message(session));
        let read_only = access.read_only().map(str::to_owned);
        Ok(Self { person, message, read_only, session })
    }
}
