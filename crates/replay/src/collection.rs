//! Recorded messages, sorted by module.

use std::collections::BTreeMap;

use diagnosis::messages::{setup_fingerprint, to_setup};
use vocabulary::{
    DecodeError, Divergences, FaultTransition, Identification, Input, Key, ModuleConfiguration,
    ModuleName, ModuleStatus, RunId, Step, StructureName, Taken, Topic, decode,
};

use crate::samples::Samples;

/// The position of a module in its stream of samples, at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ModulePosition {
    /// By the module's clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The run.
    pub run: RunId,
    /// A step that it had processed by then.
    pub step: Step,
}

/// What a status tells of how far a module was.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RecordedStatus {
    /// By the module's clock \[ns since 1970\].
    pub time_unix_ns: u64,
    /// The sequence number that its next transition was to have.
    pub next_sequence: u64,
    /// Run and step of its latest sample.
    pub position: Option<(RunId, Step)>,
}

/// The recorded messages of a module.
#[derive(Debug)]
pub struct ModuleRecord {
    /// Its structure.
    pub structure: StructureName,
    /// Its name.
    pub module: ModuleName,
    /// Its configurations, oldest first.
    pub configurations: Vec<ModuleConfiguration>,
    /// Its samples.
    pub samples: Samples,
    /// The inputs of its processes other than samples, by process and number.
    pub inputs: BTreeMap<u64, BTreeMap<u64, Input>>,
    /// The recorded states of its processes, in parts, by process, number of samples and time.
    pub states: BTreeMap<(u64, u64, u64), Vec<Input>>,
    /// Its transitions by time, including those published again.
    pub transitions: Vec<FaultTransition>,
    /// The identifications of its faults, by time.
    pub identifications: Vec<Identification>,
    /// Its divergences, by time.
    pub divergences: Vec<Divergences>,
    /// Its positions, by time.
    pub positions: Vec<ModulePosition>,
    /// Its statuses, by time.
    pub statuses: Vec<RecordedStatus>,
    /// The number of messages that could not be read.
    pub unreadable: u64,
    /// The problem of the first of them.
    pub unreadable_because: Option<String>,
}

impl ModuleRecord {
    fn new(structure: StructureName, module: ModuleName) -> Self {
        Self {
            structure,
            module,
            configurations: Vec::new(),
            samples: Samples::default(),
            inputs: BTreeMap::new(),
            states: BTreeMap::new(),
            transitions: Vec::new(),
            identifications: Vec::new(),
            divergences: Vec::new(),
            positions: Vec::new(),
            statuses: Vec::new(),
            unreadable: 0,
            unreadable_because: None,
        }
    }

    fn take(&mut self, topic: &Topic, payload: &[u8]) -> Result<(), UnusableMessage> {
        match topic {
            Topic::Sample => self.samples.push(&decode(payload)?),
            Topic::Input => self.take_input(decode(payload)?),
            Topic::Configuration => {
                let message: ModuleConfiguration = decode(payload)?;
                check_fingerprint(&message)?;
                self.configurations.push(message);
            }
            Topic::Fault(_) => {
                let message: FaultTransition = decode(payload)?;
                if let Some(found) = &message.identification {
                    self.take_identification((**found).clone());
                }
                self.note(message.time_unix_ns, message.run, message.decided_step);
                self.transitions.extend(message.is_verdict().then_some(message));
            }
            Topic::Identification(_) => self.take_identification(decode(payload)?),
            Topic::Divergence => {
                let message: Divergences = decode(payload)?;
                self.note(message.time_unix_ns, Some(message.run), Some(message.step));
                self.divergences.push(message);
            }
            Topic::Status => {
                let message: ModuleStatus = decode(payload)?;
                self.note(message.time_unix_ns, message.run, message.step);
                self.statuses.push(RecordedStatus {
                    time_unix_ns: message.time_unix_ns,
                    next_sequence: message.next_sequence,
                    position: message.run.zip(message.step),
                });
            }
            _ => {}
        }
        Ok(())
    }

    /// How many samples each run has.
    #[must_use]
    pub fn runs(&self) -> BTreeMap<RunId, usize> {
        let mut runs: BTreeMap<RunId, usize> = BTreeMap::new();
        for head in (0..self.samples.len()).filter_map(|index| self.samples.head(index)) {
            *runs.entry(head.run).or_default() += 1;
        }
        runs
    }

    /// When the recording of it began: the time of the earliest message that is published only, and never fetched later
    /// \[ns since 1970\].
    #[must_use]
    pub fn heard_since(&self) -> Option<u64> {
        let divergence = self.divergences.first().map(|message| message.time_unix_ns);
        let status = self.statuses.first().map(|status| status.time_unix_ns);
        divergence.into_iter().chain(status).min()
    }

    /// The earliest run and step of which such a message tells.
    pub(crate) fn begins(&self) -> Option<(RunId, Step)> {
        let divergences = self.divergences.first();
        let divergence = divergences.map(|m| (m.time_unix_ns, (m.run, m.step)));
        let mut statuses = self.statuses.iter();
        let status = statuses.find_map(|s| s.position.map(|position| (s.time_unix_ns, position)));
        divergence.into_iter().chain(status).min().map(|(_, position)| position)
    }

    fn take_input(&mut self, input: Input) {
        self.note(input.time_unix_ns, input.run, input.step);
        if let Taken::State(_) = &input.taken {
            let at = (input.process, input.samples, input.time_unix_ns);
            return self.states.entry(at).or_default().push(input);
        }
        self.inputs.entry(input.process).or_default().insert(input.number, input);
    }

    fn take_identification(&mut self, found: Identification) {
        self.note(found.time_unix_ns, Some(found.run), Some(found.as_of_step));
        self.identifications.push(found);
    }

    fn note(&mut self, time_unix_ns: u64, run: Option<RunId>, step: Option<Step>) {
        let position = run.zip(step).map(|(run, step)| ModulePosition { time_unix_ns, run, step });
        self.positions.extend(position);
    }

    fn sort(&mut self) {
        self.samples.sort();
        self.configurations.sort_by_key(|message| message.time_unix_ns);
        self.transitions.sort_by_key(|message| (message.time_unix_ns, message.sequence));
        self.transitions.dedup();
        self.identifications.sort_by_key(|found| (found.time_unix_ns, found.sequence));
        self.identifications.dedup();
        self.divergences.sort_by_key(|message| (message.time_unix_ns, message.step));
        self.divergences.dedup();
        self.positions.sort_unstable();
        self.statuses.sort_by_key(|status| status.time_unix_ns);
    }
}

/// Why a message cannot be used.
#[derive(Debug, thiserror::Error)]
enum UnusableMessage {
    #[error(transparent)]
    Unreadable(#[from] DecodeError),
    #[error("invalid setup: {0}")]
    Setup(#[from] serde_json::Error),
    #[error("its setup has the fingerprint {found}, not {said}: it was changed")]
    Changed { found: String, said: String },
}

/// Another version's setup may have other fields and therefore another fingerprint.
fn check_fingerprint(message: &ModuleConfiguration) -> Result<(), UnusableMessage> {
    if message.software != env!("CARGO_PKG_VERSION") {
        return Ok(());
    }
    let found = setup_fingerprint(&to_setup(message)?)?;
    if found == message.fingerprint {
        return Ok(());
    }
    Err(UnusableMessage::Changed { found, said: message.fingerprint.clone() })
}

/// Collects messages in any order; duplicates have no effect.
#[derive(Debug, Default)]
pub struct Collection {
    modules: Vec<ModuleRecord>,
    /// The index of its module and the parsed topic, by topic; `None` for topics that belong to no module.
    topics: BTreeMap<String, Option<(usize, Topic)>>,
}

impl Collection {
    /// Adds a message. Ignores topics that belong to no module; counts unreadable messages.
    pub fn take(&mut self, topic: &str, payload: &[u8]) {
        if !self.topics.contains_key(topic) {
            let known = self.place(topic);
            self.topics.insert(topic.to_owned(), known);
        }
        let Some(Some((place, topic))) = self.topics.get(topic) else { return };
        let Some(record) = self.modules.get_mut(*place) else { return };
        if let Err(error) = record.take(topic, payload) {
            record.unreadable += 1;
            record.unreadable_because.get_or_insert_with(|| format!("{topic}: {error}"));
        }
    }

    fn place(&mut self, topic: &str) -> Option<(usize, Topic)> {
        let Ok(Key::Module { structure, module, topic }) = topic.parse() else { return None };
        let known =
            self.modules.iter().position(|r| r.structure == structure && r.module == module);
        let place = known.unwrap_or_else(|| {
            self.modules.push(ModuleRecord::new(structure, module));
            self.modules.len() - 1
        });
        Some((place, topic))
    }

    /// The records of all modules, by structure and module.
    #[must_use]
    pub fn finish(self) -> Vec<ModuleRecord> {
        let mut modules = self.modules;
        modules.iter_mut().for_each(ModuleRecord::sort);
        modules.sort_by(|a, b| (&a.structure, &a.module).cmp(&(&b.structure, &b.module)));
        modules
    }
}
