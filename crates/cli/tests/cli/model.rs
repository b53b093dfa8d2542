//! `trusswatch model` through the real binary.

use crate::binary::{repository, run};
use serde_json::Value;

fn tower() -> String {
    repository("configs/tower.toml").display().to_string()
}

#[test]
fn the_summary_shows_the_tower() {
    let outcome = run(&["model", &tower()]);
    outcome.succeeds();
    for text in ["52", "152", "144 translations", "1.70 Hz", "module4"] {
        assert!(outcome.stdout.contains(text), "`{text}` is not in: {}", outcome.stdout);
    }
}

#[test]
fn a_module_is_chosen_by_name_or_by_number() {
    let named = run(&["model", &tower(), "--module", "module2"]);
    named.succeeds();
    assert_eq!(named.stdout, run(&["model", &tower(), "--module", "2"]).stdout);
    // the rest holds it, so that it predicts its own cylinders and no others
    let line = |cylinder: &str| named.stdout.lines().find(|line| line.contains(cylinder)).unwrap();
    assert!(line("module2/a1").contains("100 %"), "{}", named.stdout);
    let other = line("module1/a");
    assert!(other.contains(" 0 % ") && other.contains("WARNING"), "{}", named.stdout);
    let clamped = run(&["model", &tower(), "--module", "2", "--held", "clamped"]).stdout;
    let is_warned = |line: &str| line.contains("module2/a") && line.contains("WARNING");
    assert!(clamped.lines().any(is_warned) && !named.stdout.lines().any(is_warned));
}

#[test]
fn an_unknown_module_is_answered_with_those_that_exist() {
    for unknown in ["roof", "0", "5", ""] {
        let known = "expected `module1`, `module2`, `module3`, `module4`, or a number from 1 to 4";
        let arguments = ["model", &tower(), "--module", unknown];
        run(&arguments).fails(2, &[&format!("unknown module `{unknown}`"), known]);
    }
}

#[test]
fn the_explicit_description_of_a_module_describes_the_same_module() {
    let explicit = run(&["model", &tower(), "--module", "1", "--toml"]);
    explicit.succeeds();
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("module1.toml");
    std::fs::write(&file, &explicit.stdout).unwrap();
    let file = file.display().to_string();
    assert_eq!(
        run(&["model", &file, "--json"]).stdout,
        run(&["model", &tower(), "--module", "1", "--json"]).stdout
    );
}

#[test]
fn json_carries_the_model() {
    let outcome = run(&["model", &tower(), "--json", "--module", "1"]);
    outcome.succeeds();
    let model: Value = serde_json::from_str(&outcome.stdout).unwrap();
    assert_eq!(model["v"], 1);
    assert_eq!(model["gages"].as_array().unwrap().len(), 8);
    assert_eq!(model["actuators"][0]["path"], "module1/actuator/a1");
}

#[test]
fn a_drawing_goes_to_a_file_or_to_standard_output() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("tower.svg").display().to_string();
    let outcome = run(&["model", &tower(), "--svg", &file]);
    outcome.succeeds();
    assert!(outcome.stdout.contains("module1"), "the summary is still printed");
    let drawn = std::fs::read_to_string(&file).unwrap();
    assert!(drawn.trim_start().starts_with("<svg"), "{drawn:.100}");
    assert_eq!(run(&["model", &tower(), "--svg", "-"]).stdout.trim(), drawn.trim());
    let nowhere = directory.path().join("no/such.svg").display().to_string();
    run(&["model", &tower(), "--svg", &nowhere]).fails(1, &["cannot write", "no/such.svg"]);
}

#[test]
fn every_mistake_in_a_description_is_reported_with_its_line() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("bad.toml");
    let text = std::fs::read_to_string(tower()).unwrap();
    let text = text.replace("height_m = 3.0", "height_m = -3.0").replace("L01C4\" }", "L99C4\" }");
    std::fs::write(&file, text).unwrap();
    let outcome = run(&["model", &file.display().to_string()]);
    outcome.fails(3, &["bad.toml: line ", "height_m"]);
    run(&["model", "no-such.toml"]).fails(3, &["cannot read `no-such.toml`"]);
}
