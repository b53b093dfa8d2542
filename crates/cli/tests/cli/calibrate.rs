//! `trusswatch calibrate` through the real binary, on the small mast.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use daemon::config::load_uncalibrated;
use diagnosis::thresholds::Thresholds;
use study::ResidualRecording;

use crate::binary::{Outcome, repository, run};

const STEPS: u64 = 6000;

/// A copy of the configurations of tower and small mast, into which thresholds are written.
pub(crate) fn small_mast() -> tempfile::TempDir {
    let copy = tempfile::tempdir().unwrap();
    for folder in ["", "small", "tower", "thresholds"] {
        fs::create_dir_all(copy.path().join(folder)).unwrap();
        for entry in fs::read_dir(repository("configs").join(folder)).unwrap() {
            let file = entry.unwrap().path();
            if file.is_file() {
                let name = file.file_name().unwrap();
                fs::copy(&file, copy.path().join(folder).join(name)).unwrap();
            }
        }
    }
    copy
}

pub(crate) fn path(mast: &tempfile::TempDir, name: &str) -> String {
    mast.path().join("small").join(name).display().to_string()
}

fn calibrate(mast: &tempfile::TempDir, modules: &[&str], more: &[&str]) -> Outcome {
    let mut arguments = vec!["calibrate".to_owned()];
    arguments.extend(modules.iter().map(|module| path(mast, &format!("{module}.toml"))));
    arguments.extend(more.iter().map(ToString::to_string));
    run(&arguments)
}

fn written(mast: &tempfile::TempDir, module: &str) -> Thresholds {
    let file = path(mast, &format!("{module}.thresholds.toml"));
    toml::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Repeatable numbers that look like noise, of about this size.
fn noise(step: u64, channel: usize, size: f64) -> f64 {
    let phase = (step * 7919 + channel as u64 * 104_729) as f64;
    size * (12.9898 * phase).sin() * (1.0 + (0.37 * phase).cos())
}

/// Residuals of the lower module: (header, rows).
fn residuals(module: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let setup = load_uncalibrated(module).unwrap().setup;
    let recording = ResidualRecording::new(&setup).unwrap();
    let sizes: Vec<f64> = setup.prior_scatters().iter().map(|variance| variance.sqrt()).collect();
    let names = recording.components().iter().map(|c| format!("{}/{c}", setup.module)).collect();
    let row = |step| sizes.iter().enumerate().map(|(k, size)| noise(step, k, *size)).collect();
    (names, (0..STEPS).map(row).collect())
}

/// The table of residuals, columns in reverse and with something else between.
fn table(names: &[String], rows: &[Vec<f64>], with_step: bool) -> String {
    let line = |step: &str, cells: Vec<String>| {
        let cells: Vec<String> = cells.into_iter().rev().collect();
        let step = if with_step { format!("{step},") } else { String::new() };
        format!("note,{step}{}\n", cells.join(","))
    };
    let mut text = line("step", names.to_vec());
    for (step, row) in rows.iter().enumerate() {
        let cells = row.iter().map(ToString::to_string).collect();
        write!(text, "{}", line(&(step + 17).to_string(), cells)).unwrap();
    }
    text
}

fn write(mast: &tempfile::TempDir, name: &str, text: &str) -> String {
    let file = PathBuf::from(path(mast, name));
    fs::write(&file, text).unwrap();
    file.display().to_string()
}

#[test]
fn recorded_residuals_give_the_thresholds_of_the_same_rows_in_the_library() {
    let mast = small_mast();
    let module = PathBuf::from(path(&mast, "lower.toml"));
    let (names, rows) = residuals(&module);
    let plain = write(&mast, "plain.csv", &table(&names, &rows, false));
    let numbered = write(&mast, "numbered.csv", &table(&names, &rows, true));
    let outcome = calibrate(&mast, &["lower"], &["--recorded", &plain, &numbered, "--margin", "2"]);
    outcome.succeeds();
    let mut recording = ResidualRecording::new(&load_uncalibrated(&module).unwrap().setup).unwrap();
    for _ in 0..2 {
        rows.iter().for_each(|row| recording.push(None, row).unwrap());
        recording.end_run();
    }
    let expected = recording.finish();
    let found = written(&mast, "lower");
    assert_eq!(found.thresholds.len(), expected.channels.len());
    for channel in &expected.channels {
        let threshold = found.thresholds[&channel.component];
        let miss = threshold / (2.0 * channel.peaks.largest()) - 1.0;
        assert!(miss.abs() < 1e-3, "{}: {miss}", channel.component);
        assert!(outcome.stdout.contains(&format!("lower/{}", channel.component)));
    }
    assert_eq!(found.provenance.recordings, [plain, numbered]);
    assert_eq!((found.provenance.seeds, found.provenance.runs), (None, 2));
    assert!(found.provenance.hours > 0.0 && found.provenance.mismatch.is_none());
}

#[test]
fn thresholds_from_the_tail_say_for_which_rate() {
    let mast = small_mast();
    let plant = path(&mast, "plant.toml");
    let outcome = calibrate(
        &mast,
        &["lower", "upper"],
        &[
            "--plant",
            &plant,
            "--method",
            "tail",
            "--false-alarms-per-hour",
            "20",
            "--runs",
            "12",
            "--seconds",
            "60",
            "--first-seed",
            "70",
        ],
    );
    // Standard error tells the progress.
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    assert!(outcome.stdout.contains("shape"), "{}", outcome.stdout);
    for module in ["lower", "upper"] {
        let provenance = written(&mast, module).provenance;
        assert_eq!(provenance.false_alarms_per_hour, Some(20.0));
        assert_eq!(provenance.seeds.as_deref(), Some("70..=81"));
        assert_eq!((provenance.margin, provenance.mismatch), (1.0, Some(0.1)));
        assert!(provenance.method.contains("Pareto"));
        let file = path(&mast, &format!("{module}.toml"));
        assert_eq!(run(&["check", &file]).code, Some(0));
    }
}

#[test]
fn too_little_data_for_a_tail_says_how_much_is_needed_and_writes_nothing() {
    let mast = small_mast();
    let before = written(&mast, "lower");
    let plant = path(&mast, "plant.toml");
    let rate = ["--method", "tail", "--false-alarms-per-hour", "0.01"];
    let runs = ["--plant", &plant, "--runs", "1", "--seconds", "4"];
    calibrate(&mast, &["lower", "upper"], &[&rate[..], &runs[..]].concat())
        .fails(1, &["peaks in 0.00 h are too few", "calibrate on 0."]);
    assert_eq!(written(&mast, "lower"), before);
}

#[test]
fn arguments_that_do_not_go_together_are_refused() {
    let mast = small_mast();
    let plant = path(&mast, "plant.toml");
    for (arguments, said) in [
        (vec![], "--plant"),
        (vec!["--plant", &plant, "--method", "tail"], "--false-alarms-per-hour"),
        (vec!["--plant", &plant, "--false-alarms-per-hour", "1"], "add `--method tail`"),
        (
            vec![
                "--plant",
                &plant,
                "--method",
                "tail",
                "--false-alarms-per-hour",
                "1",
                "--margin",
                "2",
            ],
            "--margin",
        ),
        (vec!["--plant", &plant, "--recorded", "x.csv"], "--recorded"),
        (vec!["--recorded", "x.csv", "--runs", "3"], "--runs"),
        (vec!["--recorded", "x.csv", "--mismatch", "0.1"], "--mismatch"),
        (vec!["--plant", &plant, "--skip-bad"], "--skip-bad"),
        (vec!["--plant", &plant, "--margin", "0"], "`--margin` is 0; use a finite number above 0"),
        (
            vec!["--plant", &plant, "--method", "tail", "--false-alarms-per-hour", "-1"],
            "`--false-alarms-per-hour` is -1; use a finite number above 0",
        ),
        (vec!["--plant", &plant, "--method", "mean"], "'mean'"),
        (vec!["--plant", &plant, "--runs", "0"], "`--runs` is 0; use at least 1"),
    ] {
        calibrate(&mast, &["lower", "upper"], &arguments).fails(2, &[said]);
    }
}

#[test]
fn recordings_that_cannot_be_used_are_refused_by_line() {
    let mast = small_mast();
    let (names, mut rows) = residuals(Path::new(&path(&mast, "lower.toml")));
    rows.truncate(20);
    let good = table(&names, &rows, true);
    let all_but_one = table(&names[1..], &rows, true);
    let repeated = good.clone() + good.lines().last().unwrap() + "\n";
    let broken = good.replacen("note,20,", "note,20.5,", 1);
    let bad = good.replacen("note,20,", "note,20,x", 1);
    let missing = format!("line 1: missing column `{}/residual`", names[0]);
    for (text, said) in [
        (&good, "end before every channel is watched"),
        (&all_but_one, missing.as_str()),
        (&repeated, "line 22: step 36 after step 36; give each step once, rising"),
        (&broken, "line 5, column 2 `step`: invalid step `20.5`"),
        (&bad, "line 5, column"),
        (&"time,x\n1,2\n".to_owned(), "no column is a residual of the modules"),
    ] {
        let file = write(&mast, "bad.csv", text);
        calibrate(&mast, &["lower"], &["--recorded", &file]).fails(3, &[said]);
    }
    let absent = path(&mast, "absent.csv");
    calibrate(&mast, &["lower"], &["--recorded", &absent]).fails(3, &["cannot read", "absent.csv"]);
}
