//! A directory with a holder's certificate and key.

use std::path::Path;

use pki::{Certificate, Identity};
use session::mistake;
use settings::ConfigErrors;

use super::mistake as mistake_in;

/// Its holder, or everything that is wrong with it.
pub(super) fn check(directory: &Path) -> Result<String, ConfigErrors> {
    let identity = Identity::in_directory(directory);
    let problems = identity.problems(None, &[]);
    if !problems.is_empty() {
        return Err(ConfigErrors(problems.into_iter().map(mistake).collect()));
    }
    let read = Certificate::read(&identity.certificate)
        .map_err(|error| mistake_in(&identity.certificate, None, error))?;
    let name = read.common_name.unwrap_or_else(|| "unnamed".to_owned());
    Ok(format!("certificate of `{name}`, until {}", read.lifetime.until.date()))
}
