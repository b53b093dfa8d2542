//! Completed work of a campaign on disk: lines of JSON in `cases.jsonl`. The first line contains the request, followed
//! by a line for each commissioned plant and each case.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use fnv::FnvHasher;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::hash::Hasher;

use crate::campaign::{Campaign, Rows};
use crate::error::StudyError;
use crate::system::PlantRow;

/// Name of the file in the directory of a campaign.
pub const FILE: &str = "cases.jsonl";

/// Version of the format.
const VERSION: u64 = 1;

/// The completed work of a campaign.
#[derive(Debug, Clone, PartialEq)]
pub struct Done<R> {
    /// The plants that were commissioned, by system and number.
    pub plants: BTreeMap<(usize, u64), PlantRow>,
    /// The results of the cases.
    pub rows: Rows<R>,
}

impl<R> Default for Done<R> {
    fn default() -> Self {
        Self { plants: BTreeMap::new(), rows: BTreeMap::new() }
    }
}

/// The first line of a journal, which applies to all its cases.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CampaignHeader {
    v: u64,
    program: String,
    /// The request.
    pub campaign: Value,
    /// Hash of structure, plant, diagnosers and thresholds, 64 bits.
    fingerprint: String,
    /// The part of the cases that the journal is for; `None` for all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<String>,
}

/// A line after the first.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum JournalLine<P, R> {
    Plant { system: usize, plant: P },
    Case { case: u64, row: R },
}

impl CampaignHeader {
    /// The header for a campaign with this request.
    #[must_use]
    pub fn new(request: Value, campaign: &impl Campaign, shard: Option<String>) -> Self {
        let mut hasher = FnvHasher::default();
        // `Debug` prints all figures with full precision, as a fingerprint requires.
        hasher.write(format!("{:?}", campaign.systems()).as_bytes());
        Self {
            v: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            campaign: request,
            fingerprint: format!("{:016x}", hasher.finish()),
            shard,
        }
    }

    /// Reads the header of the journal in a directory.
    ///
    /// # Errors
    /// The journal does not exist, or cannot be read.
    pub fn of(directory: &Path) -> Result<Self, StudyError> {
        let path = directory.join(FILE);
        let text = fs::read_to_string(&path).map_err(|error| unreadable(&path, &error))?;
        Self::first_of(&path, &text)
    }

    fn first_of(path: &Path, text: &str) -> Result<Self, StudyError> {
        let first = text.lines().next().unwrap_or_default();
        serde_json::from_str(first).map_err(|error| unreadable(path, &error))
    }

    /// The difference from another request, if any.
    fn difference(&self, asked: &Self) -> Option<String> {
        let other = |what: &str, this: &dyn Display, asked: &dyn Display| {
            Some(format!("holds another request: {what} {this}, not {asked}"))
        };
        if self.v != asked.v {
            return other("format", &self.v, &asked.v);
        }
        if self.program != asked.program {
            return other("version", &self.program, &asked.program);
        }
        if self.campaign != asked.campaign {
            let keys = [&self.campaign, &asked.campaign].into_iter().filter_map(Value::as_object);
            let differing = keys.flat_map(|object| object.keys());
            let (ours, theirs) = (&self.campaign, &asked.campaign);
            let key = differing.into_iter().find(|key| ours.get(key) != theirs.get(key));
            let key = key.map_or("campaign", String::as_str);
            let value =
                |of: &Value| of.get(key).map_or_else(|| "none".to_owned(), Value::to_string);
            return other(key, &value(ours), &value(theirs));
        }
        if self.shard != asked.shard {
            let name = |of: &Self| of.shard.clone().unwrap_or_else(|| "none".to_owned());
            return other("shard", &name(self), &name(asked));
        }
        (self.fingerprint != asked.fingerprint)
            .then(|| "holds cases of another plant, other diagnosers or thresholds".to_owned())
    }
}

/// A journal open for adding cases.
#[derive(Debug)]
pub struct CampaignJournal {
    path: PathBuf,
    file: File,
}

impl CampaignJournal {
    /// Opens or creates the journal in a directory; returns the completed work.
    ///
    /// # Errors
    /// The journal is for another request, or cannot be read or written.
    pub fn open<R: DeserializeOwned>(
        directory: &Path,
        header: &CampaignHeader,
    ) -> Result<(Self, Done<R>), StudyError> {
        let path = directory.join(FILE);
        let io = |error| StudyError::File { path: path.clone(), error };
        fs::create_dir_all(directory).map_err(io)?;
        let file = File::options().create(true).append(true).open(&path).map_err(io)?;
        let text = fs::read_to_string(&path).map_err(io)?;
        // An incomplete last line was being written when the program was stopped.
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let done = if whole == 0 { Done::default() } else { parse(&path, &text[..whole], header)? };
        file.set_len(whole as u64).map_err(io)?;
        let mut journal = Self { path, file };
        if whole == 0 {
            journal.write(header)?;
        }
        Ok((journal, done))
    }

    /// Adds a case.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn case(&mut self, case: u64, row: &impl Serialize) -> Result<(), StudyError> {
        self.write(&JournalLine::<(), _>::Case { case, row })
    }

    /// Adds a plant of a system.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn plant(&mut self, (system, _): (usize, u64), plant: &PlantRow) -> Result<(), StudyError> {
        self.write(&JournalLine::<_, ()>::Plant { system, plant })
    }

    fn write(&mut self, line: &impl Serialize) -> Result<(), StudyError> {
        let text = line_of(line).map_err(|error| wrong(&self.path, &error))?;
        let written = self.file.write_all(text.as_bytes());
        written.map_err(|error| StudyError::File { path: self.path.clone(), error })
    }
}

/// A whole journal as text, its cases in the order of their numbers.
///
/// # Errors
/// A row that cannot be written as JSON.
pub fn text<R: Serialize>(
    header: &CampaignHeader,
    done: &Done<R>,
) -> Result<String, serde_json::Error> {
    let mut text = line_of(header)?;
    for ((system, _), plant) in &done.plants {
        text += &line_of(&JournalLine::<_, ()>::Plant { system: *system, plant })?;
    }
    for (case, row) in &done.rows {
        text += &line_of(&JournalLine::<(), _>::Case { case: *case, row })?;
    }
    Ok(text)
}

/// The completed work in the journals in these directories, of any shards.
///
/// # Errors
/// A journal is for another request than `header`'s, or cannot be read.
pub fn read_all<R: DeserializeOwned>(
    directories: &[PathBuf],
    header: &CampaignHeader,
) -> Result<Done<R>, StudyError> {
    let mut all = Done::default();
    for directory in directories {
        let path = directory.join(FILE);
        let text = fs::read_to_string(&path).map_err(|error| unreadable(&path, &error))?;
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let shard = CampaignHeader::first_of(&path, &text)?.shard;
        let done = parse(&path, &text[..whole], &CampaignHeader { shard, ..header.clone() })?;
        all.plants.extend(done.plants);
        all.rows.extend(done.rows);
    }
    Ok(all)
}

fn line_of(line: &impl Serialize) -> Result<String, serde_json::Error> {
    Ok(serde_json::to_string(line)? + "\n")
}

fn parse<R: DeserializeOwned>(
    path: &Path,
    text: &str,
    expected: &CampaignHeader,
) -> Result<Done<R>, StudyError> {
    let mut done = Done::default();
    for (number, line) in text.lines().enumerate() {
        let at =
            |error: serde_json::Error| unreadable(path, &format!("line {}: {error}", number + 1));
        if number == 0 {
            let header: CampaignHeader = serde_json::from_str(line).map_err(at)?;
            if let Some(difference) = header.difference(expected) {
                return Err(wrong(path, &difference));
            }
            continue;
        }
        match serde_json::from_str(line).map_err(at)? {
            JournalLine::Plant { system, plant } => {
                let plant: PlantRow = plant;
                done.plants.insert((system, plant.number), plant);
            }
            JournalLine::Case { case, row } => {
                done.rows.insert(case, row);
            }
        }
    }
    Ok(done)
}

fn unreadable(path: &Path, problem: &dyn Display) -> StudyError {
    wrong(path, &format!("cannot be read: {problem}"))
}

fn wrong(path: &Path, problem: &dyn Display) -> StudyError {
    StudyError::Journal { path: path.to_owned(), problem: problem.to_string() }
}
