//! `trusswatch join` through the real binary.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use crate::binary::{Outcome, repository, run};

const ROUTER: &str = "tls/192.0.2.10:7447";

/// The shipped configurations, and certificates for two of them.
fn computer() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for part in ["", "tower", "thresholds", "references"] {
        fs::create_dir_all(folder.path().join(part)).unwrap();
        for entry in fs::read_dir(repository("configs").join(part)).unwrap() {
            let from = entry.unwrap().path();
            if from.extension().is_some_and(|ending| ending == "toml") {
                let name = from.file_name().unwrap().to_owned();
                fs::copy(from, folder.path().join(part).join(name)).unwrap();
            }
        }
    }
    let library = folder.path().join("pki").display().to_string();
    run(&["pki", "authority", "tower", "--dir", &library]).succeeds();
    run(&["pki", "issue", "module1", "plant", "--dir", &library]).succeeds();
    folder
}

fn join(router: &str, file: &Path, tls: &Path) -> Outcome {
    run(&["join", router, &file.display().to_string(), "--tls", &tls.display().to_string()])
}

fn parts(folder: &tempfile::TempDir, name: &str) -> (PathBuf, PathBuf) {
    (folder.path().join(format!("{name}.toml")), folder.path().join("pki").join(name))
}

#[test]
fn diagnosers_and_plants_become_clients_and_stay_what_they_were() {
    let folder = computer();
    for name in ["module1", "plant"] {
        let (file, tls) = parts(&folder, name);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        let before = fs::read_to_string(&file).unwrap();
        join(ROUTER, &file, &tls).succeeds();
        let after = fs::read_to_string(&file).unwrap();
        let (kept, old) = before.split_once("[network]").unwrap();
        let rest = old.split_once("\n\n").map(|(_, rest)| format!("\n{rest}")).unwrap_or_default();
        let table = format!(
            "[network]\nmode = \"client\"\nconnect = [\"{ROUTER}\"]\ntls = \"{}\"\n",
            tls.display()
        );
        assert_eq!(after, format!("{kept}{table}{rest}"));
        assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o640);
        run(&["check", &file.display().to_string()]).succeeds();
    }
}

#[test]
fn what_would_not_be_valid_is_left_as_it_is() {
    let folder = computer();
    let (file, tls) = parts(&folder, "module1");
    let before = fs::read_to_string(&file).unwrap();
    let name = file.display().to_string();
    join("tcp/192.0.2.10:7447", &file, &tls).fails(3, &["write `tls/192.0.2.10:7447`"]);
    join("nowhere", &file, &tls).fails(3, &[&name, "`nowhere` is not a valid endpoint"]);
    let (_, other) = parts(&folder, "plant");
    join(ROUTER, &file, &other).fails(3, &["issued to `plant.tower`, but this is `module1.tower`"]);
    assert_eq!(fs::read_to_string(&file).unwrap(), before);
    assert!(
        fs::read_dir(folder.path())
            .unwrap()
            .all(|entry| { !entry.unwrap().file_name().to_string_lossy().starts_with(".new-") })
    );
    join(ROUTER, &folder.path().join("tower.toml"), &tls)
        .fails(3, &["tower.toml", "only diagnosers and plants"]);
    join(ROUTER, &folder.path().join("missing.toml"), &tls).fails(3, &["missing.toml", "read"]);
}

/// Without `--tls` the certificate is that of the service, which is not installed here.
#[test]
fn a_service_without_a_certificate_is_refused_with_its_place() {
    let folder = computer();
    let file = folder.path().join("no-such-module.toml");
    fs::copy(folder.path().join("module1.toml"), &file).unwrap();
    let outcome = run(&["join", ROUTER, &file.display().to_string()]);
    outcome.fails(3, &["/etc/credstore/trusswatch.no-such-module.key.pem", "cannot be read"]);
}
