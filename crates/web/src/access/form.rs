//! The fields of a form that was sent, bounded.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::time::Duration;

use axum::Form;
use axum::body::{Body, to_bytes};
use axum::extract::{FromRequest, FromRequestParts};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Request, StatusCode, header};

/// Longest form, in bytes.
const LONGEST: usize = 16 * 1024;
/// A form that has not come by then is given up.
const WITHIN: Duration = Duration::from_secs(10);
const KIND: &str = "application/x-www-form-urlencoded";

/// The fields of a form, by name.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fields(BTreeMap<String, String>);

impl Fields {
    /// A field, if it is there.
    pub(crate) fn get(&self, name: &str) -> Option<&String> {
        self.0.get(name)
    }

    /// A field, unless it is missing or blank.
    pub(crate) fn filled(&self, name: &str) -> Option<&str> {
        self.get(name).map(|text| text.trim()).filter(|text| !text.is_empty())
    }
}

impl<'a> FromIterator<(&'a str, &'a str)> for Fields {
    fn from_iter<I: IntoIterator<Item = (&'a str, &'a str)>>(fields: I) -> Self {
        Self(fields.into_iter().map(|(name, value)| (name.to_owned(), value.to_owned())).collect())
    }
}

/// Those that [`super::protect`] has read.
impl<S: Sync> FromRequestParts<S> for Fields {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get::<Fields>().cloned().unwrap_or_default())
    }
}

/// Reads the form of a request.
pub(super) async fn read(parts: &Parts, body: Body) -> Result<Fields, (StatusCode, String)> {
    let kind = parts.headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
    let kind = kind.and_then(|kind| kind.split(';').next()).unwrap_or_default();
    if !kind.trim().eq_ignore_ascii_case(KIND) {
        return Err((
            StatusCode::UNSUPPORTED_MEDIA_TYPE,
            format!("a form has the content type {KIND}"),
        ));
    }
    let too_long =
        || (StatusCode::PAYLOAD_TOO_LARGE, format!("a form has at most {LONGEST} bytes"));
    if announced(&parts.headers).is_some_and(|length| length > LONGEST) {
        return Err(too_long());
    }
    let bytes = match tokio::time::timeout(WITHIN, to_bytes(body, LONGEST)).await {
        Ok(Ok(bytes)) => bytes,
        Ok(Err(_)) => return Err(too_long()),
        Err(_) => {
            return Err((
                StatusCode::REQUEST_TIMEOUT,
                format!("the form did not come within {WITHIN:?}"),
            ));
        }
    };
    let request = Request::from_parts(parts.clone(), Body::from(bytes));
    let pairs = Form::<Vec<(String, String)>>::from_request(request, &()).await;
    let Form(pairs) = pairs.map_err(|_| unreadable("the form cannot be read"))?;
    let mut fields = BTreeMap::new();
    for (name, value) in pairs {
        if fields.insert(name, value).is_some() {
            return Err(unreadable("a field of the form is there twice"));
        }
    }
    Ok(Fields(fields))
}

fn announced(headers: &HeaderMap) -> Option<usize> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

fn unreadable(words: &str) -> (StatusCode, String) {
    (StatusCode::BAD_REQUEST, words.to_owned())
}
