//! `trusswatch study` through the real binary.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Stdio;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::Value;

use crate::binary::{Outcome, repository, run, trusswatch};

fn study(arguments: &[&str]) -> Outcome {
    run(&[&["study", "run", "--seed", "11"], arguments].concat())
}

fn object(outcome: &Outcome) -> Value {
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    serde_json::from_str(&outcome.stdout).unwrap()
}

#[test]
fn one_object_holds_the_results_whatever_the_number_of_jobs() {
    let with = |jobs| study(&["--scenarios", "7", "--nominal", "2", "--json", "--jobs", jobs]);
    let (one, three) = (with("1"), with("3"));
    assert_eq!(one.stdout, three.stdout);
    let object = object(&one);
    assert!(one.stdout.starts_with("{\n  \"v\": 1,\n"), "{}", one.stdout);
    assert_eq!((object["scenarios"].as_u64(), object["nominal_runs"].as_u64()), (Some(7), Some(2)));
    assert!(object["false_alarm_runs"].is_u64());
    let shares: f64 = ["tp", "fn", "fp", "tn"]
        .iter()
        .map(|cell| object["paper_table"][cell].as_f64().unwrap())
        .sum();
    assert!((shares - 1.0).abs() < 1e-9);
    assert!(object["exact_isolation"]["overall"].is_f64());
    // seven scenarios: one of each kind
    assert_eq!(object["exact_isolation"]["by_kind"].as_object().unwrap().len(), 7);
    // no setting could miss a valve that stands open
    assert_eq!(object["exact_isolation"]["by_kind"]["hard_over"], 1.0);
    let delay = &object["delay_ms"]["hard_over"];
    assert!(delay["median"].as_f64().is_some_and(|delay| delay <= 5.0));
    assert_eq!(delay["median"], delay["max"]);
    assert_eq!(delay["p95"], delay["max"]);
}

#[test]
fn a_campaign_is_resumed_and_extended() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let first = study(&["--scenarios", "2", "--out", out]);
    assert_eq!(first.code, Some(0), "{}", first.stderr);
    // as if it had been killed in the middle of a line
    let journal = directory.path().join("runs.jsonl");
    let whole = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, &whole[..whole.len() - 20]).unwrap();
    let extended = study(&["--scenarios", "4", "--nominal", "1", "--out", out, "--json"]);
    // one run of 15 s was done already
    assert!(extended.stderr.contains("60 of 60 s"), "{}", extended.stderr);
    let fresh = study(&["--scenarios", "4", "--nominal", "1", "--json"]);
    assert_eq!(extended.stdout, fresh.stdout);
    assert_eq!(fs::read_to_string(directory.path().join("summary.json")).unwrap(), fresh.stdout);
    let rows = |name| fs::read_to_string(directory.path().join(name)).unwrap().lines().count();
    assert_eq!((rows("scenarios.csv"), rows("nominal.csv")), (5, 2));
    // nothing is left to be done
    let again = study(&["--scenarios", "4", "--nominal", "1", "--out", out, "--json"]);
    assert_eq!((again.stdout, again.stderr.as_str()), (fresh.stdout, ""));
}

#[test]
fn another_campaign_s_directory_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    study(&["--scenarios", "1", "--out", out]);
    let with = |arguments: &[&str]| run(&[&["study", "run", "--out", out], arguments].concat());
    with(&["--seed", "12"]).fails(3, &["runs.jsonl:1", "seed 11", "12 is asked for", "--out"]);
    with(&["--seed", "11", "--mismatch", "0.1"]).fails(3, &["mismatch 0"]);
    with(&["--seed", "11", "--preset", "paper"]).fails(3, &["preset default"]);
}

#[test]
fn an_interrupted_campaign_prints_and_keeps_what_is_done() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let arguments =
        ["study", "run", "--scenarios", "100000", "--jobs", "1", "--json", "--out", out];
    let mut child = trusswatch();
    let child = child.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = child.spawn().unwrap();
    wait_for_a_run(directory.path());
    kill(Pid::from_raw(child.id().cast_signed()), Signal::SIGINT).unwrap();
    let mut stdout = String::new();
    child.stdout.take().unwrap().read_to_string(&mut stdout).unwrap();
    let stderr = BufReader::new(child.stderr.take().unwrap()).lines();
    let stderr: Vec<String> = stderr.map(Result::unwrap).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(stderr.iter().any(|line| line.contains("the same command resumes")), "{stderr:?}");
    let object: Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(object["complete"], false);
    let done = object["scenarios"].as_u64().unwrap();
    let kept = fs::read_to_string(directory.path().join("runs.jsonl")).unwrap();
    assert_eq!(kept.lines().count() as u64, 1 + done);
}

/// Until the journal holds a run; the test harness limits how long.
fn wait_for_a_run(directory: &Path) {
    let journal = directory.join("runs.jsonl");
    while fs::read_to_string(&journal).map_or(0, |text| text.lines().count()) < 2 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    study(&["--mismatch", "1.5"]).fails(2, &["`--mismatch` is 1.5", "use a share"]);
    let config = |name: &str| repository("configs").join(name).display().to_string();
    let (plant, module) = (config("plant.toml"), config("module2.toml"));
    let swapped =
        study(&["--plant", &plant, "--config", &module, "--config", &config("module1.toml")]);
    swapped.fails(3, &["module2, module1", "give them in this order"]);
}

#[test]
fn the_four_combinations_are_printed_side_by_side() {
    // own modules that need no calibration for the tracking residual, and few scenarios
    let outcome = run(&["study", "compare", "--seed", "11", "--scenarios", "7"]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    for text in ["only actuators explain", "first change names the fault", "demand", "tracking"] {
        assert!(outcome.stdout.contains(text), "{}", outcome.stdout);
    }
}

#[test]
fn recordings_are_left_with_the_truth_beside_them() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    let amount = ["--scenarios", "1", "--nominal", "1"];
    let done = run(&[&["study", "export", out, "--seed", "11", "--json"], &amount[..]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let written: Value = serde_json::from_str(&done.stdout).unwrap();
    assert_eq!((&written["scenarios"], &written["nominal_runs"]), (&1.into(), &1.into()));
    let lines =
        |name: &str| fs::read_to_string(directory.path().join(name)).unwrap().lines().count();
    assert_eq!(lines("truth.csv"), 3);
    assert_eq!(lines("changes.csv") as u64, 1 + written["changes"].as_u64().unwrap());
    assert_eq!(lines("scenario-00000.csv"), lines("nominal-00000.csv"));
}

#[test]
fn conditions_are_one_object_whatever_the_number_of_jobs() {
    let with = |jobs| {
        let asked = ["--plants", "1", "--cases", "3", "--seed", "5", "--situation", "in_a_gap"];
        run(&[&["study", "conditions"], &asked[..], &["--json", "--jobs", jobs]].concat())
    };
    let (one, two) = (with("1"), with("2"));
    assert_eq!(one.stdout, two.stdout);
    let object = object(&one);
    assert!(one.stdout.starts_with("{\n  \"v\": 1,\n"), "{}", one.stdout);
    assert_eq!((&object["weather"], &object["complete"]), (&"alike".into(), &true.into()));
    assert_eq!(object["plants"][0]["references"].as_array().unwrap().len(), 2);
    let all = &object["all"];
    assert_eq!((all["cases"].as_u64(), all["faults"].as_u64()), (Some(3), Some(3)));
    assert_eq!((&all["normal"], &all["healthy_named"]), (&0.into(), &0.into()));
    assert_eq!(object["situations"][0]["situation"], "in_a_gap");
    assert_eq!(object["cases"].as_array().unwrap().len(), 3);
}

#[test]
fn one_case_is_shown_as_its_campaign_has_it() {
    let outcome = run(&[
        "study",
        "conditions",
        "--weather",
        "none",
        "--cases",
        "7",
        "--seed",
        "5",
        "--from",
        "8",
        "--show",
    ]);
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    let said = &outcome.stdout;
    assert!(said.starts_with("case 8, from_the_start, plant 1, seed "), "{said}");
    for text in ["from step 0: ", "verdict", "at the end ", ": Named, named at step "] {
        assert!(said.contains(text), "`{text}` is not in {said}");
    }
}

#[test]
fn conditions_that_cannot_be_meant_are_refused() {
    let plant = repository("configs/plant.toml").display().to_string();
    for (arguments, said) in [
        (vec!["--mismatch", "1"], "`--mismatch` is 1; use a share from 0 to 0.9"),
        (vec!["--bias-microstrain", "0"], "`--bias-microstrain` is 0; use a number from 0.1"),
        (vec!["--situation", "asleep"], "from_the_start"),
        (vec!["--weather", "none", "--plant", &plant], "--weather"),
        (vec!["--config", "x.toml"], "--plant"),
        (vec!["--show", "--json"], "--json"),
    ] {
        run(&[&["study", "conditions"], &arguments[..]].concat()).fails(2, &[said]);
    }
}

#[test]
fn limits_are_one_object_and_a_figure() {
    let directory = tempfile::tempdir().unwrap();
    let svg = directory.path().join("limits.svg");
    let asked = ["--plants", "1", "--runs", "1", "--seed", "5", "--weather", "alike"];
    let out = ["--json", "--svg", svg.to_str().unwrap()];
    let outcome = run(&[&["study", "limits"], &asked[..], &out[..]].concat());
    let (object, text) = (object(&outcome), outcome.stdout);
    let svg = fs::read_to_string(svg).unwrap();
    assert!(text.starts_with("{\n  \"v\": 1,\n"), "{text}");
    assert!(svg.starts_with("<svg") && svg.contains("reference, alike"), "{svg}");
    assert_eq!((&object["seed"], &object["runs"]), (&5.into(), &1.into()));
    let weathers = object["weathers"].as_array().unwrap();
    assert_eq!((weathers.len(), &weathers[0]["weather"]), (1, &"alike".into()));
    // two detectors, three kinds of fault
    let limits = weathers[0]["limits"].as_array().unwrap();
    assert_eq!(limits.len(), 6);
    for curve in limits {
        let largest = curve["points"].as_array().unwrap().last().unwrap();
        assert_eq!((&largest["runs"], &largest["found"]["count"]), (&1.into(), &1.into()));
        assert!(curve["found"][0]["within_s"].as_f64().is_some_and(|time| time > 0.0));
    }
}

#[test]
fn limits_that_cannot_be_meant_are_refused() {
    for (arguments, said) in [
        (["--mismatch", "1"], "`--mismatch` is 1; use a share from 0 to 0.9"),
        (["--weather", "fair"], "alike"),
        (["--runs", "0"], "--runs"),
    ] {
        run(&[&["study", "limits"], &arguments[..]].concat()).fails(2, &[said]);
    }
}

#[test]
fn identified_faults_are_one_object_and_a_figure_the_same_for_any_number_of_jobs() {
    let directory = tempfile::tempdir().unwrap();
    let svg = directory.path().join("identified.svg");
    let asked = ["--plants", "1", "--cases", "4", "--seed", "5", "--situation", "alone", "--json"];
    let of_jobs = |jobs: &str, kind: &str| {
        let more = ["--jobs", jobs, "--kind", kind, "--svg", svg.to_str().unwrap()];
        run(&[&["study", "identify"], &asked[..], &more[..]].concat())
    };
    let outcome = of_jobs("2", "zero_output");
    let object = object(&outcome);
    assert_eq!(outcome.stdout, of_jobs("1", "zero_output").stdout);
    let row = &object["in_the_end"]["zero_output"];
    assert_eq!((&row["cases"], &object["complete"]), (&4.into(), &true.into()));
    assert_eq!(object["faults"].as_array().unwrap().len(), 4);
    of_jobs("2", "bias");
    let drawn = fs::read_to_string(&svg).unwrap();
    assert!(drawn.starts_with("<svg") && drawn.contains("after 0.2 s"), "{drawn}");
}

#[test]
fn faults_to_identify_that_cannot_be_meant_are_refused() {
    for (arguments, said) in [
        (["--in-limits", "0"], "`--in-limits` is 0; use a number from 0.01 to 1000"),
        (["--kind", "rust"], "hard_over"),
        (["--situation", "asleep"], "after_effects"),
        (["--weather", "fair"], "alike"),
    ] {
        run(&[&["study", "identify"], &arguments[..]].concat()).fails(2, &[said]);
    }
}
