//! Every file in `tests/data/loggers` holds the same two series in another form.

use std::fs::{self, File};
use std::path::PathBuf;

use clap::{Args, Command, FromArgMatches};

use crate::{CsvRows, TableError, TableFlags};

/// How a file is read.
struct Logger {
    file: &'static str,
    flags: &'static str,
    columns: &'static str,
    /// The columns that are found.
    found: [&'static str; 2],
    /// Rows without a value, of each column.
    empty: [&'static [usize]; 2],
    /// Row and number of the steps missing before it.
    gap: Option<(usize, u64)>,
}

/// A file that needs no flags and has no gap.
const fn plain(file: &'static str) -> Logger {
    Logger { file, flags: "", columns: "", found: ["a", "b"], empty: [&[], &[]], gap: None }
}

fn loggers() -> Vec<Logger> {
    vec![
        plain("plain.csv"),
        plain("utf8_mark.csv"),
        Logger { gap: Some((12, 50)), ..plain("step_gap.csv") },
        plain("excel_german.csv"),
        Logger { found: ["Weg µ", "Druck"], ..plain("excel_german_units.csv") },
        Logger { found: ["a µm", "b"], ..plain("utf16_le.txt") },
        plain("utf16_be.txt"),
        plain("classic_mac.txt"),
        plain("labview.lvm"),
        Logger {
            columns: "a,b",
            empty: [&[], &[5, 6]],
            gap: Some((15, 1)),
            ..plain("campbell_toa5.dat")
        },
        plain("catman.txt"),
        plain("quoted_time.csv"),
        plain("ni_units.csv"),
        Logger { flags: "--units-row", ..plain("odd_units.csv") },
        Logger { columns: "a,b", ..plain("odd_units.csv") },
        Logger { flags: "--skip-lines 1", ..plain("station.csv") },
        plain("station.csv"),
        Logger { columns: "#2,3", found: ["ch#2", "ch#3"], ..plain("duplicate_names.csv") },
        Logger {
            flags: "--missing -999 --missing over",
            empty: [&[3, 4], &[9]],
            ..plain("sentinels.csv")
        },
        Logger { columns: "a,b", ..plain("ragged_status.csv") },
        Logger { empty: [&[7, 8], &[2, 3, 8]], ..plain("empty_cells.csv") },
        plain("thousands_tab.txt"),
        plain("twelve_hours.csv"),
        plain("iso_offset.csv"),
        Logger { columns: "b,a", found: ["b", "a"], ..plain("pandas_index.csv") },
        Logger { flags: "--time none", ..plain("clock_put_back.csv") },
    ]
}

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/loggers"))
}

fn open(file: &str, flags: &str, columns: &str) -> Result<CsvRows, TableError> {
    let words = std::iter::once("table").chain(flags.split_whitespace());
    let matches = TableFlags::augment_args(Command::new("table")).get_matches_from(words);
    let flags = TableFlags::from_arg_matches(&matches).unwrap();
    let wanted: Vec<String> = columns.split(',').map(str::to_owned).collect();
    let wanted = Some(wanted).filter(|_| !columns.is_empty());
    let input = Box::new(File::open(folder().join(file)).unwrap());
    CsvRows::open(input, file.to_owned(), &flags, |_| Ok(wanted.clone()))
}

/// Steps and values.
fn rows(rows: &mut CsvRows) -> Vec<(u64, Vec<f64>)> {
    let mut all = Vec::new();
    while let Some(row) = rows.next_row().unwrap() {
        assert_eq!(row.problem, None, "row {}", all.len());
        all.push((row.step, row.values.to_vec()));
    }
    all
}

#[test]
fn every_logger_gives_the_same_rows() {
    let expected = rows(&mut open("plain.csv", "", "").unwrap());
    assert_eq!((expected.len(), &expected[1].1[..]), (24, &[1.008, 1411.35][..]));
    for Logger { file, flags, columns, found, empty, gap } in loggers() {
        let mut table = open(file, flags, columns).unwrap();
        assert_eq!(table.channels(), found, "{file}");
        let read = rows(&mut table);
        let lost = if file == "campbell_toa5.dat" { vec![15] } else { Vec::new() };
        let expected: Vec<&(u64, Vec<f64>)> =
            expected.iter().filter(|(step, _)| !lost.contains(step)).collect();
        assert_eq!(read.len(), expected.len(), "{file}");
        for (number, ((step, values), (_, expected))) in read.iter().zip(expected).enumerate() {
            let missing = gap.filter(|(row, _)| number >= *row).map_or(0, |(_, missing)| missing);
            assert_eq!(step - read[0].0, number as u64 + missing, "{file}, row {number}");
            for (channel, value) in values.iter().enumerate() {
                let expected =
                    if found[0] == "b" { expected[1 - channel] } else { expected[channel] };
                let is_empty = empty[channel].contains(&number);
                assert_eq!(value.is_nan(), is_empty, "{file}, row {number}");
                assert!(is_empty || *value == expected, "{file}, row {number}: {value}");
            }
        }
    }
    for entry in fs::read_dir(folder()).unwrap() {
        let name = entry.unwrap().file_name();
        assert!(loggers().iter().any(|logger| name == logger.file), "{name:?}");
    }
}

#[test]
fn what_cannot_be_recognised_says_which_flag_helps() {
    for (file, flags, columns, said) in [
        ("duplicate_names.csv", "", "", "line 1, column 3 `ch`: duplicate name; choose by number"),
        ("duplicate_names.csv", "", "ch", "duplicate name; choose by number, e.g. --columns '#2'"),
        ("station.csv", "", "s9", "line 2: missing column `s9`; use `TS`, `a`, `b`"),
        ("station.csv", "", "s9", "--skip-lines"),
        ("plain.csv", "--skip-lines 30", "", "line 31: empty; put a header row"),
        ("pandas_index.csv", "", "", "line 1, column 1: the column has no name"),
    ] {
        let error = open(file, flags, columns).err().unwrap().to_string();
        assert!(error.contains(said), "{file}: {error}");
    }
    let problem = |file: &str| -> String {
        let mut table = open(file, "", "").unwrap();
        loop {
            match table.next_row() {
                Ok(Some(row)) if row.problem.is_none() => {}
                Ok(row) => return row.unwrap().problem.unwrap(),
                Err(order) => return order.to_string(),
            }
        }
    };
    for (file, said) in [
        ("sentinels.csv", "line 11, column 3 `b`: `OVER` is not a number"),
        ("sentinels.csv", "add --missing OVER"),
        ("clock_put_back.csv", "line 12: time `2024-03-05 23:00:00` lies before the row above"),
        ("clock_put_back.csv", "--time none"),
        ("ragged_status.csv", "line 2, column 4 `status`: `ok` is not a number"),
    ] {
        let problem = problem(file);
        assert!(problem.contains(said), "{file}: {problem}");
    }
}
