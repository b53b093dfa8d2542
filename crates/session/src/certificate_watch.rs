//! When the certificates of a process expire.

use std::path::{Path, PathBuf};
use std::time::Duration;

use observer::ShownCertificate;
use pki::Certificate;
use tokio::sync::watch::{self, channel};
use tokio::task::spawn_blocking;
use tokio::time::sleep;

/// Interval of reading the files: a certificate may be renewed while the process runs.
const READ_EVERY: Duration = Duration::from_secs(3600);

/// The certificates in some files, read again every hour by a task that ends with the process.
#[derive(Debug, Clone)]
pub struct CertificateWatch(watch::Receiver<Vec<ShownCertificate>>);

impl CertificateWatch {
    /// Reads the files now and from then on. A file that cannot be read at the start is left out, which the checks report;
    /// later, what was last read of it still holds.
    ///
    /// # Panics
    /// Outside of a tokio runtime.
    #[must_use]
    pub fn start(files: Vec<PathBuf>) -> Self {
        let (sender, receiver) = channel(read(&files, &[]));
        if !files.is_empty() {
            tokio::spawn(async move {
                loop {
                    sleep(READ_EVERY).await;
                    let (files, before) = (files.clone(), sender.borrow().clone());
                    // The disk may take its time.
                    let read = spawn_blocking(move || read(&files, &before)).await;
                    let Ok(shown) = read else { return };
                    if sender.send(shown).is_err() {
                        return;
                    }
                }
            });
        }
        Self(receiver)
    }

    /// The certificates as last read.
    #[must_use]
    pub fn shown(&self) -> Vec<ShownCertificate> {
        self.0.borrow().clone()
    }

    /// When the first of them expires \[s since 1970\].
    #[must_use]
    pub fn until_unix_s(&self) -> Option<u64> {
        self.0.borrow().iter().map(|shown| shown.until_unix_s).min()
    }

    /// In words, which of them expire soon or have expired.
    #[must_use]
    pub fn expiring(&self, now_unix_s: u64) -> Vec<String> {
        in_words(&self.0.borrow(), now_unix_s)
    }
}

/// In words, which certificates in these files expire soon or have expired.
#[must_use]
pub fn expiring(files: &[PathBuf], now_unix_s: u64) -> Vec<String> {
    in_words(&read(files, &[]), now_unix_s)
}

fn in_words(shown: &[ShownCertificate], now_unix_s: u64) -> Vec<String> {
    let words = |shown: &ShownCertificate| {
        Some(format!("the certificate {} {}", shown.name, shown.expiring(now_unix_s)?))
    };
    shown.iter().filter_map(words).collect()
}

/// The certificates in these files. If not all of them can be read, what was read before and is missing now still holds.
fn read(files: &[PathBuf], before: &[ShownCertificate]) -> Vec<ShownCertificate> {
    let read: Vec<Option<ShownCertificate>> = files.iter().map(|file| read_one(file)).collect();
    let is_whole = read.iter().all(Option::is_some);
    let mut shown: Vec<ShownCertificate> = read.into_iter().flatten().collect();
    // One certificate may serve for the network and for browsers.
    shown.dedup();
    let is_missing = |old: &&ShownCertificate| !shown.iter().any(|new| new.name == old.name);
    let missing: Vec<_> = before.iter().filter(is_missing).filter(|_| !is_whole).cloned().collect();
    shown.extend(missing);
    shown
}

fn read_one(file: &Path) -> Option<ShownCertificate> {
    let certificate = Certificate::read(file).ok()?;
    let until_unix_s = u64::try_from(certificate.lifetime.until.unix_timestamp()).ok()?;
    let name = certificate.common_name.unwrap_or_else(|| file.display().to_string());
    Some(ShownCertificate { name, until_unix_s })
}

#[cfg(test)]
mod tests {
    use super::*;
    use pki::{Authority, Holder, Library, Lifetime};

    #[tokio::test]
    async fn certificates_are_told_of_before_they_expire_and_one_file_counts_once() {
        let folder = tempfile::tempdir().unwrap();
        let tower = "tower".parse().unwrap();
        let authority = Authority::create(folder.path(), tower, Lifetime::of_days(400)).unwrap();
        let holder: Holder = "operator.web".parse().unwrap();
        let place = Library::at(folder.path()).place_of(&holder);
        let issue = |days| {
            std::fs::remove_dir_all(&place).ok();
            authority.issue(&place, holder.clone(), &[], Lifetime::of_days(days)).unwrap();
        };
        issue(20);
        let file = pki::credentials::identity(&place).certificate;
        let watch = CertificateWatch::start(vec![file.clone(), file.clone()]);
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        let now = now.as_secs();
        let [words] = &watch.expiring(now)[..] else { panic!("{:?}", watch.shown()) };
        let expected = "the certificate operator.web.tower expires in ";
        assert!(words.starts_with(expected) && words.contains(" days ("), "{words}");
        issue(300);
        let renewed = CertificateWatch::start(vec![file.clone()]);
        assert!(renewed.until_unix_s() > watch.until_unix_s());
        assert_eq!(renewed.expiring(now), Vec::<String>::new());
        assert_eq!(CertificateWatch::start(Vec::new()).until_unix_s(), None);
        // What cannot be read any more is not over.
        let gone = [file, folder.path().join("gone.pem")];
        assert_eq!(read(&gone[1..], &watch.shown()), watch.shown());
        assert_eq!(read(&gone, &watch.shown()), renewed.shown());
    }
}
