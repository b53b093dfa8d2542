//! Authorities and identities on a real disk: what is made, what is renewed, and what is found wrong.

#![allow(clippy::unwrap_used, reason = "test code")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

use pki::identity::FileProblem;
use pki::lifetime::now;
use pki::{Address, Authority, Certificate, CommonName, Holder, Identity, IssueError, Library};
use pki::{IdentityProblem, Lifetime};
use tempfile::TempDir;
use time::Duration;

/// A library with an authority.
struct Bench {
    folder: TempDir,
    authority: Authority,
}

impl Bench {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let structure = "tower".parse().unwrap();
        let authority =
            Authority::create(folder.path(), structure, Lifetime::of_days(3000)).unwrap();
        Self { folder, authority }
    }

    fn library(&self) -> Library {
        Library::at(self.folder.path())
    }

    fn issue(&self, holder: &str, addresses: &[&str], lifetime: Lifetime) -> Identity {
        let holder: Holder = holder.parse().unwrap();
        let addresses: Vec<Address> = addresses.iter().map(|a| a.parse().unwrap()).collect();
        let place = self.library().place_of(&holder);
        self.authority.issue(&place, holder, &addresses, lifetime).unwrap()
    }

    fn module1(&self) -> Identity {
        self.issue("module1", &["127.0.0.1", "mast.example"], Lifetime::of_days(300))
    }
}

fn name(text: &str) -> CommonName {
    text.parse().unwrap()
}

fn wrongs(identity: &Identity) -> Vec<FileProblem> {
    let problems = identity.problems(Some(&name("module1.tower")), &[]);
    problems.into_iter().map(|problem| problem.wrong).collect()
}

fn lifetime(from_minutes: i64, until_minutes: i64) -> Lifetime {
    let now = now();
    Lifetime {
        from: now + Duration::minutes(from_minutes),
        until: now + Duration::minutes(until_minutes),
    }
}

fn mode(file: &Path) -> u32 {
    fs::metadata(file).unwrap().permissions().mode() & 0o777
}

#[test]
fn an_issued_identity_names_its_holder_and_has_no_problem() {
    let bench = Bench::new();
    let identity = bench.module1();
    let here: Vec<Address> = vec!["127.0.0.1".parse().unwrap()];
    assert_eq!(identity.problems(Some(&name("module1.tower")), &here), []);
    let certificate = Certificate::read(&identity.certificate).unwrap();
    assert_eq!(certificate.common_name.as_deref(), Some("module1.tower"));
    assert_eq!(certificate.addresses.len(), 2);
    let observer = bench.issue("observer.wall", &[], lifetime(-50, 10));
    assert_eq!(observer.problems(Some(&name("observer.wall.tower")), &[]), []);
    let holders: Vec<String> =
        bench.library().holders().unwrap().iter().map(ToString::to_string).collect();
    assert_eq!(holders, ["module1", "observer.wall"]);
}

#[test]
fn keys_are_their_owners_alone() {
    let bench = Bench::new();
    let identity = bench.module1();
    for key in [&identity.key, &bench.folder.path().join("authority/key.pem")] {
        assert_eq!(mode(key), 0o600);
        assert_eq!(mode(key.parent().unwrap()), 0o700);
    }
}

#[test]
fn nothing_is_written_over() {
    let bench = Bench::new();
    let identity = bench.module1();
    let before = fs::read(&identity.key).unwrap();
    let holder: Holder = "module1".parse().unwrap();
    let place = bench.library().place_of(&holder);
    let again = bench.authority.issue(&place, holder, &[], Lifetime::of_days(1));
    assert!(matches!(again, Err(IssueError::Exists(_))), "{again:?}");
    assert_eq!(fs::read(&identity.key).unwrap(), before);
    let structure = "tower".parse().unwrap();
    let again = Authority::create(bench.folder.path(), structure, Lifetime::of_days(1));
    assert!(matches!(again, Err(IssueError::Exists(_))), "{again:?}");
}

#[test]
fn renewal_keeps_name_addresses_and_key_even_where_the_key_is_elsewhere() {
    let bench = Bench::new();
    let identity = bench.issue("module1", &["127.0.0.1"], Lifetime::of_days(5));
    let before = Certificate::read(&identity.certificate).unwrap();
    let key = fs::read(&identity.key).unwrap();
    fs::remove_file(&identity.key).unwrap();
    bench.authority.renew(&identity, Lifetime::of_days(300)).unwrap();
    let after = Certificate::read(&identity.certificate).unwrap();
    assert!(after.lifetime.until > before.lifetime.until);
    assert_eq!((after.common_name, after.addresses), (before.common_name, before.addresses));
    assert!(!identity.key.exists());
    fs::write(&identity.key, key).unwrap();
    fs::set_permissions(&identity.key, fs::Permissions::from_mode(0o600)).unwrap();
    assert_eq!(wrongs(&identity), []);
}

#[test]
fn an_authority_renews_only_what_it_has_signed() {
    let (bench, other) = (Bench::new(), Bench::new());
    let foreign = other.module1();
    let before = fs::read(&foreign.certificate).unwrap();
    let refused = bench.authority.renew(&foreign, Lifetime::of_days(300));
    assert!(matches!(refused, Err(IssueError::NoCertificate { .. })), "{refused:?}");
    assert_eq!(fs::read(&foreign.certificate).unwrap(), before);
}

#[test]
fn no_certificate_outlives_its_authority() {
    let folder = tempfile::tempdir().unwrap();
    let structure = "tower".parse().unwrap();
    let authority = Authority::create(folder.path(), structure, Lifetime::of_days(10)).unwrap();
    let place = folder.path().join("module1");
    let holder: Holder = "module1".parse().unwrap();
    let identity = authority.issue(&place, holder, &[], Lifetime::of_days(300)).unwrap();
    let own = Certificate::read(&identity.certificate).unwrap();
    assert_eq!(own.lifetime.until, authority.certificate().lifetime.until);
}

#[test]
fn every_mistake_is_named() {
    let (bench, other) = (Bench::new(), Bench::new());
    let identity = bench.module1();
    assert_eq!(wrongs(&identity), []);

    let of = |holder, minutes: (i64, i64)| bench.issue(holder, &[], lifetime(minutes.0, minutes.1));
    let past = of("observer.past", (-50, -1));
    assert!(matches!(
        past.problems(None, &[])[..],
        [IdentityProblem { wrong: FileProblem::Expired(_), .. }]
    ));
    let future = of("observer.future", (1, 50));
    let problems = future.problems(None, &[]);
    assert!(matches!(
        problems[..],
        [IdentityProblem { wrong: FileProblem::NotYetValid { .. }, .. }]
    ));
    assert!(problems[0].wrong.passes());

    let second = of("module2", (-1, 50));
    assert!(
        matches!(&wrongs(&second)[..], [FileProblem::OtherName { found, .. }] if found == "module2.tower")
    );
    let elsewhere: Address = "192.0.2.1".parse().unwrap();
    let problems = identity.problems(None, std::slice::from_ref(&elsewhere));
    assert_eq!(problems[0].wrong, FileProblem::OtherAddress(elsewhere));

    let foreign = Identity {
        authority: other.folder.path().join("authority/certificate.pem"),
        ..identity.clone()
    };
    assert!(matches!(wrongs(&foreign)[..], [FileProblem::OtherAuthority(_)]));
    let swapped = Identity { key: second.key.clone(), ..identity.clone() };
    assert!(matches!(wrongs(&swapped)[..], [FileProblem::OtherKey(_)]));

    fs::set_permissions(&identity.key, fs::Permissions::from_mode(0o644)).unwrap();
    assert_eq!(wrongs(&identity), [FileProblem::Exposed(0o644)]);
    fs::set_permissions(&identity.key, fs::Permissions::from_mode(0o600)).unwrap();
    fs::write(&identity.key, "no key").unwrap();
    assert!(matches!(wrongs(&identity)[..], [FileProblem::Unusable(_)]));
    fs::remove_file(&identity.key).unwrap();
    assert!(matches!(wrongs(&identity)[..], [FileProblem::Unusable(_)]));
    fs::write(&identity.certificate, "no certificate").unwrap();
    assert!(matches!(wrongs(&identity)[..], [FileProblem::Unusable(_), FileProblem::Unusable(_)]));
}
