//! `trusswatch export` through the real binary.

use std::fs;
use std::path::Path;

use diagnosis::thresholds::Thresholds;
use tempfile::TempDir;

use crate::binary::{Outcome, repository, run};
use crate::calibrate::small_mast;
use crate::recorded_live::Live;
use crate::replay::{BIAS_M, published, published_of, write};

#[test]
fn a_recording_becomes_tables() {
    let directory = TempDir::new().unwrap();
    let file = directory.path().join("a.mcap");
    write(&file, &published());
    let tables = directory.path().join("tables");
    let arguments = ["export", file.to_str().unwrap(), "--csv", tables.to_str().unwrap()];
    run(&arguments).succeeds();
    let mut table = csv::Reader::from_path(tables.join("module1-run-7.csv")).unwrap();
    let heading = table.headers().unwrap().clone();
    let place = |name: &str| heading.iter().position(|column| column == name).unwrap();
    let rows: Vec<csv::StringRecord> = table.records().map(|row| row.unwrap()).collect();
    assert_eq!(rows.len(), 8000);
    assert_eq!(&rows[1200][place("step")], "1200");
    assert_eq!(rows[1200][place("time_s")].parse::<f64>().unwrap(), 1.2);
    assert!(rows[1200][place("module1/sensor/g5/elongation_m")].parse::<f64>().is_ok());
    assert!(rows[1200][place("module1/sensor/g5/residual")].parse::<f64>().is_ok());
    assert_eq!(&rows[1201][place("module1/sensor/g5/residual")], "");
    let verdicts = std::fs::read_to_string(tables.join("verdicts.csv")).unwrap();
    assert!(verdicts.contains("sensor/g5,latched"), "{verdicts}");
}

/// A recording, and the tables with residuals that are exported of it.
fn exported(directory: &Path) -> [String; 2] {
    let [file, tables] =
        ["a.mcap", "tables"].map(|name| directory.join(name).display().to_string());
    write(Path::new(&file), &published());
    run(&["export", &file, "--csv", &tables, "--residuals"]).succeeds();
    [file, tables]
}

#[test]
fn residuals_at_every_step_are_those_that_were_published() {
    let directory = TempDir::new().unwrap();
    let [file, tables] = exported(directory.path());
    let sparse = directory.path().join("sparse");
    run(&["export", &file, "--csv", sparse.to_str().unwrap()]).succeeds();
    let read = |folder: &Path| -> Vec<csv::StringRecord> {
        let mut table = csv::Reader::from_path(folder.join("module1-run-7.csv")).unwrap();
        let heading = table.headers().unwrap().clone();
        std::iter::once(heading).chain(table.records().map(Result::unwrap)).collect()
    };
    let (every, some) = (read(Path::new(&tables)), read(&sparse));
    assert_eq!(every[0], some[0]);
    assert!(every.iter().all(|row| row.iter().rev().nth(1) != Some("")));
    // The first column is the step; residuals and divergences stand last.
    let published =
        some.iter().zip(&every).filter(|(some, _)| some.iter().rev().nth(1) != Some(""));
    assert!(published.clone().count() > 50);
    published.for_each(|(some, every)| assert_eq!(some, every));
}

#[test]
fn what_a_gage_should_have_read_stands_beside_what_it_read() {
    let directory = TempDir::new().unwrap();
    let [file, tables] =
        ["a.mcap", "tables"].map(|name| directory.path().join(name).display().to_string());
    write(Path::new(&file), &published_of(Live::new(|_| ())));
    run(&["export", &file, "--csv", &tables, "--corrected"]).succeeds();
    let mut table = csv::Reader::from_path(format!("{tables}/module1-run-7.csv")).unwrap();
    let heading = table.headers().unwrap().clone();
    let column = |name: &str| {
        let name = format!("module1/sensor/g5/{name}");
        heading.iter().position(|column| column == name).unwrap()
    };
    let names = ["elongation_m", "corrected_m", "corrected_low_m", "corrected_high_m"].map(column);
    let rows = table.records().map(|row| {
        let row = row.unwrap();
        names.map(|place| row[place].parse::<f64>().unwrap())
    });
    let rows: Vec<[f64; 4]> = rows.collect();
    let [before, after] = [&rows[4000], &rows[7900]];
    assert_eq!(before[0], before[1], "its own reading");
    assert!((after[0] - after[1] - BIAS_M).abs() < 1e-5, "{after:?}");
    for [_, corrected, low, high] in [before, after] {
        assert!(low < corrected && corrected < high, "{low} {corrected} {high}");
    }
    let replayed = directory.path().join("replayed").display().to_string();
    run(&["replay", &file, "--corrected", &replayed]).succeeds();
    let table = |of: &str| std::fs::read(format!("{of}/module1-run-7.csv")).unwrap();
    assert!(table(&replayed) == table(&tables), "other tables of `replay` than of `export`");
    run(&["replay", &file, "--corrected", &replayed, "--rule", "paper"]).fails(2, &["--rule"]);
}

#[test]
fn detect_finds_the_same_in_the_recording_and_in_its_table() {
    let directory = TempDir::new().unwrap();
    let [file, tables] = exported(directory.path());
    let module = repository("configs").join("module1.toml").display().to_string();
    let detect = |input: &str| run(&["detect", input, "--config", &module, "--json"]);
    let (recorded, table) = (detect(&file), detect(&format!("{tables}/module1-run-7.csv")));
    recorded.succeeds();
    table.succeeds();
    assert!(recorded.stdout.contains("\"change\":true"));
    assert!(recorded.stdout == table.stdout, "other divergences");
    let other = run(&["detect", &file, "--config", &module, "--run", "8"]);
    other.fails(3, &["no run 8; the recording has run 7"]);
    run(&["detect", &file, "--prior-scatter", "1"]).fails(2, &["--config"]);
}

#[test]
fn calibrate_and_commission_take_the_recording_and_its_tables_alike() {
    let directory = TempDir::new().unwrap();
    let [file, tables] = exported(directory.path());
    let configs = small_mast();
    let module = |name: &str| configs.path().join(name).display().to_string();
    let modules = [module("module1.toml"), module("module2.toml")];
    let table = |module: &str| format!("{tables}/{module}-run-7.csv");
    let thresholds = |recorded: &[&str]| {
        let arguments = [&["calibrate", &modules[0], &modules[1], "--recorded"], recorded].concat();
        run(&arguments).succeeds();
        ["module1", "module2"].map(|name| {
            let text = fs::read_to_string(module(&format!("thresholds/{name}.toml"))).unwrap();
            toml::from_str::<Thresholds>(&text).unwrap().thresholds
        })
    };
    let of_tables = thresholds(&[&table("module1"), &table("module2")]);
    assert_eq!(thresholds(&[&file]), of_tables);

    let out = directory.path().join("references").display().to_string();
    let commission = |recording: &str| -> Outcome {
        let [first, second] = &modules;
        run(&["commission", first, second, "--recording", recording, "--out", &out])
    };
    // The samples were read; one snippet is too few to learn from.
    for recording in [&file, &tables, &directory.path().display().to_string()] {
        commission(recording).fails(3, &["1 usable snippets are too few for"]);
    }
    fs::copy(table("module1"), format!("{tables}/module1-run-8.csv")).unwrap();
    commission(&tables).fails(2, &["several tables of `module1`", "--run"]);
}
