//! Authentication and authorization of users.
//!
//! | file | what |
//! |---|---|
//! | `guard` | checks on every request: method, host, origin, form token |
//! | `form` | the fields of a form |
//! | `sign_in` | the pages to sign in and out |
//! | `one_time_link`, `certificate` | the two ways to sign in |
//! | `device` | devices that stay signed in |
//! | `sessions`, `cookie`, `secret` | the state of a browser that is signed in; ends a stream with its session |
//! | `attempts` | limits failed sign-ins |
//! | `refusals` | counts and logs refused requests |
//! | `responses` | security headers, plain pages, redirects |

mod attempts;
mod certificate;
mod cookie;
mod device;
mod form;
mod guard;
mod one_time_link;
mod refusals;
mod responses;
mod secret;
mod sessions;
mod sign_in;
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

pub(crate) use form::Fields;
pub(crate) use guard::protect;
pub(crate) use responses::{destination, plain};
pub(crate) use sessions::{CHECK_EVERY, PageMessage, SessionWatch};
pub(crate) use sign_in::routes;

pub use device::{Device, devices, sign_out_devices};
pub use one_time_link::{LinkError, PersonName, PersonNameError, VALID, one_time_link};
pub use secret::NoRandomness;

/// Settings for access control.
#[derive(Debug, Clone, Default)]
pub(crate) struct AccessSettings {
    /// The names of this site.
    pub(crate) site: Site,
    /// Whether pages require sign-in.
    pub(crate) require_sign_in: bool,
    /// The state directory of this process, which stores one-time links; without it there are none.
    pub(crate) state: Option<PathBuf>,
    /// A directory of revoked certificates, such as a copy of `pki/revoked`.
    pub(crate) revoked: Option<PathBuf>,
    /// Why this process cannot send commands, if so: its certificate belongs to an observer.
    pub(crate) read_only: Option<String>,
}

/// Sessions, one-time links and certificates.
#[derive(Debug, Default)]
pub(crate) struct Access {
    settings: AccessSettings,
    sessions: Sessions,
    attempts: Attempts,
    refusals: AccessRefusals,
}

impl Access {
    /// Starts without sessions but those of devices that stay signed in.
    pub(crate) fn new(settings: AccessSettings) -> Self {
        let sessions = Sessions::of_devices(settings.state.clone());
        Self { settings, sessions, ..Self::default() }
    }

    /// Why this process cannot send commands, if so; a page shows the reason in place of the forms.
    pub(crate) fn read_only(&self) -> Option<&str> {
        self.settings.read_only.as_deref()
    }

    /// Stores a message for the next page of this user.
    pub(crate) fn leave_message(&self, viewer: &Viewer, message: PageMessage) {
        if let Some(session) = &viewer.session {
            self.sessions.leave_message(session, message);
        }
    }

    /// The names of this site.
    pub(crate) fn site(&self) -> &Site {
        &self.settings.site
    }

    fn cookie(&self) -> Cookie<'_> {
        Cookie { is_secure: self.site().is_secure(), path: self.site().path() }
    }
}

/// The user who requested a page.
#[derive(Debug, Clone, Default)]
pub(crate) struct Viewer {
    /// `None` if the user is not signed in.
    pub(crate) person: Option<Person>,
    /// The outcome of the latest order, to be shown once.
    pub(crate) message: Option<PageMessage>,
    /// Why this process cannot send commands, if so.
    pub(crate) read_only: Option<String>,
    session: Option<secret::Secret>,
}

/// A user who is signed in.
#[derive(Debug, Clone)]
pub(crate) struct Person {
    /// The name recorded with orders.
    pub(crate) name: String,
    /// Whether the user may send orders from this page; the diagnoser's access control applies in addition.
    pub(crate) may_order: bool,
    /// The value of the hidden field `token` in every form of the session.
    pub(crate) form_token: String,
}

/// The user of a request and the session.
#[derive(Debug, Clone)]
struct Visit {
    access: Arc<Access>,
    person: Option<Person>,
    /// The session, kept even if the browser does not show the user's certificate any more.
    session: Option<secret::Secret>,
}

impl<S: Sync> FromRequestParts<S> for Viewer {
    type Rejection = Infallible;

    /// The result of [`protect`]; not signed in on routes that it does not cover. Only pages take the message, not the
    /// resources that they load.
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
