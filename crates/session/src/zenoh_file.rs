//! Reads a file of Zenoh's own settings, and single settings in it.

use std::path::{Path, PathBuf};

use pki::Identity;
use zenoh::Config;

use crate::session::NetworkError;

/// Reads Zenoh's settings from a file. Paths of certificates and keys in it are relative to the file.
///
/// # Errors
/// An invalid file of Zenoh settings.
pub fn from_file(file: &Path) -> Result<Config, NetworkError> {
    let mut config = Config::from_file(file).map_err(|error| NetworkError::File {
        file: file.display().to_string(),
        reason: plain(&error),
    })?;
    let folder = file.parent().unwrap_or(Path::new("."));
    for key in PATHS {
        if let Some(path) = text(&config, key).filter(|path| Path::new(path).is_relative()) {
            set(&mut config, key, &json(&folder.join(path)))?;
        }
    }
    Ok(config)
}

pub(crate) const AUTHORITY: &str = "transport/link/tls/root_ca_certificate";
pub(crate) const LISTEN_CERTIFICATE: &str = "transport/link/tls/listen_certificate";
pub(crate) const LISTEN_KEY: &str = "transport/link/tls/listen_private_key";
pub(crate) const CONNECT_CERTIFICATE: &str = "transport/link/tls/connect_certificate";
pub(crate) const CONNECT_KEY: &str = "transport/link/tls/connect_private_key";
const PATHS: [&str; 5] =
    [AUTHORITY, LISTEN_CERTIFICATE, LISTEN_KEY, CONNECT_CERTIFICATE, CONNECT_KEY];

/// The certificates that Zenoh's settings name, for listening and for connecting.
#[must_use]
pub fn identities(config: &Config) -> Vec<Identity> {
    let file = |key| text(config, key).map(PathBuf::from);
    let pairs = [(LISTEN_CERTIFICATE, LISTEN_KEY), (CONNECT_CERTIFICATE, CONNECT_KEY)];
    let mut found: Vec<Identity> = Vec::new();
    for (certificate, key) in pairs {
        if let (Some(authority), Some(certificate), Some(key)) =
            (file(AUTHORITY), file(certificate), file(key))
        {
            found.push(Identity { authority, certificate, key });
        }
    }
    found.dedup();
    found
}

/// A text setting.
fn text(config: &Config, key: &str) -> Option<String> {
    serde_json::from_str(&config.get_json(key).ok()?).ok()
}

pub(crate) fn json(path: &Path) -> String {
    serde_json::Value::from(path.to_string_lossy()).to_string()
}

/// The text of an error, without the source locations in Zenoh.
pub(crate) fn plain(error: &zenoh::Error) -> String {
    without_source_locations(&error.to_string())
}

/// A message of Zenoh without the source locations in it, each of the form `at FILE.rs:LINE`.
#[must_use]
pub fn without_source_locations(text: &str) -> String {
    let mut words = text.split(' ').peekable();
    let mut kept = Vec::new();
    while let Some(word) = words.next() {
        if word == "at" && words.peek().is_some_and(|next| next.contains(".rs:")) {
            words.next();
        } else {
            kept.push(word);
        }
    }
    kept.join(" ")
}

pub(crate) fn set(config: &mut Config, key: &'static str, value: &str) -> Result<(), NetworkError> {
    config.insert_json5(key, value).map_err(|error| NetworkError::Setting {
        key,
        value: value.to_owned(),
        reason: plain(&error),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_do_not_name_places_in_the_source() {
        let error = "bad: 7 at /some/where/x.rs:61. - Caused by worse at home at y.rs:2.";
        assert_eq!(plain(&zenoh::Error::from(error)), "bad: 7 - Caused by worse at home");
    }
}
