//! Which messages are missing: samples are counted by steps of a run, inputs by numbers of a process.
//!
//! A gap shows when a later message arrives. After the last sample of a run none does, so what its diagnoser says
//! counts as well: it has taken a step, so the sample of that step was published. The two come over different links, so
//! the sample has [`GRACE`] to arrive.

use std::collections::BTreeMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use recording::Stamp;
use vocabulary::{Key, ModuleName, StructureName, Topic, delivery::Gaps};

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
pub(super) struct Gap {
    pub(super) topic: String,
    pub(super) counting: Counting,
    /// The run or process.
    pub(super) epoch: u64,
    pub(super) from: u64,
    pub(super) to: u64,
    /// They were before the recorder: what cannot be had is no loss.
    pub(super) is_past: bool,
}

/// What is to be done with a message.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Finding {
    /// It has not been written yet.
    pub(super) is_new: bool,
    /// It is the first of a run or process.
    pub(super) begins: bool,
    /// What is missing before it.
    pub(super) gap: Option<Gap>,
}

impl Finding {
    const PLAIN: Self = Self { is_new: true, begins: false, gap: None };
    const KNOWN: Self = Self { is_new: false, begins: false, gap: None };
}

/// What came of every topic.
#[derive(Debug, Default)]
pub(super) struct Continuity(BTreeMap<String, Vec<Line>>);

/// What came of one run or process.
#[derive(Debug)]
struct Line {
    epoch: u64,
    /// The first that was published while it was recorded: what is missing before it is no loss.
    first: u64,
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

impl Continuity {
    /// A message that was published. One that came before is written once more: it was published twice.
    pub(super) fn published(&mut self, topic: &str, stamp: &Stamp) -> Finding {
        let Some((counting, epoch, at)) = placed(topic, stamp) else { return Finding::PLAIN };
        let (line, begins) = self.line(topic, epoch, counting, at);
        line.take(at);
        let gap = line.gap(topic, counting);
        Finding { is_new: true, begins, gap }
    }

    /// A message that was asked for. What is missing before it has been asked for as well.
    pub(super) fn fetched(&mut self, topic: &str, stamp: &Stamp) -> Finding {
        let Some((counting, epoch, at)) = placed(topic, stamp) else { return Finding::PLAIN };
        let (line, begins) = self.line(topic, epoch, counting, at);
        let is_new = begins || line.take(at);
        while line.gap(topic, counting).is_some() {}
        if is_new { Finding { begins, ..Finding::PLAIN } } else { Finding::KNOWN }
    }

    /// A diagnoser says on another topic of its module which step it has taken.
    pub(super) fn said(&mut self, topic: &str, stamp: &Stamp, now: Instant) {
        let Some((run, step)) = stamp.run.zip(stamp.step) else { return };
        let Ok(Key::Module { structure, module, topic }) = topic.parse() else { return };
        if !matches!(topic, Topic::Progress | Topic::Status) {
            return;
        }
        if let Some(line) = self.samples_of(&structure, &module, run) {
            line.taken_by_diagnoser(step, now);
        }
    }

    /// The gaps before samples that diagnosers have taken and that have had their time to arrive.
    pub(super) fn overdue(&mut self, now: Instant) -> Vec<Gap> {
        let mut gaps = Vec::new();
        for (topic, lines) in &mut self.0 {
            gaps.extend(lines.iter_mut().filter_map(|line| line.overdue(topic, now)));
        }
        gaps
    }

    /// How many messages of each topic are still missing, those before the recorder apart.
    pub(super) fn outstanding(&self) -> impl Iterator<Item = (&str, u64)> {
        self.0.iter().map(|(topic, lines)| (topic.as_str(), lines.iter().map(Line::lost).sum()))
    }

    fn samples_of(
        &mut self,
        structure: &StructureName,
        module: &ModuleName,
        run: u64,
    ) -> Option<&mut Line> {
        let topic = Key::of_module(structure, module, Topic::Sample).to_string();
        self.0.get_mut(&topic)?.iter_mut().find(|line| line.epoch == run)
    }

    /// How many of these never came.
    pub(super) fn settle(&mut self, gap: &Gap) -> u64 {
        let lines = self.0.get_mut(&gap.topic);
        let line = lines.and_then(|lines| lines.iter_mut().find(|line| line.epoch == gap.epoch));
        line.map_or(0, |line| count(line.gaps.give_up(gap.from..gap.to.saturating_add(1))))
    }

    fn line(&mut self, topic: &str, epoch: u64, counting: Counting, at: u64) -> (&mut Line, bool) {
        let lines = self.0.entry(topic.to_owned()).or_default();
        if let Some(index) = lines.iter().position(|line| line.epoch == epoch) {
            return (&mut lines[index], false);
        }
        if lines.len() >= EPOCHS {
            lines.remove(0);
        }
        let gaps = Gaps::starting_at(counting.first());
        let mut line = Line { epoch, first: at, gaps, taken: None };
        line.take(at);
        lines.push(line);
        let last = lines.len() - 1;
        (&mut lines[last], true)
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

impl Line {
    /// Notes that a message came. False if it came before.
    fn take(&mut self, at: u64) -> bool {
        self.gaps.skip_to(at.saturating_sub(REMEMBERED));
        self.gaps.take(at)
    }

    /// What is missing and has not been asked for.
    fn gap(&mut self, topic: &str, counting: Counting) -> Option<Gap> {
        let numbers = self.gaps.ask()?;
        let (topic, epoch, from, to) =
            (topic.to_owned(), self.epoch, numbers.start, numbers.end - 1);
        Some(Gap { topic, counting, epoch, from, to, is_past: to < self.first })
    }

    fn taken_by_diagnoser(&mut self, step: u64, now: Instant) {
        let next = self.gaps.end();
        // What is beyond that no publisher keeps, and nobody has taken.
        if step < next || step - next > REMEMBERED {
            return;
        }
        // The first that has not arrived keeps its time.
        let first_said = self.taken.filter(|(taken, _)| *taken >= next).map(|(_, at)| at);
        self.taken = Some((step, first_said.unwrap_or(now)));
    }

    fn overdue(&mut self, topic: &str, now: Instant) -> Option<Gap> {
        let (step, _) = self.taken.filter(|(_, said)| now.duration_since(*said) >= GRACE)?;
        self.taken = None;
        self.gaps.know_of(step + 1);
        self.gap(topic, Counting::Steps)
    }

    fn lost(&self) -> u64 {
        count(self.gaps.missing().filter(|numbers| numbers.start > self.first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOPIC: &str = "trusswatch/tower/m/sample";

    fn at(run: u64, step: u64) -> Stamp {
        Stamp { run: Some(run), step: Some(step), ..Stamp::default() }
    }

    fn gap(epoch: u64, from: u64, to: u64, is_past: bool) -> Option<Gap> {
        let topic = TOPIC.to_owned();
        Some(Gap { topic, counting: Counting::Steps, epoch, from, to, is_past })
    }

    #[test]
    fn what_is_missing_is_asked_for_once_and_what_never_comes_is_lost() {
        let mut continuity = Continuity::default();
        let first = continuity.published(TOPIC, &at(1, 5));
        assert_eq!(first, Finding { is_new: true, begins: true, gap: gap(1, 0, 4, true) });
        assert_eq!(continuity.published(TOPIC, &at(1, 6)), Finding::PLAIN);
        let later = continuity.published(TOPIC, &at(1, 10));
        assert_eq!(later.gap, gap(1, 7, 9, false));
        assert_eq!(continuity.fetched(TOPIC, &at(1, 8)), Finding::PLAIN);
        assert_eq!(continuity.fetched(TOPIC, &at(1, 8)), Finding::KNOWN);
        assert_eq!(continuity.fetched(TOPIC, &at(1, 10)), Finding::KNOWN);
        assert_eq!(continuity.fetched(TOPIC, &at(1, 4)), Finding::PLAIN);
        assert_eq!(continuity.settle(&later.gap.unwrap()), 2);
        assert_eq!(continuity.settle(&first.gap.unwrap()), 4);
        assert_eq!(continuity.published(TOPIC, &at(1, 11)), Finding::PLAIN);
    }

    #[test]
    fn a_message_published_late_or_twice_is_kept() {
        let mut continuity = Continuity::default();
        assert_eq!(
            continuity.published(TOPIC, &at(1, 0)),
            Finding { begins: true, ..Finding::PLAIN }
        );
        let gap = continuity.published(TOPIC, &at(1, 2)).gap.unwrap();
        assert!(continuity.published(TOPIC, &at(1, 1)).is_new);
        assert!(continuity.published(TOPIC, &at(1, 1)).is_new);
        assert_eq!(continuity.settle(&gap), 0);
    }

    #[test]
    fn two_publishers_by_turns_do_not_begin_again_each_time() {
        let mut continuity = Continuity::default();
        for step in 0..5 {
            for run in [1, 2] {
                assert_eq!(continuity.published(TOPIC, &at(run, step)).gap, None);
            }
        }
        for run in 3..9 {
            assert!(continuity.published(TOPIC, &at(run, 0)).begins);
        }
        assert!(continuity.published(TOPIC, &at(1, 5)).begins, "forgotten meanwhile");
    }

    #[test]
    fn inputs_count_from_one_and_those_asked_for_first_begin_the_line() {
        let mut continuity = Continuity::default();
        let topic = "trusswatch/tower/m/input";
        let at = |number| Stamp { process: Some(7), number: Some(number), ..Stamp::default() };
        assert!(continuity.fetched(topic, &at(1)).begins);
        assert_eq!(continuity.fetched(topic, &at(2)), Finding::PLAIN);
        assert_eq!(continuity.published(topic, &at(2)).gap, None);
        assert_eq!(continuity.published(topic, &at(3)).gap, None);
        let gap = continuity.published(topic, &at(6)).gap.unwrap();
        assert_eq!((gap.counting, gap.from, gap.to), (Counting::Numbers, 4, 5));
    }

    const PROGRESS: &str = "trusswatch/tower/m/progress";

    #[test]
    fn what_a_diagnoser_has_taken_and_never_came_is_missing_after_a_while() {
        let mut continuity = Continuity::default();
        let start = Instant::now();
        for step in 0..=4433 {
            continuity.published(TOPIC, &at(7, step));
        }
        continuity.said(PROGRESS, &at(7, 4433), start);
        assert_eq!(continuity.overdue(start + 2 * GRACE), [], "it is there");
        continuity.said(PROGRESS, &at(7, 4500), start);
        continuity.said(PROGRESS, &at(7, 4799), start + GRACE / 2);
        assert_eq!(continuity.overdue(start + GRACE / 2), [], "it may be on its way");
        assert_eq!(continuity.overdue(start + GRACE), [gap(7, 4434, 4799, false).unwrap()]);
        assert_eq!(continuity.overdue(start + 9 * GRACE), [], "once");
        assert_eq!(continuity.fetched(TOPIC, &at(7, 4434)), Finding::PLAIN);
        assert_eq!(continuity.outstanding().collect::<Vec<_>>(), [(TOPIC, 365)]);
        assert_eq!(continuity.settle(&gap(7, 4434, 4799, false).unwrap()), 365);
    }

    #[test]
    fn a_sample_that_arrives_after_its_progress_is_not_asked_for() {
        let mut continuity = Continuity::default();
        let mut now = Instant::now();
        for step in 0..1000 {
            continuity.said(PROGRESS, &at(7, step), now);
            assert!(continuity.published(TOPIC, &at(7, step)).is_new);
            now += GRACE / 10;
            assert_eq!(continuity.overdue(now), []);
        }
    }

    #[test]
    fn what_cannot_be_is_no_gap() {
        let mut continuity = Continuity::default();
        let start = Instant::now();
        continuity.said(PROGRESS, &at(7, 5), start);
        continuity.published(TOPIC, &at(7, 0));
        for topic in ["trusswatch/tower/plant/status", "trusswatch/tower/other/progress", "x"] {
            continuity.said(topic, &at(7, 9), start);
        }
        continuity.said(PROGRESS, &at(7, u64::MAX), start);
        continuity.said(PROGRESS, &at(8, 9), start);
        assert_eq!(continuity.overdue(start + GRACE), []);
    }

    #[test]
    fn what_was_before_the_recorder_is_never_lost() {
        let mut continuity = Continuity::default();
        continuity.published(TOPIC, &at(1, 5));
        continuity.published(TOPIC, &at(1, 9));
        assert_eq!(continuity.outstanding().collect::<Vec<_>>(), [(TOPIC, 3)]);
    }

    #[test]
    fn what_is_not_counted_is_simply_written() {
        let mut continuity = Continuity::default();
        let status = "trusswatch/tower/m/status";
        assert_eq!(continuity.published(status, &at(1, 5)), Finding::PLAIN);
        assert_eq!(continuity.published(TOPIC, &Stamp::default()), Finding::PLAIN);
    }
}
