//! Files for browsers: read back by another library, and by the program that most others are compared with.

#![allow(clippy::unwrap_used, reason = "test code")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use p12_keystore::{KeyStore, Pkcs12ImportPolicy};
use pki::browser::{self, BrowserFileError};
use pki::{Authority, Holder, Identity, Library, Lifetime};
use tempfile::TempDir;

const PASSWORD: &str = "correct horse battery";

/// An authority with a certificate of this holder, and where its file is to be.
fn issued(holder: &str) -> (TempDir, Identity, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let structure = "tower".parse().unwrap();
    let authority = Authority::create(folder.path(), structure, Lifetime::of_days(300)).unwrap();
    let holder: Holder = holder.parse().unwrap();
    let place = Library::at(folder.path()).place_of(&holder);
    let identity = authority.issue(&place, holder, &[], Lifetime::of_days(90)).unwrap();
    let file = folder.path().join("person.p12");
    (folder, identity, file)
}

#[test]
fn the_browser_file_holds_key_and_both_certificates_for_its_owner_only() {
    for holder in ["operator.ada", "observer.wall"] {
        let (_folder, identity, file) = issued(holder);
        browser::write(&identity, PASSWORD, &file).unwrap();
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
        let bytes = fs::read(&file).unwrap();
        let store = KeyStore::from_pkcs12(&bytes, PASSWORD, Pkcs12ImportPolicy::Strict).unwrap();
        let (name, chain) = store.private_key_chain().unwrap();
        assert_eq!(name, format!("{holder}.tower"));
        assert_eq!(chain.certs().len(), 2);
        let wrong = KeyStore::from_pkcs12(&bytes, "another password", Pkcs12ImportPolicy::Strict);
        assert!(wrong.is_err());
    }
}

#[test]
fn openssl_reads_the_file_without_its_legacy_algorithms() {
    let (_folder, identity, file) = issued("operator.ada");
    browser::write(&identity, PASSWORD, &file).unwrap();
    let asked = |password: &str, what: &[&str]| {
        Command::new("openssl")
            .args(["pkcs12", "-in", file.to_str().unwrap(), "-passin"])
            .arg(format!("pass:{password}"))
            .args(what)
            .output()
    };
    let Ok(keys) = asked(PASSWORD, &["-nocerts", "-nodes"]) else {
        println!("openssl is not there");
        return;
    };
    let keys = String::from_utf8(keys.stdout).unwrap();
    let key = fs::read_to_string(&identity.key).unwrap();
    let base64 = |text: &str| {
        let inside = text.split("-----").nth(2).unwrap_or_default();
        inside.split_whitespace().collect::<String>()
    };
    assert_eq!(base64(&keys), base64(&key), "{keys}");
    let shown = asked(PASSWORD, &["-info", "-nokeys"]).unwrap();
    let shown =
        String::from_utf8(shown.stdout).unwrap() + &String::from_utf8(shown.stderr).unwrap();
    assert!(shown.contains("operator.ada.tower") && shown.contains("AES-256-CBC"), "{shown}");
    assert_eq!(shown.matches("BEGIN CERTIFICATE").count(), 2, "{shown}");
    assert!(!asked("another password", &["-nokeys"]).unwrap().status.success());
}

#[test]
fn machines_short_passwords_and_files_that_are_there_are_refused() {
    let (_folder, module, file) = issued("module1");
    let refused = browser::write(&module, PASSWORD, &file);
    assert!(matches!(refused, Err(BrowserFileError::NoPerson(_))), "{refused:?}");
    let (_folder, ada, file) = issued("operator.ada");
    let short = browser::write(&ada, "short", &file);
    assert!(matches!(short, Err(BrowserFileError::Password(5))), "{short:?}");
    assert!(!file.exists());
    fs::write(&file, "older").unwrap();
    let there = browser::write(&ada, PASSWORD, &file);
    assert!(matches!(there, Err(BrowserFileError::Writing { .. })), "{there:?}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "older");
    fs::remove_file(&ada.key).unwrap();
    let keyless = browser::write(&ada, PASSWORD, &file.with_extension("other"));
    assert!(matches!(keyless, Err(BrowserFileError::Problems(_))), "{keyless:?}");
}
