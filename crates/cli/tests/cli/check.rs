//! `trusswatch check` through the real binary.

use std::fs;

use crate::binary::{repository, run};

/// A copy of the shipped configurations to spoil.
fn copy_of_configs() -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for folder in ["", "tower", "thresholds", "references"] {
        fs::create_dir_all(copy.path().join(folder)).unwrap();
        for entry in fs::read_dir(repository("configs").join(folder)).unwrap() {
            let entry = entry.unwrap();
            if entry.path().is_file() {
                fs::copy(entry.path(), copy.path().join(folder).join(entry.file_name())).unwrap();
            }
        }
    }
    copy
}

fn spoil(file: &std::path::Path, from: &str, to: &str) {
    let text = fs::read_to_string(file).unwrap();
    assert!(text.contains(from));
    fs::write(file, text.replacen(from, to, 1)).unwrap();
}

fn shipped(name: &str) -> String {
    repository("configs").join(name).display().to_string()
}

#[test]
fn every_shipped_file_is_valid_and_called_what_it_is() {
    for (name, what) in [
        ("tower.toml", "structure `tower`, 52 nodes"),
        ("tower/module1.structure.toml", "structure `tower`"),
        ("plant.toml", "plant of `tower`"),
        ("module1.toml", "diagnoser of module `module1` of `tower`, 4 actuators, 8 gages"),
        ("thresholds/module2.toml", "12 thresholds of module `module2`"),
        ("zenoh/peer.json5", "Zenoh settings, mode peer"),
    ] {
        let outcome = run(&["check", &shipped(name)]);
        outcome.succeeds();
        let expected = format!("{name}: valid: {what}");
        assert!(outcome.stdout.contains(&expected), "{}", outcome.stdout);
    }
}

#[test]
fn every_mistake_in_every_file_is_reported_with_file_and_line() {
    let copy = copy_of_configs();
    let place = |name: &str| copy.path().join(name);
    spoil(&place("module1.toml"), "window = 12", "window = 0");
    spoil(&place("module1.toml"), "effect_ms", "effects");
    spoil(&place("plant.toml"), "structure = ", "colour = 1\nstructure = ");
    spoil(&place("thresholds/module2.toml"), "\"sensor/g5\" = ", "\"sensor/g5\" = -");
    let files = ["module1.toml", "plant.toml", "thresholds/module2.toml", "tower.toml", "no.toml"];
    let mut arguments = vec!["check".to_owned()];
    arguments.extend(files.iter().map(|file| place(file).display().to_string()));
    let outcome = run(&arguments);
    let said = [
        "module1.toml:",
        "effects",
        "plant.toml:",
        "`colour`",
        "sensor/g5",
        "no.toml: cannot be read",
    ];
    outcome.fails(3, &said);
    assert!(outcome.stdout.contains("tower.toml: valid"), "the valid one is still reported");
    assert!(outcome.stderr.lines().all(|line| !line.is_empty()));
}

#[test]
fn a_file_of_no_kind_is_answered_with_the_kinds() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("x.toml");
    fs::write(&file, "colour = 1\n").unwrap();
    let file = file.display().to_string();
    run(&["check", &file])
        .fails(3, &["x.toml: unknown kind of file", "`modules`", "`cylinders`", "`faults`"]);
    fs::write(folder.path().join("x.toml"), "a = 1\nb = [\n").unwrap();
    run(&["check", &file]).fails(3, &["x.toml:2"]);
    run(&["check"]).fails(2, &["<FILES>"]);
}
