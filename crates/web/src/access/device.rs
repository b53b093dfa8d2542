//! Devices that stay signed in: files in the state directory of the web page, named by the fingerprint of the secret in
//! the device's cookie. They survive restarts of the page; deleting a file signs its device out.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::one_time_link::{self, Invitation, LinkError, PersonName};
use super::secret::{Fingerprint, Secret};

/// Subdirectory of the state directory.
const DIRECTORY: &str = "devices";
/// How long a device stays signed in.
pub(crate) const STAYS: Duration = Duration::from_secs(30 * 24 * 3600);

/// Keeps the device with this secret signed in from now on.
pub(crate) fn keep(
    state: &Path,
    secret: &Secret,
    person: &str,
    may_order: bool,
) -> Result<(), LinkError> {
    let until_unix_s = one_time_link::unix_s() + STAYS.as_secs();
    let kept = Invitation { person: person.to_owned(), may_order, until_unix_s };
    one_time_link::store(state, DIRECTORY, secret, &kept)
}

/// Whom the device with this secret belongs to, while it is signed in.
pub(super) fn find(state: &Path, secret: &Fingerprint) -> Option<Invitation> {
    let kept = one_time_link::read(&file(state, secret))?;
    kept.is_good(one_time_link::unix_s()).then_some(kept)
}

/// Signs a device out.
pub(super) fn end(state: &Path, secret: &Fingerprint) {
    // Without the file it is signed out already.
    let _ = fs::remove_file(file(state, secret));
}

fn file(state: &Path, secret: &Fingerprint) -> PathBuf {
    state.join(DIRECTORY).join(secret.as_str())
}

/// A device that stays signed in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Device {
    /// The user's name.
    pub person: String,
    /// Whether the user may send orders.
    pub may_order: bool,
    /// Until when \[s since 1970\].
    pub until_unix_s: u64,
}

/// The devices that stay signed in, by the person's name. `state` is the state directory of the web page.
///
/// # Errors
/// The directory cannot be read.
pub fn devices(state: &Path) -> Result<Vec<Device>, LinkError> {
    let kept = files(state)?.into_iter().map(|(_, kept)| {
        let Invitation { person, may_order, until_unix_s } = kept;
        Device { person, may_order, until_unix_s }
    });
    let mut devices: Vec<Device> = kept.collect();
    devices.sort_by(|a, b| (&a.person, a.until_unix_s).cmp(&(&b.person, b.until_unix_s)));
    Ok(devices)
}

/// Signs out all devices of a person, and returns how many these were.
///
/// # Errors
/// The directory cannot be read, or a file cannot be deleted.
pub fn sign_out_devices(state: &Path, person: &PersonName) -> Result<usize, LinkError> {
    let mut count = 0;
    for (path, kept) in files(state)? {
        if kept.person == person.as_str() {
            fs::remove_file(&path).map_err(|error| LinkError::Directory { path, error })?;
            count += 1;
        }
    }
    Ok(count)
}

fn files(state: &Path) -> Result<Vec<(PathBuf, Invitation)>, LinkError> {
    let wrong = |path: &Path| {
        let path = path.to_owned();
        move |error| LinkError::Directory { path, error }
    };
    fs::metadata(state).map_err(wrong(state))?;
    let directory = state.join(DIRECTORY);
    if !directory.exists() {
        return Ok(Vec::new());
    }
    let entries = fs::read_dir(&directory).map_err(wrong(&directory))?.flatten();
    let now = one_time_link::unix_s();
    let kept =
        entries.filter_map(|entry| Some((entry.path(), one_time_link::read(&entry.path())?)));
    Ok(kept.filter(|(_, kept)| kept.is_good(now)).collect())
}
