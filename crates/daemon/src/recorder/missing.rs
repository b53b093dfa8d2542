//! Which messages are missing: samples are counted by steps of a run, inputs by numbers of a process, transitions of a
//! module's verdicts by the sequence numbers of its journal.
//!
//! A gap shows when a later message arrives. After the last sample of a run none does, so what its diagnoser says
//! counts as well: it has taken a step, so the sample of that step was published. It counts even if no sample of the run
//! ever came: the plant may be out of reach, or have been until its last sample. The two come over different links, so
//! the sample has [`GRACE`] to arrive. Likewise a status says which number the module's next transition will have, and
//! present states that were asked for have the numbers of their transitions.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::time::{Duration, Instant};

use recording::Stamp;
use vocabulary::{FaultTransition, Key, ModuleStatus, Topic, delivery::Gaps, keys::Watched};

/// Runs, processes or journals of one topic that are remembered.
const EPOCHS: usize = 4;
/// Missing messages of one run that are remembered: as many as any publisher keeps.
const REMEMBERED: u64 = 65_536;

/// How long a message may take to arrive after a diagnoser has said that it was published.
const GRACE: Duration = Duration::from_millis(500);

/// What a topic is counted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counting {
    /// Samples: steps of a run, from 0.
    Steps,
    /// Inputs: numbers of a process, from 1.
    Numbers,
    /// Transitions of all components of a module: sequence numbers of a journal, from 1.
    Sequences,
}

/// What a message is counted as.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Place {
    /// Its topic, or the key expression of all topics that are counted together.
    pub(super) topic: String,
    pub(super) counting: Counting,
    /// The run, process or journal.
    pub(super) epoch: u64,
    pub(super) at: u64,
}

/// Messages that are missing: of one topic or key expression, from one place to another, both included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MissingRange {
    pub(super) topic: String,
    pub(super) counting: Counting,
    /// The run, process or journal.
    pub(super) epoch: u64,
    pub(super) from: u64,
    pub(super) to: u64,
    /// Published before the recorder started: not a loss if they cannot be fetched.
    pub(super) is_past: bool,
}

/// What is to be done with a message.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Noted {
    /// It has not been written yet.
    pub(super) is_new: bool,
    /// It is the first of a run or process.
    pub(super) begins: bool,
    /// What is missing before it.
    pub(super) gap: Option<MissingRange>,
}

impl Noted {
    const PLAIN: Self = Self { is_new: true, begins: false, gap: None };
    const KNOWN: Self = Self { is_new: false, begins: false, gap: None };
}

/// What came of every topic.
#[derive(Debug, Default)]
pub(super) struct NumberedStreams {
    streams: BTreeMap<String, Vec<NumberedStream>>,
    /// Topics of which every transition so far is known to have been published before the recorder started, or came.
    heard: BTreeSet<String>,
}

/// What came of one run, process or journal.
#[derive(Debug)]
struct NumberedStream {
    epoch: u64,
    counting: Counting,
    /// The first that is known to have been published since the recorder started; missing earlier ones are not a loss.
    first: Option<u64>,
    /// Did any come?
    has_begun: bool,
    gaps: Gaps,
    /// The latest that a diagnoser says was published though it had not arrived, and when it first said so.
    said: Option<(u64, Instant)>,
}

impl Counting {
    /// That of a topic, if it is counted.
    pub(super) fn of(topic: &str) -> Option<Self> {
        match topic.rsplit_once('/')?.1 {
            "sample" => Some(Counting::Steps),
            "input" => Some(Counting::Numbers),
            _ if topic.split('/').nth(3) == FAULTS.split('/').next() => Some(Counting::Sequences),
            _ => None,
        }
    }

    fn first(self) -> u64 {
        match self {
            Counting::Steps => 0,
            Counting::Numbers | Counting::Sequences => 1,
        }
    }
}

/// How the key expression of a module's transitions ends.
pub(super) const FAULTS: &str = "fault/**";

impl Place {
    /// That of a message, if it is counted.
    pub(super) fn of(topic: &str, payload: &[u8], stamp: &Stamp) -> Option<Self> {
        let counting = Counting::of(topic)?;
        let of_stamp = |place: Option<(u64, u64)>| {
            let (epoch, at) = place?;
            Some(Self { topic: topic.to_owned(), counting, epoch, at })
        };
        match counting {
            Counting::Steps => of_stamp(stamp.run.zip(stamp.step)),
            Counting::Numbers => of_stamp(stamp.process.zip(stamp.number)),
            Counting::Sequences => {
                let transition: FaultTransition = vocabulary::decode(payload).ok()?;
                transition.is_verdict().then(|| Self::of_transition(&transition))
            }
        }
    }

    fn of_transition(transition: &FaultTransition) -> Self {
        let FaultTransition { structure, module, incarnation, sequence, .. } = transition;
        let topic = Watched { structure: Some(structure), module: Some(module) }.faults();
        Self { topic, counting: Counting::Sequences, epoch: *incarnation, at: *sequence }
    }
}

impl NumberedStreams {
    /// A message that was published. One that came before is written once more: it was published twice.
    pub(super) fn published(&mut self, place: Option<&Place>) -> Noted {
        let Some(Place { topic, counting, epoch, at }) = place else { return Noted::PLAIN };
        let stream = self.stream(topic, *epoch, *counting);
        let begins = !stream.has_begun;
        if begins || stream.first.is_none() {
            stream.first = Some(stream.first.map_or(*at, |first| first.min(*at)));
        }
        stream.take(*at);
        let gap = stream.gap(topic);
        Noted { is_new: true, begins, gap }
    }

    /// A message that was asked for. Of samples and inputs what is missing before it has been asked for as well.
    pub(super) fn fetched(&mut self, place: Option<&Place>) -> Noted {
        let Some(Place { topic, counting, epoch, at }) = place else { return Noted::PLAIN };
        let stream = self.stream(topic, *epoch, *counting);
        let begins = !stream.has_begun;
        if *counting == Counting::Sequences {
            let is_new = stream.take(*at);
            return Noted { is_new, begins, gap: stream.gap(topic) };
        }
        stream.first.get_or_insert(*at);
        let is_new = stream.take(*at);
        while stream.gap(topic).is_some() {}
        if is_new { Noted { begins, ..Noted::PLAIN } } else { Noted::KNOWN }
    }

    /// The present states of a module were received whole: what follows is published after the recorder has started.
    pub(super) fn heard(&mut self, topic: &str) {
        for stream in self.streams.get_mut(topic).into_iter().flatten() {
            stream.first.get_or_insert(stream.gaps.end());
        }
        self.heard.insert(topic.to_owned());
    }

    /// A diagnoser says on another topic of its module which step it has taken, and which number its next transition
    /// will have; its samples and transitions matter if they are recorded.
    pub(super) fn said(
        &mut self,
        (topic, payload): (&str, &[u8]),
        stamp: &Stamp,
        now: Instant,
        is_recorded: impl Fn(&str) -> bool,
    ) {
        let Ok(Key::Module { structure, module, topic }) = topic.parse() else { return };
        if !matches!(topic, Topic::Progress | Topic::Status) {
            return;
        }
        if let Some((run, step)) = stamp.run.zip(stamp.step) {
            let samples = Key::of_module(&structure, &module, Topic::Sample).to_string();
            if self.has(&samples, run) || is_recorded(&samples) {
                self.stream(&samples, run, Counting::Steps).said(step, now);
            }
        }
        if topic == Topic::Status
            && let Ok(status) = vocabulary::decode::<ModuleStatus>(payload)
            && let Some(latest) = status.next_sequence.checked_sub(1)
        {
            let faults = Watched { structure: Some(&structure), module: Some(&module) }.faults();
            let journal = status.journal.incarnation;
            if self.has(&faults, journal) || is_recorded(&faults) {
                self.stream(&faults, journal, Counting::Sequences).said(latest, now);
            }
        }
    }

    /// The gaps before messages that were published, as diagnosers say, and that have had their time to arrive.
    pub(super) fn overdue(&mut self, now: Instant) -> Vec<MissingRange> {
        let mut gaps = Vec::new();
        for (topic, streams) in &mut self.streams {
            for stream in streams {
                gaps.extend(stream.overdue(topic, now));
            }
        }
        gaps
    }

    /// How many messages of each topic are still missing, those before the recorder apart.
    pub(super) fn outstanding(&self) -> impl Iterator<Item = (&str, u64)> {
        self.streams.iter().map(|(topic, streams)| {
            (topic.as_str(), streams.iter().map(NumberedStream::lost).sum())
        })
    }

    fn has(&self, topic: &str, epoch: u64) -> bool {
        self.streams.get(topic).is_some_and(|streams| streams.iter().any(|one| one.epoch == epoch))
    }

    /// How many of these never came.
    pub(super) fn settle(&mut self, gap: &MissingRange) -> u64 {
        let streams = self.streams.get_mut(&gap.topic);
        let stream =
            streams.and_then(|streams| streams.iter_mut().find(|stream| stream.epoch == gap.epoch));
        stream.map_or(0, |stream| count(stream.gaps.give_up(gap.from..gap.to.saturating_add(1))))
    }

    fn stream(&mut self, topic: &str, epoch: u64, counting: Counting) -> &mut NumberedStream {
        // The numbers of another journal begin anew.
        let is_heard = counting == Counting::Sequences && self.heard.contains(topic);
        let streams = self.streams.entry(topic.to_owned()).or_default();
        let known = streams.iter().position(|stream| stream.epoch == epoch);
        let index = known.unwrap_or_else(|| {
            if streams.len() >= EPOCHS {
                streams.remove(0);
            }
            streams.push(NumberedStream {
                epoch,
                counting,
                first: is_heard.then(|| counting.first()),
                has_begun: false,
                gaps: Gaps::starting_at(counting.first()),
                said: None,
            });
            streams.len() - 1
        });
        &mut streams[index]
    }
}

fn count(numbers: impl IntoIterator<Item = Range<u64>>) -> u64 {
    numbers.into_iter().map(|numbers| numbers.end - numbers.start).sum()
}

impl NumberedStream {
    /// Notes that a message came. False if it came before.
    fn take(&mut self, at: u64) -> bool {
        self.has_begun = true;
        self.know_of(at);
        self.gaps.take(at)
    }

    /// All before this place were published; those before the recorder are a gap of their own.
    fn know_of(&mut self, end: u64) {
        self.gaps.skip_to(end.saturating_sub(REMEMBERED));
        self.gaps.know_of(self.first.map_or(end, |first| first.min(end)));
        self.gaps.know_of(end);
    }

    /// What is missing and has not been asked for. Verdicts from before the recorder are not: a recording begins with the
    /// state that they led to.
    fn gap(&mut self, topic: &str) -> Option<MissingRange> {
        loop {
            let numbers = self.gaps.ask()?;
            let (from, to) = (numbers.start, numbers.end - 1);
            let is_past = self.first.is_none_or(|first| to < first);
            if !(is_past && self.counting == Counting::Sequences) {
                let (topic, counting, epoch) = (topic.to_owned(), self.counting, self.epoch);
                return Some(MissingRange { topic, counting, epoch, from, to, is_past });
            }
        }
    }

    /// A diagnoser says that this one was published, and all before it.
    fn said(&mut self, latest: u64, now: Instant) {
        let next = self.gaps.end();
        // No publisher keeps messages further ahead, and no diagnoser can have taken them.
        if latest.saturating_sub(next) > REMEMBERED && self.first.is_some() {
            return;
        }
        // It may have been published long ago.
        self.first.get_or_insert(latest.saturating_add(1));
        if latest < next {
            return;
        }
        // The first that has not arrived keeps its time.
        let first_said = self.said.filter(|(said, _)| *said >= next).map(|(_, at)| at);
        self.said = Some((latest, first_said.unwrap_or(now)));
    }

    fn overdue(&mut self, topic: &str, now: Instant) -> Vec<MissingRange> {
        if let Some((latest, _)) = self.said.filter(|(_, at)| now.duration_since(*at) >= GRACE) {
            self.said = None;
            self.know_of(latest.saturating_add(1));
            return std::iter::from_fn(|| self.gap(topic)).collect();
        }
        Vec::new()
    }

    fn lost(&self) -> u64 {
        let is_lost = |numbers: &Range<u64>| self.first.is_some_and(|first| numbers.start >= first);
        count(self.gaps.missing().filter(is_lost))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPIC: &str = "trusswatch/tower/m/sample";

    fn at(run: u64, step: u64) -> Stamp {
        Stamp { run: Some(run), step: Some(step), ..Stamp::default() }
    }

    impl NumberedStreams {
        fn sample(&mut self, stamp: &Stamp) -> Noted {
            self.published(Place::of(TOPIC, b"", stamp).as_ref())
        }

        fn fetched_sample(&mut self, stamp: &Stamp) -> Noted {
            self.fetched(Place::of(TOPIC, b"", stamp).as_ref())
        }
    }

    fn gap(epoch: u64, from: u64, to: u64, is_past: bool) -> Option<MissingRange> {
        let topic = TOPIC.to_owned();
        Some(MissingRange { topic, counting: Counting::Steps, epoch, from, to, is_past })
    }

    #[test]
    fn what_is_missing_is_asked_for_once_and_what_never_comes_is_lost() {
        let mut streams = NumberedStreams::default();
        let first = streams.sample(&at(1, 5));
        assert_eq!(first, Noted { is_new: true, begins: true, gap: gap(1, 0, 4, true) });
        assert_eq!(streams.sample(&at(1, 6)), Noted::PLAIN);
        let later = streams.sample(&at(1, 10));
        assert_eq!(later.gap, gap(1, 7, 9, false));
        assert_eq!(streams.fetched_sample(&at(1, 8)), Noted::PLAIN);
        assert_eq!(streams.fetched_sample(&at(1, 8)), Noted::KNOWN);
        assert_eq!(streams.fetched_sample(&at(1, 10)), Noted::KNOWN);
        assert_eq!(streams.fetched_sample(&at(1, 4)), Noted::PLAIN);
        assert_eq!(streams.settle(&later.gap.unwrap()), 2);
        assert_eq!(streams.settle(&first.gap.unwrap()), 4);
        assert_eq!(streams.sample(&at(1, 11)), Noted::PLAIN);
    }

    #[test]
    fn a_message_published_late_or_twice_is_kept() {
        let mut streams = NumberedStreams::default();
        assert_eq!(streams.sample(&at(1, 0)), Noted { begins: true, ..Noted::PLAIN });
        let gap = streams.sample(&at(1, 2)).gap.unwrap();
        assert!(streams.sample(&at(1, 1)).is_new);
        assert!(streams.sample(&at(1, 1)).is_new);
        assert_eq!(streams.settle(&gap), 0);
    }

    #[test]
    fn two_publishers_by_turns_do_not_begin_again_each_time() {
        let mut streams = NumberedStreams::default();
        for step in 0..5 {
            for run in [1, 2] {
                assert_eq!(streams.sample(&at(run, step)).gap, None);
            }
        }
        for run in 3..9 {
            assert!(streams.sample(&at(run, 0)).begins);
        }
        assert!(streams.sample(&at(1, 5)).begins, "forgotten meanwhile");
    }

    #[test]
    fn inputs_count_from_one_and_those_asked_for_first_begin_the_line() {
        let mut streams = NumberedStreams::default();
        let topic = "trusswatch/tower/m/input";
        let at = |number| {
            let stamp = Stamp { process: Some(7), number: Some(number), ..Stamp::default() };
            Place::of(topic, b"", &stamp)
        };
        assert!(streams.fetched(at(1).as_ref()).begins);
        assert_eq!(streams.fetched(at(2).as_ref()), Noted::PLAIN);
        assert_eq!(streams.published(at(2).as_ref()).gap, None);
        assert_eq!(streams.published(at(3).as_ref()).gap, None);
        let gap = streams.published(at(6).as_ref()).gap.unwrap();
        assert_eq!((gap.counting, gap.from, gap.to), (Counting::Numbers, 4, 5));
    }

    const PROGRESS: &str = "trusswatch/tower/m/progress";

    fn recorded(topic: &str) -> bool {
        topic == TOPIC
    }

    #[test]
    fn what_a_diagnoser_has_taken_and_never_came_is_missing_after_a_while() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        for step in 0..=4433 {
            streams.sample(&at(7, step));
        }
        streams.said((PROGRESS, b""), &at(7, 4433), start, recorded);
        assert_eq!(streams.overdue(start + 2 * GRACE), [], "it is there");
        streams.said((PROGRESS, b""), &at(7, 4500), start, recorded);
        streams.said((PROGRESS, b""), &at(7, 4799), start + GRACE / 2, recorded);
        assert_eq!(streams.overdue(start + GRACE / 2), [], "it may be on its way");
        assert_eq!(streams.overdue(start + GRACE), [gap(7, 4434, 4799, false).unwrap()]);
        assert_eq!(streams.overdue(start + 9 * GRACE), [], "once");
        assert_eq!(streams.fetched_sample(&at(7, 4434)), Noted::PLAIN);
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 365)]);
        assert_eq!(streams.settle(&gap(7, 4434, 4799, false).unwrap()), 365);
    }

    #[test]
    fn a_sample_that_arrives_after_its_progress_is_not_asked_for() {
        let mut streams = NumberedStreams::default();
        let mut now = Instant::now();
        for step in 0..1000 {
            streams.said((PROGRESS, b""), &at(7, step), now, recorded);
            assert!(streams.sample(&at(7, step)).is_new);
            now += GRACE / 10;
            assert_eq!(streams.overdue(now), []);
        }
    }

    #[test]
    fn what_cannot_be_is_no_gap() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.sample(&at(7, 0));
        for topic in ["trusswatch/tower/plant/status", "trusswatch/tower/other/progress", "x"] {
            streams.said((topic, b""), &at(7, 9), start, recorded);
        }
        streams.said((PROGRESS, b""), &at(7, u64::MAX), start, recorded);
        assert_eq!(streams.overdue(start + GRACE), []);
    }

    /// The plant was out of reach until its last sample, or is for ever.
    #[test]
    fn samples_of_which_none_came_are_missing_too() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.said((PROGRESS, b""), &at(7, 49), start, recorded);
        streams.said((PROGRESS, b""), &at(7, 4199), start + GRACE / 2, recorded);
        let (past, missed) = (gap(7, 0, 49, true).unwrap(), gap(7, 50, 4199, false).unwrap());
        assert_eq!(streams.overdue(start + GRACE), [past.clone(), missed.clone()]);
        streams.said((PROGRESS, b""), &at(7, 4199), start + GRACE, recorded);
        assert_eq!(streams.overdue(start + 9 * GRACE), [], "once");
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 4150)]);
        assert!(streams.fetched_sample(&at(7, 49)).is_new);
        assert!(streams.fetched_sample(&at(7, 50)).is_new);
        assert_eq!((streams.settle(&past), streams.settle(&missed)), (49, 4149));
    }

    #[test]
    fn of_a_long_run_only_what_a_publisher_keeps_is_asked_for() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.said((PROGRESS, b""), &at(7, 1_000_000), start, recorded);
        let kept = 1_000_001 - REMEMBERED;
        assert_eq!(streams.overdue(start + GRACE), [gap(7, kept, 1_000_000, true).unwrap()]);
        streams.said((PROGRESS, b""), &at(8, u64::MAX), start, recorded);
        assert_eq!(streams.overdue(start + GRACE).len(), 1);
    }

    /// It was heard a little earlier than the first sample, or that was missed.
    #[test]
    fn a_first_sample_near_a_progress_tells_what_was_before_the_recorder() {
        let start = Instant::now();
        for (first, before) in
            [(90, vec![(0, 89, true)]), (110, vec![(0, 100, true), (101, 109, false)])]
        {
            let mut streams = NumberedStreams::default();
            streams.said((PROGRESS, b""), &at(7, 100), start, recorded);
            let published = (first..120).filter_map(|step| streams.sample(&at(7, step)).gap);
            let expected =
                before.into_iter().filter_map(|(from, to, is_past)| gap(7, from, to, is_past));
            assert_eq!(published.collect::<Vec<_>>(), expected.collect::<Vec<_>>());
            assert_eq!(streams.overdue(start + GRACE), []);
        }
    }

    #[test]
    fn what_was_before_the_recorder_is_never_lost() {
        let mut streams = NumberedStreams::default();
        streams.sample(&at(1, 5));
        streams.sample(&at(1, 9));
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 3)]);
    }

    #[test]
    fn what_is_not_counted_is_simply_written() {
        let mut streams = NumberedStreams::default();
        assert_eq!(Place::of("trusswatch/tower/m/status", b"", &at(1, 5)), None);
        assert_eq!(Place::of(TOPIC, b"", &Stamp::default()), None);
        assert_eq!(streams.published(None), Noted::PLAIN);
    }

    const OF_MODULE: &str = "trusswatch/tower/m/fault/**";

    fn transition(incarnation: u64, sequence: u64) -> Option<Place> {
        let component = "m/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("tower".parse().unwrap(), component, 0);
        let transition =
            FaultTransition { incarnation, sequence, run: Some(vocabulary::RunId(1)), ..untouched };
        let payload = vocabulary::encode(&transition);
        Place::of("trusswatch/tower/m/fault/sensor/g1", &payload.unwrap(), &Stamp::default())
    }

    fn transitions(epoch: u64, from: u64, to: u64) -> MissingRange {
        let (topic, counting) = (OF_MODULE.to_owned(), Counting::Sequences);
        MissingRange { topic, counting, epoch, from, to, is_past: false }
    }

    fn status(incarnation: u64, next_sequence: u64) -> Vec<u8> {
        let waiting = ModuleStatus::waiting("tower".parse().unwrap(), "m".parse().unwrap());
        let journal = vocabulary::JournalStatus { incarnation, ..waiting.journal.clone() };
        vocabulary::encode(&ModuleStatus { next_sequence, journal, ..waiting }).unwrap()
    }

    const STATUS: &str = "trusswatch/tower/m/status";

    #[test]
    fn transitions_of_all_components_are_counted_together_and_those_before_the_recorder_not_wanted()
    {
        let mut streams = NumberedStreams::default();
        assert_eq!(transition(5, 0), None, "a component without a transition so far");
        let noted = streams.published(transition(5, 4).as_ref());
        assert_eq!(noted, Noted { begins: true, ..Noted::PLAIN });
        assert!(streams.fetched(transition(5, 2).as_ref()).is_new);
        let gap = streams.published(transition(5, 8).as_ref()).gap.unwrap();
        assert_eq!(gap, transitions(5, 5, 7));
        assert_eq!(streams.fetched(transition(5, 6).as_ref()), Noted::PLAIN);
        assert!(!streams.fetched(transition(5, 6).as_ref()).is_new);
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(OF_MODULE, 2)]);
        assert_eq!(streams.settle(&gap), 2);
    }

    #[test]
    fn a_status_or_a_present_state_shows_which_transitions_never_came() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        let all = |_: &str| true;
        streams.said((STATUS, &status(5, 3)), &Stamp::default(), start, all);
        assert_eq!(streams.overdue(start + GRACE), [], "1 and 2 were before the recorder");
        streams.said((STATUS, &status(5, 6)), &Stamp::default(), start, all);
        assert_eq!(streams.overdue(start), [], "they may be on their way");
        assert_eq!(streams.overdue(start + GRACE), [transitions(5, 3, 5)]);
        let gap = streams.fetched(transition(5, 9).as_ref()).gap;
        assert_eq!(gap, Some(transitions(5, 6, 8)));
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(OF_MODULE, 6)]);
        streams.said((STATUS, &status(5, 12)), &Stamp::default(), start, |_| false);
        assert_eq!(streams.overdue(start + GRACE), [transitions(5, 10, 11)]);
    }

    /// It was stopped before the first status came.
    #[test]
    fn what_follows_the_first_present_states_is_missed() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        for sequence in [7, 3] {
            assert_eq!(streams.fetched(transition(5, sequence).as_ref()).gap, None);
        }
        streams.heard(OF_MODULE);
        assert_eq!(streams.fetched(transition(5, 9).as_ref()).gap, Some(transitions(5, 8, 8)));
        // Another journal was begun.
        streams.said((STATUS, &status(6, 3)), &Stamp::default(), start, |_| true);
        assert_eq!(streams.overdue(start + GRACE), [transitions(6, 1, 2)]);
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(OF_MODULE, 3)]);
    }
}
