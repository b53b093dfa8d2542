//! Reads recordings.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use ::replay::{Collection, ModuleRecord};
use recording::{Ending, Recorded, Recording};
use vocabulary::{ModuleName, printable_lines};

use crate::failure::Failure;

/// Messages that go to another thread together.
const BATCH: usize = 512;

/// What recordings hold of modules.
pub(crate) struct RecordingContents {
    /// The modules.
    pub(crate) records: Vec<ModuleRecord>,
    /// What could not be read.
    pub(crate) problems: Vec<String>,
}

impl RecordingContents {
    /// Everything could be read.
    pub(crate) fn complete(&self) -> Result<(), Failure> {
        if self.problems.is_empty() { Ok(()) } else { Err(Failure::inputs(self.problems.clone())) }
    }
}

/// Reads recordings: of these modules only, or, if none is named, of all.
pub(crate) fn read(files: &[PathBuf], wanted: &[ModuleName]) -> Result<RecordingContents, Failure> {
    let threads = thread::available_parallelism().map_or(1, NonZeroUsize::get).min(8);
    let (mut records, problems) = thread::scope(|scope| {
        let mut lanes = Vec::new();
        let mut collectors = Vec::new();
        for _ in 0..threads {
            let (lane, batches) = sync_channel(16);
            lanes.push(CollectorLane { lane, batch: Vec::with_capacity(BATCH) });
            collectors.push(scope.spawn(move || collect(&batches)));
        }
        let problems = distribute(files, &mut lanes);
        drop(lanes);
        let collected = collectors.into_iter().filter_map(|collector| collector.join().ok());
        let records: Vec<ModuleRecord> = collected.flatten().collect();
        problems.map(|problems| (records, problems))
    })?;
    if let Some(absent) = wanted.iter().find(|name| !records.iter().any(|r| r.module == **name)) {
        let known: Vec<String> = records.iter().map(|r| format!("`{}`", r.module)).collect();
        let known = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
        return Err(Failure::input(format!(
            "no module `{absent}` in the recording; it has {known}"
        )));
    }
    records.retain(|record| wanted.is_empty() || wanted.contains(&record.module));
    records.sort_by(|a, b| (&a.structure, &a.module).cmp(&(&b.structure, &b.module)));
    if records.is_empty() {
        return Err(Failure::input("the recording has no module"));
    }
    let mut problems = problems;
    for record in &records {
        if let Some(problem) = &record.unreadable_because {
            let (module, count) = (&record.module, record.unreadable);
            problems.push(format!("{count} messages of `{module}` cannot be read: {problem}"));
        }
    }
    Ok(RecordingContents { records, problems })
}

/// A thread that all messages of some modules go to.
struct CollectorLane {
    lane: SyncSender<Vec<Recorded>>,
    batch: Vec<Recorded>,
}

impl CollectorLane {
    fn send(&mut self) {
        let batch = std::mem::replace(&mut self.batch, Vec::with_capacity(BATCH));
        // A collector ends only after its lane.
        let _ = self.lane.send(batch);
    }
}

fn collect(batches: &Receiver<Vec<Recorded>>) -> Vec<ModuleRecord> {
    let mut collection = Collection::default();
    for message in batches.iter().flatten() {
        collection.take(&message.topic, &message.payload);
    }
    collection.finish()
}

/// Sends each message to its module's thread. What of a file cannot be read is a problem, unless it is all of it.
fn distribute(files: &[PathBuf], lanes: &mut [CollectorLane]) -> Result<Vec<String>, Failure> {
    let mut modules: BTreeMap<String, usize> = BTreeMap::new();
    let mut problems = Vec::new();
    for file in files {
        let unusable = |error: recording::RecordingError| Failure::input(error.to_string());
        let recording = Recording::open(file).map_err(unusable)?;
        let mut messages = recording.messages().map_err(unusable)?;
        for (count, message) in messages.by_ref().enumerate() {
            let message = match message {
                Ok(message) => message,
                Err(error) if count == 0 => return Err(unusable(error)),
                // What comes after a damaged part is read all the same.
                Err(error) => {
                    problems.push(error.to_string());
                    continue;
                }
            };
            let module = message.topic.split('/').nth(2).unwrap_or_default();
            let place = modules.get(module).copied().unwrap_or_else(|| {
                let place = modules.len();
                modules.insert(module.to_owned(), place);
                place
            });
            let number = place % lanes.len();
            let lane = &mut lanes[number];
            lane.batch.push(message);
            if lane.batch.len() == BATCH {
                lane.send();
            }
        }
        if let Some(ending @ (Ending::WithinChunk(_) | Ending::WithinRecord(_))) = messages.ending()
        {
            let note = format!("note: recording {}: {ending}", file.display());
            writeln!(io::stderr(), "{}", printable_lines(&note))?;
        }
    }
    lanes.iter_mut().for_each(CollectorLane::send);
    Ok(problems)
}
