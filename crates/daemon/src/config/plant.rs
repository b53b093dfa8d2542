//! The configuration file of the simulated plant.

use std::net::SocketAddr;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use pki::Holder;
use plant::{Mismatch, Plant, PlantError, PlantParameters, ToleranceSettings};
use serde::{Deserialize, Serialize};
use session::{Network, NetworkFlags};
use settings::{ConfigErrors, SettingsFile};
use shell::health::{HealthFlags, HealthSettings};
use truss::Structure;
use vocabulary::{Encoding, ModuleName, RunId};

use super::diagnoser::load_structure;
use super::schedule::{Schedule, load_schedule};
use super::speed::Speed;

/// The content of the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlantFile {
    structure: PathBuf,
    #[serde(default = "first_seed")]
    seed: u64,
    #[serde(default = "real_time")]
    speed: Speed,
    #[serde(default = "usual_burst")]
    burst_steps: u64,
    #[serde(default)]
    blocks: bool,
    #[serde(default)]
    encoding: Encoding,
    #[serde(default)]
    steps: Option<u64>,
    #[serde(default)]
    wait_for: Option<Vec<ModuleName>>,
    #[serde(default)]
    schedule: Option<PathBuf>,
    #[serde(default)]
    mismatch: Option<MismatchSection>,
    #[serde(default)]
    plant: PlantParameters,
    #[serde(default)]
    lock_step: LockStep,
    #[serde(default)]
    tolerance: ToleranceSettings,
    #[serde(default)]
    network: Network,
    #[serde(default)]
    health: HealthSettings,
}

fn first_seed() -> u64 {
    1
}

fn real_time() -> Speed {
    Speed::REAL
}

fn usual_burst() -> u64 {
    4
}

/// The table `[mismatch]`: how the true tower differs from the description.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MismatchSection {
    /// Every stiffness, mass, damping, volume, gain and noise is multiplied by a random factor within 1 ± this value.
    pub relative: f64,
    /// Seed of the factors.
    pub seed: u64,
}

/// The table `[lock_step]`: how a plant that runs at maximum speed waits for the diagnosers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LockStep {
    /// Most steps ahead of the slowest diagnoser: 200.
    pub window_steps: u64,
    /// A diagnoser without progress for this long is ignored \[ms\]: 10000.
    pub timeout_ms: u64,
}

impl Default for LockStep {
    fn default() -> Self {
        Self { window_steps: 200, timeout_ms: 10_000 }
    }
}

/// The checked configuration of a plant process.
#[derive(Debug, Clone)]
pub struct PlantConfig {
    /// The structure as described: the nominal model of the controller and the diagnosers.
    pub structure: Structure,
    /// Its nominal parameters.
    pub parameters: PlantParameters,
    /// How the true plant differs from the nominal model.
    pub mismatch: Option<MismatchSection>,
    /// Seed of all randomness.
    pub seed: u64,
    /// How fast simulated time passes.
    pub speed: Speed,
    /// At a fixed speed, samples are published in bursts of this many steps.
    pub burst_steps: u64,
    /// Those of a burst are one message.
    pub blocks: bool,
    /// The form of samples.
    pub encoding: Encoding,
    /// End after this many steps.
    pub steps: Option<u64>,
    /// Number of the run; otherwise the time.
    pub run: Option<RunId>,
    /// Diagnosers that must be running before step 0.
    pub wait_for: Vec<ModuleName>,
    /// Faults to inject.
    pub schedule: Schedule,
    /// How the plant waits for diagnosers.
    pub lock_step: LockStep,
    /// What the controller does about faults.
    pub tolerance: ToleranceSettings,
    /// Endpoints to listen on and connect to.
    pub network: Network,
    /// The address that serves health, if any.
    pub health: Option<SocketAddr>,
}

impl PlantConfig {
    /// The plant as configured, before its first step.
    ///
    /// # Errors
    /// The configuration does not describe a valid plant; the error names what is expected.
    pub fn make_plant(&self) -> Result<Plant, PlantError> {
        let Some(MismatchSection { relative, seed }) = self.mismatch else {
            return Plant::new(&self.structure, &self.parameters, self.seed);
        };
        let truth = Mismatch::draw(&self.structure, &self.parameters, relative, seed)?;
        Plant::with_nominal(
            &truth.structure(&self.structure),
            &self.structure,
            &truth.parameters,
            &self.parameters,
            self.seed,
        )
    }
}

/// What a command line may set of a plant.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct PlantFlags {
    /// Seed of all randomness
    #[arg(long)]
    pub seed: Option<u64>,
    /// `max`, `real` or a factor
    #[arg(long)]
    pub speed: Option<Speed>,
    /// End after this many steps
    #[arg(long)]
    pub steps: Option<u64>,
    /// Faults to inject at given steps
    #[arg(long, value_name = "FILE")]
    pub schedule: Option<PathBuf>,
    /// Number of the run; otherwise the time in microseconds since 1970
    #[arg(long, value_name = "NUMBER", value_parser = run_id)]
    pub run_id: Option<RunId>,
    /// Start at once instead of waiting for the diagnosers
    #[arg(long)]
    pub no_wait: bool,
    /// Where to listen and connect
    #[command(flatten)]
    pub network: NetworkFlags,
    /// Where to serve health
    #[command(flatten)]
    pub health: HealthFlags,
}

fn run_id(text: &str) -> Result<RunId, std::num::ParseIntError> {
    text.parse().map(RunId)
}

/// Reads and checks a plant's file and the files named in it; flags override the file.
///
/// # Errors
/// All errors found.
pub fn load_plant(file: &Path, flags: &PlantFlags) -> Result<PlantConfig, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let mut written: PlantFile = document.parse()?;
    let mut errors = ConfigErrors(Vec::new());
    written.network.check(&document, &mut errors);
    written.network.add(&flags.network);
    let health = written.health.address(&document, &mut errors);
    let health = flags.health.address_or(health, &mut errors);
    let schedule_file = written.schedule.as_ref().map(|schedule| document.beside(schedule));
    let schedule_file = flags.schedule.clone().or(schedule_file);
    let schedule = schedule_file.as_deref().map(|file| errors.collect(load_schedule(file)));
    let structure = errors.collect(load_structure(&document.beside(&written.structure)));
    let (Some(structure), Some(schedule)) =
        (structure, schedule.unwrap_or(Some(Schedule::default())))
    else {
        return Err(errors);
    };
    let wait_for = waited_for(&written, flags, &structure, &document, &mut errors);
    check_figures(&written, &document, &mut errors);
    written.network.check_identity(&Holder::Plant, &structure.name, &mut errors);
    let config = PlantConfig {
        structure,
        parameters: written.plant,
        mismatch: written.mismatch,
        seed: flags.seed.unwrap_or(written.seed),
        speed: flags.speed.unwrap_or(written.speed),
        burst_steps: written.burst_steps,
        blocks: written.blocks,
        encoding: written.encoding,
        steps: flags.steps.or(written.steps),
        run: flags.run_id,
        wait_for,
        schedule,
        lock_step: written.lock_step,
        tolerance: written.tolerance,
        network: written.network,
        health,
    };
    check_plant(&config, &document, schedule_file.as_deref(), &mut errors);
    document.check_numbers(&mut errors);
    errors.or(config)
}

fn waited_for(
    written: &PlantFile,
    flags: &PlantFlags,
    structure: &Structure,
    document: &SettingsFile,
    errors: &mut ConfigErrors,
) -> Vec<ModuleName> {
    let equipped: Vec<ModuleName> =
        structure.equipped().map(|module| module.name.clone()).collect();
    if equipped.iter().any(|module| module.as_str() == vocabulary::keys::PLANT) {
        let problem =
            format!("no module may be called `{}`: keys need the word", vocabulary::keys::PLANT);
        errors.add(&document.file, document.line(&["structure"]), problem);
    }
    for module in written.wait_for.iter().flatten() {
        if !equipped.contains(module) {
            let known: Vec<String> = equipped.iter().map(|name| format!("`{name}`")).collect();
            let problem =
                format!("unknown equipped module `{module}`: expected one of {}", known.join(", "));
            errors.add(&document.file, document.line(&["wait_for"]), problem);
        }
    }
    if flags.no_wait {
        return Vec::new();
    }
    written.wait_for.clone().unwrap_or(equipped)
}

/// A gage's noise is less, a fault's harm more.
const LARGEST_INNOVATION: RangeInclusive<f64> = 1e-7..=1e-3;

fn check_figures(written: &PlantFile, document: &SettingsFile, errors: &mut ConfigErrors) {
    let LockStep { window_steps, timeout_ms } = written.lock_step;
    let figures: [(&[&str], u64, RangeInclusive<u64>); 5] = [
        (&["burst_steps"], written.burst_steps, 1..=100),
        (&["lock_step", "window_steps"], window_steps, 1..=2000),
        (&["lock_step", "timeout_ms"], timeout_ms, 100..=3_600_000),
        (&["tolerance", "stale_after_ms"], written.tolerance.stale_after_ms, 10..=10_000),
        (&["tolerance", "most_shut_off"], written.tolerance.most_shut_off, 0..=1000),
    ];
    for (place, value, allowed) in figures {
        if !allowed.contains(&value) {
            let key = place.last().copied().unwrap_or_default();
            let problem =
                format!("`{key}` is {value}; use {} to {}", allowed.start(), allowed.end());
            errors.add(&document.file, document.line(place), problem);
        }
    }
    let innovation = written.tolerance.largest_innovation;
    if let Some(strain) = innovation.filter(|strain| !LARGEST_INNOVATION.contains(strain)) {
        let problem = format!("`largest_innovation` is {strain}; use a strain of 1e-7 to 1e-3");
        let place = &["tolerance", "largest_innovation"];
        errors.add(&document.file, document.line(place), problem);
    }
}

/// Creates the plant and injects every scheduled fault as a check.
fn check_plant(
    config: &PlantConfig,
    document: &SettingsFile,
    schedule: Option<&Path>,
    errors: &mut ConfigErrors,
) {
    let parameters = config.parameters.check();
    for error in parameters.as_ref().err().map(|errors| errors.0.as_slice()).unwrap_or_default() {
        let mut place = vec!["plant"];
        place.extend(error.parameter.split('.'));
        errors.add(&document.file, document.line(&place), error);
    }
    if parameters.is_err() {
        return;
    }
    match config.make_plant() {
        Ok(mut plant) => {
            for fault in &config.schedule.faults {
                if let Err(error) = plant.inject(&fault.component, fault.fault) {
                    errors.add(schedule.unwrap_or(&document.file), None, error);
                }
            }
        }
        Err(error) => {
            let line = document.line(place(&error)).or_else(|| document.line(&["structure"]));
            errors.add(&document.file, line, error);
        }
    }
}

/// The place in the file that most likely causes the error.
fn place(error: &PlantError) -> &'static [&'static str] {
    match error {
        PlantError::Model(_) => &["structure"],
        PlantError::Controller(_) | PlantError::NoEquilibrium => &["plant", "controller"],
        PlantError::LoadNode { place, .. } if place.starts_with("moving") => {
            &["plant", "moving_loads"]
        }
        PlantError::LoadNode { .. } => &["plant", "recorded_loads"],
        PlantError::DemandAtStart { .. } => &["plant", "hydraulics", "demand_limit_n"],
        PlantError::Parameters(_) | PlantError::Equipment(_) => &["plant"],
    }
}
