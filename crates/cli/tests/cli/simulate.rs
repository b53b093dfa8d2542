//! `trusswatch simulate`: results are kept, gone on with and merged; a story is shown.

use std::fs;

use serde_json::Value;

use crate::binary::run;

#[test]
fn results_are_kept_gone_on_with_and_merged_and_a_story_is_shown() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name).display().to_string();
    let (kept, picture) = (at("results.jsonl"), at("story.svg"));
    let first = run(&["simulate", "--seeds", "0..2", "--results", &kept]);
    assert_eq!(first.code, Some(0), "{}{}", first.stdout, first.stderr);
    assert!(first.stdout.contains("2 worlds") && first.stdout.contains("no violation"));
    // A process that was killed leaves half a line.
    let torn = fs::read_to_string(&kept).unwrap() + "{\"v\":1,\"se";
    fs::write(&kept, &torn).unwrap();
    let merged = run(&["simulate", "--merge", &kept, "--json"]);
    let summary: Value = serde_json::from_str(&merged.stdout).unwrap();
    assert_eq!(
        (&summary["v"], &summary["seeds"], &summary["violations"]),
        (&1.into(), &2.into(), &0.into())
    );
    assert!(summary["module_hours"].as_f64().unwrap() > 0.0 && summary["unreached"].is_array());
    let more = run(&["simulate", "--seeds", "0..3", "--results", &kept, "--json"]);
    assert_eq!(more.code, Some(0), "{}", more.stderr);
    assert!(more.stderr.contains("1 of 1 worlds"), "{}", more.stderr);
    let shown = run(&["simulate", "--show", "1", "--svg", &picture]);
    assert_eq!(shown.code, Some(0), "{}", shown.stderr);
    assert!(shown.stdout.contains("module1 starts") && shown.stdout.contains("in_service"));
    assert!(fs::read_to_string(&picture).unwrap().starts_with("<svg"));
}

#[test]
fn seeds_that_are_no_range_and_files_that_are_no_results_are_refused() {
    for wrong in ["5", "5..5", "9..3", "a..b", "..3"] {
        let refused = run(&["simulate", "--seeds", wrong]);
        assert_eq!(refused.code, Some(2), "{wrong}");
        assert!(refused.stderr.contains("e.g. 0..1000"), "{}", refused.stderr);
    }
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("other.jsonl");
    fs::write(&file, "{\"v\":1}\n{}\n").unwrap();
    let refused = run(&["simulate", "--merge", file.to_str().unwrap()]);
    assert_eq!(refused.code, Some(3));
    assert!(refused.stderr.contains("other.jsonl:1: not a result"), "{}", refused.stderr);
}
