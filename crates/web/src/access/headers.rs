//! What every answer tells a browser, so that neither a foreign page nor a foreign text gets hold of it.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

/// Nothing from elsewhere, no script or style in the page itself, no frame around it, no form to elsewhere.
const CONTENT: &str = "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self' data:; \
    connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'";

/// Under `no-referrer` browsers would send `Origin: null` with forms of this very page; to other sites nothing is sent
/// by `same-origin` either.
const REFERRER: &str = "same-origin";

const ALWAYS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, REFERRER),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Thirty days of TLS only.
const TLS_ONLY: HeaderValue = HeaderValue::from_static("max-age=2592000");
const NOT_KEPT: HeaderValue = HeaderValue::from_static("no-store");

/// Adds them. What says itself how long it may be kept, such as a style sheet, may be kept.
pub(super) fn add(headers: &mut HeaderMap, is_tls: bool) {
    for (name, value) in ALWAYS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if is_tls {
        headers.insert(header::STRICT_TRANSPORT_SECURITY, TLS_ONLY);
    }
    headers.entry(header::CACHE_CONTROL).or_insert(NOT_KEPT);
}
