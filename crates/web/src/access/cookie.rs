//! The cookie that carries the secret of a session.

use axum::http::{HeaderMap, HeaderValue, header};

use super::device::STAYS;
use super::secret::Secret;

/// Name over TLS. Browsers accept it only from this host over TLS, so no other host of the domain can set it.
const SECURE_NAME: &str = "__Host-trusswatch";
/// Name over TLS under a path, which browsers do not allow with the former.
const SECURE_NAME_OF_PATH: &str = "__Secure-trusswatch";
/// Name over plain HTTP on this machine.
const PLAIN_NAME: &str = "trusswatch";

/// Name and attributes of the cookie.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cookie<'a> {
    /// Whether the browser connects over TLS.
    pub(crate) is_secure: bool,
    /// The path under which a proxy has the site; empty at the root.
    pub(crate) path: &'a str,
}

impl Cookie<'_> {
    /// The session named in a request. Several cookies of this name are all ignored, because at least one was planted.
    pub(crate) fn read(self, headers: &HeaderMap) -> Option<Secret> {
        let values = headers.get_all(header::COOKIE).iter().filter_map(|value| value.to_str().ok());
        let pairs =
            values.flat_map(|value| value.split(';')).filter_map(|pair| pair.split_once('='));
        let mut own = pairs.filter(|(name, _)| name.trim() == self.name());
        match (own.next(), own.next()) {
            (Some((_, value)), None) => Secret::from_text(value.trim()),
            _ => None,
        }
    }

    /// Sets the cookie: until the browser is closed, or for a device that stays signed in.
    pub(crate) fn set(self, session: &Secret, is_kept: bool) -> Option<HeaderValue> {
        let age = if is_kept { format!("; Max-Age={}", STAYS.as_secs()) } else { String::new() };
        let value = format!("{}={}{}{age}", self.name(), session.as_str(), self.attributes());
        HeaderValue::from_str(&value).ok()
    }

    /// Deletes the cookie.
    pub(crate) fn clear(self) -> Option<HeaderValue> {
        HeaderValue::from_str(&format!("{}={}; Max-Age=0", self.name(), self.attributes())).ok()
    }

    fn name(self) -> &'static str {
        match (self.is_secure, self.path.is_empty()) {
            (true, true) => SECURE_NAME,
            (true, false) => SECURE_NAME_OF_PATH,
            (false, _) => PLAIN_NAME,
        }
    }

    fn attributes(self) -> String {
        let path = if self.path.is_empty() { "/" } else { self.path };
        let secure = if self.is_secure { "; Secure" } else { "" };
        format!("; Path={path}; HttpOnly; SameSite=Strict{secure}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(cookies: &[String]) -> HeaderMap {
        cookies.iter().map(|text| (header::COOKIE, HeaderValue::from_str(text).unwrap())).collect()
    }

    #[test]
    fn a_session_is_read_from_its_own_cookie_alone() {
        let secret = Secret::new().unwrap();
        let [secure, plain] = [true, false].map(|is_secure| Cookie { is_secure, path: "" });
        let own = format!("a=b; __Host-trusswatch={}; c=d", secret.as_str());
        let read = secure.read(&headers(std::slice::from_ref(&own))).unwrap();
        assert_eq!(read.fingerprint(), secret.fingerprint());
        assert!(plain.read(&headers(std::slice::from_ref(&own))).is_none());
        assert!(secure.read(&headers(&[own.clone(), own])).is_none());
        assert!(secure.read(&headers(&["__Host-trusswatch=guess".to_owned()])).is_none());
    }

    #[test]
    fn scripts_and_other_sites_do_not_get_it() {
        let secret = Secret::new().unwrap();
        let set = Cookie { is_secure: true, path: "" }.set(&secret, false).unwrap();
        let expected = format!(
            "__Host-trusswatch={}; Path=/; HttpOnly; SameSite=Strict; Secure",
            secret.as_str()
        );
        assert_eq!(set, expected.as_str());
        let kept = Cookie { is_secure: true, path: "" }.set(&secret, true).unwrap();
        assert_eq!(kept, format!("{expected}; Max-Age=2592000").as_str());
        let cleared = Cookie { is_secure: false, path: "" }.clear().unwrap();
        assert_eq!(cleared, "trusswatch=; Path=/; HttpOnly; SameSite=Strict; Max-Age=0");
    }
}
