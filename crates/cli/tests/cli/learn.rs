//! `trusswatch learn`, and `trusswatch detect` with what it learnt.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::binary::{repository, run};

/// Uniform numbers from -1 to 1, the same everywhere (Knuth's linear congruential generator).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// Twelve minutes at 5 Hz of a load in plateaus and four gages, as a German logger writes them.
fn table(file: &Path, seed: u64, mut fault: impl FnMut(usize, &mut [f64; 5])) {
    let mut noise = Noise(seed);
    let mut text = "Zeit [s];Kraft;e1;e2;e3;e4\n".to_owned();
    let zeros: Vec<f64> = (0..4).map(|_| 0.2 * noise.next()).collect();
    let (mut force, mut target) = (0.0_f64, 0.0);
    for row in 0..3600 {
        if row % 300 == 0 {
            target = 50.0 * (1.0 + noise.next());
        }
        force += (target - force).clamp(-1.0, 1.0);
        let mut values = [force; 5];
        for (k, value) in values.iter_mut().enumerate().skip(1) {
            *value = force * [0.0, 1.0, -0.6, 0.4, 2.0][k] + zeros[k - 1] + 0.1 * noise.next();
        }
        fault(row, &mut values);
        let cells: Vec<String> = values
            .iter()
            .map(|x| if x.is_nan() { String::new() } else { format!("{x:.2}") })
            .collect();
        writeln!(text, "{:.1};{}", row as f64 / 5.0, cells.join(";")).unwrap();
    }
    std::fs::write(file, text.replace('.', ",")).unwrap();
}

fn learnt(directory: &Path) -> PathBuf {
    let module = directory.join("bridge.toml");
    let files: Vec<PathBuf> = (1..=3).map(|k| directory.join(format!("healthy{k}.csv"))).collect();
    for (seed, file) in files.iter().enumerate() {
        table(file, seed as u64 + 1, |row, values| {
            // Somebody stood on a cable.
            if seed == 1 && (1000..1040).contains(&row) {
                values[2] += 40.0;
            }
        });
    }
    let mut arguments = vec!["learn".to_owned()];
    arguments.extend(files.iter().map(|file| file.display().to_string()));
    let out = module.display().to_string();
    arguments.extend(
        ["--inputs", "Kraft", "--sensors", "e1,e2,e3,e4", "--out", &out].map(str::to_owned),
    );
    let outcome = run(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    outcome.succeeds();
    assert!(outcome.stdout.contains("learnt from 3 recordings"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("healthy2.csv: rows 9"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("`e2` looks faulty"), "{}", outcome.stdout);
    module
}

/// The values of a table with a header.
fn values(file: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(file).unwrap().replace(';', "\t");
    let text = if text.contains('\t') { text.replace(',', ".") } else { text.replace(',', "\t") };
    let cell = |cell: &str| cell.parse().unwrap_or(f64::NAN);
    text.lines().skip(1).map(|line| line.split('\t').map(cell).collect()).collect()
}

/// `e3` should have read 8 less from row 2000 on; the others read what they should.
fn assert_corrected(corrected: &Path, today: &Path) {
    const E3: usize = 7;
    let (corrected, today) = (values(corrected), values(today));
    assert_eq!(corrected.len(), today.len());
    let (mut told, mut covered) = (0, 0);
    for (row, (corrected, read)) in corrected.iter().zip(&today).enumerate() {
        let [expected, low, high] = [E3, E3 + 1, E3 + 2].map(|place| corrected[place]);
        assert_eq!(corrected[0] as usize, row);
        assert!(corrected[1] == read[2] && corrected[2].is_nan(), "{corrected:?} {read:?}");
        if low.is_nan() {
            // Named already, but a window has yet to tell what it should have read.
            let is_untold = expected.is_nan() && (2000..2050).contains(&row);
            let is_own = expected == read[4] && row < 2400;
            assert!(is_untold || is_own, "{row}: {corrected:?} {read:?}");
            continue;
        }
        told += 1;
        assert!((expected - (read[4] - 8.0)).abs() < 40.0, "{row}: {corrected:?} {read:?}");
        covered += usize::from((low - 0.2..high + 0.2).contains(&(read[4] - 8.0)));
    }
    assert!(told > 1200 && covered > told * 3 / 4, "{covered} of {told}");
}

#[test]
fn a_channel_without_signal_has_no_corrected_reading() {
    let directory = tempfile::tempdir().unwrap();
    let module = learnt(directory.path()).display().to_string();
    let [today, corrected] = ["today.csv", "corrected.csv"].map(|name| directory.path().join(name));
    table(&today, 9, |row, values| {
        if row >= 2000 {
            values[2] = -900.0 - (row % 7) as f64;
        }
    });
    let [today, file] = [&today, &corrected].map(|file| file.display().to_string());
    run(&["detect", &today, "--config", &module, "--corrected", &file]).succeeds();
    let rows = values(&corrected);
    assert!(rows[1900][4].is_finite() && rows[1900][10].is_finite(), "{:?}", rows[1900]);
    for row in &rows[2600..] {
        assert!(row[4].is_nan() && row[10].is_finite(), "{row:?}");
    }
}

#[test]
fn from_tables_to_a_named_fault_in_two_commands() {
    let directory = tempfile::tempdir().unwrap();
    let module = learnt(directory.path());
    let today = directory.path().join("today.csv");
    table(&today, 9, |row, values| {
        if row >= 2000 {
            values[3] += 8.0;
        }
    });
    let (today, module) = (today.display().to_string(), module.display().to_string());
    let svg = directory.path().join("today.svg");
    let picture = svg.display().to_string();
    let corrected = directory.path().join("corrected.csv");
    let columns = corrected.display().to_string();
    let outcome =
        run(&["detect", &today, "--config", &module, "--svg", &picture, "--corrected", &columns]);
    outcome.succeeds();
    assert_corrected(&corrected, Path::new(&today));
    let picture = std::fs::read_to_string(&svg).unwrap();
    for part in ["<svg", "(c) e3\n", "(e) Kraft\n", "\nfaulty\n", "\nexpected\n"] {
        assert!(picture.contains(part), "{part}");
    }
    let line = outcome.stdout.lines().find(|line| line.starts_with("e3: faulty, rows ")).unwrap();
    assert!(
        line.contains(" to 719.8 s), the end: bias of 8.") || line.contains("bias of 7.9"),
        "{line}"
    );
    let outcome = run(&["detect", &today, "--config", &module, "--json"]);
    outcome.succeeds();
    let lines: Vec<Value> =
        outcome.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines.iter().all(|line| line["v"] == 1), "{lines:?}");
    let faulty: Vec<&Value> =
        lines.iter().map(|line| &line["verdict"]).filter(|v| v["state"] == "faulty").collect();
    let [verdict] = faulty[..] else { panic!("{lines:?}") };
    assert_eq!(verdict["component"], "e3");
    let first = verdict["first_index"].as_u64().unwrap();
    assert_eq!(verdict["first_time"], format!("{} s", first as f64 / 5.0));
    assert_eq!(verdict["last_time"], "719.8 s");
    assert!((1990..2015).contains(&first), "{verdict}");
    let components = &lines.last().unwrap()["summary"]["components"];
    assert_eq!(components["e3"]["state"], "faulty");
    assert_eq!(components["e3"]["first_index"], first);
    for healthy in ["e1", "e2", "e4", "Kraft"] {
        assert_eq!(components[healthy]["state"], "normal", "{components}");
    }
}

/// A row every ten minutes, as data acquisition of buildings and turbines keeps them.
#[test]
fn rows_farther_apart_than_a_second_are_windows() {
    let directory = tempfile::tempdir().unwrap();
    let slow = |name: &str, seed: u64, step_s: u64| {
        let file = directory.path().join(name);
        table(&file, seed, |_, _| {});
        let text = std::fs::read_to_string(&file).unwrap();
        let mut slow = "time [s];Kraft;e1;e2;e3;e4\n".to_owned();
        for (row, line) in text.lines().skip(1).enumerate() {
            let (_, cells) = line.split_once(';').unwrap();
            writeln!(slow, "{};{cells}", row as u64 * step_s).unwrap();
        }
        std::fs::write(&file, slow).unwrap();
        file.display().to_string()
    };
    let files = [slow("a.csv", 1, 600), slow("b.csv", 2, 600), slow("c.csv", 3, 600)];
    let out = directory.path().join("slow.toml").display().to_string();
    let mut learn = vec!["learn"];
    learn.extend(files.iter().map(String::as_str));
    learn.extend(["--inputs", "Kraft", "--sensors", "e1,e2,e3,e4", "--out", &out]);
    let outcome = run(&learn);
    outcome.succeeds();
    let said = "learnt from 3 recordings, 1800.00 h, in windows of 600 s";
    assert!(outcome.stdout.contains(said), "{}", outcome.stdout);
    run(&["detect", &slow("d.csv", 4, 600), "--config", &out]).succeeds();
    let hourly = slow("e.csv", 4, 3600);
    let said = "e.csv: samples are 3600 s apart, but the module compares medians of 600 s";
    run(&["detect", &hourly, "--config", &out]).fails(3, &[said]);
}

#[test]
fn what_is_missing_is_named() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("one.csv");
    table(&file, 1, |_, _| {});
    let (file, out) = (file.display().to_string(), directory.path().join("m.toml"));
    let out = out.display().to_string();
    let learn = |sensors: &str, inputs: &str| {
        run(&["learn", &file, "--inputs", inputs, "--sensors", sensors, "--out", &out])
    };
    learn("e1,e7", "Kraft").fails(3, &["missing column `e7`"]);
    learn("e1,e1", "Kraft").fails(3, &["duplicate name"]);
    let whole = std::fs::read_to_string(&file).unwrap();
    let steps: String = (0..99).map(|k| format!("{k};1,{k}\n")).collect();
    std::fs::write(&file, format!("step;Kraft\n{steps}9000000000000;1,0\n")).unwrap();
    let one = run(&["learn", &file, "--inputs", "Kraft", "--sensors", "#1", "--out", &out]);
    one.fails(3, &["rows are missing in a row, at most 1000000 may be; correct the steps"]);
    std::fs::write(&file, &whole).unwrap();
    let text = std::fs::read_to_string(&file).unwrap().replace("Zeit [s]", "n");
    std::fs::write(&file, text).unwrap();
    learn("e1,e2,e3", "Kraft")
        .fails(3, &["no column of times tells the sampling rate; add --rate HZ"]);
    std::fs::write(&out, "change_threshold = 3\n").unwrap();
    run(&["detect", &file, "--config", &out]).fails(3, &["m.toml:", "missing field"]);
}

#[test]
fn a_module_that_is_sampled_every_ten_minutes_has_a_valid_diagnoser() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name).display().to_string();
    let tables = repository("crates/cli/walkthrough");
    let healthy = ["may.csv", "june.csv", "july.csv"];
    let healthy = healthy.map(|name| tables.join(name).display().to_string());
    let mut arguments = vec!["learn"];
    arguments.extend(healthy.iter().map(String::as_str));
    let learned = path("learned.toml");
    arguments.extend(["--out", &learned, "--inputs", "wind711", "--sensors", "wind721,wind736"]);
    run(&arguments).succeeds();
    let check = |step_s: &str| {
        let head = "module = 'm'\nstructure_name = 'park'\nlearned = 'learned.toml'\n";
        std::fs::write(path("m.toml"), format!("{head}step_s = {step_s}\n")).unwrap();
        run(&["check", &path("m.toml")])
    };
    check("600.0").succeeds();
    check("6000.0")
        .fails(3, &["m.toml:4: `step_s` is 6000; use seconds above 0, at most the window"]);
}
