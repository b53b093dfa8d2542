//! What responses have in common: security headers, plain pages, and redirects to pages of this site only.

use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{Html, IntoResponse, Response};
use maud::{DOCTYPE, Markup, html};

/// Allows no content from other sites, no inline script or style, no framing, and no forms to other sites.
const CONTENT_POLICY: &str = "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self' data:; \
    connect-src 'self'; manifest-src 'self'; form-action 'self'; frame-ancestors 'none'; base-uri 'none'";

/// With `no-referrer` browsers would send `Origin: null` with forms of this site; `same-origin` sends nothing to other
/// sites either.
const REFERRER: &str = "same-origin";

const ALWAYS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, REFERRER),
    (header::X_FRAME_OPTIONS, "DENY"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Requires TLS for thirty days.
const TLS_ONLY: HeaderValue = HeaderValue::from_static("max-age=2592000");
const NOT_KEPT: HeaderValue = HeaderValue::from_static("no-store");

/// Adds the security headers of every response, which protect pages from other sites and from injected text. A response that sets its own caching, such as a style sheet, keeps it.
pub(super) fn add_security_headers(headers: &mut HeaderMap, is_tls: bool) {
    for (name, value) in ALWAYS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    if is_tls {
        headers.insert(header::STRICT_TRANSPORT_SECURITY, TLS_ONLY);
    }
    headers.entry(header::CACHE_CONTROL).or_insert(NOT_KEPT);
}

/// A page that needs only the style sheet: for sign-in and refused requests.
pub(crate) fn plain(status: StatusCode, title: &str, content: &Markup) -> Response {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " – trusswatch" }
                link rel="stylesheet" href="/page.css";
            }
            body {
                main class="plain" {
                    h1 { (title) }
                    (content)
                }
            }
        }
    };
    (status, Html(page.into_string())).into_response()
}

/// Longest path that a form may return to, in bytes.
const LONGEST: usize = 500;

/// The redirect after a form was sent: to this path if it is on this site, otherwise to the overview. Browsers read a path that begins with two
/// slashes or with a backslash as another site.
pub(crate) fn destination(back: Option<&String>) -> HeaderValue {
    let own = back.filter(|path| is_own(path));
    let header = own.and_then(|path| HeaderValue::from_str(path).ok());
    header.unwrap_or(HeaderValue::from_static("/"))
}

fn is_own(path: &str) -> bool {
    path.len() <= LONGEST
        && path.starts_with('/')
        && !path.starts_with("//")
        && path.bytes().all(|byte| byte.is_ascii_graphic() && byte != b'\\')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_paths_of_this_site_are_gone_back_to() {
        for own in ["/", "/component/module1/sensor/g2", "/history?module=module1&from=1h#last"] {
            assert_eq!(destination(Some(&own.to_owned())), own);
        }
        let long = format!("/{}", "a".repeat(LONGEST));
        for other in [
            "",
            "//evil.example",
            "https://evil.example",
            "/\\evil.example",
            "\\/evil.example",
            "javascript:x",
            "/\t/x",
            "/a\r\nSet-Cookie: a=b",
            "/ü",
            "/a b",
            &long,
        ] {
            assert_eq!(destination(Some(&other.to_owned())), "/", "{other}");
        }
        assert_eq!(destination(None), "/");
    }
}
