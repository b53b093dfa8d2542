//! `trusswatch study` through the real binary.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::Stdio;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use serde_json::{Value, json};

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
    let asked = &object["campaign"];
    assert_eq!((&asked["name"], &asked["seed"]), (&"run".into(), &11.into()));
    assert_eq!((&asked["mismatch"], &asked["weather"]), (&0.0.into(), &json!(["none"])));
    let (all, nominal) = (&object["all"], &object["nominal"]);
    assert_eq!((&all["cases"], &nominal["cases"]), (&7.into(), &2.into()));
    assert!(nominal["false_alarms"].is_u64() && all["exact_95"].is_array());
    let shares: f64 =
        ["tp", "fn", "fp", "tn"].iter().map(|cell| object["samples"][cell].as_f64().unwrap()).sum();
    assert!((shares - 1.0).abs() < 1e-9);
    // seven scenarios: one of each kind
    assert_eq!(object["kinds"].as_object().unwrap().len(), 7);
    // no setting could miss a valve that stands open
    assert_eq!(object["kinds"]["hard_over"]["exact"], 1);
    let delay = &object["kinds"]["hard_over"]["delay_ms"];
    assert!(delay["median"].as_f64().is_some_and(|delay| delay <= 5.0));
    assert_eq!(delay["median"], delay["max"]);
    assert_eq!(delay["p95"], delay["max"]);
}

/// Every file of a campaign's directory by its name.
fn files(directory: &Path) -> BTreeMap<OsString, String> {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    entries.map(|of| (of.file_name(), fs::read_to_string(of.path()).unwrap())).collect()
}

#[test]
fn a_campaign_that_was_killed_is_resumed_and_leaves_what_one_run_leaves() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let with = |out: &str| {
        let out = at(out).display().to_string();
        study(&["--scenarios", "4", "--nominal", "1", "--json", "--out", &out])
    };
    let whole = with("whole");
    // as if it had been killed in the middle of the third case's line
    let journal = fs::read_to_string(at("whole").join("cases.jsonl")).unwrap();
    let end = journal.lines().take(3).map(|line| line.len() + 1).sum::<usize>() + 20;
    fs::create_dir(at("killed")).unwrap();
    fs::write(at("killed").join("cases.jsonl"), &journal[..end]).unwrap();
    let resumed = with("killed");
    assert!(resumed.stderr.contains("3 of 3 runs"), "{}", resumed.stderr);
    assert_eq!(resumed.stdout, whole.stdout);
    assert_eq!(files(&at("killed")), files(&at("whole")));
    let kept = files(&at("whole"));
    assert_eq!(kept[OsStr::new("summary.json")], whole.stdout);
    assert_eq!(kept[OsStr::new("cases.csv")].lines().count(), 6);
    // nothing is left to be done
    let again = with("killed");
    assert_eq!((again.stdout, again.stderr.as_str()), (whole.stdout, ""));
}

/// Runs a campaign whole, and in so many processes at a time, whose shards are merged.
fn shards_are_one_run(campaign: &[&str], of: u64) {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name).display().to_string();
    let spawn = |out: &str, more: &[&str]| {
        let mut command = trusswatch();
        command.args(["study"]).args(campaign).args(["--jobs", "1", "--out", out]).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let shards = (0..of).map(|number| {
        let shard = format!("{number}/{of}");
        (at(&number.to_string()), spawn(&at(&number.to_string()), &["--shard", &shard]))
    });
    let shards: Vec<_> = shards.collect();
    let one = spawn(&at("one"), &[]).wait_with_output().unwrap();
    assert!(one.status.success(), "{}", String::from_utf8_lossy(&one.stderr));
    let mut merge = vec!["study".to_owned(), "merge".to_owned()];
    for (place, shard) in shards {
        let shard = shard.wait_with_output().unwrap();
        assert!(shard.status.success(), "{}", String::from_utf8_lossy(&shard.stderr));
        merge.push(place);
    }
    let arguments = |more: &[String]| [&merge[..], more].concat();
    let run =
        |arguments: Vec<String>| run(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let merged = run(arguments(&["--out".to_owned(), at("merged")]));
    assert_eq!(merged.code, Some(0), "{}", merged.stderr);
    assert_eq!(merged.stdout.as_bytes(), one.stdout);
    assert_eq!(files(Path::new(&at("merged"))), files(Path::new(&at("one"))));
    let mut incomplete = merge.clone();
    incomplete.pop();
    run(incomplete).fails(3, &["cases are missing, the first of them"]);
}

// The engine's tests compare shards with one run more closely; here the request is told by the journal again.
#[test]
fn shards_of_scenarios_are_one_run() {
    shards_are_one_run(&["run", "--seed", "11", "--scenarios", "2", "--nominal", "1"], 2);
}

#[test]
#[ignore = "takes minutes: profile nightly"]
fn shards_of_conditions_are_one_run() {
    let asked = ["conditions", "--plants", "2", "--cases", "1", "--situations", "from_the_start"];
    shards_are_one_run(&asked, 2);
}

#[test]
fn shards_of_histories_are_one_run() {
    let asked = ["conditions", "--situations", "histories", "--cases", "4", "--seed", "3"];
    shards_are_one_run(&asked, 2);
}

#[test]
#[ignore = "takes minutes: profile nightly"]
fn shards_of_limits_are_one_run() {
    shards_are_one_run(&["limits", "--isolation", "--runs", "1", "--seed", "4"], 3);
}

#[test]
fn another_campaign_s_directory_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().to_str().unwrap();
    study(&["--scenarios", "1", "--out", out]);
    let with = |arguments: &[&str]| {
        run(&[&["study", "run", "--scenarios", "1", "--out", out], arguments].concat())
    };
    with(&["--seed", "12"]).fails(3, &["cases.jsonl", "seed 11, not 12", "--out"]);
    with(&["--seed", "11", "--mismatch", "0.1"]).fails(3, &["mismatch 0.0, not 0.1"]);
    with(&["--seed", "11", "--preset", "paper"]).fails(3, &["preset \"default\", not \"paper\""]);
    with(&["--seed", "11", "--shard", "1/2"]).fails(3, &["shard none, not 1/2"]);
    let other = run(&["study", "identify", "--out", out]);
    other.fails(3, &["holds another request: "]);
}

#[test]
fn what_shards_and_cases_cannot_be_is_refused() {
    study(&["--shard", "2/2", "--out", "x"]).fails(2, &["use K/N with K from 0 to N-1"]);
    study(&["--shard", "1/2"]).fails(2, &["--out"]);
    study(&["--show", "1", "--json"]).fails(2, &["--json"]);
    study(&["--scenarios", "3", "--show", "3"]).fails(2, &["`--show` is 3; the campaign has 3"]);
    run(&["study", "merge", "nowhere"]).fails(3, &["nowhere/cases.jsonl"]);
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
    let done = object["all"]["cases"].as_u64().unwrap();
    let kept = fs::read_to_string(directory.path().join("cases.jsonl")).unwrap();
    assert_eq!(kept.lines().count() as u64, 1 + done);
}

/// Until the journal holds a run; the test harness limits how long.
fn wait_for_a_run(directory: &Path) {
    let journal = directory.join("cases.jsonl");
    while fs::read_to_string(&journal).map_or(0, |text| text.lines().count()) < 2 {
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
}

#[test]
fn what_cannot_be_meant_is_refused() {
    study(&["--mismatch", "1.5"]).fails(2, &["--mismatch", "use a number from 0 to 0.9"]);
    study(&["--weather", "none,alike"]).fails(2, &["`--weather` names several"]);
    let config = |name: &str| repository("configs").join(name).display().to_string();
    let (plant, module) = (config("plant.toml"), config("module2.toml"));
    let swapped =
        study(&["--plant", &plant, "--config", &module, "--config", &config("module1.toml")]);
    swapped.fails(3, &["module2, module1", "give them in this order"]);
    let often = run(&["study", "rivals", "--per-hour", "49"]);
    often.fails(2, &["`--per-hour` is 49", "counts one alarm at most", "at most 48"]);
}

#[test]
fn the_four_combinations_are_printed_side_by_side() {
    // own modules that need no calibration for the tracking residual, and few scenarios
    let outcome = run(&["study", "compare", "--seed", "11", "--scenarios", "2"]);
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
    let truth = fs::read_to_string(directory.path().join("truth.csv")).unwrap();
    let truth: Vec<Vec<&str>> = truth.lines().map(|line| line.split(',').collect()).collect();
    let [heading, scenario, nominal] = &truth[..] else { panic!("{truth:?}") };
    let columns = ["file", "number", "seed", "component", "kind", "parameters", "onset"];
    assert_eq!(heading[..], columns);
    assert_eq!((scenario[0], scenario[4]), ("scenario-00000.csv", "internal_leakage"));
    assert!(scenario[5].starts_with("area_m2="), "{scenario:?}");
    assert_eq!((nominal[0], nominal[1], &nominal[3..]), ("nominal-00000.csv", "0", &[""; 4][..]));
    assert_eq!(lines("changes.csv") as u64, 1 + written["changes"].as_u64().unwrap());
    assert_eq!(lines("scenario-00000.csv"), lines("nominal-00000.csv"));
}

#[test]
fn conditions_are_one_object() {
    let asked = ["--plants", "1", "--cases", "3", "--seed", "5", "--situations", "in_a_gap"];
    let outcome = run(&[&["study", "conditions", "--json"], &asked[..]].concat());
    let object = object(&outcome);
    assert!(outcome.stdout.starts_with("{\n  \"v\": 1,\n"), "{}", outcome.stdout);
    let asked = &object["campaign"];
    assert_eq!((&asked["weather"], &object["complete"]), (&json!(["alike"]), &true.into()));
    assert_eq!(object["plants"][0]["references"].as_array().unwrap().len(), 2);
    let all = &object["all"];
    assert_eq!((all["cases"].as_u64(), all["faults"].as_u64()), (Some(3), Some(3)));
    assert_eq!((&all["normal"], &all["healthy_named"]), (&0.into(), &0.into()));
    assert_eq!(object["situations"]["in_a_gap"], object["all"]);
}

/// What `--show` says of a case.
fn shown(campaign: &str, case: &str) -> String {
    let arguments: Vec<&str> = ["study"].into_iter().chain(campaign.split(' ')).collect();
    let outcome = run(&[&arguments[..], &["--show", case]].concat());
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    outcome.stdout
}

#[test]
fn a_case_of_every_campaign_is_explained() {
    for (campaign, case, said) in [
        ("run --seed 11", "3", &["number 3 of seed 11", "INJECT", "FAULT", "exact: "][..]),
        (
            "conditions --weather none --cases 7 --seed 5",
            "8",
            &["number 8 of seed 5, from_the_start: ", "INJECT", "condition", "was named"],
        ),
        (
            "conditions --situations histories --seed 3",
            "1",
            &["number 1 of seed 3, intermittent: ", "INJECT", "REPAIR", "outcome"],
        ),
        ("limits --isolation --seed 4", "400", &["isolation, ", "INJECT", "outcome"]),
        ("identify --kind bias --plants 1", "0", &["alone, ", "kind       module", "bias"]),
    ] {
        let text = shown(campaign, case);
        assert!(said.iter().all(|said| text.contains(said)), "{said:?}: {text}");
    }
}

#[test]
fn conditions_that_cannot_be_meant_are_refused() {
    let plant = repository("configs/plant.toml").display().to_string();
    for (arguments, said) in [
        (vec!["--mismatch", "1"], "use a number from 0 to 0.9"),
        (vec!["--bias-microstrain", "0"], "use a number from 0.1 to 10000"),
        (vec!["--situations", "asleep"], "from_the_start"),
        (vec!["--weather", "none", "--plant", &plant], "--weather"),
        (vec!["--config", "x.toml"], "--plant"),
    ] {
        run(&[&["study", "conditions"], &arguments[..]].concat()).fails(2, &[said]);
    }
}

#[test]
fn limits_are_one_object_and_a_figure() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().to_str().unwrap();
    let asked = ["--plants", "1", "--runs", "1", "--seed", "5", "--weather", "alike"];
    let outcome = run(&[&["study", "limits"], &asked[..], &["--json", "--out", place]].concat());
    let (object, text) = (object(&outcome), outcome.stdout);
    let svg = fs::read_to_string(directory.path().join("limits.svg")).unwrap();
    assert!(text.starts_with("{\n  \"v\": 1,\n"), "{text}");
    assert!(svg.starts_with("<svg") && svg.contains("reference, alike"), "{svg}");
    assert_eq!((&object["campaign"]["seed"], &object["campaign"]["runs"]), (&5.into(), &1.into()));
    // two detectors, three kinds of fault
    let curves = object["curves"].as_array().unwrap();
    assert_eq!(curves.len(), 6);
    for curve in curves {
        assert_eq!(curve["weather"], "alike");
        let largest = curve["points"].as_array().unwrap().last().unwrap();
        assert_eq!((&largest["runs"], &largest["found"]["count"]), (&1.into(), &1.into()));
        assert!(curve["found"][0]["within_s"].as_f64().is_some_and(|time| time > 0.0));
    }
}

#[test]
fn limits_that_cannot_be_meant_are_refused() {
    for (arguments, said) in [
        (["--mismatch", "1"], "use a number from 0 to 0.9"),
        (["--weather", "fair"], "alike"),
        (["--runs", "0"], "--runs"),
    ] {
        run(&[&["study", "limits"], &arguments[..]].concat()).fails(2, &[said]);
    }
}

#[test]
fn identified_faults_are_one_object_and_a_figure() {
    let directory = tempfile::tempdir().unwrap();
    let place = directory.path().to_str().unwrap();
    let identify = |more: &[&str]| {
        let asked = ["--plants", "1", "--cases", "4", "--seed", "5", "--situation", "alone"];
        object(&run(&[&["study", "identify", "--json"], &asked[..], more].concat()))
    };
    let known = identify(&["--kind", "zero_output", "--out", place]);
    let row = &known["in_the_end"]["zero_output"];
    assert_eq!((&row["cases"], &known["complete"]), (&4.into(), &true.into()));
    // Without its hypothesis a stuck reading is right as none of the known kinds.
    let left_out = &identify(&["--kind", "stuck", "--without", "stuck"])["in_the_end"];
    assert_eq!(left_out["none_of_these"]["cases"], 4, "{left_out}");
    assert!(left_out["stuck"].is_null(), "{left_out}");
    let drawn = fs::read_to_string(directory.path().join("identified.svg")).unwrap();
    assert!(drawn.starts_with("<svg") && drawn.contains("after 0.2 s"), "{drawn}");
}

#[test]
fn faults_to_identify_that_cannot_be_meant_are_refused() {
    for (arguments, said) in [
        (["--in-limits", "0"], "use a number from 0.01 to 1000"),
        (["--kind", "rust"], "hard_over"),
        (["--without", "none_of_these"], "hard_over"),
        (["--situation", "asleep"], "after_effects"),
        (["--weather", "fair"], "alike"),
    ] {
        run(&[&["study", "identify"], &arguments[..]].concat()).fails(2, &[said]);
    }
    let both = ["study", "tolerance", "--kind", "hard_over", "--cylinders"];
    run(&both).fails(2, &["--kind", "--cylinders"]);
}
