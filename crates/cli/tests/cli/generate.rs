//! `trusswatch generate`.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::binary::run;

fn files(directory: &Path) -> BTreeSet<String> {
    let entries = fs::read_dir(directory).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn every_program_and_subcommand_has_a_manual_page_with_its_options() {
    let directory = tempfile::tempdir().unwrap();
    let man = directory.path().join("man");
    run(&["generate", "man", man.to_str().unwrap()]).succeeds();
    let files = files(&man);
    let expected = [
        "trusswatch.1",
        "trusswatch-check.1",
        "trusswatch-fault.1",
        "trusswatch-fault-show.1",
        "trusswatch-faults.1",
        "trusswatch-diagnoser.1",
        "trusswatch-diagnoser-run.1",
        "trusswatch-plant.1",
        "trusswatch-plant-run.1",
    ];
    for page in expected {
        assert!(files.contains(page), "{page} is not in {files:?}");
    }
    assert!(
        !files.iter().any(|page| page.contains("help") || page.contains("generate")),
        "{files:?}"
    );
    let page = fs::read_to_string(man.join("trusswatch-diagnoser-run.1")).unwrap();
    assert!(page.contains("\\-\\-state\\-dir") && page.contains("Exit codes"), "{page}");
}

#[test]
fn every_program_has_completions_for_every_shell() {
    let directory = tempfile::tempdir().unwrap();
    run(&["generate", "completions", directory.path().to_str().unwrap()]).succeeds();
    let expected = [
        ("bash", ["trusswatch.bash", "trusswatch-diagnoser.bash", "trusswatch-plant.bash"]),
        ("fish", ["trusswatch.fish", "trusswatch-diagnoser.fish", "trusswatch-plant.fish"]),
        ("zsh", ["_trusswatch", "_trusswatch-diagnoser", "_trusswatch-plant"]),
    ];
    for (shell, names) in expected {
        let folder = directory.path().join(shell);
        assert_eq!(files(&folder), names.map(str::to_owned).into(), "{shell}");
        let text = fs::read_to_string(folder.join(names[0])).unwrap();
        assert!(text.contains("faults") && text.contains("connect"), "{shell}");
    }
}

#[test]
fn a_directory_that_cannot_be_made_is_named() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let place = file.path().join("man");
    run(&["generate", "man", place.to_str().unwrap()]).fails(1, &[place.to_str().unwrap()]);
}
