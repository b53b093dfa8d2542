//! `trusswatch replicate` through the real binary.

use std::path::{Path, PathBuf};

use crate::binary::{Outcome, repository, run};

/// What is repeated, into this directory, with these further words.
fn repeat(out: &Path, words: &[&str]) -> Outcome {
    let file = |path| repository(path).display().to_string();
    let (first, second) = (file("configs/module1.toml"), file("configs/module2.toml"));
    let (plant, out) = (file("configs/plant.toml"), out.display().to_string());
    let mut arguments = vec!["replicate", &first, &second, "--plant", &plant, "--out", &out];
    arguments.extend(words);
    run(&arguments)
}

fn files(directory: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files
}

fn names(directory: &Path) -> Vec<String> {
    let name = |path: PathBuf| path.file_name().unwrap().to_string_lossy().into_owned();
    files(directory).into_iter().map(name).collect()
}

/// Every file that was written is valid; what `check` reports of them.
fn checked(directory: &Path) -> String {
    let mut all = vec![PathBuf::from("check")];
    for folder in [directory.to_owned(), directory.join("structures"), directory.join("thresholds")]
    {
        all.extend(files(&folder).into_iter().filter(|path| path.is_file()));
    }
    let outcome = run(&all);
    outcome.succeeds();
    outcome.stdout
}

fn table(file: &Path) -> toml::Table {
    std::fs::read_to_string(file).unwrap().parse().unwrap()
}

#[test]
fn every_file_of_a_row_is_valid_and_states_its_origin() {
    let directory = tempfile::tempdir().unwrap();
    let row = directory.path().join("row");
    let outcome = repeat(&row, &["--copies", "3"]);
    outcome.succeeds();
    assert!(outcome.stdout.contains("3 copies of `tower`, 6 diagnosers"), "{}", outcome.stdout);
    let said = checked(&row);
    for text in [
        "structure `tower-x3`, 156 nodes, 456 members",
        "diagnoser of module `t02-module1` of `tower-x3`, 4 actuators, 8 gages, peers: t02-module2",
        "12 thresholds of module `t03-module2`",
        "plant of `tower-x3`",
    ] {
        assert!(said.contains(text), "`{text}` is not in: {said}");
    }
    let thresholds = table(&row.join("thresholds/t03-module2.toml"));
    let original = table(&repository("configs/thresholds/module2.toml"));
    assert_eq!(thresholds["thresholds"], original["thresholds"]);
    let note = thresholds["provenance"]["note"].as_str().unwrap();
    assert!(note.contains("those of `module2` of the structure `tower`"), "{note}");
}

#[test]
fn peers_reach_as_far_as_asked_for_and_each_pair_is_linked_once() {
    let directory = tempfile::tempdir().unwrap();
    let row = directory.path().join("row");
    repeat(&row, &["--copies", "4", "--neighbours", "1", "--first-port", "9000"]).succeeds();
    checked(&row);
    let config = table(&row.join("t02-module1.toml"));
    let peers: Vec<&str> =
        config["peers"].as_array().unwrap().iter().filter_map(toml::Value::as_str).collect();
    let expected = ["t01-module1", "t01-module2", "t02-module2", "t03-module1", "t03-module2"];
    assert_eq!(peers, expected);
    let network = config["network"].as_table().unwrap();
    assert_eq!(network["listen"].to_string(), r#"["tcp/127.0.0.1:9003"]"#);
    // The plant, and those of its peers that come before it.
    let connect = r#"["tcp/127.0.0.1:9000", "tcp/127.0.0.1:9001", "tcp/127.0.0.1:9002"]"#;
    assert_eq!(network["connect"].to_string(), connect);
}

#[test]
fn clients_of_a_router_get_its_settings_too() {
    let directory = tempfile::tempdir().unwrap();
    let row = directory.path().join("row");
    repeat(&row, &["--copies", "1", "--router", "tcp/127.0.0.1:7000"]).succeeds();
    let expected = [
        "plant.toml",
        "router.json5",
        "structure.toml",
        "structures",
        "t01-module1.toml",
        "t01-module2.toml",
        "thresholds",
    ];
    assert_eq!(names(&row), expected);
    checked(&row);
    let network = &table(&row.join("plant.toml"))["network"];
    assert_eq!(network["mode"].as_str(), Some("client"));
    assert_eq!(network["connect"].to_string(), r#"["tcp/127.0.0.1:7000"]"#);
    let router = std::fs::read_to_string(row.join("router.json5")).unwrap();
    assert!(router.contains("tcp/127.0.0.1:7000"), "{router}");
}

#[test]
fn what_cannot_be_made_is_refused_and_nothing_is_written() {
    let directory = tempfile::tempdir().unwrap();
    let row = directory.path().join("row");
    for copies in ["0", "501"] {
        let problem = format!("`--copies` is {copies}; use 1 to 500");
        repeat(&row, &["--copies", copies]).fails(2, &[&problem]);
    }
    let ports = ["--copies", "100", "--first-port", "65400"];
    repeat(&row, &ports).fails(2, &["`--first-port` is 65400; use 1 to 65335"]);
    let file = |path| repository(path).display().to_string();
    let (first, plant) = (file("configs/module1.toml"), file("configs/plant.toml"));
    let out = row.display().to_string();
    let one = ["replicate", &first, "--plant", &plant, "--copies", "2", "--out", &out];
    run(&one).fails(2, &["equipped module `module2`"]);
    let small = file("configs/small/lower.toml");
    repeat(&row, &[&small, "--copies", "2"])
        .fails(2, &["lower.toml", "`lower` is not an equipped"]);
    assert!(!row.exists());
}

/// Many on one machine cannot all serve one address or write one journal.
#[test]
fn what_copies_cannot_share_is_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let mut modules = Vec::new();
    for name in ["module1", "module2"] {
        let mut config = table(&repository(&format!("configs/{name}.toml")));
        for key in ["structure", "thresholds", "reference"] {
            let path = config[key].as_str().unwrap();
            let absolute = repository("configs").join(path).display().to_string();
            config.insert(key.into(), absolute.into());
        }
        config["state"].as_table_mut().unwrap().insert("directory".into(), "journal".into());
        let health = toml::Table::from_iter([("listen".to_owned(), "127.0.0.1:9465".into())]);
        config.insert("health".into(), health.into());
        std::fs::write(at(name), config.to_string()).unwrap();
        modules.push(at(name));
    }
    let plant = repository("configs/plant.toml");
    let mut arguments: Vec<PathBuf> = vec!["replicate".into()];
    arguments.extend(modules);
    arguments.extend(["--plant".into(), plant, "--copies".into(), "2".into()]);
    arguments.extend(["--out".into(), at("row")]);
    run(&arguments).succeeds();
    checked(&at("row"));
    let copied = table(&at("row").join("t02-module1.toml"));
    assert!(!copied.contains_key("health"));
    assert!(!copied["state"].as_table().unwrap().contains_key("directory"));
}

#[test]
fn each_copy_has_traffic_of_its_own() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let mut config = table(&repository("configs/plant.toml"));
    let structure = repository("configs/tower.toml").display().to_string();
    config.insert("structure".into(), structure.into());
    let lift: toml::Table =
        "paths = [[\"L01C1\", \"L02C1\"]]\naxles_n = [5e3]\naxles_behind_m = [0.0]\n\
        speed_m_per_s = [1.0, 2.0]\npause_s = [1.0, 8.0]"
            .parse()
            .unwrap();
    config["plant"].as_table_mut().unwrap().insert("moving_loads".into(), vec![lift].into());
    std::fs::write(at("plant.toml"), config.to_string()).unwrap();
    let module = |name: &str| repository(&format!("configs/{name}.toml"));
    let words = ["--copies", "2", "--out"].map(PathBuf::from);
    let mut arguments: Vec<PathBuf> =
        vec!["replicate".into(), module("module1"), module("module2")];
    arguments.extend(["--plant".into(), at("plant.toml")]);
    arguments.extend(words.into_iter().chain([at("row")]));
    run(&arguments).succeeds();
    checked(&at("row"));
    let copied = table(&at("row").join("plant.toml"));
    let loads = copied["plant"]["moving_loads"].as_array().unwrap();
    assert_eq!(loads.len(), 2);
    assert_eq!(loads[1]["paths"][0][1].as_str(), Some("t02-L02C1"));
}

#[test]
fn a_directory_with_files_in_it_is_left_alone() {
    let directory = tempfile::tempdir().unwrap();
    let kept = directory.path().join("kept.txt");
    std::fs::write(&kept, "mine").unwrap();
    let name = directory.path().display().to_string();
    repeat(directory.path(), &["--copies", "2"]).fails(1, &[&name, "has files in it"]);
    assert_eq!(names(directory.path()), ["kept.txt"]);
    repeat(&kept, &["--copies", "2"]).fails(1, &["kept.txt"]);
    assert_eq!(std::fs::read_to_string(&kept).unwrap(), "mine");
}
