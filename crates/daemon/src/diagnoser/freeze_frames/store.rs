//! Which freeze frames are kept: the latest ones, so many and so long at most.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::Instant;

use diagnosis::messages::Speaker;
use vocabulary::Occurrences;
use vocabulary::{FreezeFrame, FrozenSignals};

use super::files::{self, FoundFrame, FreezeFrameFiles};

/// So many are kept.
pub(super) const MOST: usize = 32;
/// So long they are together \[bytes\].
const MOST_BYTES: u64 = 16 << 20;

/// The frames, the oldest first.
#[derive(Debug)]
pub(super) struct FreezeFrameStore {
    files: Option<FreezeFrameFiles>,
    entries: VecDeque<FreezeFrameEntry>,
    failures: Occurrences,
}

#[derive(Debug)]
struct FreezeFrameEntry {
    /// The frame without its signals; none of a file that cannot be used, which only waits for its removal.
    head: Option<FreezeFrame>,
    bytes: u64,
    place: FreezeFramePlace,
}

#[derive(Debug)]
enum FreezeFramePlace {
    File(PathBuf),
    /// Without a folder, or as long as the disk does not take it.
    Memory(Box<FreezeFrame>),
}

impl FreezeFrameStore {
    /// Opens the frames of a module in a folder, or an empty store in memory. Unusable files are logged, and are the
    /// first to be deleted for lack of space.
    pub(super) fn open(files: Option<FreezeFrameFiles>, speaker: &Speaker) -> Self {
        let found =
            files.as_ref().map_or(Ok(Vec::new()), FreezeFrameFiles::read).unwrap_or_else(|error| {
                tracing::warn!("earlier freeze frames cannot be read: {error}");
                Vec::new()
            });
        let mut entries: Vec<FreezeFrameEntry> =
            found.into_iter().map(|found| FreezeFrameEntry::of(found, speaker)).collect();
        // Those that cannot be used come first; the others in the order of their numbers.
        entries.sort_by_key(|entry| entry.head.as_ref().map(|head| head.signals.sequence));
        let mut store = Self { files, entries: entries.into(), failures: Occurrences::default() };
        store.make_room();
        store
    }

    /// Keeps a frame: in its file, or, if the disk does not take it, in memory until it does.
    pub(super) fn keep(&mut self, frame: FreezeFrame) {
        let bytes = vocabulary::encode(&frame).map_or(0, |bytes| bytes.len() as u64);
        let head = Some(without_signals(&frame));
        self.entries.push_back(FreezeFrameEntry {
            head,
            bytes,
            place: FreezeFramePlace::Memory(Box::new(frame)),
        });
        self.make_room();
        self.save();
    }

    /// Writes what is only in memory.
    fn save(&mut self) {
        let Some(files) = &self.files else { return };
        for entry in &mut self.entries {
            let FreezeFramePlace::Memory(frame) = &entry.place else { continue };
            match files.write(frame) {
                Ok((path, bytes)) => {
                    entry.bytes = bytes;
                    entry.place = FreezeFramePlace::File(path);
                }
                Err(error) => {
                    if let Some(times) = self.failures.note(Instant::now()) {
                        tracing::warn!(times, "freeze frame kept in memory only: {error}");
                    }
                    return;
                }
            }
        }
    }

    fn make_room(&mut self) {
        let total = |entries: &VecDeque<FreezeFrameEntry>| {
            entries.iter().map(|entry| entry.bytes).sum::<u64>()
        };
        while self.entries.len() > MOST || total(&self.entries) > MOST_BYTES {
            let Some(FreezeFrameEntry { place: FreezeFramePlace::File(path), .. }) =
                self.entries.pop_front()
            else {
                continue;
            };
            if let Err(error) = std::fs::remove_file(&path) {
                tracing::warn!(file = %path.display(), "old freeze frame not removed: {error}");
            }
        }
    }

    /// The frames without their signals, newest first.
    pub(super) fn heads(&self) -> impl Iterator<Item = &FreezeFrame> {
        self.entries.iter().rev().filter_map(|entry| entry.head.as_ref())
    }

    /// The frame of a transition.
    ///
    /// # Errors
    /// It is not kept, with those that are; or its file cannot be read.
    pub(super) fn frame(&self, sequence: u64) -> Result<FreezeFrame, String> {
        let is_it = |entry: &&FreezeFrameEntry| {
            entry.head.as_ref().is_some_and(|h| h.signals.sequence == sequence)
        };
        let Some(entry) = self.entries.iter().rev().find(is_it) else {
            let kept: Vec<String> =
                self.heads().map(|head| head.signals.sequence.to_string()).collect();
            return Err(match &kept[..] {
                [] => NONE.to_owned(),
                kept => format!(
                    "no freeze frame for transition {sequence}; available: {}",
                    kept.join(", ")
                ),
            });
        };
        match &entry.place {
            FreezeFramePlace::Memory(frame) => Ok((**frame).clone()),
            FreezeFramePlace::File(path) => files::read(path).map_err(|error| {
                format!("the freeze frame of transition {sequence} cannot be read: {error}")
            }),
        }
    }
}

/// The refusal while there are no frames.
pub(super) const NONE: &str =
    "no freeze frame available yet: one is complete two seconds after latching";

impl FreezeFrameEntry {
    fn of(FoundFrame { path, bytes, frame }: FoundFrame, speaker: &Speaker) -> Self {
        let head = match frame {
            Ok(frame) if is_own(&frame, speaker) => Some(without_signals(&frame)),
            Ok(_) => {
                tracing::warn!(file = %path.display(), "freeze frame belongs to another journal: ignored");
                None
            }
            Err(error) => {
                tracing::warn!(file = %path.display(), "freeze frame not used: {error}");
                None
            }
        };
        Self { head, bytes, place: FreezeFramePlace::File(path) }
    }
}

fn is_own(frame: &FreezeFrame, speaker: &Speaker) -> bool {
    frame.structure == speaker.structure
        && frame.module == speaker.module
        && frame.incarnation == speaker.incarnation
}

fn without_signals(frame: &FreezeFrame) -> FreezeFrame {
    // Field by field, for the signals are long.
    let signals = FrozenSignals { steps: Vec::new(), traces: Vec::new(), ..frame.signals };
    FreezeFrame {
        signals,
        structure: frame.structure.clone(),
        module: frame.module.clone(),
        component: frame.component.clone(),
        ..*frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;
    use vocabulary::{RunId, Step};

    fn speaker(incarnation: u64) -> Speaker {
        let own = Speaker::of("tower".parse().unwrap(), "m1".parse().unwrap());
        Speaker { incarnation, ..own }
    }

    fn frame(sequence: u64, steps: u64) -> FreezeFrame {
        let speaker = speaker(7);
        let trace = vocabulary::Trace {
            name: "residual".to_owned(),
            unit: "m".to_owned(),
            values: (0..steps).map(|_| Some(1.234_567_890_123_456e-9)).collect(),
        };
        let signals = FrozenSignals {
            sequence,
            run: RunId(3),
            step_s: 1e-3,
            onset_step: Step(10),
            detection_step: Step(12),
            decided_step: Step(20),
            threshold: 0.3,
            steps: (0..steps).map(Step).collect(),
            traces: vec![trace],
        };
        speaker.freeze_frame(&"sensor/g1".parse().unwrap(), signals, 5)
    }

    fn open(directory: &Path) -> FreezeFrameStore {
        FreezeFrameStore::open(Some(FreezeFrameFiles::of(directory)), &speaker(7))
    }

    fn kept(store: &FreezeFrameStore) -> Vec<u64> {
        store.heads().map(|head| head.signals.sequence).collect()
    }

    fn files(directory: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(directory.join("freeze-frames")).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn of_forty_frames_the_latest_thirty_two_are_kept_and_found_again() {
        let directory = tempfile::tempdir().unwrap();
        let mut store = open(directory.path());
        assert_eq!(store.frame(1), Err(NONE.to_owned()));
        (1..=40).for_each(|sequence| store.keep(frame(sequence, 3)));
        for store in [store, open(directory.path())] {
            assert_eq!(kept(&store), (9..=40).rev().collect::<Vec<_>>());
            assert_eq!(files(directory.path()).len(), MOST);
            assert_eq!(store.frame(9), Ok(frame(9, 3)));
            assert!(
                store
                    .heads()
                    .all(|head| head.signals.steps.is_empty() && head.signals.traces.is_empty())
            );
            let refusal = store.frame(8).unwrap_err();
            assert!(refusal.contains("transition 8;") && refusal.ends_with(", 10, 9"), "{refusal}");
        }
    }

    #[test]
    fn long_ones_are_fewer() {
        let directory = tempfile::tempdir().unwrap();
        for mut store in [open(directory.path()), FreezeFrameStore::open(None, &speaker(7))] {
            (1..=25).for_each(|sequence| store.keep(frame(sequence, 30_000)));
            let bytes: u64 = store.entries.iter().map(|entry| entry.bytes).sum();
            assert!(
                store.entries.len() < 25 && bytes <= MOST_BYTES && bytes > MOST_BYTES - (1 << 20)
            );
            assert_eq!(kept(&store)[0], 25);
        }
    }

    #[test]
    fn what_is_no_frame_of_this_journal_is_not_used_and_goes_first() {
        let directory = tempfile::tempdir().unwrap();
        open(directory.path()).keep(frame(1, 3));
        let folder = directory.path().join("freeze-frames");
        std::fs::write(folder.join("ffff-3.json"), "{").unwrap();
        std::fs::write(folder.join("ffff-4.unfinished"), "{").unwrap();
        let other = FreezeFrame { incarnation: 6, ..frame(2, 3) };
        FreezeFrameFiles::of(directory.path()).write(&other).unwrap();
        let mut store = open(directory.path());
        assert_eq!(kept(&store), [1]);
        assert_eq!(files(directory.path()).len(), 3, "without what was not finished");
        (10..10 + MOST as u64).for_each(|sequence| store.keep(frame(sequence, 3)));
        assert_eq!(kept(&store).len(), MOST);
        assert!(files(directory.path()).iter().all(|name| name.starts_with("0000000000000007-")));
    }

    #[test]
    fn what_the_disk_does_not_take_is_kept_in_memory_until_it_does() {
        let directory = tempfile::tempdir().unwrap();
        let blocked = directory.path().join("freeze-frames");
        std::fs::write(&blocked, "a file in the folder's place").unwrap();
        let mut store = open(directory.path());
        (1..=3).for_each(|sequence| store.keep(frame(sequence, 3)));
        assert_eq!((kept(&store), store.frame(2)), (vec![3, 2, 1], Ok(frame(2, 3))));
        std::fs::remove_file(&blocked).unwrap();
        store.keep(frame(4, 3));
        assert_eq!(files(directory.path()).len(), 4);
        let mode = std::fs::metadata(blocked.join(&files(directory.path())[0])).unwrap();
        assert_eq!(mode.permissions().mode() & 0o777, 0o600);
        assert_eq!(store.frame(2), Ok(frame(2, 3)));
    }
}
