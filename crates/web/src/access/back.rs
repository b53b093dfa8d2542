//! The redirect after a form was sent: always to a page of this site, whatever the form requests.

use axum::http::HeaderValue;

/// Longest path accepted, in bytes.
const LONGEST: usize = 500;

/// The path as a header if it is on this site, otherwise the overview. Browsers read a path that begins with two
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
