//! A series of files: a new one is begun by size and time, the oldest is deleted by quota.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::{Loss, Metadata, Recorded, RecordingError, Writer, by_component, quota};

/// The highest number that is tried for the name of a file.
const LAST_NUMBER: u32 = 9999;

/// When the next file is begun, and when the oldest is deleted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FileLimits {
    /// Longest file without its head ([`RecordingFiles::write_head`]) \[bytes\].
    pub file_bytes: u64,
    /// Longest time recorded in one file \[ns\].
    pub file_ns: u64,
    /// Largest total length of all files, unless the present one alone is longer \[bytes\].
    pub quota_bytes: u64,
}

/// Recordings in a directory, one being written.
pub struct RecordingFiles {
    directory: PathBuf,
    name: String,
    limits: FileLimits,
    present: Option<Present>,
    is_held: bool,
    number: u32,
    begun: Vec<PathBuf>,
    deleted: Vec<PathBuf>,
    openings: BTreeMap<String, Recorded>,
    notes: BTreeMap<String, Metadata>,
    losses: BTreeMap<String, u64>,
}

/// The file being written.
struct Present {
    writer: Writer,
    began_unix_ns: u64,
    /// The number of messages that a failure of the disk would lose, by topic.
    unsynced: BTreeMap<String, u64>,
    /// The part of its length that does not count.
    head_bytes: u64,
}

impl RecordingFiles {
    /// Recordings with this name in this directory. The first file is begun with the first message.
    #[must_use]
    pub fn new(directory: &Path, name: &str, limits: FileLimits) -> Self {
        Self {
            directory: directory.into(),
            name: name.to_owned(),
            limits,
            present: None,
            is_held: false,
            number: 0,
            begun: Vec::new(),
            deleted: Vec::new(),
            openings: BTreeMap::new(),
            notes: BTreeMap::new(),
            losses: BTreeMap::new(),
        }
    }

    /// Writes a message, and the messages derived from it.
    ///
    /// # Errors
    /// It cannot be written. Then the file ends, messages not yet on the disk count as lost, and the next message begins
    /// another file.
    pub fn write(&mut self, message: &Recorded, now_unix_ns: u64) -> Result<(), RecordingError> {
        let derived = by_component(message);
        let mut is_counted = false;
        let written = self.attempt(now_unix_ns, |present| {
            is_counted = true;
            present.count(&message.topic);
            present.writer.write(message)?;
            derived.iter().try_for_each(|derived| present.writer.write(derived))
        });
        if written.is_err() && !is_counted {
            self.count_lost([(message.topic.clone(), 1)]);
        }
        written
    }

    /// Writes a message that every file has at its head. Three quarters of it, the compressed length of text in base64, do
    /// not count for the file's length; otherwise a short file would consist of its head.
    ///
    /// # Errors
    /// As when any message is written.
    pub fn write_head(
        &mut self,
        message: &Recorded,
        now_unix_ns: u64,
    ) -> Result<(), RecordingError> {
        self.write(message, now_unix_ns)?;
        if let Some(present) = &mut self.present {
            present.head_bytes += message.payload.len() as u64 / 4 * 3;
        }
        Ok(())
    }

    /// Writes a message now and at the start of every later file, until another one of its topic replaces it.
    ///
    /// # Errors
    /// As when any message is written.
    pub fn write_in_each(
        &mut self,
        message: Recorded,
        now_unix_ns: u64,
    ) -> Result<(), RecordingError> {
        let written = match &self.present {
            // Opening the file will write it.
            None => Ok(()),
            Some(_) => self.write(&message, now_unix_ns),
        };
        self.openings.insert(message.topic.clone(), message);
        written?;
        self.attempt(now_unix_ns, |_| Ok(()))
    }

    /// Writes metadata now and at the start of every later file.
    ///
    /// # Errors
    /// As when a message is written.
    pub fn note(&mut self, metadata: Metadata, now_unix_ns: u64) -> Result<(), RecordingError> {
        if self.notes.get(&metadata.name) == Some(&metadata) {
            return Ok(());
        }
        self.notes.insert(metadata.name.clone(), metadata.clone());
        match self.present {
            None => Ok(()),
            Some(_) => self.attempt(now_unix_ns, |present| present.writer.note(metadata)),
        }
    }

    /// Counts messages of a topic as lost, in the file as well.
    ///
    /// # Errors
    /// As when a message is written; they are counted nevertheless.
    pub fn lose(
        &mut self,
        topic: &str,
        count: u64,
        reason: &str,
        now_unix_ns: u64,
    ) -> Result<(), RecordingError> {
        let total = self.losses.entry(topic.to_owned()).or_default();
        *total = total.saturating_add(count);
        let (topic, reason, total) = (topic.to_owned(), reason.to_owned(), *total);
        let loss = Loss { topic, count, total, reason, time_unix_ns: now_unix_ns };
        self.attempt(now_unix_ns, |present| present.writer.write(&loss.to_message()))
    }

    /// Sets whether the present file continues whatever its length and time, because its head is not complete.
    pub fn hold(&mut self, is_held: bool) {
        self.is_held = is_held;
    }

    /// Syncs everything so far to the disk; ends a file that is long enough.
    ///
    /// # Errors
    /// It cannot be written, as when a message is.
    pub fn sync(&mut self, now_unix_ns: u64) -> Result<(), RecordingError> {
        let Some(present) = &mut self.present else { return Ok(()) };
        if let Err(error) = present.sync() {
            self.give_up();
            return Err(error);
        }
        let since = now_unix_ns.saturating_sub(present.began_unix_ns);
        let length = present.writer.written().unwrap_or(0);
        let longest = self.limits.file_bytes.saturating_add(present.head_bytes);
        if !self.is_held && (length >= longest || since >= self.limits.file_ns) {
            self.finish()?;
        }
        Ok(())
    }

    /// Ends the present file.
    ///
    /// # Errors
    /// It cannot be written; then it stays unfinished.
    pub fn finish(&mut self) -> Result<(), RecordingError> {
        let losses = self.losses.iter().map(|(topic, count)| (topic.clone(), count.to_string()));
        let losses = Metadata { name: "losses".to_owned(), values: losses.collect() };
        let Some(present) = self.present.take() else { return Ok(()) };
        let Present { mut writer, unsynced, .. } = present;
        let finished = writer.note(losses).and_then(|()| writer.finish());
        if finished.is_err() {
            self.count_lost(unsynced);
        }
        finished
    }

    /// The file being written, and its length on the disk \[bytes\].
    pub fn present(&mut self) -> Option<(&Path, u64)> {
        let writer = &mut self.present.as_mut()?.writer;
        let length = writer.written().unwrap_or(0);
        Some((writer.file(), length))
    }

    /// The files begun so far.
    #[must_use]
    pub fn begun(&self) -> &[PathBuf] {
        &self.begun
    }

    /// The files deleted since the last call.
    pub fn take_deleted(&mut self) -> Vec<PathBuf> {
        std::mem::take(&mut self.deleted)
    }

    /// The number of messages of each topic lost so far.
    #[must_use]
    pub fn losses(&self) -> &BTreeMap<String, u64> {
        &self.losses
    }

    fn attempt(
        &mut self,
        now_unix_ns: u64,
        what: impl FnOnce(&mut Present) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        if self.present.is_none() {
            self.present = Some(self.open(now_unix_ns)?);
        }
        let done = self.present.as_mut().map_or(Ok(()), what);
        if done.is_err() {
            self.give_up();
        }
        done
    }

    fn open(&mut self, now_unix_ns: u64) -> Result<Present, RecordingError> {
        let room = self.limits.quota_bytes.saturating_sub(self.limits.file_bytes);
        let kept = quota::keep(&self.directory, &self.name, room, &self.begun);
        self.deleted
            .extend(kept.map_err(|error| RecordingError::writing(&self.directory, &error))?);
        let mut writer = self.create(now_unix_ns)?;
        self.begun.push(writer.file().into());
        for metadata in self.notes.values() {
            writer.note(metadata.clone())?;
        }
        for message in self.openings.values() {
            writer.write(message)?;
        }
        Ok(Present { writer, began_unix_ns: now_unix_ns, unsynced: BTreeMap::new(), head_bytes: 0 })
    }

    /// Creates the next file under an unused name.
    fn create(&mut self, now_unix_ns: u64) -> Result<Writer, RecordingError> {
        loop {
            self.number += 1;
            let name = quota::file_name(&self.name, now_unix_ns, self.number);
            let file = self.directory.join(name);
            match Writer::create(&file) {
                // Another recorder uses this name, perhaps since just now.
                Err(_) if file.exists() && self.number <= LAST_NUMBER => {}
                created => return created,
            }
        }
    }

    fn give_up(&mut self) {
        if let Some(present) = self.present.take() {
            self.count_lost(present.unsynced);
        }
    }

    fn count_lost(&mut self, unsynced: impl IntoIterator<Item = (String, u64)>) {
        for (topic, count) in unsynced {
            *self.losses.entry(topic).or_default() += count;
        }
    }
}

impl Present {
    fn count(&mut self, topic: &str) {
        match self.unsynced.get_mut(topic) {
            Some(count) => *count += 1,
            None => drop(self.unsynced.insert(topic.to_owned(), 1)),
        }
    }

    fn sync(&mut self) -> Result<(), RecordingError> {
        self.writer.sync()?;
        self.unsynced.clear();
        Ok(())
    }
}
