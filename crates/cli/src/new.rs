//! `trusswatch new`: from a structure's description to a directory that runs.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Parser;
use daemon::config::{PlantConfig, PlantFlags, load_diagnoser, load_plant};
use diagnosis::ModuleSetup;
use plant::{HydraulicParameters, PlantParameters};
use settings::ConfigErrors;
use study::module_setups;
use toml::{Table, Value};
use truss::{Prediction, Structure};
use vocabulary::ModuleName;

use crate::command_line::{CommandLine, TopCommand};
use crate::failure::Failure;
use crate::replicate::directory::Directory;
use crate::replicate::layout::NetworkLayout;
use crate::shipped::{Shipped, TEMPLATES};
use crate::{calibrate, commission, model, output};

const STRUCTURE: &str = "structure.toml";
const PLANT: &str = "plant.toml";
const ASSUMED: &str = "assumed.txt";
/// Of a force loop in steps at least: sampled faster than that, it oscillates.
const LOOP_STEPS: f64 = 4.0;
const GAIN: &str = "force_gain_m3_per_s_per_n";
/// Duration of a fault-free run after its warm-up, at least: seconds, and steps.
const RUN_S: f64 = 12.5;
const RUN_STEPS: f64 = 10_000.0;
/// Snippets under varied weather: as many as a reference has values, and so many more.
const LEAST_SNIPPETS: usize = 40;
const MORE_THAN_VALUES: usize = 12;

const EXAMPLES: &str = "\
Examples:
  trusswatch new --template bridge > bridge.toml
  trusswatch new --template bridge-traffic > traffic.toml
  trusswatch new bridge.toml --plant traffic.toml --out bridge
  trusswatch study run --plant bridge/plant.toml --config bridge/west.toml --config bridge/east.toml --mismatch 0.1
  trusswatch new --check bridge";

/// Make a directory that runs of a structure's description
///
/// The directory gets the plant and, for each equipped module, a diagnoser: its part of the structure, held by the
/// stiffness of the rest; its thresholds and root ratio, calibrated on simulated plants within 10 %; and its reference,
/// learned in simulated weather. All of them are processes of this machine. What was assumed is printed, and kept in
/// `assumed.txt`. A minute or two on two cores.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Description of the structure (TOML)
    #[arg(required_unless_present_any = ["template", "check"])]
    structure: Option<PathBuf>,
    /// Print a description to start from; `bridge-traffic` is one for `--plant`
    #[arg(long, value_name = "NAME", conflicts_with_all = ["structure", "out", "check"], value_parser = TEMPLATES.map(|(name, _)| name))]
    template: Option<String>,
    /// The directory that takes the files; a new or an empty one
    #[arg(long, value_name = "DIRECTORY", required_unless_present_any = ["template", "check"])]
    out: Option<PathBuf>,
    /// Cylinders, gages, loads, controller and sampling step: a table `[plant]` as in a plant's configuration, of which
    /// nothing else is used [default: the tower's figures]
    #[arg(long, value_name = "PLANT.toml", conflicts_with_all = ["template", "check"])]
    plant: Option<PathBuf>,
    /// Fault-free runs for the thresholds
    #[arg(long, value_name = "N", default_value_t = 100)]
    runs: u64,
    /// The port on which the plant listens; the modules take those that follow
    #[arg(long, value_name = "PORT", default_value_t = 7447)]
    first_port: u16,
    /// Say what of such a directory is missing or wrong
    #[arg(long, value_name = "DIRECTORY", conflicts_with_all = ["structure", "out"])]
    check: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(name) = &arguments.template {
        let template = TEMPLATES.iter().find(|(known, _)| known == name);
        return output::print(template.map_or("", |(_, Shipped { text, .. })| text));
    }
    match (&arguments.check, &arguments.structure, &arguments.out) {
        (Some(directory), ..) => output::print(&checked(directory)?),
        (None, Some(structure), Some(out)) => make(arguments, structure, out),
        _ => Err(Failure::usage("name the structure's description and `--out DIRECTORY`")),
    }
}

fn make(arguments: &Arguments, file: &Path, out: &Path) -> Result<(), Failure> {
    let structure = model::read(file)?;
    let equipped: Vec<ModuleName> = structure.equipped().map(|m| m.name.clone()).collect();
    if equipped.is_empty() {
        let problem = "no module has actuators or gages; give one some";
        return Err(Failure::input(format!("{}: {problem}", file.display())));
    }
    let layout = NetworkLayout::mesh(arguments.first_port, equipped.len())?;
    let given = arguments.plant.as_deref().map(plant_table).transpose()?.unwrap_or_default();
    let directory = Directory::claim(out)?;
    let mut assumed = Vec::new();
    let table = with_fitting_gain(given.clone(), &mut assumed);
    let table = match given.contains_key("hydraulics") {
        true => table,
        false => with_strong_cylinders(table, &structure),
    };
    directory.write(STRUCTURE, &structure.to_toml())?;
    directory.write(PLANT, &plant_text(table, &layout))?;
    let plant = load_plant(&out.join(PLANT), &PlantFlags::default())
        .map_err(|errors| of_given_files(errors, arguments, file, out))?;
    assumed.extend(assumptions(&structure, &plant, given.contains_key("hydraulics")));
    let setups = module_setups(&structure, &plant.parameters)
        .map_err(|error| Failure::input(format!("{}: {error}", file.display())))?;
    let mut files = Vec::new();
    for (place, setup) in setups.iter().enumerate() {
        let linked: Vec<usize> = (0..setups.len()).filter(|other| *other != place).collect();
        let network = layout.of_module(place, &linked);
        let name = format!("{}.toml", setup.module);
        let comment = format!(
            "# Part of module `{}`, held by the stiffness of the rest of the structure.\n",
            setup.module
        );
        directory
            .write(&part_of(&setup.module), &format!("{comment}{}", setup.structure.to_toml()))?;
        directory.write(&name, &module_text(setup, network, false)?)?;
        directory.write(&format!("thresholds/{name}"), "")?;
        files.push(out.join(name));
        let local = structure.predictions(&setup.structure);
        let local = local.map_err(|error| Failure::input(error.to_string()))?;
        assumed.extend(warnings(&setup.module, &local));
    }
    let text: String = assumed.iter().map(|line| format!("- {line}\n")).collect();
    directory.write(ASSUMED, &text)?;
    write!(output::stdout(), "Assumed, see {}:\n{text}\n", out.join(ASSUMED).display())?;
    calibrate_and_commission(arguments, &plant, &setups, &files, out)?;
    for (place, setup) in setups.iter().enumerate() {
        let linked: Vec<usize> = (0..setups.len()).filter(|other| *other != place).collect();
        let text = module_text(setup, layout.of_module(place, &linked), true)?;
        directory.write(&format!("{}.toml", setup.module), &text)?;
    }
    let complete = checked(out)?;
    directory.keep();
    output::print(&complete)
}

/// Names in place of the files made, which are gone, those given.
fn of_given_files(
    mut errors: ConfigErrors,
    arguments: &Arguments,
    file: &Path,
    out: &Path,
) -> Failure {
    for error in &mut errors.0 {
        let given = match &arguments.plant {
            Some(plant) if error.file == out.join(PLANT) => plant,
            _ => file,
        };
        error.file = given.to_owned();
        error.line = None;
    }
    errors.into()
}

fn part_of(module: &ModuleName) -> String {
    format!("parts/{module}.structure.toml")
}

/// Thresholds, and then references, by the commands that make them.
fn calibrate_and_commission(
    arguments: &Arguments,
    plant: &PlantConfig,
    setups: &[ModuleSetup],
    files: &[PathBuf],
    out: &Path,
) -> Result<(), Failure> {
    let values: usize = setups.iter().map(|setup| setup.components().len()).sum();
    let snippets = LEAST_SNIPPETS.max(values + MORE_THAN_VALUES).to_string();
    let warm_up = setups.iter().map(|setup| setup.detection.warm_up_vectors).max().unwrap_or(0);
    let warm_up_s = warm_up as f64 * plant.parameters.step_s;
    // The smallest forces that can be told from the noise are far below; the largest is what the plant allows.
    let stroke = (0.8 * plant.parameters.hydraulics.demand_limit_n).to_string();
    let words = |command: &str, more: &[&dyn AsRef<std::ffi::OsStr>]| -> Vec<OsString> {
        let plant = out.join(PLANT);
        let mut words: Vec<OsString> = vec!["trusswatch".into(), command.into()];
        words.extend(files.iter().map(OsString::from));
        words.extend(["--plant".into(), plant.into()]);
        words.extend(more.iter().map(|word| word.as_ref().to_owned()));
        words
    };
    // Slow sampling needs more time for as many samples.
    let seconds = warm_up_s + RUN_S.max(RUN_STEPS * plant.parameters.step_s);
    let (runs, seconds) = (arguments.runs.to_string(), seconds.to_string());
    let references = out.join("references");
    call(words("calibrate", &[&"--runs", &runs, &"--seconds", &seconds]))?;
    let snippet = (12.0_f64).max(2.0 * warm_up_s).to_string();
    call(words(
        "commission",
        &[
            &"--out",
            &references,
            &"--snippets",
            &snippets,
            &"--stroke-n",
            &stroke,
            &"--seconds",
            &snippet,
        ],
    ))
}

/// Runs a subcommand as a person would type it.
fn call(words: Vec<OsString>) -> Result<(), Failure> {
    let line =
        CommandLine::try_parse_from(words).map_err(|error| Failure::usage(error.to_string()))?;
    match line.command {
        TopCommand::Calibrate(arguments) => calibrate::run(&arguments),
        TopCommand::Commission(arguments) => commission::run(&arguments),
        _ => Ok(()),
    }
}

/// The table `[plant]` of a file, or the whole file if it has none.
fn plant_table(file: &Path) -> Result<Table, Failure> {
    let text = fs::read_to_string(file).map_err(|error| Failure::unreadable(file, error))?;
    let unusable = |reason: &str| Failure::input(format!("{}: {reason}", file.display()));
    let mut table: Table =
        text.parse().map_err(|error: toml::de::Error| unusable(error.message()))?;
    match table.remove("plant") {
        Some(Value::Table(plant)) => Ok(plant),
        _ => Err(unusable("missing table `[plant]`, e.g. with `step_s` and `[plant.hydraulics]`")),
    }
}

fn plant_text(given: Table, layout: &NetworkLayout) -> String {
    let mut table = Table::new();
    table.insert("structure".into(), STRUCTURE.into());
    table.insert("plant".into(), given.into());
    table.insert("network".into(), layout.of_plant().into());
    format!("# The simulated plant. Made by `trusswatch new`.\n{table}")
}

/// Slows the force control down if its gain is left open and does not fit the step.
fn with_fitting_gain(mut given: Table, assumed: &mut Vec<String>) -> Table {
    let hydraulics = given.get("hydraulics").and_then(Value::as_table).cloned();
    let mut hydraulics = hydraulics.unwrap_or_default();
    // What cannot be read is refused with its place when the plant's file is.
    let Ok(parameters) = Value::Table(given.clone()).try_into::<PlantParameters>() else {
        return given;
    };
    let least_s = LOOP_STEPS * parameters.step_s;
    let present_s = parameters.hydraulics.time_constant_s();
    if hydraulics.contains_key(GAIN) || present_s >= least_s {
        return given;
    }
    let gain = parameters.hydraulics.force_gain_m3_per_s_per_n * present_s / least_s;
    assumed.push(format!(
        "Force control: a gain of {gain:.3e} m³/s/N, so that its time constant is {LOOP_STEPS} steps of {} s.",
        parameters.step_s
    ));
    hydraulics.insert(GAIN.into(), gain.into());
    given.insert("hydraulics".into(), hydraulics.into());
    given
}

/// Enlarges the tower's cylinders if the structure's loads ask for more, unless others are given.
fn with_strong_cylinders(mut table: Table, structure: &Structure) -> Table {
    // What cannot be read or built is refused with its place later.
    let Ok(parameters) = Value::Table(table.clone()).try_into::<PlantParameters>() else {
        return table;
    };
    if let Ok(times) = study::missing_cylinder_size(structure, &parameters)
        && times > 1.0
        && let Ok(larger) = Value::try_from(parameters.hydraulics.enlarged(times))
    {
        table.insert("hydraulics".into(), larger);
    }
    table
}

fn assumptions(structure: &Structure, plant: &PlantConfig, hydraulics_given: bool) -> Vec<String> {
    let parameters = &plant.parameters;
    let mut lines = vec![
        format!("Sampling: {} s, and intervals, ties and holds to match.", parameters.step_s),
        "Each part is held by the statically condensed stiffness of the rest of the structure, which predicts its own \
         cylinders' effects whatever the supports; the rest's inertia and other modules' cylinders are not in it."
            .to_owned(),
        "Every module asks every other one.".to_owned(),
        format!(
            "Loads, as plant.toml has them (left open, the tower's): {}. Wind and live loads act on each height at which \
             nodes can move. Under others calibrate and commission again.",
            parameters.loads_in_words()
        ),
    ];
    if !hydraulics_given && structure.modules.iter().any(|module| !module.actuators.is_empty()) {
        let limit_n = parameters.hydraulics.demand_limit_n;
        let times = limit_n / HydraulicParameters::default().demand_limit_n;
        let size = match times > 1.0 {
            true => format!(
                ", {times:.1} times as large, for up to {:.0} kN: smaller ones have no reserve for mean wind and live loads",
                1e-3 * limit_n
            ),
            false => String::new(),
        };
        lines.push(format!(
            "Cylinders, valves and pressure sensors: the tower's{size}; give yours with `--plant`."
        ));
    }
    lines
}

/// What the local model does not predict.
fn warnings(module: &ModuleName, predictions: &[Prediction]) -> Vec<String> {
    let mut lines = Vec::new();
    let wrong = |own: bool| {
        predictions.iter().filter(move |p| p.is_wrong() && (p.module == *module) == own)
    };
    for found in wrong(true) {
        let (gage, actuator, share) = (&found.gage, &found.actuator, 100.0 * found.share());
        lines.push(format!("WARNING: {module}/{gage} reads {share:.0} % of the effect of {actuator} by the local model."));
    }
    let mut gages: Vec<String> = wrong(false).map(|found| found.gage.to_string()).collect();
    gages.dedup();
    if !gages.is_empty() {
        let mut line = format!("{module}: other modules' cylinders move ");
        let _ = write!(
            line,
            "{}; their effects are explained by asking, not predicted.",
            gages.join(", ")
        );
        lines.push(line);
    }
    lines
}

fn module_text(
    setup: &ModuleSetup,
    network: Table,
    has_reference: bool,
) -> Result<String, Failure> {
    let name = &setup.module;
    let mut table = Table::new();
    table.insert("module".into(), name.to_string().into());
    table.insert("structure".into(), part_of(name).into());
    table.insert("thresholds".into(), format!("thresholds/{name}.toml").into());
    if has_reference {
        table.insert("reference".into(), format!("references/{name}.toml").into());
    }
    let peers: Vec<Value> = setup.peers.iter().map(|peer| peer.to_string().into()).collect();
    table.insert("peers".into(), peers.into());
    table.insert("step_s".into(), setup.step_s.into());
    table.insert("gage_noise_strain".into(), setup.gage_noise_strain.into());
    if let Some(hydraulics) = &setup.hydraulics {
        let hydraulics =
            Table::try_from(hydraulics).map_err(|e| Failure::runtime(e.to_string()))?;
        table.insert("hydraulics".into(), hydraulics.into());
    }
    table.insert("network".into(), network.into());
    Ok(format!("# Diagnoser of module `{name}`. Made by `trusswatch new`.\n{table}"))
}

/// The confirmation that a directory is complete, or what of it is missing or wrong.
fn checked(directory: &Path) -> Result<String, Failure> {
    let plant = load_plant(&directory.join(PLANT), &PlantFlags::default())?;
    let mut mistakes = Vec::new();
    let mut files = Vec::new();
    for module in plant.structure.equipped() {
        let file = directory.join(format!("{}.toml", module.name));
        match load_diagnoser(&file) {
            Ok(config) if config.module_setup().reference.is_none() => mistakes.push(format!(
                "{}: no `reference`; make one with `trusswatch commission`",
                file.display()
            )),
            Ok(_) => files.push(file),
            Err(errors) => mistakes.extend(errors.0.iter().map(ToString::to_string)),
        }
    }
    if !mistakes.is_empty() {
        return Err(Failure::inputs(mistakes));
    }
    let configs: String =
        files.iter().map(|file| format!(" --config {}", file.display())).collect();
    let plant = directory.join(PLANT);
    Ok(format!(
        "{}: complete, {} diagnosers. Try:\n  trusswatch study run --plant {}{configs} --mismatch 0.1 --scenarios 60\n",
        directory.display(),
        files.len(),
        plant.display()
    ))
}
