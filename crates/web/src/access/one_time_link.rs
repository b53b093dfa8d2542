//! One-time links: files in the state directory of the web page, named by the fingerprint of the secret in the link.
//! Write access to the directory is the right to admit users; read access reveals no link.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt, chown};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};
use vocabulary::{is_printable, quotation};

use super::secret::{NoRandomness, Secret};

/// Subdirectory of the state directory.
const DIRECTORY: &str = "links";
/// Most unused links.
const MOST: usize = 100;
/// The extension of a file being written, and the age after which such a file is abandoned.
const BEING_WRITTEN: &str = "new";
const WRITTEN_WITHIN: Duration = Duration::from_secs(60);
/// Longest file read, in bytes.
const LONGEST_FILE: u64 = 4096;
/// Permitted lifetimes of a link.
pub const VALID: std::ops::RangeInclusive<Duration> =
    Duration::from_secs(1)..=Duration::from_secs(24 * 3600);

/// The user whom a link admits.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Invitation {
    /// The person's name.
    pub(crate) person: String,
    /// Whether the user may send orders.
    pub(crate) may_order: bool,
    /// When the link expires \[s since 1970\].
    pub(crate) until_unix_s: u64,
}

/// Why no link was created.
#[derive(Debug, thiserror::Error)]
pub enum LinkError {
    /// The directory, or a file in it, cannot be written.
    #[error("{}: {error}; name the directory that `trusswatch web` has as --state-dir, and run this as its owner", path.display())]
    Directory {
        /// The path.
        path: PathBuf,
        /// The cause.
        error: io::Error,
    },
    /// There are too many unused links.
    #[error("{}: too many unused links ({MOST}); wait for them to expire or delete them", .0.display())]
    TooMany(PathBuf),
    /// The lifetime is too short or too long.
    #[error("invalid lifetime {0:?} of a link: expected 1s to 24h")]
    Valid(Duration),
    /// No secret could be generated.
    #[error(transparent)]
    Randomness(#[from] NoRandomness),
}

/// Creates a link that admits a user once. Returns its path with query, `/sign-in?link=…`, to be appended to the page's
/// address. `state` is the state directory of the web page, which must exist.
///
/// # Errors
/// The directory cannot be written, there are too many unused links, or `valid` is outside [`VALID`]; no link was
/// created.
pub fn one_time_link(
    state: &Path,
    person: &PersonName,
    may_order: bool,
    valid: Duration,
) -> Result<String, LinkError> {
    if !VALID.contains(&valid) {
        return Err(LinkError::Valid(valid));
    }
    let now = unix_s();
    let until_unix_s = now.saturating_add(valid.as_secs());
    let person = person.as_str().to_owned();
    let secret = invite(state, &Invitation { person, may_order, until_unix_s }, now)?;
    Ok(format!("/sign-in?link={}", secret.as_str()))
}

pub(crate) fn invite(state: &Path, invitation: &Invitation, now: u64) -> Result<Secret, LinkError> {
    let secret = Secret::new()?;
    store_at(state, DIRECTORY, &secret, invitation, now)?;
    Ok(secret)
}

/// Stores whom a secret admits, in a subdirectory of the state directory.
pub(super) fn store(
    state: &Path,
    subdirectory: &str,
    secret: &Secret,
    invitation: &Invitation,
) -> Result<(), LinkError> {
    store_at(state, subdirectory, secret, invitation, unix_s())
}

fn store_at(
    state: &Path,
    subdirectory: &str,
    secret: &Secret,
    invitation: &Invitation,
    now: u64,
) -> Result<(), LinkError> {
    let wrong = |path: &Path| {
        let path = path.to_owned();
        move |error: io::Error| LinkError::Directory { path, error }
    };
    let owner = fs::metadata(state).map_err(wrong(state))?;
    let directory = state.join(subdirectory);
    match DirBuilder::new().mode(0o700).create(&directory) {
        Ok(()) => set_owner(&directory, &owner).map_err(wrong(&directory))?,
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        Err(error) => return Err(wrong(&directory)(error)),
    }
    tidy(&directory, now);
    if fs::read_dir(&directory).map_err(wrong(&directory))?.count() >= MOST {
        return Err(LinkError::TooMany(directory));
    }
    let file = directory.join(secret.fingerprint().as_str());
    write(&file, invitation, &owner).map_err(wrong(&file))
}

/// Redeems a secret once: the link's file is durably deleted before the user is admitted.
pub(crate) fn accept(state: &Path, secret: &Secret) -> Option<Invitation> {
    accept_at(state, secret, unix_s())
}

fn accept_at(state: &Path, secret: &Secret, now: u64) -> Option<Invitation> {
    let directory = state.join(DIRECTORY);
    let file = directory.join(secret.fingerprint().as_str());
    // A guess costs no more than this.
    let invitation = read(&file)?;
    tidy(&directory, now);
    // If several requests arrive at once, only the one that deletes the file succeeds.
    fs::remove_file(&file).ok()?;
    // Sync the directory, so that the file does not reappear after a power failure.
    File::open(&directory).and_then(|directory| directory.sync_all()).ok()?;
    invitation.is_good(now).then_some(invitation)
}

impl Invitation {
    /// Whether it admits at this time.
    pub(super) fn is_good(&self, now: u64) -> bool {
        now < self.until_unix_s && self.person.parse::<PersonName>().is_ok()
    }
}

/// Deletes expired links and invalid files. One that cannot be deleted is not accepted either.
fn tidy(directory: &Path, now: u64) {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    for file in entries.map(|entry| entry.path()) {
        let is_good = read(&file).is_some_and(|invitation| invitation.is_good(now));
        if !is_good && !is_being_written(&file) {
            let _ = fs::remove_file(&file);
        }
    }
}

fn is_being_written(file: &Path) -> bool {
    let age = || file.metadata().ok()?.modified().ok()?.elapsed().ok();
    file.extension().is_some_and(|extension| extension == BEING_WRITTEN)
        && age().is_none_or(|age| age < WRITTEN_WITHIN)
}

/// Reads a file; `None` if it is missing or damaged.
pub(super) fn read(file: &Path) -> Option<Invitation> {
    let mut text = String::new();
    File::open(file).ok()?.take(LONGEST_FILE).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

/// Writes the file atomically: a concurrent reader finds the complete file or none.
fn write(file: &Path, invitation: &Invitation, owner: &fs::Metadata) -> io::Result<()> {
    let beside = file.with_extension(BEING_WRITTEN);
    let mut written = OpenOptions::new().write(true).create_new(true).mode(0o600).open(&beside)?;
    let text = serde_json::to_string(invitation).map_err(io::Error::other)?;
    let done = written
        .write_all(text.as_bytes())
        .and_then(|()| written.sync_all())
        .and_then(|()| set_owner(&beside, owner))
        .and_then(|()| fs::rename(&beside, file));
    if done.is_err() {
        let _ = fs::remove_file(&beside);
    }
    done
}

/// Gives a file created by root to the owner of the directory, the web page's user.
fn set_owner(path: &Path, owner: &fs::Metadata) -> io::Result<()> {
    let made = fs::metadata(path)?;
    if made.uid() == owner.uid() {
        return Ok(());
    }
    chown(path, Some(owner.uid()), Some(owner.gid()))
}

/// The present time.
pub(super) fn unix_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs()
}

/// Longest name, in bytes.
const LONGEST_NAME: usize = 100;

/// The name of a user who signs in, a printable text on one line; modules record it in their journal with every order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PersonName(String);

/// An invalid name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` is not usable as a person's name: use 1 to {LONGEST_NAME} bytes of printable text without spaces at its ends"
)]
pub struct PersonNameError(String);

impl PersonName {
    /// The name as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::str::FromStr for PersonName {
    type Err = PersonNameError;

    fn from_str(text: &str) -> Result<Self, PersonNameError> {
        let is_usable = !text.is_empty()
            && text.len() <= LONGEST_NAME
            && text.trim() == text
            && text.chars().all(is_printable);
        if is_usable {
            Ok(Self(text.to_owned()))
        } else {
            Err(PersonNameError(quotation(text, LONGEST_NAME)))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    const NOW: u64 = 1_795_000_000;

    fn ada(until_unix_s: u64) -> Invitation {
        Invitation { person: "Ada Lovelace".to_owned(), may_order: true, until_unix_s }
    }

    fn files(state: &Path) -> Vec<PathBuf> {
        fs::read_dir(state.join(DIRECTORY)).unwrap().map(|entry| entry.unwrap().path()).collect()
    }

    #[test]
    fn a_link_works_once_and_its_file_is_private_without_the_secret() {
        let state = tempfile::tempdir().unwrap();
        let secret = invite(state.path(), &ada(NOW + 60), NOW).unwrap();
        let file = files(state.path()).pop().unwrap();
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(file.parent().unwrap().metadata().unwrap().permissions().mode() & 0o777, 0o700);
        let shown = format!("{}{}", file.display(), fs::read_to_string(&file).unwrap());
        assert!(!shown.contains(secret.as_str()));
        assert_eq!(accept_at(state.path(), &secret, NOW), Some(ada(NOW + 60)));
        assert_eq!(accept_at(state.path(), &secret, NOW), None);
    }

    #[test]
    fn one_of_many_simultaneous_uses_of_a_link_succeeds() {
        let state = tempfile::tempdir().unwrap();
        let secret = invite(state.path(), &ada(NOW + 60), NOW).unwrap();
        let accepted = std::thread::scope(|scope| {
            let attempt = || accept_at(state.path(), &secret, NOW).is_some();
            let attempts: Vec<_> = (0..8).map(|_| scope.spawn(attempt)).collect();
            attempts.into_iter().map(|one| one.join().unwrap()).filter(|let_in| *let_in).count()
        });
        assert_eq!(accepted, 1);
    }

    #[test]
    fn an_expired_link_is_refused_and_removed() {
        let state = tempfile::tempdir().unwrap();
        let secret = invite(state.path(), &ada(NOW + 60), NOW).unwrap();
        let another = invite(state.path(), &ada(NOW + 61), NOW).unwrap();
        assert_eq!(accept_at(state.path(), &secret, NOW + 60), None);
        assert_eq!(files(state.path()).len(), 1);
        assert!(accept_at(state.path(), &another, NOW + 60).is_some());
    }

    #[test]
    fn what_is_no_link_is_none_and_unused_links_are_bounded() {
        let state = tempfile::tempdir().unwrap();
        let secret = invite(state.path(), &ada(NOW + 60), NOW).unwrap();
        fs::write(files(state.path()).pop().unwrap(), "{\"person\":\"ada\"}").unwrap();
        assert_eq!(accept_at(state.path(), &secret, NOW), None);
        for _ in 0..MOST {
            invite(state.path(), &ada(NOW + 60), NOW).unwrap();
        }
        let refused = invite(state.path(), &ada(NOW + 60), NOW);
        assert!(matches!(refused, Err(LinkError::TooMany(_))), "{refused:?}");
        invite(state.path(), &ada(NOW + 120), NOW + 60).unwrap();
    }

    #[test]
    fn wrong_directories_and_times_are_named() {
        let state = tempfile::tempdir().unwrap();
        let name = "ada".parse().unwrap();
        let missing = state.path().join("missing");
        let minute = Duration::from_secs(60);
        let error = one_time_link(&missing, &name, true, minute).unwrap_err().to_string();
        assert!(error.contains("missing") && error.contains("--state-dir"), "{error}");
        let error = one_time_link(state.path(), &name, true, Duration::from_secs(90_000));
        assert_eq!(
            error.unwrap_err().to_string(),
            "invalid lifetime 90000s of a link: expected 1s to 24h"
        );
        let link = one_time_link(state.path(), &name, false, minute).unwrap();
        let secret = Secret::from_text(link.strip_prefix("/sign-in?link=").unwrap()).unwrap();
        let invitation = accept(state.path(), &secret).unwrap();
        assert_eq!((invitation.person.as_str(), invitation.may_order), ("ada", false));
    }

    #[test]
    fn names_of_people_are_printable_and_short() {
        for usable in ["ada", "Ada Lovelace", "Ørsted, H. C.", "塔", &"a".repeat(100)] {
            assert_eq!(usable.parse::<PersonName>().unwrap().as_str(), usable);
        }
        for unusable in
            ["", " ada", "ada ", "a\nb", "a\r\nSet-Cookie: x", "a\u{202e}b", &"a".repeat(101)]
        {
            let error = unusable.parse::<PersonName>().unwrap_err().to_string();
            assert!(error.contains("is not usable as a person's name"), "{error}");
            assert!(!error.contains('\n'), "{error}");
        }
    }
}
