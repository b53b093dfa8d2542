//! Which messages are missing: samples are counted by steps of a run, inputs by numbers of a process.
//!
//! A gap shows when a later message arrives. After the last sample of a run none does, so what its diagnoser says
//! counts as well: it has taken a step, so the sample of that step was published. It counts even if no sample of the run
//! ever came: the plant may be out of reach, or have been until its last sample. The two come over different links, so
//! the sample has [`GRACE`] to arrive.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use recording::Stamp;
use vocabulary::{Key, Topic, delivery::Gaps};

/// Runs or processes of one topic that are remembered.
const EPOCHS: usize = 4;
/// Missing messages of one run that are remembered: as many as any publisher keeps.
const REMEMBERED: u64 = 65_536;

/// How long a sample may take to arrive after its diagnoser has said that it took it.
pub(super) const GRACE: Duration = Duration::from_millis(500);

/// What a topic is counted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Counting {
    /// Samples: steps of a run, from 0.
    Steps,
    /// Inputs: numbers of a process, from 1.
    Numbers,
}

/// Messages that are missing: of one topic, from one place to another, both included.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct MissingRange {
    pub(super) topic: String,
    pub(super) counting: Counting,
    /// The run or process.
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
pub(super) struct NumberedStreams(BTreeMap<String, Vec<NumberedStream>>);

/// What came of one run or process.
#[derive(Debug)]
struct NumberedStream {
    epoch: u64,
    /// The first that is known to have been published since the recorder started; missing earlier ones are not a loss.
    first: Option<u64>,
    /// Did any come?
    has_begun: bool,
    gaps: Gaps,
    /// The latest step that a diagnoser has taken though its sample had not arrived, and when it first said so.
    taken: Option<(u64, Instant)>,
}

impl Counting {
    /// That of a topic, if it is counted.
    pub(super) fn of(topic: &str) -> Option<Self> {
        match topic.rsplit_once('/')?.1 {
            "sample" => Some(Counting::Steps),
            "input" => Some(Counting::Numbers),
            _ => None,
        }
    }

    fn first(self) -> u64 {
        match self {
            Counting::Steps => 0,
            Counting::Numbers => 1,
        }
    }

    /// Run or process, and the place in it.
    pub(super) fn place(self, stamp: &Stamp) -> Option<(u64, u64)> {
        match self {
            Counting::Steps => stamp.run.zip(stamp.step),
            Counting::Numbers => stamp.process.zip(stamp.number),
        }
    }
}

impl NumberedStreams {
    /// A message that was published. One that came before is written once more: it was published twice.
    pub(super) fn published(&mut self, topic: &str, stamp: &Stamp) -> Noted {
        let Some((counting, epoch, at)) = placed(topic, stamp) else { return Noted::PLAIN };
        let stream = self.stream(topic, epoch, counting);
        let begins = !stream.has_begun;
        if begins {
            stream.first = Some(stream.first.map_or(at, |first| first.min(at)));
        }
        stream.take(at);
        let gap = stream.gap(topic, counting);
        Noted { is_new: true, begins, gap }
    }

    /// A message that was asked for. What is missing before it has been asked for as well.
    pub(super) fn fetched(&mut self, topic: &str, stamp: &Stamp) -> Noted {
        let Some((counting, epoch, at)) = placed(topic, stamp) else { return Noted::PLAIN };
        let stream = self.stream(topic, epoch, counting);
        let begins = !stream.has_begun;
        stream.first.get_or_insert(at);
        let is_new = stream.take(at);
        while stream.gap(topic, counting).is_some() {}
        if is_new { Noted { begins, ..Noted::PLAIN } } else { Noted::KNOWN }
    }

    /// A diagnoser says on another topic of its module which step it has taken; its samples matter if they are recorded.
    pub(super) fn said(
        &mut self,
        topic: &str,
        stamp: &Stamp,
        now: Instant,
        is_recorded: impl FnOnce(&str) -> bool,
    ) {
        let Some((run, step)) = stamp.run.zip(stamp.step) else { return };
        let Ok(Key::Module { structure, module, topic }) = topic.parse() else { return };
        if !matches!(topic, Topic::Progress | Topic::Status) {
            return;
        }
        let topic = Key::of_module(&structure, &module, Topic::Sample).to_string();
        if self.has(&topic, run) || is_recorded(&topic) {
            self.stream(&topic, run, Counting::Steps).taken_by_diagnoser(step, now);
        }
    }

    /// The gaps before samples that diagnosers have taken and that have had their time to arrive.
    pub(super) fn overdue(&mut self, now: Instant) -> Vec<MissingRange> {
        let mut gaps = Vec::new();
        for (topic, streams) in &mut self.0 {
            for stream in streams {
                gaps.extend(stream.overdue(topic, now));
            }
        }
        gaps
    }

    /// How many messages of each topic are still missing, those before the recorder apart.
    pub(super) fn outstanding(&self) -> impl Iterator<Item = (&str, u64)> {
        self.0.iter().map(|(topic, streams)| {
            (topic.as_str(), streams.iter().map(NumberedStream::lost).sum())
        })
    }

    fn has(&self, topic: &str, epoch: u64) -> bool {
        self.0.get(topic).is_some_and(|streams| streams.iter().any(|one| one.epoch == epoch))
    }

    /// How many of these never came.
    pub(super) fn settle(&mut self, gap: &MissingRange) -> u64 {
        let streams = self.0.get_mut(&gap.topic);
        let stream =
            streams.and_then(|streams| streams.iter_mut().find(|stream| stream.epoch == gap.epoch));
        stream.map_or(0, |stream| count(stream.gaps.give_up(gap.from..gap.to.saturating_add(1))))
    }

    fn stream(&mut self, topic: &str, epoch: u64, counting: Counting) -> &mut NumberedStream {
        let streams = self.0.entry(topic.to_owned()).or_default();
        let known = streams.iter().position(|stream| stream.epoch == epoch);
        let index = known.unwrap_or_else(|| {
            if streams.len() >= EPOCHS {
                streams.remove(0);
            }
            let gaps = Gaps::starting_at(counting.first());
            streams.push(NumberedStream {
                epoch,
                first: None,
                has_begun: false,
                gaps,
                taken: None,
            });
            streams.len() - 1
        });
        &mut streams[index]
    }
}

fn placed(topic: &str, stamp: &Stamp) -> Option<(Counting, u64, u64)> {
    let counting = Counting::of(topic)?;
    let (epoch, at) = counting.place(stamp)?;
    Some((counting, epoch, at))
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

    /// What is missing and has not been asked for.
    fn gap(&mut self, topic: &str, counting: Counting) -> Option<MissingRange> {
        let numbers = self.gaps.ask()?;
        let (topic, epoch, from, to) =
            (topic.to_owned(), self.epoch, numbers.start, numbers.end - 1);
        let is_past = self.first.is_none_or(|first| to < first);
        Some(MissingRange { topic, counting, epoch, from, to, is_past })
    }

    fn taken_by_diagnoser(&mut self, step: u64, now: Instant) {
        let next = self.gaps.end();
        // No publisher keeps messages further ahead, and no diagnoser can have taken them.
        if step < next || step - next > REMEMBERED && self.first.is_some() {
            return;
        }
        // It may have taken this one long ago.
        self.first.get_or_insert(step.saturating_add(1));
        // The first that has not arrived keeps its time.
        let first_said = self.taken.filter(|(taken, _)| *taken >= next).map(|(_, at)| at);
        self.taken = Some((step, first_said.unwrap_or(now)));
    }

    fn overdue(&mut self, topic: &str, now: Instant) -> Vec<MissingRange> {
        if let Some((step, _)) = self.taken.filter(|(_, said)| now.duration_since(*said) >= GRACE) {
            self.taken = None;
            self.know_of(step.saturating_add(1));
            return std::iter::from_fn(|| self.gap(topic, Counting::Steps)).collect();
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

    fn gap(epoch: u64, from: u64, to: u64, is_past: bool) -> Option<MissingRange> {
        let topic = TOPIC.to_owned();
        Some(MissingRange { topic, counting: Counting::Steps, epoch, from, to, is_past })
    }

    #[test]
    fn what_is_missing_is_asked_for_once_and_what_never_comes_is_lost() {
        let mut streams = NumberedStreams::default();
        let first = streams.published(TOPIC, &at(1, 5));
        assert_eq!(first, Noted { is_new: true, begins: true, gap: gap(1, 0, 4, true) });
        assert_eq!(streams.published(TOPIC, &at(1, 6)), Noted::PLAIN);
        let later = streams.published(TOPIC, &at(1, 10));
        assert_eq!(later.gap, gap(1, 7, 9, false));
        assert_eq!(streams.fetched(TOPIC, &at(1, 8)), Noted::PLAIN);
        assert_eq!(streams.fetched(TOPIC, &at(1, 8)), Noted::KNOWN);
        assert_eq!(streams.fetched(TOPIC, &at(1, 10)), Noted::KNOWN);
        assert_eq!(streams.fetched(TOPIC, &at(1, 4)), Noted::PLAIN);
        assert_eq!(streams.settle(&later.gap.unwrap()), 2);
        assert_eq!(streams.settle(&first.gap.unwrap()), 4);
        assert_eq!(streams.published(TOPIC, &at(1, 11)), Noted::PLAIN);
    }

    #[test]
    fn a_message_published_late_or_twice_is_kept() {
        let mut streams = NumberedStreams::default();
        assert_eq!(streams.published(TOPIC, &at(1, 0)), Noted { begins: true, ..Noted::PLAIN });
        let gap = streams.published(TOPIC, &at(1, 2)).gap.unwrap();
        assert!(streams.published(TOPIC, &at(1, 1)).is_new);
        assert!(streams.published(TOPIC, &at(1, 1)).is_new);
        assert_eq!(streams.settle(&gap), 0);
    }

    #[test]
    fn two_publishers_by_turns_do_not_begin_again_each_time() {
        let mut streams = NumberedStreams::default();
        for step in 0..5 {
            for run in [1, 2] {
                assert_eq!(streams.published(TOPIC, &at(run, step)).gap, None);
            }
        }
        for run in 3..9 {
            assert!(streams.published(TOPIC, &at(run, 0)).begins);
        }
        assert!(streams.published(TOPIC, &at(1, 5)).begins, "forgotten meanwhile");
    }

    #[test]
    fn inputs_count_from_one_and_those_asked_for_first_begin_the_line() {
        let mut streams = NumberedStreams::default();
        let topic = "trusswatch/tower/m/input";
        let at = |number| Stamp { process: Some(7), number: Some(number), ..Stamp::default() };
        assert!(streams.fetched(topic, &at(1)).begins);
        assert_eq!(streams.fetched(topic, &at(2)), Noted::PLAIN);
        assert_eq!(streams.published(topic, &at(2)).gap, None);
        assert_eq!(streams.published(topic, &at(3)).gap, None);
        let gap = streams.published(topic, &at(6)).gap.unwrap();
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
            streams.published(TOPIC, &at(7, step));
        }
        streams.said(PROGRESS, &at(7, 4433), start, recorded);
        assert_eq!(streams.overdue(start + 2 * GRACE), [], "it is there");
        streams.said(PROGRESS, &at(7, 4500), start, recorded);
        streams.said(PROGRESS, &at(7, 4799), start + GRACE / 2, recorded);
        assert_eq!(streams.overdue(start + GRACE / 2), [], "it may be on its way");
        assert_eq!(streams.overdue(start + GRACE), [gap(7, 4434, 4799, false).unwrap()]);
        assert_eq!(streams.overdue(start + 9 * GRACE), [], "once");
        assert_eq!(streams.fetched(TOPIC, &at(7, 4434)), Noted::PLAIN);
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 365)]);
        assert_eq!(streams.settle(&gap(7, 4434, 4799, false).unwrap()), 365);
    }

    #[test]
    fn a_sample_that_arrives_after_its_progress_is_not_asked_for() {
        let mut streams = NumberedStreams::default();
        let mut now = Instant::now();
        for step in 0..1000 {
            streams.said(PROGRESS, &at(7, step), now, recorded);
            assert!(streams.published(TOPIC, &at(7, step)).is_new);
            now += GRACE / 10;
            assert_eq!(streams.overdue(now), []);
        }
    }

    #[test]
    fn what_cannot_be_is_no_gap() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.published(TOPIC, &at(7, 0));
        for topic in ["trusswatch/tower/plant/status", "trusswatch/tower/other/progress", "x"] {
            streams.said(topic, &at(7, 9), start, recorded);
        }
        streams.said(PROGRESS, &at(7, u64::MAX), start, recorded);
        assert_eq!(streams.overdue(start + GRACE), []);
    }

    /// The plant was out of reach until its last sample, or is for ever.
    #[test]
    fn samples_of_which_none_came_are_missing_too() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.said(PROGRESS, &at(7, 49), start, recorded);
        streams.said(PROGRESS, &at(7, 4199), start + GRACE / 2, recorded);
        let (past, missed) = (gap(7, 0, 49, true).unwrap(), gap(7, 50, 4199, false).unwrap());
        assert_eq!(streams.overdue(start + GRACE), [past.clone(), missed.clone()]);
        streams.said(PROGRESS, &at(7, 4199), start + GRACE, recorded);
        assert_eq!(streams.overdue(start + 9 * GRACE), [], "once");
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 4150)]);
        assert!(streams.fetched(TOPIC, &at(7, 49)).is_new);
        assert!(streams.fetched(TOPIC, &at(7, 50)).is_new);
        assert_eq!((streams.settle(&past), streams.settle(&missed)), (49, 4149));
    }

    #[test]
    fn of_a_long_run_only_what_a_publisher_keeps_is_asked_for() {
        let mut streams = NumberedStreams::default();
        let start = Instant::now();
        streams.said(PROGRESS, &at(7, 1_000_000), start, recorded);
        let kept = 1_000_001 - REMEMBERED;
        assert_eq!(streams.overdue(start + GRACE), [gap(7, kept, 1_000_000, true).unwrap()]);
        streams.said(PROGRESS, &at(8, u64::MAX), start, recorded);
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
            streams.said(PROGRESS, &at(7, 100), start, recorded);
            let published =
                (first..120).filter_map(|step| streams.published(TOPIC, &at(7, step)).gap);
            let expected =
                before.into_iter().filter_map(|(from, to, is_past)| gap(7, from, to, is_past));
            assert_eq!(published.collect::<Vec<_>>(), expected.collect::<Vec<_>>());
            assert_eq!(streams.overdue(start + GRACE), []);
        }
    }

    #[test]
    fn what_was_before_the_recorder_is_never_lost() {
        let mut streams = NumberedStreams::default();
        streams.published(TOPIC, &at(1, 5));
        streams.published(TOPIC, &at(1, 9));
        assert_eq!(streams.outstanding().collect::<Vec<_>>(), [(TOPIC, 3)]);
    }

    #[test]
    fn what_is_not_counted_is_simply_written() {
        let mut streams = NumberedStreams::default();
        let status = "trusswatch/tower/m/status";
        assert_eq!(streams.published(status, &at(1, 5)), Noted::PLAIN);
        assert_eq!(streams.published(TOPIC, &Stamp::default()), Noted::PLAIN);
    }
}
