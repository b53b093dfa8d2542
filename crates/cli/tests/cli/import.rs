//! `trusswatch import`: tables of two loggers become one recording, which the other commands read.

use std::fmt::Write;
use std::path::Path;

use crate::binary::{Outcome, run};

/// What both loggers measure, at a time \[s\].
fn load(time_s: f64) -> f64 {
    50.0 + 30.0 * (time_s / 9.0).sin()
        + 8.0 * (time_s / 2.1).cos()
        + (time_s * time_s / 500.0).sin()
}

/// Forces in kN at 10 Hz, gages at 5 Hz by a logger that began so much later.
fn tables(directory: &Path, day: u32, later_s: f64, bias: f64) -> [String; 2] {
    let jitter = |k: u32, channel: u32| {
        let bits = (k * 7919 + channel * 104_729 + day * 1_299_709).wrapping_mul(2_654_435_761);
        f64::from(bits >> 8) / f64::from(1 << 24) - 0.5
    };
    let zero = f64::from(day % 3);
    let mut forces = "Time [s],F [kN]\n".to_owned();
    for k in 0..6000 {
        let time_s = f64::from(k) / 10.0;
        // One row is missing.
        if k != 3000 {
            writeln!(forces, "{time_s:.1},{:.4}", load(time_s) + 0.05 * jitter(k, 0)).unwrap();
        }
    }
    let mut gages = "t;e1 [um/m];e2;trigger\n".to_owned();
    for k in 0..2900 {
        let time_s = f64::from(k) / 5.0;
        let load = load(time_s + later_s);
        let e1 = -2.0 * load + zero + 0.1 * jitter(k, 1) + if k > 1500 { bias } else { 0.0 };
        let e2 = 0.7 * load - zero + 0.1 * jitter(k, 2);
        writeln!(gages, "{time_s:.1};{e1:.4};{e2:.4};{load:.3}").unwrap();
    }
    [("forces", forces), ("gages", gages)].map(|(name, text)| {
        let file = directory.join(format!("{name}{day}.csv"));
        std::fs::write(&file, text).unwrap();
        file.display().to_string()
    })
}

const MAP: &str = "structure = 'bridge'\nmodule = 'span'\nstep_s = 0.2\n\
    [[tables]]\ncommon = 'F [kN]'\n[[tables]]\ncommon = 'trigger'\n\
    [[columns]]\ncolumn = 'F [kN]'\ncomponent = 'sensor/F'\nunit = 'kN'\nscale = 1000.0\n\
    [[columns]]\ntable = 2\ncolumn = 'e1 [um/m]'\ncomponent = 'sensor/e1'\nsign = -1.0\n\
    [[columns]]\ntable = 2\ncolumn = 'e2'\ncomponent = 'sensor/e2'\noffset = 1.0\n";

fn imported(directory: &Path, day: u32, later_s: f64, bias: f64) -> (String, Outcome) {
    let [forces, gages] = tables(directory, day, later_s, bias);
    let map = directory.join("map.toml");
    std::fs::write(&map, MAP).unwrap();
    let (map, out) = (map.display().to_string(), directory.join(format!("day{day}.mcap")));
    let out = out.display().to_string();
    let outcome = run(&["import", &forces, &gages, "--map", &map, "--out", &out]);
    (out, outcome)
}

#[test]
fn two_loggers_become_a_recording_that_is_learnt_and_judged() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let days: Vec<String> = [(1, 3.4), (2, 0.0), (3, 12.0)]
        .map(|(day, later_s)| {
            let (out, outcome) = imported(here, day, later_s, 0.0);
            outcome.succeeds();
            let offset = format!("begins {later_s:+.1}");
            assert!(outcome.stdout.contains(&offset), "{offset}: {}", outcome.stdout);
            assert!(outcome.stdout.contains("1 values missing"), "{}", outcome.stdout);
            out
        })
        .into();
    let module = here.join("learned.toml").display().to_string();
    let mut learn = vec!["learn"];
    learn.extend(days.iter().map(String::as_str));
    learn.extend(["--inputs", "F", "--sensors", "e1,e2", "--out", &module]);
    run(&learn).succeeds();
    let (today, outcome) = imported(here, 4, -2.0, 20.0);
    outcome.succeeds();
    let svg = here.join("today.svg").display().to_string();
    let outcome = run(&["detect", &today, "--config", &module, "--svg", &svg]);
    outcome.succeeds();
    assert!(outcome.stdout.contains("e1: faulty, rows 149"), "{}", outcome.stdout);
    let picture = std::fs::read_to_string(&svg).unwrap();
    for part in ["(a) e1\n", "(c) F\n", "\nfaulty\n"] {
        assert!(picture.contains(part), "{part}");
    }
    let config = here.join("span.toml");
    let text =
        "module = 'span'\nstructure_name = 'bridge'\nlearned = 'learned.toml'\nstep_s = 0.2\n";
    std::fs::write(&config, text).unwrap();
    // The learned module has its channels in another order than the recording.
    let replayed = run(&["replay", &today, "--config", &config.display().to_string()]);
    assert!(replayed.stdout.contains("span/sensor/e1"), "{}", replayed.stdout);
    assert!(!replayed.stdout.contains("span/sensor/F"), "{}", replayed.stdout);
    let tables = here.join("tables").display().to_string();
    run(&["export", &today, "--csv", &tables]).succeeds();
    let table = std::fs::read_to_string(here.join("tables/span-run-1.csv")).unwrap();
    assert!(table.starts_with("step,time_s,published_s,span/sensor/F/reading,"), "{table:.90}");
    let first: Vec<f64> = table
        .lines()
        .nth(1)
        .unwrap()
        .split(',')
        .skip(3)
        .take(3)
        .map(|x| x.parse().unwrap())
        .collect();
    // The recording begins when both have begun; at -2 s that is when the forces do.
    assert!((first[0] - 1000.0 * load(0.0)).abs() < 100.0, "{first:?}");
    assert!((first[1] - 2.0 * load(0.0)).abs() < 4.0, "{first:?}");
    assert!((first[2] - (0.7 * load(0.0) - 2.0)).abs() < 2.0, "{first:?}");
}

#[test]
fn a_map_is_proposed_and_mistakes_in_it_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let [forces, gages] = tables(directory.path(), 1, 0.0, 0.0);
    let map = directory.path().join("proposed.toml");
    let (file, out) = (map.display().to_string(), directory.path().join("a.mcap"));
    let out = out.display().to_string();
    run(&["import", &forces, &gages, "--map", &file, "--propose"]).succeeds();
    let proposed = std::fs::read_to_string(&map).unwrap();
    let import = |text: &str| {
        std::fs::write(&map, text).unwrap();
        run(&["import", &forces, &gages, "--map", &file, "--out", &out])
    };
    for part in
        ["component = \"sensor/F\"\nunit = \"kN\"", "component = \"sensor/e1\"\nunit = \"um/m\""]
    {
        assert!(proposed.contains(part), "{proposed}");
    }
    for (from, to, complaint) in [
        ("column = \"e2\"", "column = \"e9\"", "missing column `e9`"),
        ("sensor/e2", "actuator/e2", "has no such component"),
        ("sensor/e2", "sensor/e1", "several columns are `sensor/e1`"),
        ("table = 2\ncolumn = \"e2\"", "table = 3\ncolumn = \"e2\"", "`table` is 3; use 1 to 2"),
        ("structure = ", "step_s = -1.0\nstructure = ", "`step_s` is -1"),
    ] {
        assert!(proposed.contains(from), "{from}: {proposed}");
        import(&proposed.replacen(from, to, 1)).fails(3, &[complaint]);
    }
    let common = proposed.replacen("[[tables]]", "[[tables]]\ncommon = \"F [kN]\"", 1);
    let (head, tail) = common.rsplit_once("[[tables]]").unwrap();
    import(&format!("{head}[[tables]]\ncommon = \"Time\"{tail}")).fails(3, &["Time"]);
    import(&proposed).succeeds();
    run(&["import", &forces, "--map", &file, "--propose"]).fails(1, &["proposed.toml"]);
}

#[test]
fn tables_with_dates_are_aligned_by_them_and_date_the_recording() {
    let directory = tempfile::tempdir().unwrap();
    let here = directory.path();
    let file = |name: &str| here.join(name).display().to_string();
    // Each reads the seconds since 10:00.
    let table = |name: &str, first: u32, zone: &str| {
        let row = |k: u32| format!("2024-05-01T10:00:{k:02}{zone},{k}\n");
        let rows: String = (first..first + 20).map(row).collect();
        std::fs::write(file(name), format!("time,{name}\n{rows}")).unwrap();
        file(name)
    };
    let map = file("map.toml");
    let text = "structure = 'bridge'\nmodule = 'span'\n\
        [[columns]]\ncolumn = 'a'\ncomponent = 'sensor/a'\n\
        [[columns]]\ntable = 2\ncolumn = 'b'\ncomponent = 'sensor/b'\n";
    std::fs::write(&map, text).unwrap();
    let out = file("out.mcap");
    let import = |a: &str, b: &str| {
        let _ = std::fs::remove_file(&out);
        run(&["import", a, b, "--map", &map, "--out", &out])
    };
    let (zoned, later) = (table("a", 3, "Z"), table("b", 8, "Z"));
    let outcome = import(&zoned, &later);
    outcome.succeeds();
    assert!(
        outcome.stdout.contains("it begins at 2024-05-01T10:00:08.000Z\n"),
        "{}",
        outcome.stdout
    );
    assert!(outcome.stdout.contains("15 samples of 2 signals"), "{}", outcome.stdout);
    run(&["export", &out, "--csv", &file("tables")]).succeeds();
    let exported = std::fs::read_to_string(here.join("tables/span-run-1.csv")).unwrap();
    let cells: Vec<&str> = exported.lines().nth(1).unwrap().split(',').collect();
    let cells: Vec<f64> = cells.iter().map(|cell| cell.parse().unwrap()).collect();
    assert_eq!((cells[2], cells[3], cells[4]), (1_714_557_608.0, 8.0, 8.0), "{exported}");
    let bare = table("b", 8, "");
    let outcome = import(&zoned, &bare);
    assert!(outcome.stderr.contains("says the time zone of its times and"), "{}", outcome.stderr);
    let outcome = import(&table("a", 3, ""), &bare);
    outcome.succeeds();
    assert!(outcome.stdout.contains("name no zone and are taken for UTC"), "{}", outcome.stdout);
    let outcome = import(&table("a", 30, ""), &bare);
    assert!(outcome.stderr.contains("no time in common"), "{}", outcome.stderr);
}
