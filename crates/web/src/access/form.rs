//! The fields of a submitted form, with limits on size and time.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::time::Duration;

use axum::Form;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, FromRequest, FromRequestParts};
use axum::http::request::Parts;
use axum::http::{Request, StatusCode};

/// Longest form, in bytes.
const LONGEST: usize = 16 * 1024;
/// Timeout for receiving a form.
const WITHIN: Duration = Duration::from_secs(10);

/// The field that may occur several times, once for each component that was selected: the values stand one after another,
/// separated by spaces.
const REPEATED: &str = "component";

/// The fields of a form, by name.
#[derive(Debug, Clone, Default)]
pub(crate) struct Fields(BTreeMap<String, String>);

impl Fields {
    /// A field, if present.
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

/// Takes the fields that the guard has read.
impl<S: Sync> FromRequestParts<S> for Fields {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get::<Fields>().cloned().unwrap_or_default())
    }
}

/// Reads the form of a request.
pub(super) async fn read(parts: &Parts, body: Body) -> Result<Fields, (StatusCode, String)> {
    let mut request = Request::from_parts(parts.clone(), body);
    DefaultBodyLimit::max(LONGEST).apply(&mut request);
    let form = Form::<Vec<(String, String)>>::from_request(request, &());
    let pairs = match tokio::time::timeout(WITHIN, form).await {
        Ok(Ok(Form(pairs))) => pairs,
        Ok(Err(refused)) => return Err((refused.status(), refused.body_text())),
        Err(_) => {
            let words = format!("the form was not received within {WITHIN:?}");
            return Err((StatusCode::REQUEST_TIMEOUT, words));
        }
    };
    let mut fields: BTreeMap<String, String> = BTreeMap::new();
    for (name, value) in pairs {
        match fields.get_mut(&name) {
            None => {
                fields.insert(name, value);
            }
            Some(values) if name == REPEATED => {
                values.push(' ');
                values.push_str(&value);
            }
            Some(_) => {
                let words = "duplicate form field".to_owned();
                return Err((StatusCode::BAD_REQUEST, words));
            }
        }
    }
    Ok(Fields(fields))
}
