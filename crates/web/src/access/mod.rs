//! Who has opened a page, and what he may do.

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

use crate::app::Shared;

/// Sessions, one-time links, certificates.
#[derive(Debug, Default)]
pub(crate) struct Access {}

/// Whoever has opened a page.
#[derive(Debug, Clone, Default)]
pub(crate) struct Viewer {
    /// None if nobody has signed in.
    pub(crate) person: Option<Person>,
    /// The outcome of the latest order, to be shown once.
    pub(crate) message: Option<String>,
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

impl FromRequestParts<Shared> for Viewer {
    type Rejection = std::convert::Infallible;

    async fn from_request_parts(_: &mut Parts, _: &Shared) -> Result<Self, Self::Rejection> {
        Ok(Self::default())
    }
}
