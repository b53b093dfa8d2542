//! `trusswatch detect --config`: a recording of a run gives the very changes of the run.

use std::collections::BTreeSet;
use std::path::Path;

use crate::binary::{Outcome, repository, run, run_with};
use daemon::config::{PlantFlags, load_diagnoser, load_plant};
use serde_json::Value;
use study::scenarios::{ScenarioCampaign, ScenarioRanges};
use study::{System, export};

fn shipped(name: &str) -> String {
    repository("configs").join(name).display().to_string()
}

/// The shipped tower in short runs: 3 s without and 2 s with a fault.
fn campaign() -> ScenarioCampaign {
    let plant = load_plant(Path::new(&shipped("plant.toml")), &PlantFlags::default()).unwrap();
    let setup = |name| load_diagnoser(Path::new(&shipped(name))).unwrap().module_setup();
    let system = System {
        name: String::new(),
        structure: plant.structure,
        parameters: plant.parameters,
        setups: vec![setup("module1.toml"), setup("module2.toml")],
        mismatch: 0.1,
        controllers: Vec::new(),
        seed: 7,
    };
    let ranges = ScenarioRanges { length_s: 5.0, onset_s: [3.0, 3.2], ..ScenarioRanges::default() };
    ScenarioCampaign { system, ranges, scenarios: 7, nominal: 0 }
}

fn modules(names: &[&str]) -> Vec<String> {
    names.iter().flat_map(|name| ["--config".to_owned(), shipped(name)]).collect()
}

fn detect(input: &str, modules: &[String], more: &[&str]) -> Outcome {
    let mut arguments = vec!["detect", "-"];
    arguments.extend(modules.iter().map(String::as_str));
    arguments.extend(more);
    run_with(input, &arguments)
}

/// Channel and row of every change.
fn changes(outcome: &Outcome) -> BTreeSet<(String, u64)> {
    outcome.succeeds();
    let mut active = BTreeSet::new();
    let mut begun = BTreeSet::new();
    for line in outcome.stdout.lines() {
        let row: Value = serde_json::from_str(line).unwrap();
        for (channel, reading) in row["channels"].as_object().unwrap() {
            if reading["change"] == false {
                active.remove(channel);
            } else if active.insert(channel.clone()) {
                begun.insert((channel.clone(), row["index"].as_u64().unwrap()));
            }
        }
    }
    begun
}

#[test]
fn a_recording_gives_the_very_changes_of_its_run() {
    let campaign = campaign();
    let both = modules(&["module1.toml", "module2.toml"]);
    let mut count = 0;
    for number in 0..7 {
        let mut table = Vec::new();
        let (record, exported) = export(&campaign, number, false, &mut table).unwrap();
        let table = String::from_utf8(table).unwrap();
        let expected: BTreeSet<_> =
            exported.iter().map(|c| (c.component.to_string(), c.step.0)).collect();
        count += expected.len();
        assert_eq!(changes(&detect(&table, &both, &["--json"])), expected);
        // a module alone, and a channel alone, are watched no differently
        let alone = detect(&table, &modules(&["module2.toml"]), &["--json"]);
        let of = |name: &str| -> BTreeSet<_> {
            expected.iter().filter(|(channel, _)| channel.starts_with(name)).cloned().collect()
        };
        assert_eq!(changes(&alone), of("module2/"));
        let faulty = record.injection.unwrap().component.to_string();
        let one = detect(&table, &both, &["--json", "--columns", &faulty]);
        assert_eq!(changes(&one), of(&faulty));
    }
    assert!(count >= 7, "only {count} changes");
}

#[test]
fn the_summary_names_the_modules() {
    let mut table = Vec::new();
    let mut campaign = campaign();
    campaign.ranges.length_s = 0.1;
    campaign.ranges.onset_s = [0.05, 0.06];
    export(&campaign, 0, false, &mut table).unwrap();
    let table = String::from_utf8(table).unwrap();
    let both = modules(&["module1.toml", "module2.toml"]);
    let outcome = detect(&table, &both, &[]);
    outcome.succeeds();
    assert!(outcome.stdout.contains("100 rows, 24 channels"), "{}", outcome.stdout);
    let said = "settings and thresholds of `module1`, `module2`";
    assert!(outcome.stdout.contains(said), "{}", outcome.stdout);
}

#[test]
fn a_column_that_is_missing_is_named() {
    let one = modules(&["module1.toml"]);
    let table = "step,module1/actuator/a1\n0,1\n";
    let hint =
        "`trusswatch export FILE.mcap --csv DIR --residuals` writes the residuals of a recording";
    detect(table, &one, &[]).fails(3, &["missing column `module1/actuator/a2/residual`", hint]);
    // As `trusswatch export` writes without the flag.
    let exported = "step,module1/actuator/a1/demand_n,module1/sensor/g1/elongation_m\n0,1,2\n";
    detect(exported, &one, &[]).fails(3, &["module1/actuator/a1/residual`", hint]);
    let outcome = detect(table, &one, &["--columns", "step"]);
    outcome.fails(2, &["no module given has a component `step`", "`module1/sensor/g8`"]);
    let rows: String = (0..100).map(|step| format!("{step},{}\n", step % 7)).collect();
    let table = "step,module1/actuator/a1\n".to_owned() + &rows;
    detect(&table, &one, &["--columns", "module1/actuator/a1"]).succeeds();
}

#[test]
fn a_gap_is_no_change_and_steps_must_rise() {
    let one = modules(&["module1.toml"]);
    let noise = |step: u64| 40.0 * (12.9898 * (step * 7919) as f64).sin();
    let table = |gap: u64, shift: f64| -> String {
        let row = |k: u64| {
            let (gap, shift) = if k < 3000 { (0, 0.0) } else { (gap, shift) };
            format!("{},{}\n", k + gap, noise(k) + shift)
        };
        "step,module1/actuator/a1\n".to_owned() + &(0..6000).map(row).collect::<String>()
    };
    let only = ["--columns", "module1/actuator/a1", "--json"];
    assert!(!changes(&detect(&table(0, 5000.0), &one, &only)).is_empty(), "a jump is a change");
    let after_a_night = changes(&detect(&table(50_000_000, 5000.0), &one, &only));
    assert!(after_a_night.is_empty(), "{after_a_night:?}");
    let back = table(0, 0.0) + "17,0\n";
    detect(&back, &one, &only)
        .fails(3, &["line 6002: step 17 after step 5999; give each step once"]);
}

#[test]
fn modules_leave_no_room_for_settings_of_one_s_own() {
    for flag in [
        "--window",
        "--lag",
        "--interval",
        "--prior-scatter",
        "--threshold",
        "--warm-up",
        "--quiet-steps",
    ] {
        let module = shipped("module1.toml");
        run(&["detect", "-", "--config", &module, flag, "2"]).fails(2, &[flag, "--config"]);
    }
    let twice = modules(&["module1.toml", "module1.toml"]);
    detect("x\n1\n", &twice, &[]).fails(2, &["`module1` is given twice"]);
    let none = ["detect", "-", "--config", "no-such-file.toml"];
    run(&none).fails(3, &["no-such-file.toml"]);
}
