//! Writes everything, on a thread of its own. Messages that a failing disk costs are counted, and it is tried again.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use recording::{Metadata, Recorded, RecordingError, RecordingFiles, Stamp};
use shell::clock;
use vocabulary::Occurrences;
use vocabulary::{Input, ModuleConfiguration, Taken, Topic};

use super::fetching::{FetchRequest, FetchRequests, module_request};
use super::keys::RecordedKeys;
use super::missing::{Counting, MissingRange, NumberedStreams, Place};
use super::queue::{Dropped, QueuedEvents, ReceivedMessage, RecorderEvent};
use super::report::RecorderReport;
use super::states::OwedStates;

/// What is older than this is on the disk, with what it takes to get there: a second at most is lost.
const SYNC_EVERY: Duration = Duration::from_millis(600);
/// After a failure of the disk.
const AGAIN_AFTER: Duration = Duration::from_secs(1);
/// Messages are taken by so many at once, for waking up costs more than writing.
const PAUSE: Duration = Duration::from_millis(20);
/// A file has no more channels than some 65 thousand, and no structure as many topics as this.
const MOST_TOPICS: usize = 16_384;

/// Why messages are not in the recording.
const NO_ROOM: &str = "recorder queue full";
const DISK: &str = "the disk could not be written";
const GONE: &str = "missed, and their publisher no longer keeps them or is out of reach";
const UNANSWERED: &str = "missed, and not received before the recorder ended";
const TOO_MANY: &str = "too many topics";

/// The thread that writes.
pub(super) struct RecordingThread {
    files: RecordingFiles,
    keys: RecordedKeys,
    shown: Arc<Mutex<RecorderReport>>,
    dropped: Dropped,
    requests: FetchRequests,
    streams: NumberedStreams,
    states: OwedStates,
    /// How many files were begun.
    files_begun: usize,
    report: RecorderReport,
    /// Losses that are not in the file yet, by topic and reason.
    losses: BTreeMap<(String, &'static str), u64>,
    synced: Instant,
    counted: u64,
    retry_at: Option<Instant>,
    failures: Occurrences,
}

impl RecordingThread {
    pub(super) fn new(
        mut files: RecordingFiles,
        keys: &RecordedKeys,
        shown: Arc<Mutex<RecorderReport>>,
        dropped: Dropped,
        requests: FetchRequests,
    ) -> Self {
        let about = [
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("structure", keys.structure.as_ref().map_or("any".to_owned(), ToString::to_string)),
            ("keys", keys.expressions().join(" ")),
        ];
        // Without a file there is nothing that could fail.
        let _ = files.note(metadata("recorder", about), 0);
        Self {
            files,
            keys: keys.clone(),
            shown,
            dropped,
            requests,
            streams: NumberedStreams::default(),
            states: OwedStates::default(),
            files_begun: 0,
            report: RecorderReport::default(),
            losses: BTreeMap::new(),
            synced: Instant::now(),
            counted: 0,
            retry_at: None,
            failures: Occurrences::default(),
        }
    }

    /// Until nothing can come any more.
    pub(super) fn run(mut self, mut arrivals: QueuedEvents) {
        let mut batch = Vec::with_capacity(1024);
        while arrivals.wait(&mut batch) {
            for arrival in batch.drain(..) {
                self.take(arrival);
            }
            if self.synced.elapsed() >= SYNC_EVERY {
                self.sync();
            }
            if arrivals.is_empty() {
                std::thread::sleep(PAUSE);
            }
        }
        self.retry_at = None;
        // Nothing more can be asked for: what a diagnoser has said was published, and has had its time, is missing as well.
        self.streams.overdue(Instant::now());
        for (topic, count) in self.streams.outstanding().filter(|(_, count)| *count > 0) {
            *self.losses.entry((topic.to_owned(), UNANSWERED)).or_default() += count;
        }
        self.sync();
        if let Err(error) = self.files.finish() {
            self.fail(&error);
        }
        self.publish();
    }

    fn take(&mut self, arrival: RecorderEvent) {
        match arrival {
            RecorderEvent::Published(message) => {
                let stamp = Stamp::of(&message.payload);
                let place = Place::of(&message.topic, &message.payload, &stamp);
                let noted = self.streams.published(place.as_ref());
                if let Some(gap) = noted.gap {
                    self.want(gap);
                }
                if noted.begins && Counting::of(&message.topic) == Some(Counting::Numbers) {
                    // A diagnoser was started: its setup may be another one.
                    module_request(&message.topic).map(|request| self.requests.add(request));
                }
                let is_recorded = |topic: &str| self.keys.has(topic);
                let said = (message.topic.as_str(), message.payload.as_slice());
                self.streams.said(said, &stamp, Instant::now(), is_recorded);
                let sample = message.topic.ends_with("/sample").then(|| message.topic.clone());
                self.record(message, stamp);
                // If a file begins with it, it is the first in there.
                if let Some(topic) = sample {
                    self.states.sample(&topic, &stamp);
                }
            }
            RecorderEvent::Fetched(message) => {
                let stamp = Stamp::of(&message.payload);
                if message.topic.ends_with(&format!("/{}", Topic::Configuration)) {
                    self.configure(message, stamp);
                    return;
                }
                let place = Place::of(&message.topic, &message.payload, &stamp);
                let noted = self.streams.fetched(place.as_ref());
                if let Some(gap) = noted.gap {
                    self.want(gap);
                }
                if noted.is_new {
                    self.report.fetched += 1;
                    self.record(message, stamp);
                }
            }
            RecorderEvent::Heard(topic) => {
                if self.keys.has(&topic) {
                    self.streams.heard(&topic);
                }
            }
            RecorderEvent::State(message) => self.take_state(message),
            RecorderEvent::Settled(gap) => self.settle(&gap),
            RecorderEvent::Tick => {
                self.ask_states();
                for gap in self.streams.overdue(Instant::now()) {
                    self.want(gap);
                }
            }
        }
    }

    fn take_state(&mut self, message: ReceivedMessage) {
        let stamp = Stamp::of(&message.payload);
        // Who does not know the question may answer another one.
        let Ok(Input { taken: Taken::State(part), .. }) = vocabulary::decode(&message.payload)
        else {
            return;
        };
        if self.states.came(&message.topic, &stamp, &part, Instant::now()) {
            self.record_by(RecordingFiles::write_head, message, stamp);
        }
    }

    fn want(&mut self, gap: MissingRange) {
        let request = FetchRequest::Missing(gap.clone());
        if !self.requests.add(request) {
            self.settle(&gap);
        }
    }

    /// What has not come by now is lost, unless it was before the recorder.
    fn settle(&mut self, gap: &MissingRange) {
        let missing = self.streams.settle(gap);
        if missing > 0 && !gap.is_past {
            self.lose(&gap.topic, GONE, missing);
        }
    }

    fn lose(&mut self, topic: &str, reason: &'static str, count: u64) {
        *self.losses.entry((topic.to_owned(), reason)).or_default() += count;
    }

    fn record(&mut self, message: ReceivedMessage, stamp: Stamp) {
        self.record_by(RecordingFiles::write, message, stamp);
    }

    fn record_by(
        &mut self,
        write: fn(&mut RecordingFiles, &Recorded, u64) -> Result<(), RecordingError>,
        message: ReceivedMessage,
        stamp: Stamp,
    ) {
        let ReceivedMessage { topic, payload, at_unix_ns } = message;
        if self.is_failing() {
            return self.lose(&topic, DISK, 1);
        }
        let topics = self.report.messages.len();
        match self.report.messages.get_mut(&topic) {
            Some(count) => *count += 1,
            None if topics >= MOST_TOPICS => {
                return self.lose("more", TOO_MANY, 1);
            }
            None => drop(self.report.messages.insert(topic.clone(), 1)),
        }
        let recorded = Recorded::stamped(topic, payload, stamp, at_unix_ns);
        if let Err(error) = write(&mut self.files, &recorded, at_unix_ns) {
            self.fail(&error);
        }
        self.note_file();
    }

    /// Each file begins with the state of each diagnoser, so that it can be replayed without the files before it.
    fn note_file(&mut self) {
        let begun = self.files.begun().len();
        if begun != self.files_begun {
            self.files_begun = begun;
            self.states.begin_file();
            self.ask_states();
        }
    }

    fn ask_states(&mut self) {
        for (structure, module) in self.states.due(Instant::now()) {
            // If the queue is full, it stays due and is tried again.
            self.requests.add(FetchRequest::State(structure, module));
        }
    }

    /// A diagnoser gave its setup.
    fn configure(&mut self, message: ReceivedMessage, stamp: Stamp) {
        let ReceivedMessage { topic, payload, at_unix_ns } = message;
        let Ok(setup) = vocabulary::decode::<ModuleConfiguration>(&payload) else {
            tracing::debug!(topic, "invalid configuration");
            return;
        };
        let name = format!("module/{}/{}", setup.structure, setup.module);
        let module = (setup.structure, setup.module);
        let about = [
            ("software", setup.software),
            ("configuration", setup.fingerprint),
            ("thresholds", setup.thresholds),
            ("reference", setup.reference.unwrap_or_else(|| "none".to_owned())),
        ];
        *self.report.messages.entry(topic.clone()).or_default() += 1;
        let recorded = Recorded::stamped(topic, payload, stamp, at_unix_ns);
        let written = self.files.write_in_each(recorded, at_unix_ns);
        let noted = written.and_then(|()| self.files.note(metadata(&name, about), at_unix_ns));
        if let Err(error) = noted {
            self.fail(&error);
        }
        self.note_file();
        self.states.want(module.0, module.1);
    }

    fn is_failing(&self) -> bool {
        self.retry_at.is_some_and(|retry_at| Instant::now() < retry_at)
    }

    fn fail(&mut self, error: &RecordingError) {
        self.retry_at = Some(Instant::now() + AGAIN_AFTER);
        self.report.problem = Some(error.to_string());
        if let Some(times) = self.failures.note(Instant::now()) {
            tracing::error!(times, "{error}; dropping messages until the disk is writable");
        }
        self.publish();
    }

    /// Everything so far onto the disk, losses too.
    fn sync(&mut self) {
        self.rate();
        let dropped = std::mem::take(&mut *self.dropped.lock());
        for (topic, count) in dropped {
            // What is counted shows as a gap, and may still be had.
            if Counting::of(&topic).is_none() {
                self.lose(&topic, NO_ROOM, count);
            }
        }
        if !self.is_failing() {
            match self.try_sync() {
                Ok(()) => self.recover(),
                Err(error) => self.fail(&error),
            }
        }
        for file in self.files.take_deleted() {
            tracing::info!(file = %file.display(), "deleted the oldest recording: quota exceeded");
        }
        self.publish();
    }

    fn try_sync(&mut self) -> Result<(), RecordingError> {
        let now = clock::unix_ns();
        let mut outcome = Ok(());
        for ((topic, reason), count) in std::mem::take(&mut self.losses) {
            // Counted all the same, so each is logged once.
            outcome = outcome.and(self.files.lose(&topic, count, reason, now));
        }
        self.files.hold(self.states.are_owed());
        outcome.and(self.files.sync(now))
    }

    fn recover(&mut self) {
        self.retry_at = None;
        if self.report.problem.take().is_some() {
            tracing::info!("the disk can be written again");
            // Samples are missing, and a state that came meanwhile: the replay goes on from a new one.
            self.states.begin_file();
            self.ask_states();
        }
    }

    fn rate(&mut self) {
        let total = self.report.total();
        let seconds = self.synced.elapsed().as_secs_f64();
        if seconds > 0.0 {
            self.report.rate = (total - self.counted) as f64 / seconds;
        }
        (self.counted, self.synced) = (total, Instant::now());
    }

    fn publish(&mut self) {
        let present = self.files.present().map(|(file, length)| (file.to_path_buf(), length));
        let (file, length) = present.unzip();
        (self.report.file, self.report.file_bytes) = (file, length.unwrap_or(0));
        self.report.files = self.files.begun().to_vec();
        self.report.losses = self.files.losses().clone();
        for ((topic, _), count) in &self.losses {
            *self.report.losses.entry(topic.clone()).or_default() += count;
        }
        *self.shown.lock() = self.report.clone();
    }
}

fn metadata<const N: usize>(name: &str, about: [(&str, String); N]) -> Metadata {
    let values = about.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    Metadata { name: name.to_owned(), values }
}
