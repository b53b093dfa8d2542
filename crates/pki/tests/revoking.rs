//! Revoking on a real disk: what takes the place of a lost key, what is kept, and what never comes back.

#![allow(clippy::unwrap_used, reason = "test code")]

use std::fs;

use pki::revocation::{RevokeError, remove, replace};
use pki::{Authority, Certificate, CommonName, Holder, Library, Lifetime};
use tempfile::TempDir;

/// A library with an authority and a certificate of module 1.
struct Bench {
    folder: TempDir,
    authority: Authority,
}

const DAYS: u16 = 90;

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let structure = "tower".parse().unwrap();
        let authority =
            Authority::create(folder.path(), structure, Lifetime::of_days(3000)).unwrap();
        let bench = Self { folder, authority };
        bench.issue("module1");
        bench
    }

    fn library(&self) -> Library {
        Library::at(self.folder.path())
    }

    /// As `trusswatch pki issue` does it.
    fn issue(&self, holder: &str) {
        let holder: Holder = holder.parse().unwrap();
        let issued = self.library().generations().unwrap().of(holder.clone());
        let here = ["127.0.0.1".parse().unwrap()];
        let place = self.library().place_of(&holder);
        self.authority.issue(&place, issued, &here, Lifetime::of_days(DAYS)).unwrap();
    }

    fn replace(&self, holder: &str) -> Result<pki::revocation::Revoked, RevokeError> {
        let holder = holder.parse().unwrap();
        replace(&self.authority, &self.library(), &holder, Lifetime::of_days(DAYS))
    }

    fn remove(&self, holder: &str) -> Result<pki::revocation::Revoked, RevokeError> {
        remove(&self.authority, &self.library(), &holder.parse().unwrap())
    }

    fn present(&self, holder: &str) -> String {
        self.library().present(&holder.parse().unwrap()).unwrap().to_string()
    }

    fn revoked(&self) -> Vec<String> {
        self.library().revoked().unwrap().iter().map(ToString::to_string).collect()
    }
}

#[test]
fn a_lost_key_gives_way_to_another_one_of_the_next_generation() {
    let bench = Bench::new();
    let identity = bench.library().identity(&"module1".parse().unwrap());
    let (certificate, key) =
        (fs::read(&identity.certificate).unwrap(), fs::read(&identity.key).unwrap());
    let revoked = bench.replace("module1").unwrap();
    assert_eq!(revoked.name.to_string(), "module1.tower");
    assert_eq!(fs::read(&revoked.kept).unwrap(), certificate);
    assert_ne!(fs::read(&identity.key).unwrap(), key);
    let first: CommonName = "module1.tower".parse().unwrap();
    assert_eq!(identity.problems(Some(&first), &revoked.addresses), []);
    let read = Certificate::read(&identity.certificate).unwrap();
    assert_eq!(read.common_name.as_deref(), Some("module1~2.tower"));
    assert_eq!(read.addresses, revoked.addresses);

    bench.authority.renew(&identity, Lifetime::of_days(1)).unwrap();
    assert_eq!(bench.present("module1"), "module1~2");
    bench.replace("module1").unwrap();
    assert_eq!(bench.present("module1"), "module1~3");
    assert_eq!(bench.revoked(), ["module1", "module1~2"]);
    let holders = bench.library().holders().unwrap();
    assert_eq!(holders, ["module1".parse().unwrap()]);
}

#[test]
fn a_removed_holder_gets_another_name_when_issued_again() {
    let bench = Bench::new();
    bench.issue("operator.ada");
    bench.remove("operator.ada").unwrap();
    let place = bench.folder.path().join("operator.ada");
    assert!(!place.exists());
    let again = bench.remove("operator.ada").unwrap_err();
    assert!(matches!(&again, RevokeError::Already { .. }), "{again}");
    bench.issue("operator.ada");
    assert_eq!(bench.present("operator.ada"), "operator.ada~2");
    bench.remove("operator.ada").unwrap();
    bench.issue("operator.ada");
    assert_eq!(bench.present("operator.ada"), "operator.ada~3");
}

#[test]
fn what_is_not_there_or_not_ones_own_is_not_revoked() {
    let (bench, other) = (Bench::new(), Bench::new());
    let unknown = bench.replace("module7").unwrap_err().to_string();
    assert!(unknown.contains("no certificate of `module7`, only of `module1`;"), "{unknown}");
    let file = |bench: &Bench, holder: &str| {
        bench.library().identity(&holder.parse().unwrap()).certificate
    };
    fs::copy(file(&other, "module1"), file(&bench, "module1")).unwrap();
    let foreign = bench.replace("module1").unwrap_err().to_string();
    assert!(foreign.contains("is not signed by this authority"), "{foreign}");
    bench.issue("module2");
    fs::copy(file(&bench, "module2"), file(&bench, "module1")).unwrap();
    let mistaken = bench.remove("module1").unwrap_err().to_string();
    assert!(mistaken.contains("issued to `module2.tower`, not to `module1`"), "{mistaken}");
    assert_eq!(bench.revoked(), [""; 0]);
}

/// From a backup, for instance.
#[test]
fn a_revoked_certificate_that_is_put_back_is_still_revoked() {
    let bench = Bench::new();
    let revoked = bench.replace("module1").unwrap();
    let holder: Holder = "module1".parse().unwrap();
    fs::copy(&revoked.kept, bench.library().identity(&holder).certificate).unwrap();
    let current = bench.library().generations().unwrap().of(holder);
    assert_eq!(current.to_string(), "module1~2");
    let again = bench.replace("module1").unwrap_err().to_string();
    assert!(again.contains("`module1.tower` is revoked already; remove `"), "{again}");
}

#[test]
fn a_name_with_no_room_for_a_generation_can_still_be_removed() {
    let bench = Bench::new();
    let longest = "a".repeat(64 - ".tower".len());
    bench.issue(&longest);
    let refused = bench.replace(&longest).unwrap_err().to_string();
    assert!(refused.contains("longer than the 64 characters"), "{refused}");
    assert_eq!((bench.present(&longest), bench.revoked().len()), (longest.clone(), 0));
    bench.remove(&longest).unwrap();
    assert_eq!(bench.revoked(), [longest]);
}
