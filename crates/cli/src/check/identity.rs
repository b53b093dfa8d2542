//! A directory by which somebody shows who it is.

use std::path::Path;

use daemon::config::{ConfigErrors, mistake};
use pki::{Certificate, Identity};

use super::mistake as mistake_in;

/// Whose it is, or everything that is wrong with it.
pub(super) fn check(directory: &Path) -> Result<String, ConfigErrors> {
    let identity = Identity::in_directory(directory);
    let problems = identity.problems(None, &[]);
    if !problems.is_empty() {
        return Err(ConfigErrors(problems.into_iter().map(mistake).collect()));
    }
    let read = Certificate::read(&identity.certificate)
        .map_err(|error| mistake_in(&identity.certificate, None, error))?;
    let name = read.common_name.unwrap_or_else(|| "nobody".to_owned());
    Ok(format!("certificate of `{name}`, until {}", read.lifetime.until.date()))
}
