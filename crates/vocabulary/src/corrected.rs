//! Readings in place of those of faulty gages.

use crate::{Key, ModuleName, RunId, Step, StructureName, Topic};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// What each gage of a module reads at one step, or should read. Published at every step while anyone subscribes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Corrected {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The run that the step is counted in.
    pub run: RunId,
    /// The step.
    pub step: Step,
    /// When this was published \[ns since 1970\].
    pub time_unix_ns: u64,
    /// What the gages read, or should.
    #[serde(flatten)]
    pub readings: CorrectedReadings,
    /// Observed force of each actuator (eq. 8) \[N\]; `null` while a pressure is missing.
    pub forces_n: Vec<Option<f64>>,
}

impl Message for Corrected {
    const WHAT: &'static str = "corrected readings";
}

impl Corrected {
    /// The key that it is published on.
    #[must_use]
    pub fn key(&self) -> Key {
        Key::of_module(&self.structure, &self.module, Topic::Corrected)
    }
}

/// The readings of a module's gages at one step, in the order of its samples.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct CorrectedReadings {
    /// Elongation \[m\]: of a healthy gage its own reading, of a faulty one what it should read; `null` where `source` is
    /// `not_valid`.
    pub elongations_m: Vec<Option<f64>>,
    /// The lower end of the 95 % interval of the true elongation \[m\].
    pub low_m: Vec<Option<f64>>,
    /// Its upper end \[m\].
    pub high_m: Vec<Option<f64>>,
    /// Where each comes from.
    pub source: Vec<ReadingSource>,
}

/// What a faulty gage read at a step, and what it should have read.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplacedReading {
    /// The step.
    pub step: Step,
    /// What it read \[m\]; `null` if that was nothing usable.
    pub own_m: Option<f64>,
    /// What it should have read \[m\]; `null` if that is not known.
    pub elongation_m: Option<f64>,
    /// The lower end of the 95 % interval of that \[m\].
    pub low_m: Option<f64>,
    /// Its upper end \[m\].
    pub high_m: Option<f64>,
}

/// Where a corrected reading comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReadingSource {
    /// The gage itself.
    Own,
    /// The module's other gages and the forces: from the verdict on the gage until its reset.
    Replaced,
    /// Nothing is known: neither does the gage read anything that can be used, nor can it be replaced.
    NotValid,
}

impl CorrectedReadings {
    /// Has no entries.
    pub fn clear(&mut self) {
        let Self { elongations_m, low_m, high_m, source } = self;
        [elongations_m, low_m, high_m].into_iter().for_each(Vec::clear);
        source.clear();
    }

    /// Adds the next gage's, whose interval reaches this far to both sides \[m\]. Not valid unless both are numbers.
    pub fn push(&mut self, elongation_m: f64, off_m: f64, source: ReadingSource) {
        let known = (elongation_m.is_finite() && off_m.is_finite()).then_some(elongation_m);
        self.elongations_m.push(known);
        self.low_m.push(known.map(|elongation_m| elongation_m - off_m));
        self.high_m.push(known.map(|elongation_m| elongation_m + off_m));
        self.source.push(known.map_or(ReadingSource::NotValid, |_| source));
    }
}
