//! `trusswatch commission` through the real binary, on the small mast.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use daemon::config::{PlantFlags, load_diagnoser, load_plant, load_uncalibrated};
use diagnosis::ModuleSetup;
use diagnosis::state::Reference;
use serde_json::Value;
use study::Rig;
use study::commissioning::{PlantSite, SnippetPlan, learn, record_snippets};
use vocabulary::RunId;

use crate::binary::{Outcome, run};
use crate::calibrate::{path, small_mast};

const MODULES: [&str; 2] = ["lower", "upper"];
/// Enough for the nine gages and cylinders of the mast, with a stroke of each cylinder.
const WEATHER: &str = "24";

fn commission(mast: &tempfile::TempDir, more: &[&str]) -> Outcome {
    let mut arguments = vec!["commission".to_owned()];
    arguments.extend(MODULES.map(|module| path(mast, &format!("{module}.toml"))));
    arguments.extend(more.iter().map(ToString::to_string));
    run(&arguments)
}

/// Commissions the simulated mast with these snippets, into `references`.
fn simulated(mast: &tempfile::TempDir, more: &[&str]) -> Outcome {
    let (plant, out) = (path(mast, "plant.toml"), path(mast, "references"));
    let usual = ["--plant", &plant, "--out", &out, "--seconds", "3", "--stroke-n", "20e3"];
    commission(mast, &[&usual[..], more].concat())
}

#[track_caller]
fn done(outcome: Outcome) -> String {
    assert_eq!(outcome.code, Some(0), "{}", outcome.stderr);
    outcome.stdout
}

fn reference(file: &str) -> Reference {
    toml::from_str(&fs::read_to_string(file).unwrap()).unwrap()
}

/// Lets a module's configuration name its reference.
fn name_reference(mast: &tempfile::TempDir, module: &str) -> PathBuf {
    let file = PathBuf::from(path(mast, &format!("{module}.toml")));
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, format!("reference = \"references/{module}.toml\"\n{text}")).unwrap();
    file
}

#[test]
fn references_are_written_that_the_modules_take() {
    let mast = small_mast();
    let said = done(simulated(&mast, &["--snippets", WEATHER]));
    for text in [
        "smallest bias",
        "lower/sensor/g1",
        "not seen beyond",
        "false alarms an hour at most (95 %)",
    ] {
        assert!(said.contains(text), "`{text}` is not in {said}");
    }
    for module in MODULES {
        let file = name_reference(&mast, module);
        let setup = load_diagnoser(&file).unwrap().module_setup();
        let reference = setup.reference.clone().unwrap();
        assert_eq!((reference.long.means.snippets, reference.peers().count()), (30, 1));
        let checked = run(&["check", &file.display().to_string()]);
        checked.succeeds();
        let alone = path(&mast, &format!("references/{module}.toml"));
        let text = fs::read_to_string(&alone).unwrap();
        assert!(text.starts_with("# ") && text.contains("# trusswatch commission "), "{text}");
        let checked = run(&["check", &alone]);
        checked.succeeds();
        assert!(checked.stdout.contains("reference of module"), "{}", checked.stdout);
    }
}

#[test]
fn a_spoilt_reference_is_refused_by_check() {
    let mast = small_mast();
    done(simulated(&mast, &["--snippets", WEATHER]));
    let file = path(&mast, "references/lower.toml");
    let text = fs::read_to_string(&file).unwrap();
    for (from, to, said) in [
        ("\nv = 4\n", "\nv = 7\n", "its version is 7"),
        // What another version has besides does not hide that it is one.
        ("\nv = 4\n", "\nv = 1\nmargin = 1.3\n", "its version is 1"),
        ("gage_threshold = ", "gage_threshold = -", "`gage_threshold` is -"),
        ("hours = ", "ours = ", "ours"),
    ] {
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        run(&["check", &file]).fails(3, &["lower.toml", said]);
    }
}

#[test]
fn later_snippets_are_added_to_earlier_ones() {
    let mast = small_mast();
    let snippets = path(&mast, "references/snippets.jsonl");
    let count = || fs::read_to_string(&snippets).unwrap().lines().count() - 1;
    done(simulated(&mast, &["--snippets", WEATHER]));
    assert_eq!(count(), 30);
    let more = ["--snippets", "5", "--seed", "2000", "--add", &snippets, "--json"];
    let object: Value = serde_json::from_str(&done(simulated(&mast, &more))).unwrap();
    assert_eq!(count(), 41);
    assert_eq!(reference(&path(&mast, "references/lower.toml")).long.means.snippets, 41);
    assert_eq!((&object["v"], &object["snippets"]), (&1.into(), &41.into()));
    assert_eq!(object["earlier_snippets"], 30);
    let lower = &object["modules"][0];
    assert_eq!((&lower["module"], &lower["snippets"]), (&"lower".into(), &41.into()));
    for figure in ["hours", "gage_threshold", "false_alarms_per_hour"] {
        assert!(lower[figure].as_f64().is_some_and(|figure| figure > 0.0), "{lower}");
    }
    assert_eq!(lower["gages"].as_array().unwrap().len(), 3);
    // the same snippets again would count twice
    let again = ["--snippets", "5", "--seed", "2000", "--add", &snippets];
    simulated(&mast, &again).fails(2, &["`seed 2000` is there twice", "`--seed`"]);
}

#[test]
fn earlier_snippets_of_something_else_are_refused() {
    let mast = small_mast();
    done(simulated(&mast, &["--snippets", WEATHER]));
    let snippets = path(&mast, "references/snippets.jsonl");
    let text = fs::read_to_string(&snippets).unwrap();
    let spoilt = path(&mast, "spoilt.jsonl");
    let refused = |text: &str, said: &[&str]| {
        fs::write(&spoilt, text).unwrap();
        let more = ["--snippets", "1", "--seed", "9", "--add", &spoilt];
        let outcome = simulated(&mast, &more);
        outcome.fails(3, &[&["spoilt.jsonl"], said].concat());
    };
    refused(&text.replacen("\"upper\"", "\"top\"", 1), &["`top`", "`upper`", "give the same"]);
    refused(&text.replacen("\"v\":2", "\"v\":9", 1), &["its version is 9"]);
    refused(&text.replacen("\"settings\":[\"", "\"settings\":[\"0", 1), &["settings of `lower`"]);
    refused(&text.replacen("\"label\"", "\"name\"", 1), &["line 2"]);
    refused("", &["it is empty"]);
    refused("{}\n", &["line 1", "snippets.jsonl"]);
    let absent = path(&mast, "absent.jsonl");
    simulated(&mast, &["--add", &absent]).fails(3, &["cannot read", "absent.jsonl"]);
}

/// The mast's plant, and what its modules are.
fn site(mast: &tempfile::TempDir) -> (PlantSite, Vec<ModuleSetup>) {
    let plant = load_plant(Path::new(&path(mast, "plant.toml")), &PlantFlags::default()).unwrap();
    let setup = |module| {
        let file = path(mast, &format!("{module}.toml"));
        load_uncalibrated(Path::new(&file)).unwrap().setup
    };
    let site = PlantSite::nominal(&plant.structure, &plant.parameters);
    (site, MODULES.map(setup).to_vec())
}

/// Records some steps of the mast into a directory.
fn record(mast: &tempfile::TempDir, seed: u64, steps: u64) -> String {
    let (site, setups) = site(mast);
    let directory = PathBuf::from(path(mast, &format!("recording{seed}")));
    fs::create_dir(&directory).unwrap();
    let mut tables: Vec<String> = setups.iter().map(header).collect();
    let plant = site.plant(seed).unwrap();
    let mut rig = Rig::new(plant, setups.clone(), Vec::new(), RunId(seed)).unwrap();
    for _ in 0..steps {
        rig.step().unwrap();
        for (table, sample) in tables.iter_mut().zip(rig.samples()) {
            let pressures = sample.pressures_pa.iter().flatten();
            write!(table, "{}", sample.step).unwrap();
            for value in sample.elongations_m.iter().chain(&sample.demands_n).chain(pressures) {
                write!(table, ",{value}").unwrap();
            }
            table.push('\n');
        }
    }
    for (table, setup) in tables.iter().zip(&setups) {
        fs::write(directory.join(format!("{}.csv", setup.module)), table).unwrap();
    }
    directory.display().to_string()
}

fn header(setup: &ModuleSetup) -> String {
    let components = setup.components();
    let (actuators, gages): (Vec<_>, Vec<_>) =
        components.iter().map(ToString::to_string).partition(|name| name.starts_with("actuator"));
    let mut names = vec!["step".to_owned()];
    let column = |component: &String, signal| format!("{}/{component}/{signal}", setup.module);
    names.extend(gages.iter().map(|gage| column(gage, "elongation_m")));
    names.extend(actuators.iter().map(|actuator| column(actuator, "demand_n")));
    for actuator in &actuators {
        names.extend(["pressure_a_pa", "pressure_b_pa"].map(|signal| column(actuator, signal)));
    }
    names.join(",") + "\n"
}

#[test]
fn recorded_samples_give_the_reference_of_the_same_samples_in_the_library() {
    let mast = small_mast();
    let seeds: Vec<u64> = (300..321).collect();
    let mut more: Vec<String> = vec!["--out".into(), path(&mast, "references")];
    for seed in &seeds {
        more.extend(["--recording".to_owned(), record(&mast, *seed, 4500)]);
    }
    done(commission(&mast, &more.iter().map(String::as_str).collect::<Vec<_>>()));
    let (site, setups) = site(&mast);
    let plan = |seed: &u64| SnippetPlan { seed: *seed, seconds: 2.0, stroke: None };
    let plans: Vec<SnippetPlan> = seeds.iter().map(plan).collect();
    let snippets = record_snippets(&site, &setups, &plans, 1, &|| {}).unwrap();
    for (place, module) in MODULES.iter().enumerate() {
        let expected = learn(&setups, place, &snippets, 0.001).unwrap();
        assert_eq!(reference(&path(&mast, &format!("references/{module}.toml"))), expected);
    }
}

#[test]
fn recordings_that_cannot_be_used_are_refused() {
    let mast = small_mast();
    let out = path(&mast, "references");
    let recording = record(&mast, 1, 3000);
    let with = |more: &[&str]| commission(&mast, &[&["--out", &out], more].concat());
    let too_few = "1 usable snippets are too few for 9 values; give at least 21";
    with(&["--recording", &recording]).fails(3, &[too_few]);
    with(&["--recording", &recording, "--recording", &recording]).fails(2, &["there twice"]);
    let table = Path::new(&recording).join("upper.csv");
    let good = fs::read_to_string(&table).unwrap();
    for (from, to, said) in [
        ("g2/elongation_m", "g2/strain", "missing column `upper/sensor/g2/elongation_m`"),
        ("\n7,", "\n6,", "line 9: step 6 after step 6; give each step once, rising"),
        ("\n7,", "\n6.5,", "line 9, column 1 `step`: invalid step `6.5`"),
        ("\n7,", "\n7,x,", "upper.csv, line 9"),
    ] {
        fs::write(&table, good.replacen(from, to, 1)).unwrap();
        with(&["--recording", &recording]).fails(3, &["upper.csv", said]);
    }
    fs::remove_file(&table).unwrap();
    with(&["--recording", &recording]).fails(3, &["cannot read", "upper.csv"]);
    assert!(!Path::new(&out).exists(), "nothing is written unless all is well");
}

#[test]
fn arguments_that_do_not_go_together_are_refused() {
    let mast = small_mast();
    let (plant, out) = (path(&mast, "plant.toml"), path(&mast, "references"));
    let (lower, upper) = (path(&mast, "lower.toml"), path(&mast, "upper.toml"));
    for (arguments, said) in [
        (vec![&*lower, &upper, "--out", &out], "--plant"),
        (vec![&lower, "--plant", &plant, "--out", &out], "module `upper` too"),
        (vec![&lower, "--recording", "x", "--out", &out], "`lower` has the peer `upper`"),
        (vec![&lower, &lower, "--plant", &plant, "--out", &out], "`lower` is given twice"),
        (vec![&lower, "--plant", &plant], "--out"),
        (vec![&lower, "--plant", &plant, "--out", &out, "--recording", "x"], "--recording"),
        (vec![&lower, "--plant", &plant, "--out", &out, "--seconds", "1"], "`--seconds` is 1"),
        (vec![&lower, "--plant", &plant, "--out", &out, "--stroke-n", "-1"], "`--stroke-n` is -1"),
        (vec![&lower, "--plant", &plant, "--out", &out, "--mismatch", "0.1"], "--plant-seed"),
    ] {
        run(&[&["commission"], &arguments[..]].concat()).fails(2, &[said]);
    }
}
