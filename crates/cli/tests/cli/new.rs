//! `trusswatch new` through the real binary: from a description to diagnosers that find faults, by nothing else.

use std::fs;

use daemon::config::load_diagnoser;

use crate::binary::run;

#[test]
fn a_template_becomes_a_directory_that_runs() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name).display().to_string();
    let template = run(&["new", "--template", "frame"]);
    template.succeeds();
    let (description, plant, out) = (path("frame.toml"), path("plant.toml"), path("frame"));
    fs::write(&description, &template.stdout).unwrap();
    // 200 Hz, for which the tower's force control is too fast
    fs::write(&plant, "[plant]\nstep_s = 5e-3\n").unwrap();
    let made = run(&["new", &description, "--out", &out, "--plant", &plant, "--runs", "10"]);
    assert_eq!(made.code, Some(0), "{}{}", made.stdout, made.stderr);
    for assumed in ["Sampling: 0.005 s", "Force control: a gain of", "the tower's; give yours"] {
        assert!(made.stdout.contains(assumed), "{}", made.stdout);
    }
    let module = format!("{out}/frame.toml");
    let setup = load_diagnoser(module.as_ref()).unwrap().module_setup();
    assert!(setup.reference.is_some() && setup.isolation.root_ratio.is_finite());
    assert_eq!(setup.detection.divergence.interval.vectors(), Some(400), "two seconds");
    run(&["new", "--check", &out]).succeeds();
    let found = run(&[
        "study",
        "run",
        "--plant",
        &format!("{out}/plant.toml"),
        "--config",
        &module,
        "--mismatch",
        "0.1",
        "--scenarios",
        "7",
        "--out",
        &path("study"),
        "--json",
    ]);
    assert_eq!(found.code, Some(0), "{}", found.stderr);
    // Two cylinders and four gages are fewer than the paper's figures show.
    assert!(!place.path().join("study/figure4.svg").exists());
    // thresholds of another step are refused
    let other = fs::read_to_string(&module).unwrap().replace("step_s = 0.005", "step_s = 0.004");
    fs::write(&module, other).unwrap();
    run(&["new", "--check", &out])
        .fails(3, &["steps of 0.005 s, but the module has steps of 0.004 s"]);
}

#[test]
fn what_cannot_be_made_is_refused_before_anything_is_written() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name).display().to_string();
    let description = run(&["new", "--template", "frame"]).stdout;
    let bare =
        description.lines().take_while(|line| !line.starts_with("actuators")).collect::<Vec<_>>();
    fs::write(path("bare.toml"), bare.join("\n")).unwrap();
    run(&["new", &path("bare.toml"), "--out", &path("bare")])
        .fails(3, &["no module has actuators or gages"]);
    assert!(!place.path().join("bare").exists());
    run(&["new", "frame.toml"]).fails(2, &["--out"]);
    run(&["new", "--check", &path("bare")]).fails(3, &["plant.toml"]);
}

#[test]
fn a_refusal_leaves_nothing_behind_and_the_corrected_description_is_accepted() {
    let place = tempfile::tempdir().unwrap();
    let path = |name: &str| place.path().join(name).display().to_string();
    let (description, plant, out) = (path("frame.toml"), path("plant.toml"), path("made/frame"));
    fs::write(&description, run(&["new", "--template", "frame"]).stdout).unwrap();
    let make = |step_s: &str, out: &str, runs: &str| {
        fs::write(&plant, format!("[plant]\nstep_s = {step_s}\n")).unwrap();
        run(&["new", &description, "--out", out, "--plant", &plant, "--runs", runs])
    };
    let named = format!("{plant}: `step_s` is 50; use a step from");
    make("50.0", &out, "10").fails(3, &[&named]);
    assert!(!place.path().join("made").exists());
    // Refused late, by the calibration.
    make("5e-3", &out, "0").fails(2, &["--runs"]);
    assert!(!place.path().join("made").exists());
    let empty = path("empty");
    fs::create_dir(&empty).unwrap();
    make("50.0", &empty, "10").fails(3, &[&named]);
    assert_eq!(fs::read_dir(&empty).unwrap().count(), 0, "an empty directory stays, empty");
    let made = make("5e-3", &empty, "10");
    assert_eq!(made.code, Some(0), "{}", made.stderr);
}
