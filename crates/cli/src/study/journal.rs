//! What a campaign has done so far, on disk: a line of JSON for each run, so that an interrupted
//! campaign goes on and a finished one can be extended.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use fnv::FnvHasher;
use serde::{Deserialize, Serialize};
use std::hash::Hasher;
use study::{Campaign, NominalRecord, ScenarioRecord};

use crate::failure::Failure;

/// Name of the file in the directory of the campaign.
const FILE: &str = "runs.jsonl";

/// What all runs of a journal have in common: the first line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Heading {
    program: String,
    preset: String,
    seed: u64,
    mismatch: f64,
    /// Of structure, plant, diagnosers, thresholds and ranges.
    fingerprint: String,
}

/// A line after the first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    Scenario(ScenarioRecord),
    Nominal(NominalRecord),
}

/// The runs that are done.
#[derive(Debug, Default)]
pub(super) struct Done {
    pub(super) scenarios: BTreeMap<u64, ScenarioRecord>,
    pub(super) nominal: BTreeMap<u64, NominalRecord>,
}

impl Done {
    /// Numbers below `all` that are not done.
    pub(super) fn missing<T>(done: &BTreeMap<u64, T>, all: u64) -> Vec<u64> {
        let numbers: BTreeSet<u64> = done.keys().copied().collect();
        (0..all).filter(|number| !numbers.contains(number)).collect()
    }
}

/// A journal that further runs are written to.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
}

impl Journal {
    /// Opens the journal of this campaign, or begins it; returns what is done already.
    pub(super) fn open(
        directory: &Path,
        preset: &str,
        campaign: &Campaign,
    ) -> Result<(Journal, Done), Failure> {
        let path = directory.join(FILE);
        let heading = Heading::of(preset, campaign);
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
            Err(error) => {
                return Err(Failure::input(format!("cannot read `{}`: {error}", path.display())));
            }
        };
        let (done, whole) = read(&path, &text, &heading)?;
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let file = file.map_err(|error| cannot_write(&path, &error))?;
        // A last line without its end was being written when the program was stopped.
        file.set_len(whole as u64).map_err(|error| cannot_write(&path, &error))?;
        let mut journal = Journal { path, file };
        if whole == 0 {
            journal.write(&heading)?;
        }
        Ok((journal, done))
    }

    /// Keeps a scenario.
    pub(super) fn scenario(&mut self, record: &ScenarioRecord) -> Result<(), Failure> {
        self.write(&Line::Scenario(record.clone()))
    }

    /// Keeps a nominal run.
    pub(super) fn nominal(&mut self, record: &NominalRecord) -> Result<(), Failure> {
        self.write(&Line::Nominal(record.clone()))
    }

    fn write(&mut self, line: &impl Serialize) -> Result<(), Failure> {
        let mut text = serde_json::to_string(line)?;
        text.push('\n');
        self.file.write_all(text.as_bytes()).map_err(|error| cannot_write(&self.path, &error))
    }
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
}

/// The runs in a journal's text, and the length of its whole lines.
fn read(path: &Path, text: &str, expected: &Heading) -> Result<(Done, usize), Failure> {
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    let mut lines = text[..whole].lines().enumerate();
    let wrong = |line: usize, problem: &dyn std::fmt::Display| {
        let place = format!("{}:{}", path.display(), line + 1);
        Failure::input(format!("{place}: {problem}; give another directory with `--out`"))
    };
    let mut done = Done::default();
    let Some((_, first)) = lines.next() else { return Ok((done, whole)) };
    let heading: Heading = serde_json::from_str(first).map_err(|error| wrong(0, &error))?;
    if let Some(difference) = heading.difference(expected) {
        return Err(wrong(0, &difference));
    }
    for (number, line) in lines {
        match serde_json::from_str(line).map_err(|error| wrong(number, &error))? {
            Line::Scenario(record) => drop(done.scenarios.insert(record.number, record)),
            Line::Nominal(record) => drop(done.nominal.insert(record.number, record)),
        }
    }
    Ok((done, whole))
}

impl Heading {
    fn of(preset: &str, campaign: &Campaign) -> Heading {
        // Debug prints every bit of every figure, which is what a fingerprint needs.
        let Campaign { structure, parameters, setups, ranges, controllers, .. } = campaign;
        let mut hasher = FnvHasher::default();
        let all = format!("{structure:?} {parameters:?} {setups:?} {ranges:?} {controllers:?}");
        hasher.write(all.as_bytes());
        Heading {
            program: env!("CARGO_PKG_VERSION").to_owned(),
            preset: preset.to_owned(),
            seed: campaign.seed,
            mismatch: campaign.mismatch,
            fingerprint: format!("{:016x}", hasher.finish()),
        }
    }

    /// In what another campaign differs.
    fn difference(&self, asked: &Heading) -> Option<String> {
        let differing =
            |what: &str, this: &dyn std::fmt::Display, asked: &dyn std::fmt::Display| {
                Some(format!("holds a campaign with {what} {this}, but {asked} is asked for"))
            };
        if self.program != asked.program {
            differing("version", &self.program, &asked.program)
        } else if self.preset != asked.preset {
            differing("preset", &self.preset, &asked.preset)
        } else if self.seed != asked.seed {
            differing("seed", &self.seed, &asked.seed)
        } else if self.mismatch.to_bits() != asked.mismatch.to_bits() {
            differing("mismatch", &self.mismatch, &asked.mismatch)
        } else if self.fingerprint != asked.fingerprint {
            Some("holds a campaign with another plant, other diagnosers or thresholds".to_owned())
        } else {
            None
        }
    }
}
