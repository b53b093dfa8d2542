//! The journal's files, read as far as they reach whenever there is a question.
//!
//! A rotation replaces a file; then all is read anew, as it is when a record is not where it was.

use std::path::{Path, PathBuf};

use journal::{JournalFollower, JournalLook, OpenError, RecordPlace};
use process::JournalRecord;
use vocabulary::{FaultTransition, HistoryPage, HistoryQuestion, Identification, PhaseChange};

use super::page::{EntryReader, HistoryEntries, HistoryIndex, compile};
use diagnosis::messages::Speaker;

/// A record that is not where it was, thrice in a row, is not due to a journal that is being replaced meanwhile.
const ATTEMPTS: usize = 3;

/// A page that cannot be had.
#[derive(Debug, thiserror::Error)]
pub(super) enum PageError {
    #[error(transparent)]
    Read(#[from] OpenError),
    #[error("journal modified while it was read; retry")]
    Changing,
}

/// A journal, as far as it has been read.
#[derive(Debug)]
pub(super) struct HistoryReader<'a> {
    speaker: &'a Speaker,
    directory: PathBuf,
    known: ReadHistory,
}

/// What has been read.
#[derive(Debug)]
struct ReadHistory {
    follower: JournalFollower,
    entries: HistoryEntries,
    index: HistoryIndex<RecordPlace>,
}

impl<'a> HistoryReader<'a> {
    pub(super) fn new(speaker: &'a Speaker, directory: &Path) -> Self {
        let known = ReadHistory::nothing(speaker, directory);
        Self { speaker, directory: directory.to_owned(), known }
    }

    /// The page that is asked for, of all that the journal holds at this moment.
    pub(super) fn page(&mut self, question: HistoryQuestion) -> Result<HistoryPage, PageError> {
        for _ in 0..ATTEMPTS {
            match self.known.page(self.speaker, question) {
                Err(error) => {
                    self.known = ReadHistory::nothing(self.speaker, &self.directory);
                    if let PageError::Read(_) = error {
                        return Err(error);
                    }
                }
                page => return page,
            }
        }
        Err(PageError::Changing)
    }
}

impl ReadHistory {
    fn nothing(speaker: &Speaker, directory: &Path) -> Self {
        let entries = HistoryEntries::of(&speaker.module);
        Self { follower: JournalFollower::new(directory), entries, index: HistoryIndex::new() }
    }

    fn page(
        &mut self,
        speaker: &Speaker,
        question: HistoryQuestion,
    ) -> Result<HistoryPage, PageError> {
        let mut look = self.follower.look()?;
        if look.is_anew() {
            self.entries = HistoryEntries::of(&speaker.module);
            self.index = HistoryIndex::new();
        }
        while let Some((place, record)) = look.next_record()? {
            if let Some(entry) = self.entries.read(&record) {
                self.index.enter(&entry, place);
            }
        }
        compile(speaker, &self.index, question, &mut look)
    }
}

impl EntryReader<RecordPlace> for JournalLook<'_> {
    type Error = PageError;

    fn transition(
        &mut self,
        sequence: u64,
        place: RecordPlace,
    ) -> Result<FaultTransition, PageError> {
        match record_at(self, place)? {
            JournalRecord::Transition(transition) if transition.sequence == sequence => {
                Ok(*transition)
            }
            _ => Err(PageError::Changing),
        }
    }

    fn identification(
        &mut self,
        sequence: u64,
        place: RecordPlace,
    ) -> Result<Identification, PageError> {
        match record_at(self, place)? {
            JournalRecord::Identification(found) if found.sequence == sequence => Ok(*found),
            _ => Err(PageError::Changing),
        }
    }

    fn phase(&mut self, number: u64, place: RecordPlace) -> Result<PhaseChange, PageError> {
        match record_at(self, place)? {
            JournalRecord::Phase(change) if change.number == number => Ok(*change),
            _ => Err(PageError::Changing),
        }
    }
}

fn record_at(look: &JournalLook<'_>, place: RecordPlace) -> Result<JournalRecord, PageError> {
    let text = look.record_at(place)?.ok_or(PageError::Changing)?;
    JournalRecord::from_text(&text).ok_or(PageError::Changing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::OpenOptions;
    use std::io::Write;

    use journal::Journal;
    use vocabulary::{RunId, Step};

    use super::super::testing as straightforward;

    const COMPONENTS: [&str; 5] =
        ["sensor/g1", "sensor/g2", "sensor/g3", "actuator/a1", "actuator/a2"];

    fn speaker(module: &str) -> Speaker {
        Speaker::of("t".parse().unwrap(), module.parse().unwrap())
    }

    fn transition(of: &Speaker, component: &str, sequence: u64) -> JournalRecord {
        let untouched = of.untouched(&component.parse().unwrap(), 0);
        JournalRecord::Transition(Box::new(FaultTransition { sequence, ..untouched }))
    }

    fn found(of: &Speaker, component: &str, sequence: u64, as_of: u64) -> JournalRecord {
        let kind = vocabulary::fault::FaultKind::Bias.into();
        let candidate = vocabulary::Candidate { kind, probability: 0.1, size: None };
        let found = diagnosis::identification::IdentificationResult {
            run: RunId(1),
            sequence,
            component: component.parse().unwrap(),
            as_of: Step(as_of),
            candidates: vec![candidate; (as_of % 5) as usize],
            signature: Vec::new(),
        };
        JournalRecord::Identification(Box::new(of.identification(found, 0)))
    }

    fn change(step: u64) -> JournalRecord {
        let change = vocabulary::Change::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
        JournalRecord::Change { run: RunId(1), change }
    }

    /// Numbers as if drawn, the same each time.
    struct Drawn(u64);

    impl Drawn {
        fn below(&mut self, end: u64) -> u64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888);
            (self.0 >> 33) % end
        }
    }

    /// A journal that grows as a diagnoser's does, and suffers worse.
    struct Growing {
        directory: tempfile::TempDir,
        journal: Journal,
        drawn: Drawn,
        sequence: u64,
        step: u64,
        /// Of each component.
        latest: [Option<String>; COMPONENTS.len()],
        identified: Vec<String>,
    }

    impl Growing {
        fn new(seed: u64) -> Self {
            let directory = tempfile::tempdir().unwrap();
            let journal = Journal::open(directory.path()).unwrap().journal;
            let latest = [const { None }; COMPONENTS.len()];
            let (drawn, identified) = (Drawn(seed), Vec::new());
            Self { directory, journal, drawn, sequence: 0, step: 0, latest, identified }
        }

        fn record(&mut self) -> String {
            let of = speaker(if self.drawn.below(10) == 0 { "m2" } else { "m1" });
            self.step += 1;
            let place = self.drawn.below(COMPONENTS.len() as u64) as usize;
            match self.drawn.below(10) {
                0 => "{\"record\":\"of the future\"}".to_owned(),
                1 => change(self.step).to_text().unwrap(),
                2..5 => {
                    let fault = self.sequence.saturating_sub(self.drawn.below(4));
                    let found = found(&of, COMPONENTS[place], fault, self.step);
                    let text = found.to_text().unwrap();
                    self.identified.push(text.clone());
                    text
                }
                _ => {
                    self.sequence += 1 + self.drawn.below(2);
                    let text = transition(&of, COMPONENTS[place], self.sequence).to_text().unwrap();
                    self.latest[place] = Some(text.clone());
                    text
                }
            }
        }

        fn rotate(&mut self) {
            let known = self.identified.len().saturating_sub(3);
            let snapshot: Vec<String> =
                self.latest.iter().flatten().chain(&self.identified[known..]).cloned().collect();
            self.journal.rotate(snapshot).unwrap();
        }

        /// Appends behind the journal's back.
        fn damage(&mut self) {
            let mut file = OpenOptions::new().append(true).open(self.present()).unwrap();
            file.write_all(b"0123abcd no record\n").unwrap();
        }

        /// As after an append that failed: what was read already is cut off again, and others come.
        fn take_back(&mut self, question: HistoryQuestion, reading: &mut HistoryReader<'_>) {
            let length = std::fs::metadata(self.present()).unwrap().len();
            for _ in 0..self.drawn.below(3) {
                let record = self.record();
                self.journal.append(&record).unwrap();
            }
            reading.page(question).unwrap();
            OpenOptions::new().write(true).open(self.present()).unwrap().set_len(length).unwrap();
        }

        fn present(&self) -> PathBuf {
            self.directory.path().join("journal")
        }

        fn question(&mut self) -> HistoryQuestion {
            let since = self.drawn.below(self.sequence + 3);
            HistoryQuestion { since, limit: 1 + self.drawn.below(30) }
        }

        fn straightforward(&self, speaker: &Speaker, question: HistoryQuestion) -> HistoryPage {
            let mut entries = HistoryEntries::of(&speaker.module);
            let records = journal::read(self.directory.path()).unwrap().map(Result::unwrap);
            let all = records.filter_map(|record| entries.read(&record));
            straightforward::compile(speaker, all, question)
        }
    }

    #[test]
    fn pages_of_any_journal_are_those_that_come_from_reading_all_of_it() {
        let speaker = speaker("m1");
        for seed in 0..20 {
            let mut growing = Growing::new(seed);
            let mut reading = HistoryReader::new(&speaker, growing.directory.path());
            for _ in 0..100 {
                let question = growing.question();
                match growing.drawn.below(20) {
                    0 => growing.rotate(),
                    1 => growing.damage(),
                    2 => growing.take_back(question, &mut reading),
                    _ => {
                        let count = growing.drawn.below(6);
                        let records: Vec<_> = (0..count).map(|_| growing.record()).collect();
                        growing.journal.append_all(records).unwrap();
                    }
                }
                let page = reading.page(question).unwrap();
                let expected = growing.straightforward(&speaker, question);
                assert_eq!(
                    vocabulary::encode(&page).unwrap(),
                    vocabulary::encode(&expected).unwrap()
                );
            }
        }
    }

    #[test]
    fn a_record_that_was_damaged_after_it_had_been_read_is_passed_over() {
        let (speaker, mut growing) = (speaker("m1"), Growing::new(1));
        let records = (1..4).map(|sequence| transition(&speaker, "sensor/g1", sequence));
        let records: Vec<String> = records.map(|record| record.to_text().unwrap()).collect();
        growing.journal.append_all(&records).unwrap();
        let mut reading = HistoryReader::new(&speaker, growing.directory.path());
        let mut shown = || {
            let page = reading.page(HistoryQuestion::since(1)).unwrap();
            page.transitions.iter().map(|transition| transition.sequence).collect::<Vec<_>>()
        };
        assert_eq!(shown(), [1, 2, 3]);
        let text = std::fs::read_to_string(growing.present()).unwrap();
        std::fs::write(growing.present(), text.replace("\"sequence\":2", "\"sequence\":9"))
            .unwrap();
        assert_eq!(shown(), [1, 3]);
    }

    #[test]
    fn a_journal_that_cannot_be_read_is_named_and_read_once_it_can_be() {
        let (speaker, directory) = (speaker("m1"), tempfile::tempdir().unwrap());
        let directory = directory.path().join("state");
        let mut reading = HistoryReader::new(&speaker, &directory);
        let error = reading.page(HistoryQuestion::since(1)).unwrap_err().to_string();
        assert!(error.contains("cannot read") && error.contains("state"), "{error}");
        let record = transition(&speaker, "sensor/g1", 1).to_text().unwrap();
        Journal::open(&directory).unwrap().journal.append(&record).unwrap();
        assert_eq!(reading.page(HistoryQuestion::since(1)).unwrap().transitions.len(), 1);
    }
}
