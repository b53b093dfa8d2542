//! `trusswatch detect` through the real binary.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::Stdio;

use crate::binary::{Outcome, repository, run, run_with, trusswatch};
use serde_json::Value;

/// A small detector on standard input.
const SMALL: [&str; 10] =
    ["detect", "-", "--window", "1", "--lag", "1", "--interval", "2", "--prior-scatter", "1"];

fn small(input: &str, more: &[&str]) -> Outcome {
    run_with(input, &[&SMALL[..], more].concat())
}

fn rows(outcome: &Outcome) -> Vec<Value> {
    outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Divergences of channel `x`.
fn divergences(outcome: &Outcome) -> Vec<Option<f64>> {
    rows(outcome).iter().map(|row| row["channels"]["x"]["divergence"].as_f64()).collect()
}

fn golden() -> Vec<Value> {
    let file = repository("crates/diagnosis/tests/data/kl_divergence.json");
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

fn table_of(case: &Value) -> String {
    let mut table = "x\n".to_owned();
    for sample in case["samples"].as_array().unwrap() {
        writeln!(table, "{sample}").unwrap();
    }
    table
}

fn flags_of(case: &Value) -> Vec<String> {
    let number = |name: &str| case[name].to_string();
    [
        ["--window".into(), number("window")],
        ["--lag".into(), number("lag")],
        ["--interval".into(), number("interval")],
        ["--prior-scatter".into(), number("regularization")],
    ]
    .concat()
}

#[test]
fn every_golden_value_is_met() {
    let cases = golden();
    assert_eq!(cases.len(), 5);
    for case in &cases {
        let flags = flags_of(case);
        let mut arguments = vec!["detect", "-", "--json"];
        arguments.extend(flags.iter().map(String::as_str));
        let outcome = run_with(&table_of(case), &arguments);
        outcome.succeeds();
        let found = divergences(&outcome);
        assert_eq!(found.len(), case["samples"].as_array().unwrap().len());
        let expected = case["divergence"].as_array().unwrap();
        for pair in expected {
            let index = pair[0].as_u64().unwrap() as usize;
            let expected = pair[1].as_f64().unwrap();
            let miss = (found[index].unwrap() - expected).abs();
            assert!(
                miss <= 1e-12 + 1e-9 * expected.abs(),
                "{} row {index}: {miss}",
                case["series"]
            );
        }
        let first = expected[0][0].as_u64().unwrap() as usize;
        assert!(found[..first].iter().all(Option::is_none), "{}", case["series"]);
    }
}

#[test]
fn a_line_of_json_has_the_documented_form() {
    let outcome = small("x,\"the y\"\n1,2\n1,2\n4,2\n", &["--json", "--threshold", "0.1"]);
    outcome.succeeds();
    let lines: Vec<&str> = outcome.stdout.lines().collect();
    assert_eq!(
        lines[0],
        r#"{"v":1,"index":0,"channels":{"x":{"divergence":null,"change":false},"the y":{"divergence":null,"change":false}}}"#
    );
    let last: Value = serde_json::from_str(lines[2]).unwrap();
    assert_eq!(last["index"], 2);
    assert_eq!(last["channels"]["x"]["change"], true);
    assert_eq!(last["channels"]["the y"]["change"], false);
}

#[test]
fn a_change_begins_at_the_threshold_itself_and_needs_one() {
    let table = "x\n1\n1\n4\n";
    let exact = divergences(&small(table, &["--json"]))[2].unwrap().to_string();
    let at = small(table, &["--json", "--threshold", &exact]);
    assert_eq!(rows(&at)[2]["channels"]["x"]["change"], true);
    assert_eq!(rows(&small(table, &["--json"]))[2]["channels"]["x"]["change"], false);
}

#[test]
fn nothing_counts_as_a_change_before_the_warm_up() {
    let changes = |warm_up: &str| -> Vec<bool> {
        let flags = ["--json", "--threshold", "0.1", "--warm-up", warm_up, "--interval", "0"];
        let arguments = ["detect", "-", "--window", "1", "--lag", "1", "--prior-scatter", "1"];
        let outcome = run_with("x\n1\n2\n9\n-80\n900\n", &[&arguments[..], &flags[..]].concat());
        outcome.succeeds();
        rows(&outcome).iter().map(|row| row["channels"]["x"]["change"] == true).collect()
    };
    assert_eq!(changes("0"), [false, false, true, true, true]);
    assert_eq!(changes("5"), [false, false, false, false, true]);
}

#[test]
fn a_change_is_over_once_the_channel_was_quiet_for_long_enough() {
    let changes = |quiet_steps: &str| -> Vec<bool> {
        let flags = ["--json", "--threshold", "0.1", "--quiet-steps", quiet_steps];
        let outcome = small("x\n0\n0\n9\n9\n9\n9\n9\n", &flags);
        outcome.succeeds();
        rows(&outcome).iter().map(|row| row["channels"]["x"]["change"] == true).collect()
    };
    assert_eq!(changes("1"), [false, false, true, true, false, false, false]);
    assert_eq!(changes("3"), [false, false, true, true, true, true, false]);
}

#[test]
fn bad_rows_are_refused_by_line_and_column() {
    let finite = "use a finite number";
    for (table, said) in [
        ("x,y\n1,2\n3\n", "standard input, line 3, column 2 `y`: missing, 1 fields instead of 2"),
        ("x,y\n1,2\n3,4,5\n", "line 3, column 3: one too many, 3 fields instead of 2"),
        ("x,y\n1,2\nfour,5\n", "line 3, column 1 `x`: `four` is not a number"),
        ("x,y\n1,2\n-inf,4\n", "line 3, column 1 `x`: `-inf` is not finite"),
        ("x,y\n1,2\n1e999,4\n", "line 3, column 1 `x`: `1e999` is not finite"),
    ] {
        let outcome = small(table, &["--json"]);
        outcome.fails(3, &[said, "--skip-bad"]);
        assert!(said.contains("one too many") || outcome.stderr.contains(finite));
        assert_eq!(rows(&outcome).len(), 1, "the row before the mistake is printed");
    }
}

#[test]
fn skipped_bad_rows_keep_their_place_and_are_counted_as_gaps() {
    let table = "x\n1\n1\n4\nNaN\nabc\n\n1,2\n4\n4\n4\n";
    let outcome = small(table, &["--json", "--skip-bad"]);
    assert_eq!(outcome.code, Some(0));
    assert_eq!(outcome.stderr, "standard input: 2 of 10 rows were bad and count as gaps\n");
    let found = rows(&outcome);
    let indices: Vec<u64> = found.iter().map(|row| row["index"].as_u64().unwrap()).collect();
    assert_eq!(indices, (0..10).collect::<Vec<u64>>());
    let defined: Vec<bool> = divergences(&outcome).iter().map(Option::is_some).collect();
    assert_eq!(
        defined,
        [false, false, true, false, false, false, false, true, true, true],
        "with a window of 1 the Gaussian outlives the gap"
    );
}

#[test]
fn no_window_is_formed_across_a_gap() {
    let flags = ["--json", "--skip-bad", "--window", "3", "--lag", "1", "--interval", "0"];
    let arguments = [&["detect", "-", "--prior-scatter", "1"], &flags[..]].concat();
    let outcome = run_with("x\n1\n2\n4\n3\n5\nbad\n1\n2\n7\n", &arguments);
    let defined: Vec<bool> = divergences(&outcome).iter().map(Option::is_some).collect();
    assert_eq!(defined, [false, false, false, false, true, false, false, false, true]);
}

#[test]
fn numbers_too_large_to_square_are_reported_and_do_no_harm() {
    let outcome = small("x\n1\n-1e300\n1e300\n1\n2\n3\n4\n", &["--json"]);
    assert_eq!(outcome.code, Some(0));
    assert!(outcome.stderr.contains("channel `x` was restarted"), "{}", outcome.stderr);
    assert!(divergences(&outcome)[6].is_some());
}

#[test]
fn settings_out_of_range_name_flag_and_range() {
    for (flag, bad, said) in [
        ("--window", "0", "from 1 to 256"),
        ("--window", "257", "from 1 to 256"),
        ("--window", "-3", "from 1 to 256"),
        ("--window", "ten", "from 1 to 256"),
        ("--lag", "0", "from 1 to 4096"),
        ("--lag", "99999999999999999999", "from 1 to 4096"),
        ("--interval", "1", "from 2 to 10000000 vectors, or 0"),
        ("--prior-scatter", "0", "finite number above 0"),
        ("--prior-scatter", "-1e-9", "finite number above 0"),
        ("--prior-scatter", "nan", "finite number above 0"),
        ("--threshold", "inf", "finite number above 0"),
        ("--quiet-steps", "0", "1.."),
        ("--delimiter", "::", "one ASCII character"),
    ] {
        let mut arguments = vec!["detect", "-", flag, bad];
        if flag != "--prior-scatter" {
            arguments.extend(["--prior-scatter", "1"]);
        }
        run(&arguments).fails(2, &[flag, said, &format!("`{bad}`").replace('`', "'")]);
    }
    run(&["detect", "-"]).fails(2, &["--prior-scatter"]);
}

#[test]
fn headers_that_cannot_be_meant_are_refused() {
    for (table, said) in [
        ("", "line 1: empty; put a header row"),
        ("x,y\n", "nothing was judged: 0 rows are too few"),
        ("\n1\n", "line 1: empty; put a header row"),
        ("0.5,0.25\n1,2\n", "line 1: `0.5` is a number; put a header row"),
        ("x,x\n1,2\n", "line 1, column 2 `x`: duplicate name"),
        (",x\n1,2\n", "line 1, column 1: the column has no name"),
    ] {
        small(table, &[]).fails(3, &[said]);
    }
    small("x,y\n1,2\n", &["--columns", "x,z"]).fails(3, &["missing column `z`; use `x`, `y`"]);
    small("x,y\n1,2\n", &["--columns", "x,x"]).fails(3, &["column 1 `x`", "duplicate name"]);
}

#[test]
fn an_empty_cell_is_a_gap_of_its_channel_alone() {
    let defined = |table: &str, channel: &str| -> Vec<bool> {
        let flags = ["--json", "--window", "2", "--lag", "1", "--interval", "0"];
        let outcome =
            run_with(table, &[&["detect", "-", "--prior-scatter", "1"], &flags[..]].concat());
        outcome.succeeds();
        rows(&outcome)
            .iter()
            .map(|row| row["channels"][channel]["divergence"].is_number())
            .collect()
    };
    let whole = "x,y\n1,1\n2,2\n4,4\n3,3\n5,5\n1,1\n2,2\n7,7\n";
    let holed = whole.replace("5,5", ",5").replace("1,1\n2,2\n7", "1,1\n2,NA\n7");
    let undefined: Vec<bool> = vec![false; 3];
    assert_eq!(defined(&holed, "y")[..6], defined(whole, "y")[..6]);
    assert_eq!(defined(&holed, "x"), [&undefined[..], &[true, false, false, true, true]].concat());
    assert_eq!(defined(&holed, "y"), [&undefined[..], &[true, true, true, false, false]].concat());
}

#[test]
fn a_channel_with_a_gap_of_its_own_leaves_the_others_as_they_are() {
    let cell = |row: u32, channel: u32| f64::from((row * 7 + channel * 3) % 11).to_string();
    let table = |holes: bool| -> String {
        let row = |row: u32| -> String {
            let cells = (0..6).map(|channel| match (holes, channel, row % 9) {
                (true, 1, 4) | (true, 4, 7) => String::new(),
                _ => cell(row, channel),
            });
            cells.collect::<Vec<_>>().join(",") + "\n"
        };
        "a,b,c,d,e,f\n".to_owned() + &(0..60).map(row).collect::<String>()
    };
    let arguments =
        ["detect", "-", "--prior-scatter", "1", "--json", "--window", "1", "--interval", "20"];
    let of = |table: &str| rows(&run_with(table, &arguments));
    let same = |a: &Value, b: &Value, name: &str| a["channels"][name] == b["channels"][name];
    let (holed, whole) = (of(&table(true)), of(&table(false)));
    assert_eq!((holed.len(), whole.len()), (60, 60));
    for (holed, whole) in holed.iter().zip(&whole) {
        assert!(["a", "c", "d", "f"].iter().all(|name| same(holed, whole, name)), "{holed}");
    }
    let undefined = |name: &str| {
        holed.iter().filter(|row| row["channels"][name]["divergence"].is_null()).count()
    };
    assert!(undefined("b") >= 6 && undefined("e") >= 6);
}

#[test]
fn nothing_judged_is_no_success() {
    let arguments = ["detect", "-", "--prior-scatter", "1"];
    let with = |table: &str, more: &[&str]| run_with(table, &[&arguments[..], more].concat());
    with("x\n1\n2\n", &[]).fails(3, &["nothing was judged: 2 rows are too few, use at least 21"]);
    let bad = "x\n1\n".to_owned() + &"one\n".repeat(30);
    with(&bad, &["--skip-bad"]).fails(3, &["nothing was judged: 30 of 31 rows were bad"]);
    let gaps = "x\n1\n".to_owned() + &"NaN\n1\n".repeat(30);
    with(&gaps, &["--json"]).fails(3, &["no channel has enough values without a gap"]);
}

#[test]
fn steps_and_times_tell_what_is_missing_and_must_rise() {
    let undefined = |table: &str| -> usize {
        let flags = ["--json", "--window", "3", "--lag", "1", "--interval", "0"];
        let outcome =
            run_with(table, &[&["detect", "-", "--prior-scatter", "1"], &flags[..]].concat());
        outcome.succeeds();
        let rows = rows(&outcome);
        assert_eq!(
            rows[0]["channels"].as_object().unwrap().len(),
            1,
            "the clock column is not a channel"
        );
        rows.iter().filter(|row| row["channels"]["x"]["divergence"].is_null()).count()
    };
    let table = |name: &str, gap: u64| -> String {
        let row = |k: u64| format!("{},{}\n", k + if k < 10 { 0 } else { gap }, k % 5);
        format!("{name},x\n") + &(0..20).map(row).collect::<String>()
    };
    for name in ["step", "time"] {
        assert_eq!(undefined(&table(name, 0)), 4);
        assert_eq!(undefined(&table(name, 3)), 6);
    }
    small("step,x\n4,1\n5,1\n5,1\n", &[])
        .fails(3, &["standard input, line 4: step 5 after step 5; give each step once, rising"]);
    small("time,x\n2,1\n1,1\n", &["--skip-bad"]).fails(3, &["line 3: time `1` lies before"]);
    let chosen = small("step,x\n4,1\n5,1\n6,1\n", &["--json", "--columns", "step"]);
    assert!(rows(&chosen)[0]["channels"]["step"].is_object());
}

#[test]
fn a_change_that_leaves_the_interval_is_not_counted() {
    let value = |k: u32| f64::from((k * 7919) % 101) / 50.0 + if k < 300 { 0.0 } else { 20.0 };
    let table =
        "x\n".to_owned() + &(0..1000).map(|k| format!("{}\n", value(k))).collect::<String>();
    let flags = ["--window", "3", "--lag", "5", "--interval", "400", "--warm-up", "50"];
    let arguments = ["detect", "-", "--prior-scatter", "1", "--threshold", "0.2"];
    let outcome = run_with(&table, &[&arguments[..], &flags].concat());
    outcome.succeeds();
    let line = outcome.stdout.lines().find(|line| line.trim_start().starts_with("x ")).unwrap();
    let cells: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(cells[4], "1", "{line}");
    assert!(cells[5].parse::<u32>().unwrap().abs_diff(300) < 10, "{line}");
    assert!(outcome.stdout.contains("not counted as changes: 1"), "{}", outcome.stdout);
    let json = run_with(&table, &[&arguments[..], &flags, &["--json"]].concat());
    let leaving = |row: &Value| row["channels"]["x"]["leaving"] == true;
    assert!(rows(&json).iter().any(leaving));
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let arguments = ["detect", "no-such-file.csv", "--prior-scatter", "1"];
    run(&arguments).fails(3, &["cannot read `no-such-file.csv`"]);
}

#[test]
fn columns_that_are_not_chosen_may_hold_anything() {
    let table = "time;x;note\n12:00;1;a\n12:01;3;\n12:02;4;NaN\n";
    let outcome = small(table, &["--json", "--delimiter", ";", "--columns", "x"]);
    outcome.succeeds();
    assert_eq!(divergences(&outcome), divergences(&small("x\n1\n3\n4\n", &["--json"])));
}

#[test]
fn the_summary_shows_where_the_largest_divergence_and_the_changes_are() {
    let table = "quiet,x\n0,0\n0,0\n0,0\n0,9\n0,0\n0,0\n0,0\n";
    let outcome = small(table, &["--threshold", "0.5"]);
    outcome.succeeds();
    assert!(outcome.stdout.contains("standard input: 7 rows, 2 channels"));
    let line = |name: &str| -> Vec<String> {
        let line = outcome.stdout.lines().find(|line| line.trim_start().starts_with(name));
        line.unwrap().split_whitespace().map(str::to_owned).collect()
    };
    assert_eq!(line("quiet"), ["quiet", "5", "0.000000", "2", "0", "-"]);
    assert_eq!(line("x ")[3..], ["3", "1", "3"], "at row 5 it leaves the interval of 2");
    let every_row = small(table, &["--all", "--threshold", "0.5"]);
    assert_eq!(every_row.stdout.lines().count(), 8);
    assert!(every_row.stdout.lines().nth(4).unwrap().trim_end().ends_with('!'));
}

#[test]
fn a_closed_pipe_ends_the_run_quietly() {
    let mut child = trusswatch()
        .args(SMALL)
        .arg("--json")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    stdin.write_all(b"x\n1\n").unwrap();
    let mut line = String::new();
    stdout.read_line(&mut line).unwrap();
    assert!(line.starts_with(r#"{"v":1,"index":0"#), "each row is printed at once: {line}");
    drop(stdout);
    let rows = "2\n".repeat(100_000);
    // The run may end before it has read everything.
    drop(stdin.write_all(rows.as_bytes()));
    drop(stdin);
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    assert_eq!((child.wait().unwrap().code(), said.as_str()), (Some(0), ""));
}
