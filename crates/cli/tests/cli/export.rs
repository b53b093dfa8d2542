//! `trusswatch export` through the real binary.

use tempfile::TempDir;

use crate::binary::run;
use crate::replay::{published, write};

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
    assert!(rows[1200][place("sensor_g5_elongation_m")].parse::<f64>().is_ok());
    assert!(rows[1200][place("sensor_g5_residual")].parse::<f64>().is_ok());
    assert_eq!(&rows[1201][place("sensor_g5_residual")], "");
    let verdicts = std::fs::read_to_string(tables.join("verdicts.csv")).unwrap();
    assert!(verdicts.contains("sensor/g5,latched"), "{verdicts}");
}
