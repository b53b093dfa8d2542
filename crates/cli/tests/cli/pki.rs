//! `trusswatch pki` through the real binary, and `check` of what it has made.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use crate::binary::{Outcome, repository, run, trusswatch};

/// Set this variable to write the shipped settings instead of comparing them.
const REWRITE: &str = "TRUSSWATCH_REWRITE_ACCESS";

/// A library with an authority and these holders.
fn library(holders: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    pki(folder.path(), &["authority", "tower"]).succeeds();
    for holder in holders {
        pki(folder.path(), &["issue", holder, "--address", "127.0.0.1"]).succeeds();
    }
    folder
}

fn pki(library: &Path, words: &[&str]) -> Outcome {
    let library = library.display().to_string();
    let words = ["pki"].iter().chain(words).copied().chain(["--dir", &library]);
    run(&words.collect::<Vec<_>>())
}

fn check(file: &Path) -> Outcome {
    run(&["check", &file.display().to_string()])
}

#[test]
fn certificates_are_made_listed_and_renewed() {
    let folder = library(&["module1", "operator.ada"]);
    let listed = pki(folder.path(), &["list"]);
    listed.succeeds();
    for text in ["authority of tower", "module1", "127.0.0.1", "operator.ada"] {
        assert!(listed.stdout.contains(text), "{}", listed.stdout);
    }
    let again = pki(folder.path(), &["issue", "module1"]);
    again.fails(3, &["module1` already exists"]);

    let file = folder.path().join("module1/certificate.pem");
    let before = fs::read_to_string(&file).unwrap();
    let key = fs::read_to_string(folder.path().join("module1/key.pem")).unwrap();
    pki(folder.path(), &["renew", "--all", "--days", "30"]).succeeds();
    assert_ne!(fs::read_to_string(&file).unwrap(), before);
    assert_eq!(fs::read_to_string(folder.path().join("module1/key.pem")).unwrap(), key);
    let listed = pki(folder.path(), &["list", "--json"]);
    listed.succeeds();
    let listed: serde_json::Value = serde_json::from_str(&listed.stdout).unwrap();
    assert_eq!(listed["v"], 1);
    assert_eq!(listed["certificates"][0]["days_left"], 29, "{listed:#}");
    let identity = check(&folder.path().join("module1"));
    identity.succeeds();
    assert!(identity.stdout.contains("certificate of `module1.tower`"), "{}", identity.stdout);
}

#[test]
fn what_cannot_be_meant_is_refused_with_what_would_be_right() {
    let folder = tempfile::tempdir().unwrap();
    let none = pki(folder.path(), &["issue", "module1"]);
    none.fails(3, &["authority/certificate.pem", "trusswatch pki authority STRUCTURE"]);
    for holder in ["king.ada", "authority", "../module1"] {
        let outcome = pki(folder.path(), &["issue", holder]);
        assert_eq!(outcome.code, Some(2), "{holder}");
        assert!(outcome.stderr.contains("operator.NAME"), "{}", outcome.stderr);
    }
    let outcome = pki(folder.path(), &["issue", "module1", "--address", "192.0.2.1:7447"]);
    assert_eq!(outcome.code, Some(2));
    assert!(outcome.stderr.contains("without a port"), "{}", outcome.stderr);
    pki(folder.path(), &["authority", "tower"]).succeeds();
    let unknown = pki(folder.path(), &["renew", "module1"]);
    unknown.fails(3, &["module1/certificate.pem", "cannot be read"]);
}

#[test]
fn several_holders_are_issued_at_once_but_have_no_address_in_common() {
    let folder = library(&[]);
    let issued = pki(folder.path(), &["issue", "plant", "module1", "operator.ada"]);
    issued.succeeds();
    assert_eq!(issued.stdout.lines().count(), 3, "{}", issued.stdout);
    let refused = pki(folder.path(), &["issue", "module2", "module3", "--address", "192.0.2.1"]);
    refused.fails(2, &["`--address` with several holders", "one by one"]);
    assert!(!folder.path().join("module2").exists());
}

#[test]
fn services_get_certificates_that_are_good_and_of_their_own_authority() {
    let folder = library(&["module1", "plant", "router.ground", "operator.ada"]);
    let store = folder.path().join("credstore");
    let install = |library: &Path, holder: &str| {
        let directory = library.join(holder).display().to_string();
        run(&["pki", "install", &directory, "--store", &store.display().to_string()])
    };
    for (holder, unit) in [
        ("module1", "trusswatch-diagnoser@module1.service"),
        ("plant", "trusswatch-plant.service"),
        ("router.ground", "trusswatch-router.service"),
    ] {
        let installed = install(folder.path(), holder);
        installed.succeeds();
        let line = format!("{holder}.tower for {unit}, until ");
        assert!(installed.stdout.contains(&line), "{}", installed.stdout);
    }
    assert_eq!(store.metadata().unwrap().permissions().mode() & 0o777, 0o700);
    let modes = fs::read_dir(&store).unwrap().map(|entry| entry.unwrap().metadata().unwrap());
    let modes: Vec<u32> = modes.map(|file| file.permissions().mode() & 0o777).collect();
    assert_eq!(modes, [0o600; 7]);

    let key = store.join("trusswatch.module1.key.pem");
    assert_eq!(fs::read(&key).unwrap(), fs::read(folder.path().join("module1/key.pem")).unwrap());
    install(folder.path(), "operator.ada")
        .fails(3, &["`operator.ada.tower` has no service", "--tls"]);
    install(folder.path(), "module7").fails(3, &["module7/key.pem: cannot be read"]);
    let foreign = library(&["module1"]);
    let file = store.join("trusswatch.authority.pem").display().to_string();
    install(foreign.path(), "module1").fails(3, &[&file, "of another authority"]);
    assert_eq!(fs::read(&key).unwrap(), fs::read(folder.path().join("module1/key.pem")).unwrap());

    pki(folder.path(), &["renew", "module1"]).succeeds();
    install(folder.path(), "module1").succeeds();
    let renewed = fs::read(folder.path().join("module1/certificate.pem")).unwrap();
    assert_eq!(fs::read(store.join("trusswatch.module1.certificate.pem")).unwrap(), renewed);
}

#[test]
fn endpoints_of_the_settings_are_those_that_are_named_and_of_tls() {
    let structure = repository("configs/tower.toml").display().to_string();
    let access = |endpoint: &str| run(&["pki", "access", &structure, "--listen", endpoint]);
    let printed = access("tls/192.0.2.10:7447");
    printed.succeeds();
    assert!(printed.stdout.contains("\"tls/192.0.2.10:7447\""), "{}", printed.stdout);
    assert!(!printed.stdout.contains("127.0.0.1"), "{}", printed.stdout);
    for endpoint in ["tcp/192.0.2.10:7447", "192.0.2.10", "tls/"] {
        access(endpoint).fails(3, &[endpoint, "write e.g. `tls/192.0.2.10:7447`"]);
    }
}

/// The shipped settings are what the program prints, and Zenoh takes them.
#[test]
fn the_shipped_access_control_is_the_one_that_is_generated() {
    let structure = repository("configs/tower.toml").display().to_string();
    for mode in ["router", "peer"] {
        let printed = run(&[
            "pki",
            "access",
            &structure,
            "--mode",
            mode,
            "--operator",
            "ada",
            "--observer",
            "wall",
        ]);
        printed.succeeds();
        let file = repository("configs/zenoh").join(format!("tower-{mode}.json5"));
        if std::env::var_os(REWRITE).is_some() {
            fs::write(&file, &printed.stdout).unwrap();
        }
        let shipped = fs::read_to_string(&file).unwrap();
        let name = file.display();
        assert!(shipped == printed.stdout, "{name} is out of date; set {REWRITE}=1 to rewrite it");
        let checked = check(&file);
        checked.succeeds();
        let named = "access control for module1.tower, module2.tower, plant.tower, \
                     operator.ada.tower, observer.wall.tower";
        assert!(checked.stdout.contains(named), "{}", checked.stdout);
    }
}

#[test]
fn the_people_of_a_library_are_named_in_its_access_control() {
    let folder = library(&["operator.ben", "observer.station", "router.ground"]);
    let structure = repository("configs/tower.toml").display().to_string();
    let printed = pki(folder.path(), &["access", &structure]);
    printed.succeeds();
    for name in ["operator.ben.tower", "observer.station.tower", "module2.tower"] {
        assert!(printed.stdout.contains(name), "{name}");
    }
    assert!(!printed.stdout.contains("operator.ada"), "no other holder is");
}

/// The arguments that make a gateway of the tower.
const TO_FLEET: [&str; 4] =
    ["--fleet-endpoint", "tls/192.0.2.99:7447", "--fleet-tls", "/etc/trusswatch/fleet"];

#[test]
fn a_gateway_connects_to_the_router_of_another_name_with_the_certificate_of_the_fleet() {
    let structure = repository("configs/tower.toml").display().to_string();
    let access = |words: &[&str]| run(&[&["pki", "access", &structure], words].concat());
    let gateway = ["--gateway", "hub.fleet=operator.ada"];
    let printed = access(&[&gateway[..], &TO_FLEET].concat());
    printed.succeeds();
    for text in [
        "\"router.hub.fleet\"",
        "tls/192.0.2.99:7447#root_ca_certificate_file=/etc/trusswatch/fleet/authority.pem;",
        "connect_private_key_file=/etc/trusswatch/fleet/key.pem\"",
        "\"trusswatch/tower/*/command/*/ada\"",
    ] {
        assert!(printed.stdout.contains(text), "`{text}` is not in: {}", printed.stdout);
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("gateway.json5");
    fs::write(&file, &printed.stdout).unwrap();
    check(&file).succeeds();

    access(&gateway).fails(2, &["--fleet-endpoint", "--fleet-tls"]);
    access(&TO_FLEET).fails(2, &["--gateway"]);
    access(&[&["--gateway", "hub.tower"], &TO_FLEET[..]].concat())
        .fails(2, &["`tower` is the name of the structure"]);
    access(&[&["--gateway", "hub"], &TO_FLEET[..]].concat())
        .fails(2, &["invalid fleet router `hub`: expected `NAME.fleet`, e.g. `hub.fleet`"]);
    access(&[&["--mode", "peer"], &gateway[..], &TO_FLEET].concat())
        .fails(2, &["only a router can be a gateway"]);
}

#[test]
fn the_router_of_a_fleet_admits_gateways_by_the_names_of_their_structures() {
    let folder = library(&["operator.ben"]);
    let printed = pki(folder.path(), &["fleet", "fleet", "tower", "mast", "--observer", "wall"]);
    printed.succeeds();
    let names = ["router.tower", "router.mast", "operator.ben", "observer.wall"];
    for name in names.map(|name| format!("\"{name}.fleet\"")) {
        assert!(printed.stdout.contains(&name), "`{name}` is not in: {}", printed.stdout);
    }
    let file = folder.path().join("hub.json5");
    fs::write(&file, &printed.stdout).unwrap();
    check(&file).succeeds();
    pki(folder.path(), &["fleet", "tower", "tower"]).fails(2, &["give the fleet another name"]);
}

/// The common names that the rules of the tower admit.
fn admitted(library: &Path, more: &[&str]) -> Vec<String> {
    let structure = repository("configs/tower.toml").display().to_string();
    let printed = pki(library, &[&["access", &structure], more].concat());
    printed.succeeds();
    let (_, rules) = printed.stdout.split_once("\n{").unwrap();
    let rules: serde_json::Value = serde_json::from_str(&format!("{{{rules}")).unwrap();
    let subjects = rules["access_control"]["subjects"].as_array().unwrap().iter();
    let names = subjects.flat_map(|subject| subject["cert_common_names"].as_array().unwrap());
    names.map(|name| name.as_str().unwrap().to_owned()).collect()
}

#[test]
fn a_revoked_certificate_is_named_by_no_rule() {
    let folder = library(&["module1", "operator.ada", "router.top"]);
    let names = || admitted(folder.path(), &["--router", "top"]);
    let [second, plant] = ["module2.tower", "plant.tower"];
    let first = ["module1.tower", second, plant, "operator.ada.tower", "router.top.tower"];
    assert_eq!(names(), first);

    let revoked = pki(folder.path(), &["revoke", "module1"]);
    revoked.succeeds();
    for text in [
        "revoked/module1.pem: module1.tower, revoked",
        "/module1: module1~2.tower, until ",
        "trusswatch pki access STRUCTURE.toml --dir ",
        "systemctl restart trusswatch-router",
        "trusswatch pki install module1 && rm -r module1",
        "systemctl restart trusswatch-diagnoser@module1\n",
        "a process at 127.0.0.1 can still impersonate it",
    ] {
        assert!(revoked.stdout.contains(text), "`{text}` is not in: {}", revoked.stdout);
    }
    for holder in ["operator.ada", "operator.ada", "router.top", "plant"] {
        let outcome = pki(folder.path(), &["revoke", holder]);
        assert_eq!(outcome.code == Some(0), holder != "plant", "{}", outcome.stderr);
    }
    let next = ["module1~2.tower", second, plant, "operator.ada~3.tower", "router.top~2.tower"];
    assert_eq!(names(), next);
    pki(folder.path(), &["renew", "--all"]).succeeds();
    assert_eq!(names(), next);

    let listed = pki(folder.path(), &["list"]);
    listed.succeeds();
    for text in ["operator.ada~3.tower", "revoked: operator.ada~2.tower, until 20"] {
        assert!(listed.stdout.contains(text), "{}", listed.stdout);
    }
    let listed: serde_json::Value =
        serde_json::from_str(&pki(folder.path(), &["list", "--json"]).stdout).unwrap();
    assert_eq!(listed["certificates"][0]["common_name"], "module1~2.tower");
    assert_eq!(listed["revoked"].as_array().unwrap().len(), 4, "{listed:#}");
}

#[test]
fn a_removed_holder_issued_again_gets_a_new_name() {
    let folder = library(&["operator.ada", "module1"]);
    let ada = |name: &String| name.contains("ada");
    let left = pki(folder.path(), &["revoke", "operator.ada", "--remove"]);
    left.succeeds();
    assert!(!left.stdout.contains("operator.ada~2"), "{}", left.stdout);
    assert!(!folder.path().join("operator.ada").exists());
    assert!(!admitted(folder.path(), &[]).iter().any(ada));
    let again = pki(folder.path(), &["revoke", "operator.ada"]);
    again.fails(3, &["`operator.ada.tower` is revoked already", "issue `operator.ada` again"]);

    let back = pki(folder.path(), &["issue", "operator.ada"]);
    back.succeeds();
    assert!(back.stdout.contains("operator.ada~2.tower, until"), "{}", back.stdout);
    let names = admitted(folder.path(), &["--operator", "ada"]);
    assert_eq!(names.into_iter().filter(ada).collect::<Vec<_>>(), ["operator.ada~2.tower"]);

    // A module is one of the structure: it is admitted again as soon as it has another certificate.
    pki(folder.path(), &["revoke", "module1", "--remove"]).succeeds();
    assert!(admitted(folder.path(), &[]).contains(&"module1~2.tower".to_owned()));
}

#[test]
fn a_certificate_that_is_not_there_is_not_revoked() {
    let folder = library(&["module1"]);
    let unknown = pki(folder.path(), &["revoke", "modul1"]);
    unknown.fails(3, &["no certificate of `modul1`, only of `module1`"]);
    let outcome = pki(folder.path(), &["revoke", "module1~2"]);
    assert_eq!(outcome.code, Some(2));
    assert!(outcome.stderr.contains("expected MODULE, plant"), "{}", outcome.stderr);
    assert!(!folder.path().join("revoked").exists());
}

/// A revoked directory from a backup.
#[test]
fn a_revoked_certificate_that_is_put_back_is_found() {
    let folder = library(&["module1"]);
    let own = folder.path().join("module1/certificate.pem");
    let certificate = fs::read(&own).unwrap();
    pki(folder.path(), &["revoke", "module1"]).succeeds();
    fs::write(&own, certificate).unwrap();
    let listed = pki(folder.path(), &["list"]);
    assert_eq!(listed.code, Some(1));
    assert!(listed.stdout.contains("is revoked; remove"), "{}", listed.stdout);
    assert!(admitted(folder.path(), &[]).contains(&"module1~2.tower".to_owned()));
}

#[test]
fn a_later_certificate_is_as_good_as_the_first_one() {
    let folder = library(&["module1"]);
    pki(folder.path(), &["revoke", "module1", "--days", "20"]).succeeds();
    let own = folder.path().join("module1");
    let (_copy, file) = module1_with(&own, HERE);
    check(&file).succeeds();
    let identity = check(&own);
    assert!(identity.stdout.contains("certificate of `module1~2.tower`"), "{}", identity.stdout);
    let store = folder.path().join("credstore").display().to_string();
    let installed = run(&["pki", "install", &own.display().to_string(), "--store", &store]);
    installed.succeeds();
    let line = "module1~2.tower for trusswatch-diagnoser@module1.service, until ";
    assert!(installed.stdout.contains(line), "{}", installed.stdout);
}

#[test]
fn certificates_last_a_season_unless_specified_otherwise() {
    let folder = library(&["module1"]);
    let listed = pki(folder.path(), &["list", "--json"]).stdout;
    let listed: serde_json::Value = serde_json::from_str(&listed).unwrap();
    assert_eq!(listed["certificates"][0]["days_left"], 89, "{listed:#}");
}

/// A copy of module 1's configuration that shows itself by the certificates in this directory.
fn module1_with(identity: &Path, listen: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(repository("configs/module1.toml")).unwrap();
    let mut table: toml::Table = text.parse().unwrap();
    for key in ["structure", "thresholds", "reference"] {
        let path = repository("configs").join(table[key].as_str().unwrap());
        table.insert(key.into(), path.canonicalize().unwrap().display().to_string().into());
    }
    let network = table["network"].as_table_mut().unwrap();
    network.insert("tls".into(), identity.display().to_string().into());
    network.insert("listen".into(), vec![listen.to_owned()].into());
    network.insert("connect".into(), vec!["tls/127.0.0.1:7447"].into());
    let file = folder.path().join("module1.toml");
    fs::write(&file, table.to_string()).unwrap();
    (folder, file)
}

const HERE: &str = "tls/127.0.0.1:7448";

#[test]
fn a_configuration_is_checked_together_with_its_certificates() {
    let folder = library(&["module1", "module2"]);
    let own = folder.path().join("module1");
    let (_copy, file) = module1_with(&own, HERE);
    check(&file).succeeds();

    let (_copy, elsewhere) = module1_with(&own, "tls/192.0.2.9:7448");
    check(&elsewhere)
        .fails(3, &["certificate.pem", "does not name 192.0.2.9", "--address 192.0.2.9"]);
    let (_copy, plain) = module1_with(&own, "tcp/127.0.0.1:7448");
    check(&plain).fails(3, &["`tcp/127.0.0.1:7448` is not possible beside `tls`", HERE]);
    let (_copy, other) = module1_with(&folder.path().join("module2"), HERE);
    let wrong_name = ["module2/certificate.pem", "`module2.tower`", "this is `module1.tower`"];
    check(&other).fails(3, &wrong_name);
    let (_copy, missing) = module1_with(&folder.path().join("module7"), HERE);
    check(&missing).fails(3, &["module7/key.pem: cannot be read", "module7/authority.pem"]);

    let key = own.join("key.pem");
    fs::set_permissions(&key, fs::Permissions::from_mode(0o644)).unwrap();
    check(&file).fails(3, &["key.pem", "readable by other users (mode 0644)", "0600"]);
    fs::copy(folder.path().join("module2/key.pem"), &key).unwrap();
    fs::set_permissions(&key, fs::Permissions::from_mode(0o600)).unwrap();
    check(&file).fails(3, &["key.pem: does not belong to the certificate"]);
    let foreign = library(&["module1"]);
    fs::copy(foreign.path().join("module1/authority.pem"), own.join("authority.pem")).unwrap();
    check(&file).fails(3, &["certificate.pem: is not signed by the authority in"]);
}

/// Certificates that are not valid at this time of day, as a real issuer makes them.
#[test]
fn a_certificate_out_of_its_time_is_a_mistake() {
    let folder = library(&[]);
    let authority = ::pki::Authority::open(folder.path()).unwrap();
    let holder: ::pki::Holder = "module1".parse().unwrap();
    let now = ::pki::lifetime::now();
    let minutes = time::Duration::minutes;
    for (from, until, word) in [(-9, -1, "expired on"), (1, 9, "is not valid before")] {
        let place = folder.path().join(format!("until{until}"));
        let lifetime = ::pki::Lifetime { from: now + minutes(from), until: now + minutes(until) };
        let here = ["127.0.0.1".parse().unwrap()];
        authority.issue(&place, holder.clone(), &here, lifetime).unwrap();
        let (_copy, file) = module1_with(&place, HERE);
        check(&file).fails(3, &["certificate.pem", word]);
    }
}

#[test]
fn access_control_that_cannot_work_is_found_before_zenoh_finds_it() {
    let shipped = fs::read_to_string(repository("configs/zenoh/tower-router.json5")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("router.json5");
    let spoil = |from: &str, to: &str| {
        assert!(shipped.contains(from), "{from}");
        fs::write(&file, shipped.replacen(from, to, 1)).unwrap();
    };
    spoil("\"id\": \"command as ada\"", "\"id\": \"command as adam\"");
    check(&file).fails(3, &["router.json5", "names the rule `command as ada`, which is not there"]);
    spoil("\"enable_mtls\": true", "\"enable_mtls\": false");
    check(&file).fails(3, &["router.json5", "enable_mtls: true"]);
    spoil("\"ingress\"", "\"inward\"");
    check(&file).fails(3, &["router.json5", "inward"]);
    let arguments = ["router", "--zenoh", "configs/zenoh/client-tls.json5"];
    let outcome = trusswatch().args(arguments).current_dir(repository(".")).output().unwrap();
    let said = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert_eq!(outcome.status.code(), Some(3), "{said}");
    assert!(said.contains("client-tls.json5") && said.contains("needs \"router\""), "{said}");
}

#[test]
fn a_router_whose_certificate_does_not_name_its_address_does_not_start() {
    let folder = library(&["router.ground"]);
    let tls = folder.path().join("router.ground").display().to_string();
    let zenoh = repository("configs/zenoh/tower-router.json5").display().to_string();
    let words = ["router", "--zenoh", &zenoh, "--tls", &tls, "--listen", "tls/192.0.2.9:7447"];
    let outcome = trusswatch().args(words).output().unwrap();
    let said = String::from_utf8_lossy(&outcome.stderr).into_owned();
    assert_eq!(outcome.status.code(), Some(3), "{said}");
    assert!(said.contains("does not name 192.0.2.9"), "{said}");
}

#[test]
fn a_person_gets_a_file_for_a_browser_and_a_machine_does_not() {
    let folder = library(&["module1", "operator.ada", "observer.wall"]);
    let made = pki(folder.path(), &["p12", "operator.ada"]);
    made.succeeds();
    let (said, password) = made.stdout.trim().split_once(", password ").unwrap();
    assert!(said.ends_with("operator.ada.p12: operator.ada") && password.len() == 20, "{said}");
    let file = folder.path().join("operator.ada.p12");
    assert_eq!(file.metadata().unwrap().permissions().mode() & 0o777, 0o600);
    pki(folder.path(), &["p12", "operator.ada"]).fails(3, &["operator.ada.p12", "remove it first"]);
    let given = folder.path().join("password");
    fs::write(&given, "correct horse battery\n").unwrap();
    let given = given.display().to_string();
    let made = pki(folder.path(), &["p12", "observer.wall", "--password-file", &given]);
    made.succeeds();
    assert!(!made.stdout.contains("password "), "{}", made.stdout);
    fs::write(&given, "short\n").unwrap();
    let short = pki(folder.path(), &["p12", "observer.wall", "--password-file", &given]);
    short.fails(2, &["the password has 5 characters; use 12 or more"]);
    pki(folder.path(), &["p12", "module1"])
        .fails(2, &["module1.tower` is not an operator or observer"]);
    // A file beside the directories is no holder.
    pki(folder.path(), &["list"]).succeeds();
}
