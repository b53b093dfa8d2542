//! Security headers of every response, which protect pages from other sites and from injected text.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

/// Allows no content from other sites, no inline script or style, no framing, and no forms to other sites.
const CONTENT: &str = "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self' data:; \
    connect-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'";

/// With `no-referrer` browsers would send `Origin: null` with forms of this site; `same-origin` sends nothing to other
/// sites either.
const REFERRER: &str = "same-origin";

const ALWAYS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, REFERRER),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Requires TLS for thirty days.
const TLS_ONLY: HeaderValue = HeaderValue::from_static("max-age=2592000");
const NOT_KEPT: HeaderValue = HeaderValue::from_static("no-store");

/// Adds the headers. A response that sets its own caching, such as a style sheet, keeps it.
pub(super) fn add(headers: &mut HeaderMap, is_tls: bool) {
    for (name, value) in ALWAYS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if is_tls {
        headers.insert(header::STRICT_TRANSPORT_SECURITY, TLS_ONLY);
    }
    headers.entry(header::CACHE_CONTROL).or_insert(NOT_KEPT);
}
