//! A diagnoser's configuration file, which describes its own module only.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use diagnosis::residual::NominalHydraulics;
use diagnosis::state::learned::LearnedModule;
use diagnosis::state::{REFERENCE_VERSION, Reference, ReferenceProblem};
use diagnosis::thresholds::{MadeFor, MeasuredEffects, Thresholds};
use diagnosis::{DetectionSection, Diagnoser, IsolationSection, ModuleSetup, SignalSettings};
use pki::Holder;
use process::ProcessSettings;
use serde::{Deserialize, Serialize};
use session::Network;
use session::NetworkFlags;
use settings::{ConfigError, ConfigErrors, SettingsFile};
use shell::health::{HealthFlags, HealthSettings};
use truss::Structure;
use vocabulary::{Component, ModuleName, StructureName};

/// The content of the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct DiagnoserFile {
    module: ModuleName,
    structure: PathBuf,
    thresholds: PathBuf,
    #[serde(default)]
    reference: Option<PathBuf>,
    #[serde(default)]
    peers: Vec<ModuleName>,
    #[serde(default = "one_millisecond")]
    step_s: f64,
    gage_noise_strain: f64,
    #[serde(default)]
    hydraulics: Option<NominalHydraulics>,
    #[serde(default)]
    signals: SignalSettings,
    #[serde(default)]
    detection: DetectionSection,
    #[serde(default)]
    isolation: IsolationSection,
    #[serde(default)]
    network: Network,
    #[serde(default)]
    publish: PublishSettings,
    #[serde(default)]
    queries: QuerySettings,
    #[serde(default)]
    input: InputSettings,
    #[serde(default)]
    state: StateSettings,
    #[serde(default)]
    tolerance: ModuleTolerance,
    #[serde(default)]
    health: HealthSettings,
}

/// The content of the file of a learned module's diagnoser.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct LearnedFile {
    module: ModuleName,
    structure_name: StructureName,
    learned: PathBuf,
    step_s: f64,
    #[serde(default)]
    network: Network,
    #[serde(default)]
    publish: PublishSettings,
    #[serde(default)]
    queries: QuerySettings,
    #[serde(default)]
    input: InputSettings,
    #[serde(default)]
    state: StateSettings,
    #[serde(default)]
    health: HealthSettings,
}

impl LearnedFile {
    /// As the file of a diagnoser, without what only a structural model needs.
    fn as_diagnoser(&self) -> DiagnoserFile {
        let Self { module, step_s, network, publish, queries, input, state, health, .. } =
            self.clone();
        DiagnoserFile {
            module,
            structure: PathBuf::new(),
            thresholds: PathBuf::new(),
            reference: None,
            peers: Vec::new(),
            step_s,
            gage_noise_strain: 0.0,
            hydraulics: None,
            signals: SignalSettings::default(),
            detection: DetectionSection::default(),
            isolation: IsolationSection::default(),
            network,
            publish,
            queries,
            input,
            state,
            tolerance: ModuleTolerance::default(),
            health,
        }
    }
}

fn one_millisecond() -> f64 {
    1e-3
}

/// The table `[publish]`: the intervals of messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PublishSettings {
    /// Steps between two divergence messages: 100. At a change there is one besides.
    pub divergence_every_steps: u64,
    /// Steps between two progress messages: 20.
    pub progress_every_steps: u64,
    /// Time between two status messages \[ms\]: 1000.
    pub status_every_ms: u64,
    /// Samples that may wait to be processed: 4096. More are dropped and counted.
    pub sample_queue: usize,
}

impl Default for PublishSettings {
    fn default() -> Self {
        Self {
            divergence_every_steps: 100,
            progress_every_steps: 20,
            status_every_ms: 1000,
            sample_queue: 4096,
        }
    }
}

/// The table `[queries]`: timeouts of queries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct QuerySettings {
    /// Timeout of a query to a peer \[ms\]: 300. Doubled after a timeout, and once more after another, until the peer
    /// answers or refuses.
    pub timeout_ms: u64,
    /// How long a peer's query is held until its step arrives \[ms\]: 1000.
    pub hold_ms: u64,
    /// How long the next sample waits for a peer's answer \[ms\]: 50. If all answers arrive within this time, every
    /// transition equals that of a single process, not only every verdict.
    pub pause_ms: u64,
}

impl Default for QuerySettings {
    fn default() -> Self {
        Self { timeout_ms: 300, hold_ms: 1000, pause_ms: 50 }
    }
}

impl QuerySettings {
    pub(crate) fn timeout(&self) -> Duration {
        Duration::from_millis(self.timeout_ms)
    }

    pub(crate) fn hold(&self) -> Duration {
        Duration::from_millis(self.hold_ms)
    }

    pub(crate) fn pause(&self) -> Duration {
        Duration::from_millis(self.pause_ms)
    }
}

/// The table `[input]`: the handling of missing, late and foreign samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InputSettings {
    /// Without a sample for this long the module is stale \[ms\]: 500.
    pub stale_after_ms: u64,
    /// Samples that have waited for this long are dropped, so that processing catches up \[ms\]: 1000.
    pub resync_after_ms: u64,
    /// Most missed samples requested from the publisher: 8192; 0 for none.
    pub recover_steps: u64,
    /// A publisher that is silent for this long may be replaced by another one \[ms\]: 200.
    pub incumbent_ms: u64,
}

impl Default for InputSettings {
    fn default() -> Self {
        Self { stale_after_ms: 500, resync_after_ms: 1000, recover_steps: 8192, incumbent_ms: 200 }
    }
}

impl InputSettings {
    pub(crate) fn stale_after(&self) -> Duration {
        Duration::from_millis(self.stale_after_ms)
    }

    pub(crate) fn resync_after(&self) -> Duration {
        Duration::from_millis(self.resync_after_ms)
    }

    pub(crate) fn incumbent(&self) -> Duration {
        Duration::from_millis(self.incumbent_ms)
    }
}

/// The table `[tolerance]`: what the module may do about a faulty cylinder of its own. Nothing, unless it is permitted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ModuleTolerance {
    /// So many cylinders of the structure may be shut off at a time: 0.
    pub most_shut_off: u64,
    /// The module shuts one off by itself that is known to be hard over; otherwise an operator does.
    pub by_itself: bool,
}

/// The table `[state]`: persistent state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StateSettings {
    /// The directory of the journal, relative to this file. Default: the environment variable `STATE_DIRECTORY`;
    /// without it, faults are lost when the process ends.
    pub directory: Option<PathBuf>,
    /// A new journal file begins when the present one reaches this size \[MiB\]: 16. One older file is kept.
    pub rotate_mib: u64,
}

impl Default for StateSettings {
    fn default() -> Self {
        Self { directory: None, rotate_mib: 16 }
    }
}

impl StateSettings {
    pub(crate) fn rotate_bytes(&self) -> u64 {
        self.rotate_mib << 20
    }

    /// Resolves the directory relative to the configuration file.
    fn resolve(mut self, document: &SettingsFile) -> Self {
        let given = std::env::var_os(STATE_VARIABLE).filter(|text| !text.is_empty());
        let named = self.directory.map(|directory| document.beside(&directory));
        self.directory = named.or(given.map(PathBuf::from));
        self
    }
}

/// The environment variable with the state directory, set by service managers.
const STATE_VARIABLE: &str = "STATE_DIRECTORY";

/// The checked configuration of a diagnoser process.
#[derive(Debug, Clone)]
pub struct DiagnoserConfig {
    /// Name of the structure, from its description.
    pub structure_name: StructureName,
    /// Endpoints to listen on and connect to.
    pub network: Network,
    /// The intervals of messages.
    pub publish: PublishSettings,
    /// Timeouts of queries.
    pub queries: QuerySettings,
    /// The handling of missing, late and foreign samples.
    pub input: InputSettings,
    /// Persistent state.
    pub state: StateSettings,
    /// What the module may do about a faulty cylinder.
    pub tolerance: ModuleTolerance,
    /// The address that serves health, if any.
    pub health: Option<SocketAddr>,
    /// Fingerprint of the thresholds.
    pub thresholds: String,
    setup: ModuleSetup,
}

impl DiagnoserConfig {
    /// Fingerprint of the reference, if there is one.
    pub(crate) fn reference(&self) -> Option<String> {
        let learned = self.setup.learned.as_ref().map(|learned| learned.fingerprint());
        learned.or_else(|| self.setup.reference.as_ref().map(|reference| reference.fingerprint()))
    }

    /// The setup for a `diagnosis::Diagnoser`.
    #[must_use]
    pub fn module_setup(&self) -> ModuleSetup {
        self.setup.clone()
    }

    /// The module.
    #[must_use]
    pub fn module(&self) -> &ModuleName {
        &self.setup.module
    }

    /// The other modules that are queried.
    #[must_use]
    pub fn peers(&self) -> &[ModuleName] {
        &self.setup.peers
    }

    /// Number of actuators and of gages; a learned module has its channels as gages.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        let components = self.setup.components();
        let is_actuator = |component: &&Component| matches!(component, Component::Actuator(_));
        let actuators = components.iter().filter(is_actuator).count();
        (actuators, components.len() - actuators)
    }

    /// Adds endpoints from the command line.
    ///
    /// # Errors
    /// An endpoint is invalid.
    pub fn with_flags(mut self, flags: &NetworkFlags) -> Result<Self, ConfigErrors> {
        self.network.add(flags);
        let mut errors = ConfigErrors(Vec::new());
        self.network.check_identity(&self.holder(), &self.structure_name, &mut errors);
        errors.or(self)
    }

    /// Sets the address for health from the flag, if given.
    ///
    /// # Errors
    /// The address is invalid.
    pub fn with_health(mut self, flags: &HealthFlags) -> Result<Self, ConfigErrors> {
        let mut errors = ConfigErrors(Vec::new());
        self.health = flags.address_or(self.health, &mut errors);
        errors.or(self)
    }

    /// Sets the directory of the journal, if given.
    #[must_use]
    pub fn with_state_directory(mut self, directory: Option<PathBuf>) -> Self {
        self.state.directory = directory.or(self.state.directory);
        self
    }

    /// Keeps the reference in the file, or removes it.
    pub(crate) fn with_reference(mut self, wanted: bool) -> Self {
        if !wanted {
            self.setup.reference = None;
        }
        self
    }

    fn holder(&self) -> Holder {
        Holder::Module(self.setup.module.clone())
    }

    /// What the process around the diagnosis is set to.
    pub(crate) fn process_settings(&self) -> ProcessSettings {
        ProcessSettings {
            stale_after: self.input.stale_after(),
            resync_after: self.input.resync_after(),
            recover_steps: self.input.recover_steps,
            sample_queue: self.publish.sample_queue,
            hold: self.queries.hold(),
            pause: self.queries.pause(),
            divergence_every_steps: self.publish.divergence_every_steps,
            progress_every_steps: self.publish.progress_every_steps,
            status_every: Duration::from_millis(self.publish.status_every_ms),
            thresholds: self.thresholds.clone(),
            reference: self.reference(),
            tie_steps: self.setup.isolation.tie_steps,
            shuts_off_by_itself: self.tolerance.by_itself,
        }
    }
}

/// Reads and checks a diagnoser's file and the files named in it.
///
/// # Errors
/// All errors found.
pub fn load_diagnoser(file: &Path) -> Result<DiagnoserConfig, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    let learned: Option<LearnedFile> =
        document.has(&["learned"]).then(|| document.parse()).transpose()?;
    let mut written = match &learned {
        Some(learned) => learned.as_diagnoser(),
        None => document.parse()?,
    };
    fit_to_step(&mut written, &document);
    let mut errors = ConfigErrors(Vec::new());
    written.network.check(&document, &mut errors);
    let health = written.health.address(&document, &mut errors);
    check_figures(&written, &document, &mut errors);
    if let Some(learned) = learned {
        return load_learned_diagnoser(&document, &learned, (written, health), errors);
    }
    let structure = errors.collect(load_structure(&document.beside(&written.structure)));
    let thresholds = SettingsFile::read(&document.beside(&written.thresholds))
        .and_then(|document| Ok((document.parse::<Thresholds>()?, document)));
    let thresholds = errors.collect(thresholds);
    let (Some(structure), Some((thresholds, thresholds_document))) = (structure, thresholds) else {
        return Err(errors);
    };
    let components = components(&structure, &written.module);
    if components.is_empty() {
        let problem = format!(
            "`{}` has no module `{}` with actuators or gages",
            written.structure.display(),
            written.module
        );
        errors.add(file, document.line(&["module"]), problem);
        return Err(errors);
    }
    let used_for = MadeFor::new(&structure, written.step_s);
    let fitted = thresholds.fit(&written.module, &components, &written.detection, Some(&used_for));
    if let Some(effects) = &thresholds.effects {
        use_measured(&mut written, &document, effects);
    }
    let fitted = fitted.unwrap_or_else(|problems| {
        for problem in problems {
            let place = problem.place();
            let place: Vec<&str> = place.iter().map(String::as_str).collect();
            errors.add(&thresholds_document.file, thresholds_document.line(&place), problem);
        }
        // A placeholder, so that the rest of the setup is checked as well.
        vec![1.0; components.len()]
    });
    let structure_name = structure.name.clone();
    let holder = Holder::Module(written.module.clone());
    written.network.check_identity(&holder, &structure_name, &mut errors);
    let reference = written.reference.as_ref().map(|path| load_reference(&document.beside(path)));
    let reference = reference.and_then(|loaded| errors.collect(loaded));
    let setup = ModuleSetup { reference, ..setup(&written, structure, fitted) };
    for problem in Diagnoser::new(setup.clone()).err().unwrap_or_default() {
        errors.add(file, document.line(&problem.place()), problem);
    }
    document.check_numbers(&mut errors);
    thresholds_document.check_numbers(&mut errors);
    errors.or(DiagnoserConfig {
        structure_name,
        network: written.network,
        publish: written.publish,
        queries: written.queries,
        input: written.input,
        state: written.state.resolve(&document),
        tolerance: written.tolerance,
        health,
        thresholds: thresholds.fingerprint(),
        setup,
    })
}

/// Reads and checks the module that a learned diagnoser's file names.
fn load_learned_diagnoser(
    document: &SettingsFile,
    learned: &LearnedFile,
    (written, health): (DiagnoserFile, Option<SocketAddr>),
    mut errors: ConfigErrors,
) -> Result<DiagnoserConfig, ConfigErrors> {
    let structure_name = learned.structure_name.clone();
    let holder = Holder::Module(written.module.clone());
    written.network.check_identity(&holder, &structure_name, &mut errors);
    let module = errors.collect(load_learned(&document.beside(&learned.learned)));
    document.check_numbers(&mut errors);
    let Some(module) = module else { return Err(errors) };
    let thresholds = vec![module.reference_threshold; module.channels.len()];
    let fingerprint = module.fingerprint();
    let own = written.module.clone();
    let setup = ModuleSetup::of_readings(structure_name.clone(), own, written.step_s);
    let setup = ModuleSetup { learned: Some(Arc::new(module)), thresholds, ..setup };
    for problem in Diagnoser::new(setup.clone()).err().unwrap_or_default() {
        errors.add(&document.file, document.line(&problem.place()), problem);
    }
    errors.or(DiagnoserConfig {
        structure_name,
        network: written.network,
        publish: written.publish,
        queries: written.queries,
        input: written.input,
        state: written.state.resolve(document),
        tolerance: written.tolerance,
        health,
        thresholds: fingerprint,
        setup,
    })
}

/// Reads a learned module.
///
/// # Errors
/// The file is not a learned module, or a value in it is out of range.
pub fn load_learned(file: &Path) -> Result<LearnedModule, ConfigErrors> {
    let module: LearnedModule = SettingsFile::read(file)?.parse()?;
    module.check().map_err(|problem| ConfigErrors::one(file, None, problem))?;
    Ok(module)
}

/// Reads a reference. A file of another version is reported as such, whatever its content.
///
/// # Errors
/// The reason why it cannot be read.
pub fn load_reference(file: &Path) -> Result<Arc<Reference>, ConfigErrors> {
    #[derive(Deserialize)]
    struct ReferenceHead {
        v: u32,
    }
    let document = SettingsFile::read(file)?;
    match document.parse() {
        Ok(ReferenceHead { v }) if v != REFERENCE_VERSION => {
            let problem = ReferenceProblem::Version(v).to_string();
            let line = document.line(&["v"]);
            Err(ConfigErrors(vec![ConfigError { file: file.to_owned(), line, problem }]))
        }
        _ => {
            let reference = document.parse()?;
            let mut errors = ConfigErrors(Vec::new());
            document.check_numbers(&mut errors);
            errors.or(Arc::new(reference))
        }
    }
}

/// A module whose thresholds are to be calibrated.
#[derive(Debug, Clone)]
pub struct Uncalibrated {
    /// The setup, with placeholder thresholds.
    pub setup: ModuleSetup,
    /// The detection settings for the calibration.
    pub detection: DetectionSection,
    /// The file for the thresholds.
    pub thresholds: PathBuf,
}

/// Reads and checks a diagnoser's file and its structure, but not its thresholds.
///
/// # Errors
/// All errors found.
pub fn load_uncalibrated(file: &Path) -> Result<Uncalibrated, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    if document.has(&["learned"]) {
        let problem = "a learned module is neither calibrated nor commissioned: make it anew with `trusswatch learn`";
        return Err(ConfigErrors::one(file, document.line(&["learned"]), problem));
    }
    let mut written: DiagnoserFile = document.parse()?;
    fit_to_step(&mut written, &document);
    let mut errors = ConfigErrors(Vec::new());
    check_figures(&written, &document, &mut errors);
    let structure = load_structure(&document.beside(&written.structure))?;
    let channels = components(&structure, &written.module).len();
    let setup = setup(&written, structure, vec![1.0; channels]);
    for problem in Diagnoser::new(setup.clone()).err().unwrap_or_default() {
        errors.add(file, document.line(&problem.place()), problem);
    }
    let thresholds = document.beside(&written.thresholds);
    errors.or(Uncalibrated { setup, detection: written.detection, thresholds })
}

/// Reads a structure's description.
pub(super) fn load_structure(file: &Path) -> Result<Structure, ConfigErrors> {
    let document = SettingsFile::read(file)?;
    Structure::from_toml(&document.text).map_err(|mistakes| {
        let mut errors = ConfigErrors(Vec::new());
        for mistake in mistakes.iter() {
            errors.add(file, mistake.line, &mistake.problem);
        }
        errors
    })
}

fn components(structure: &Structure, module: &ModuleName) -> Vec<Component> {
    structure.module(module).map_or_else(Vec::new, |module| module.components().collect())
}

fn setup(written: &DiagnoserFile, structure: Structure, thresholds: Vec<f64>) -> ModuleSetup {
    ModuleSetup {
        module: written.module.clone(),
        structure,
        hydraulics: written.hydraulics,
        gage_noise_strain: written.gage_noise_strain,
        step_s: written.step_s,
        signals: written.signals,
        detection: written.detection.into(),
        isolation: written.isolation.in_steps_of(written.step_s),
        thresholds,
        peers: written.peers.clone(),
        reference: None,
        learned: None,
        readings: Vec::new(),
    }
}

/// Takes settings that the file leaves open from the measured effects of faults.
fn use_measured(written: &mut DiagnoserFile, document: &SettingsFile, effects: &MeasuredEffects) {
    let isolation = &mut written.isolation;
    isolation.root_ratio.get_or_insert(effects.root_ratio);
    if !document.has(&["isolation", "effect_ms"]) {
        isolation.effect_ms = effects.effect_ms.max(isolation.quiet_ms);
    }
}

/// Fits settings that the file leaves open to its sampling step. The written defaults are for 1 kHz, and remain as
/// they are wherever they fit.
fn fit_to_step(written: &mut DiagnoserFile, document: &SettingsFile) {
    let step_ms = 1e3 * written.step_s;
    if !(step_ms.is_finite() && step_ms > 0.0) {
        return;
    }
    let is_open = |table: &str, key: &str| !document.has(&[table, key]);
    let DiagnoserFile { isolation, detection, step_s, .. } = written;
    detection.fit_to_step(*step_s, |key| is_open("detection", key));
    isolation.fit_to_step(*step_s, detection, |key| is_open("isolation", key));
    if is_open("isolation", "hold_ms") {
        isolation.hold_ms = isolation.hold_ms.min(60_000.0);
    }
    // A message as often as at 1 kHz, or each step.
    let publish = &mut written.publish;
    for (key, every_steps) in [
        ("divergence_every_steps", &mut publish.divergence_every_steps),
        ("progress_every_steps", &mut publish.progress_every_steps),
    ] {
        if is_open("publish", key) {
            *every_steps = (*every_steps as f64 / step_ms).round().clamp(1.0, 10_000.0) as u64;
        }
    }
    // Nothing that comes each step is late after less than some steps. Slowly sampled modules get the largest that is allowed.
    let (queries, input) = (&mut written.queries, &mut written.input);
    for (table, key, ms, steps, largest) in [
        ("queries", "timeout_ms", &mut queries.timeout_ms, 2.0, 10_000),
        ("queries", "hold_ms", &mut queries.hold_ms, 3.0, 60_000),
        ("input", "stale_after_ms", &mut input.stale_after_ms, 5.0, 3_600_000),
        ("input", "resync_after_ms", &mut input.resync_after_ms, 5.0, 60_000),
        ("input", "incumbent_ms", &mut input.incumbent_ms, 3.0, 60_000),
    ] {
        if is_open(table, key) {
            *ms = (*ms).max((steps * step_ms).ceil() as u64).min(largest);
        }
    }
}

fn check_figures(written: &DiagnoserFile, document: &SettingsFile, errors: &mut ConfigErrors) {
    for (key, name) in [("module", &written.module)]
        .into_iter()
        .chain(written.peers.iter().map(|peer| ("peers", peer)))
    {
        if name.as_str() == vocabulary::keys::PLANT {
            let problem = format!("no module may be called `{name}`: keys need the word");
            errors.add(&document.file, document.line(&[key]), problem);
        }
    }
    let IsolationSection { hold_ms, tie_ms, effect_ms, quiet_ms, .. } = written.isolation;
    for (key, value) in
        [("hold_ms", hold_ms), ("tie_ms", tie_ms), ("effect_ms", effect_ms), ("quiet_ms", quiet_ms)]
    {
        if !(0.0..=60_000.0).contains(&value) {
            let problem = format!("`{key}` is {value}; use 0 to 60000");
            errors.add(&document.file, document.line(&["isolation", key]), problem);
        }
    }
    let PublishSettings {
        divergence_every_steps,
        progress_every_steps,
        status_every_ms,
        sample_queue,
    } = written.publish;
    let QuerySettings { timeout_ms, hold_ms, pause_ms } = written.queries;
    let InputSettings { stale_after_ms, resync_after_ms, recover_steps, incumbent_ms } =
        written.input;
    for (table, key, value, allowed) in [
        ("publish", "divergence_every_steps", divergence_every_steps, 1..=1_000_000),
        ("publish", "progress_every_steps", progress_every_steps, 1..=10_000),
        ("publish", "status_every_ms", status_every_ms, 100..=60_000),
        ("publish", "sample_queue", sample_queue as u64, 16..=1_000_000),
        ("queries", "timeout_ms", timeout_ms, 10..=10_000),
        ("queries", "hold_ms", hold_ms, 10..=60_000),
        ("queries", "pause_ms", pause_ms, 0..=10_000),
        ("input", "stale_after_ms", stale_after_ms, 10..=3_600_000),
        ("input", "resync_after_ms", resync_after_ms, 100..=60_000),
        ("input", "recover_steps", recover_steps, 0..=100_000),
        ("input", "incumbent_ms", incumbent_ms, 10..=60_000),
        ("state", "rotate_mib", written.state.rotate_mib, 1..=32),
        ("tolerance", "most_shut_off", written.tolerance.most_shut_off, 0..=1000),
    ] {
        if !allowed.contains(&value) {
            let problem =
                format!("`{key}` is {value}; use {} to {}", allowed.start(), allowed.end());
            errors.add(&document.file, document.line(&[table, key]), problem);
        }
    }
}
