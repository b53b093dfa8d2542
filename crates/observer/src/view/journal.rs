//! The journals of modules, merged, with their gaps.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt;
use std::time::Duration;

use vocabulary::words::printable;
use vocabulary::{
    ComponentPath, FaultState, FaultTransition, HistoryPage, Identification, ModuleName,
    PhaseChange, RunId, Step, StructureName,
};

use super::component::found_at;
use super::line::EventLine;
use super::news::{News, ObservedEvent};
use super::order::QueryError;

/// The part of a module's journal that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleHistory {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The first sequence number requested.
    pub since: u64,
    /// Transitions in the order of their sequence numbers.
    pub transitions: Vec<FaultTransition>,
    /// Published identifications, those of each fault in order.
    pub identifications: Vec<Identification>,
    /// Changes of the phase and of the monitored components, in order.
    pub phases: Vec<PhaseChange>,
    /// The lowest sequence number that the journal still held; `None` if it held none.
    pub first_sequence: Option<u64>,
    /// The sequence number of the module's next transition; `None` if no page was received.
    pub next_sequence: Option<u64>,
    /// The error that ended reading early.
    pub broken_off: Option<QueryError>,
    /// What an observer saw that no journal holds: the process came or went, transitions were missed.
    pub observed: Vec<ObservedEvent>,
    /// Whether this is what an observer heard of the module, rather than its journal.
    pub is_heard: bool,
}

/// A range of sequence numbers missing from a journal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryGap {
    /// The first that is missing.
    pub from: u64,
    /// The last that is missing.
    pub to: u64,
}

impl ModuleHistory {
    /// A history of which no page was read yet.
    #[must_use]
    pub fn new(structure: &StructureName, module: &ModuleName, since: u64) -> Self {
        Self {
            structure: structure.clone(),
            module: module.clone(),
            since,
            transitions: Vec::new(),
            identifications: Vec::new(),
            phases: Vec::new(),
            first_sequence: None,
            next_sequence: None,
            broken_off: None,
            observed: Vec::new(),
            is_heard: false,
        }
    }

    /// What an observer heard of a module, from all its events in the order of their arrival. A state that was reported
    /// again when the observer connected counts once.
    #[must_use]
    pub fn heard(
        structure: &StructureName,
        module: &ModuleName,
        events: impl IntoIterator<Item = ObservedEvent>,
    ) -> Self {
        let mut heard = Self { is_heard: true, ..Self::new(structure, module, 1) };
        let mut known = BTreeSet::new();
        for event in events {
            let is_own = |of: &StructureName, who: &str| of == structure && who == module.as_str();
            match event.news {
                News::Fault(transition) | News::Present(transition) => {
                    if is_own(&transition.structure, transition.module.as_str())
                        && transition.sequence > 0
                        && known.insert(transition.place())
                    {
                        heard.transitions.push(*transition);
                    }
                }
                News::Identification(found) => {
                    if is_own(&found.structure, found.module.as_str()) {
                        heard.identifications.push(*found);
                    }
                }
                News::Phase(change) => {
                    let is_new = !heard.phases.contains(&change);
                    if is_own(&change.structure, change.module.as_str()) && is_new {
                        heard.phases.push(change);
                    }
                }
                News::Presence { ref structure, ref who, .. } => {
                    if is_own(structure, who) {
                        heard.observed.push(event);
                    }
                }
                News::SeveralProcesses { ref structure, ref module }
                | News::Missed { ref structure, ref module, .. } => {
                    if is_own(structure, module.as_str()) {
                        heard.observed.push(event);
                    }
                }
                News::Connection { .. } | News::Lost { .. } => heard.observed.push(event),
                News::Unreadable { .. } => {}
            }
        }
        heard
    }

    /// Whether the module answered at all.
    #[must_use]
    pub fn answered(&self) -> bool {
        self.next_sequence.is_some()
    }

    /// Missing ranges. Numbers before the journal's first were deleted by rotation and are not gaps; numbers after a
    /// failed page are unknown.
    #[must_use]
    pub fn gaps(&self) -> Vec<HistoryGap> {
        let Some(first) = self.first_sequence else { return Vec::new() };
        let mut expected = first.max(self.since).max(1);
        let mut gaps = Vec::new();
        let end = self.next_sequence.filter(|_| self.broken_off.is_none());
        for sequence in self.transitions.iter().map(|t| t.sequence).chain(end) {
            if sequence > expected {
                gaps.push(HistoryGap { from: expected, to: sequence - 1 });
            }
            expected = expected.max(sequence.saturating_add(1));
        }
        gaps
    }

    /// Adds a page that was requested from a sequence number on; returns the start of the next page, if any.
    ///
    /// # Errors
    /// The page belongs to another module or does not match the request.
    pub fn accept(&mut self, asked: u64, page: HistoryPage) -> Result<Option<u64>, QueryError> {
        let senseless = |what| Err(QueryError::Senseless(what));
        if page.structure != self.structure || page.module != self.module {
            let (structure, module) = (&page.structure, &page.module);
            return senseless(format!("the page belongs to `{module}` of `{structure}`"));
        }
        let mut next = asked;
        for transition in &page.transitions {
            if transition.sequence < next {
                let sequence = transition.sequence;
                return senseless(format!("sequence {sequence} instead of {next}"));
            }
            next = transition.sequence.saturating_add(1);
        }
        if page.more && page.transitions.is_empty() {
            return senseless(format!(
                "the page is empty, although the journal continues from {asked}"
            ));
        }
        self.first_sequence = self.first_sequence.or(page.first_sequence);
        self.next_sequence = Some(page.next_sequence);
        self.transitions.extend(page.transitions);
        self.identifications.extend(page.identifications);
        self.phases.extend(page.phases);
        Ok(page.more.then_some(next))
    }

    /// Everything that is missing, in words.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        let Self { module, broken_off, first_sequence, next_sequence, .. } = self;
        let error = broken_off.as_ref().map(|error| printable(&error.to_string()));
        if self.is_heard {
            let why = error.map_or_else(String::new, |error| format!("{error}; "));
            return vec![format!("{module}: {why}what follows is what this page heard of it")];
        }
        if !self.answered() {
            let why = error.unwrap_or_else(|| "no answer".to_owned());
            return vec![format!("{module}: {why}; its history is unavailable")];
        }
        let since = self.since.max(1);
        let mut notes = Vec::new();
        match (first_sequence, next_sequence) {
            (Some(first), _) if *first > since => {
                notes
                    .push(format!("{module}: the journal reaches back to transition {first} only"));
            }
            (None, Some(next)) if *next > since => {
                let count = next - 1;
                notes.push(format!(
                    "{module}: the journal holds none of the {count} transitions up to now"
                ));
            }
            _ => {}
        }
        notes.extend(error.map(|error| {
            let after = self.transitions.last().map_or(0, |transition| transition.sequence);
            format!("{module}: nothing was read after transition {after}: {error}")
        }));
        notes.extend(self.gaps().iter().map(|HistoryGap { from, to }| match from == to {
            true => format!("{module}: transition {from} is missing from the journal"),
            false => format!("{module}: transitions {from} to {to} are missing from the journal"),
        }));
        notes
    }
}

/// An entry of a journal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JournalEntry<'a> {
    /// A verdict changed.
    Transition(&'a FaultTransition),
    /// The kind of a fault became known.
    Identification(&'a Identification),
    /// The module entered another phase, or what it monitors changed.
    Phase(&'a PhaseChange),
    /// What an observer saw that no journal holds.
    Observed(&'a ModuleName, &'a ObservedEvent),
}

impl<'a> JournalEntry<'a> {
    /// The component of the entry; `None` if it is about the module.
    #[must_use]
    pub fn component(&self) -> Option<&'a ComponentPath> {
        match self {
            JournalEntry::Transition(transition) => Some(&transition.component),
            JournalEntry::Identification(found) => Some(&found.component),
            JournalEntry::Phase(_) | JournalEntry::Observed(..) => None,
        }
    }

    /// Whether it says something of this component: its own entries, and those of its module.
    #[must_use]
    pub fn concerns(&self, component: &ComponentPath) -> bool {
        match self {
            JournalEntry::Phase(_) | JournalEntry::Observed(..) => {
                *self.module() == component.module
            }
            _ => self.component() == Some(component),
        }
    }

    /// The module of the entry.
    #[must_use]
    pub fn module(&self) -> &'a ModuleName {
        match self {
            JournalEntry::Transition(transition) => &transition.module,
            JournalEntry::Identification(found) => &found.module,
            JournalEntry::Phase(change) => &change.module,
            JournalEntry::Observed(module, _) => module,
        }
    }

    /// Its sequence number, or that of the transition that it belongs to; `None` of a phase, which has a number of its
    /// own.
    #[must_use]
    pub fn sequence(&self) -> Option<u64> {
        match self {
            JournalEntry::Transition(transition) => Some(transition.sequence),
            JournalEntry::Identification(found) => Some(found.sequence),
            JournalEntry::Phase(_) | JournalEntry::Observed(..) => None,
        }
    }

    /// The time of publishing \[ns since 1970\].
    #[must_use]
    pub fn time_unix_ns(&self) -> u64 {
        match self {
            JournalEntry::Transition(transition) => transition.time_unix_ns,
            JournalEntry::Identification(found) => found.time_unix_ns,
            JournalEntry::Phase(change) => change.time_unix_ns,
            JournalEntry::Observed(_, event) => event.time_unix_ns,
        }
    }

    /// The new state, of a transition.
    #[must_use]
    pub fn state(&self) -> Option<FaultState> {
        match self {
            JournalEntry::Transition(transition) => Some(transition.state()),
            JournalEntry::Identification(_)
            | JournalEntry::Phase(_)
            | JournalEntry::Observed(..) => None,
        }
    }

    /// The entry as a line of text.
    #[must_use]
    pub fn line(&self) -> EventLine {
        match self {
            JournalEntry::Transition(transition) => EventLine::of_transition(transition),
            JournalEntry::Identification(found) => EventLine::of_identification(found),
            JournalEntry::Phase(change) => EventLine::of_phase(change),
            JournalEntry::Observed(_, event) => EventLine::of(event),
        }
    }

    fn found_at(&self) -> Option<(RunId, Step)> {
        match self {
            JournalEntry::Transition(transition) => found_at(transition),
            JournalEntry::Identification(found) => Some((found.run, found.as_of_step)),
            // It has only a time: nothing is found at its step.
            JournalEntry::Phase(_) | JournalEntry::Observed(..) => None,
        }
    }
}

/// The merged journals of several modules.
#[derive(Debug, Clone, PartialEq)]
pub struct Journals<'a> {
    /// All entries, earliest first. Those of a module stay in the order of their sequence numbers, even if its clock
    /// was set back; an identification follows its fault.
    pub entries: Vec<JournalEntry<'a>>,
    /// Pairs of modules whose times contradict the order of their steps. If there are any, entries of one run are
    /// sorted by step; otherwise all entries are sorted by time.
    pub contradictions: Vec<Contradiction<'a>>,
}

impl<'a> Journals<'a> {
    /// Merges journals.
    pub fn merge(histories: impl IntoIterator<Item = &'a ModuleHistory>) -> Self {
        let histories: Vec<&ModuleHistory> = histories.into_iter().collect();
        let contradictions = contradictions(&histories);
        let by_steps = !contradictions.is_empty();
        let mut rest: Vec<VecDeque<Dated<'_>>> = histories.into_iter().map(dated).collect();
        let mut entries = Vec::new();
        while let Some(place) = next(&rest, by_steps) {
            entries.extend(rest[place].pop_front().map(|(_, entry)| entry));
        }
        Self { entries, contradictions }
    }
}

/// An entry and its time, which is raised to that of its predecessor if it is earlier.
type Dated<'a> = (u64, JournalEntry<'a>);

fn dated(history: &ModuleHistory) -> VecDeque<Dated<'_>> {
    let mut latest = 0;
    let mut declared = BTreeMap::new();
    let mut dated = Vec::new();
    for transition in &history.transitions {
        latest = latest.max(transition.time_unix_ns);
        declared.insert(transition.sequence, latest);
        dated.push((latest, JournalEntry::Transition(transition)));
    }
    for found in &history.identifications {
        let declared = declared.get(&found.sequence).copied().unwrap_or_default();
        dated.push((found.time_unix_ns.max(declared), JournalEntry::Identification(found)));
    }
    let phases = history.phases.iter();
    dated.extend(phases.map(|change| (change.time_unix_ns, JournalEntry::Phase(change))));
    let observed = history.observed.iter();
    dated.extend(
        observed.map(|event| (event.time_unix_ns, JournalEntry::Observed(&history.module, event))),
    );
    // A stable sort keeps the order of entries with the same time.
    dated.sort_by_key(|(time, _)| *time);
    dated.into()
}

/// The module whose next entry comes first: the one with the earliest time, or, with `by_steps`, with the earliest step
/// of the same run.
fn next(rest: &[VecDeque<Dated<'_>>], by_steps: bool) -> Option<usize> {
    let heads = || rest.iter().enumerate().filter_map(|(place, left)| Some((place, left.front()?)));
    let (place, (_, earliest)) = heads().min_by_key(|(_, (time, _))| *time)?;
    let run = earliest.found_at().filter(|_| by_steps).map(|(run, _)| run);
    let of_run = |(place, (time, entry)): (usize, &Dated<'_>)| {
        let (_, step) = entry.found_at().filter(|(entry_run, _)| Some(*entry_run) == run)?;
        Some((step, *time, place))
    };
    Some(heads().filter_map(of_run).min().map_or(place, |(_, _, place)| place))
}

/// Smaller differences may have other causes, such as a decision that waited for a peer.
const AGREE_WITHIN: Duration = Duration::from_secs(2);

/// A module whose times are later than those of another module, judged by the order of their steps. Displayed as a
/// sentence.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Contradiction<'a> {
    /// The structure.
    pub structure: &'a StructureName,
    /// The module whose clock is ahead.
    pub ahead: &'a ModuleName,
    /// The module whose clock is behind.
    pub behind: &'a ModuleName,
    /// The smallest difference that explains the times.
    pub by: Duration,
}

impl fmt::Display for Contradiction<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { ahead, behind, by, .. } = self;
        write!(
            f,
            "clocks differ: according to the steps, by which this table is sorted, the clock of {ahead} is at least \
             {} s ahead of that of {behind}; check time synchronisation",
            by.as_secs()
        )
    }
}

/// Finds contradictions: modules count the same steps, so a decision at an earlier step should have the earlier time. A
/// clock that is ahead is so at every step; decisions on samples that were recovered after a restart are late, while
/// others of the run are not.
fn contradictions<'a>(histories: &[&'a ModuleHistory]) -> Vec<Contradiction<'a>> {
    let pairs = histories.iter().flat_map(|a| histories.iter().map(move |b| (*a, *b)));
    let pairs = pairs.filter(|(a, b)| a.structure == b.structure && a.module != b.module);
    let found = |(ahead, behind): (&'a ModuleHistory, &'a ModuleHistory)| {
        let (first, second) = (points(ahead), points(behind));
        let by = lead(&first, &second)?.min(least_lead(&first, &second)?);
        let by = Some(by).filter(|by| *by > AGREE_WITHIN)?;
        let (structure, ahead, behind) = (&ahead.structure, &ahead.module, &behind.module);
        Some(Contradiction { structure, ahead, behind, by })
    };
    pairs.filter_map(found).collect()
}

/// A run, a step, and the time recorded for it \[ns since 1970\].
type Point = (RunId, Step, u64);

fn points(history: &ModuleHistory) -> Vec<Point> {
    let point = |transition: &FaultTransition| {
        let (run, step) = found_at(transition)?;
        Some((run, step, transition.time_unix_ns))
    };
    let mut points: Vec<Point> = history.transitions.iter().filter_map(point).collect();
    points.sort_unstable();
    points
}

/// The largest difference by which the first module's time is later although its step is the earlier one.
fn lead(first: &[Point], second: &[Point]) -> Option<Duration> {
    let mut later = second.iter().rev().peekable();
    // The earliest time of the second module at later steps of the present run.
    let mut earliest: Option<(RunId, u64)> = None;
    let mut longest = None;
    for (run, step, time) in first.iter().rev() {
        while let Some((other_run, _, other)) =
            later.next_if(|point| (point.0, point.1) > (*run, *step))
        {
            let before = earliest.filter(|(known, _)| known == other_run).map(|(_, time)| time);
            earliest = Some((*other_run, before.unwrap_or(u64::MAX).min(*other)));
        }
        if let Some((_, other)) = earliest.filter(|(known, other)| known == run && other < time) {
            longest = longest.max(Some(Duration::from_nanos(time - other)));
        }
    }
    longest
}

/// The smallest difference by which the first module's time is later where its step is not the earlier one: its clock is
/// not further ahead. `None` if there is no such step.
fn least_lead(first: &[Point], second: &[Point]) -> Option<Duration> {
    let mut earlier = second.iter().peekable();
    // The latest time of the second module at steps up to this one of the present run.
    let mut latest: Option<(RunId, u64)> = None;
    let mut least = None;
    for (run, step, time) in first {
        while let Some((other_run, _, other)) =
            earlier.next_if(|point| (point.0, point.1) <= (*run, *step))
        {
            let before = latest.filter(|(known, _)| known == other_run).map(|(_, time)| time);
            latest = Some((*other_run, before.unwrap_or(0).max(*other)));
        }
        if let Some((_, other)) = latest.filter(|(known, _)| known == run) {
            let lead = Duration::from_nanos(time.saturating_sub(other));
            least = Some(least.map_or(lead, |least: Duration| least.min(lead)));
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{acknowledged, history, identification, journaled};

    fn at(module: &str, sequence: u64, run: u64, step: u64, second: u64) -> FaultTransition {
        FaultTransition {
            run: Some(RunId(run)),
            decided_step: Some(Step(step)),
            ..journaled(module, sequence, second * 1_000_000_000)
        }
    }

    fn page(sequences: &[u64], more: bool) -> HistoryPage {
        HistoryPage {
            structure: "tower".parse().unwrap(),
            module: "m".parse().unwrap(),
            transitions: sequences.iter().map(|sequence| journaled("m", *sequence, 0)).collect(),
            identifications: Vec::new(),
            phases: Vec::new(),
            first_sequence: Some(3),
            next_sequence: 12,
            more,
        }
    }

    fn empty(since: u64) -> ModuleHistory {
        ModuleHistory::new(&"tower".parse().unwrap(), &"m".parse().unwrap(), since)
    }

    fn names(journals: &Journals<'_>) -> Vec<String> {
        let name = |entry: &JournalEntry<'_>| match entry {
            JournalEntry::Transition(t) => format!("{}.{}", t.module, t.sequence),
            JournalEntry::Identification(found) => {
                format!("{}.{} is known", found.module, found.sequence)
            }
            JournalEntry::Phase(change) => format!("phase {}", change.number),
            JournalEntry::Observed(_, event) => format!("event {}", event.number),
        };
        journals.entries.iter().map(name).collect()
    }

    #[test]
    fn pages_follow_each_other_and_what_is_missing_is_reported() {
        let mut read = empty(1);
        assert!(!read.answered());
        assert_eq!(read.accept(1, page(&[3, 4, 6], true)), Ok(Some(7)));
        assert_eq!(read.accept(7, page(&[7, 8], false)), Ok(None));
        let gap = |from, to| HistoryGap { from, to };
        assert_eq!(read.gaps(), [gap(5, 5), gap(9, 11)]);
        assert_eq!(ModuleHistory { since: 6, ..read.clone() }.gaps(), [gap(9, 11)]);
        read.broken_off = Some(QueryError::Unanswered(Duration::ZERO));
        assert_eq!(read.gaps(), [gap(5, 5)], "after a break nothing is known of the end");
    }

    #[test]
    fn pages_that_would_never_end_or_are_anothers_are_refused() {
        for (asked, page) in [
            (7, page(&[6], true)),
            (1, page(&[3, 3], false)),
            (1, page(&[], true)),
            (1, HistoryPage { module: "n".parse().unwrap(), ..page(&[3], false) }),
        ] {
            assert!(matches!(empty(1).accept(asked, page), Err(QueryError::Senseless(_))));
        }
    }

    #[test]
    fn everything_that_is_missing_is_noted() {
        let mut cut = history("m1", vec![journaled("m1", 5, 1), journaled("m1", 7, 2)]);
        (cut.first_sequence, cut.next_sequence) = (Some(5), Some(10));
        let mut broken = history("m2", vec![journaled("m2", 1, 1)]);
        broken.next_sequence = Some(4);
        broken.broken_off = Some(QueryError::Unanswered(Duration::from_secs(3)));
        let mut none = history("m3", Vec::new());
        (none.first_sequence, none.next_sequence) = (None, Some(3));
        let mut silent = history("m4", Vec::new());
        silent.next_sequence = None;
        silent.broken_off = Some(QueryError::Unanswered(Duration::from_secs(3)));
        let whole = history("m5", vec![journaled("m5", 1, 1), journaled("m5", 2, 2)]);
        let untouched = history("m6", Vec::new());
        let notes = [cut, broken, none, silent, whole, untouched].map(|history| history.notes());
        assert_eq!(
            notes.concat(),
            [
                "m1: the journal reaches back to transition 5 only",
                "m1: transition 6 is missing from the journal",
                "m1: transitions 8 to 9 are missing from the journal",
                "m2: nothing was read after transition 1: no answer within 3s",
                "m3: the journal holds none of the 2 transitions up to now",
                "m4: no answer within 3s; its history is unavailable",
            ]
        );
    }

    #[test]
    fn modules_are_merged_by_time_and_each_keeps_its_order() {
        let found = |sequence, time_unix_ns| Identification {
            sequence,
            time_unix_ns,
            ..identification(true, &["bias"])
        };
        let first = ModuleHistory {
            identifications: vec![found(1, 7), found(2, 35)],
            ..history("m1", vec![journaled("m1", 1, 10), journaled("m1", 2, 30)])
        };
        let second = vec![journaled("m2", 4, 20), journaled("m2", 5, 5), journaled("m2", 6, 40)];
        let histories = [first, history("m2", second)];
        let expected = ["m1.1", "m1.1 is known", "m2.4", "m2.5", "m1.2", "m1.2 is known", "m2.6"];
        assert_eq!(names(&Journals::merge(&histories)), expected);
    }

    #[test]
    fn clocks_that_contradict_the_order_of_steps_are_noted_and_do_not_change_it() {
        // Its clock is ahead.
        let first = history("m1", vec![at("m1", 1, 1, 100, 5100), at("m1", 2, 1, 300, 5300)]);
        let second =
            vec![at("m2", 1, 1, 50, 50), at("m2", 2, 1, 200, 200), at("m2", 3, 1, 400, 400)];
        let histories = [first, history("m2", second)];
        let journals = Journals::merge(&histories);
        assert_eq!(names(&journals), ["m2.1", "m1.1", "m2.2", "m1.2", "m2.3"]);
        let expected = "clocks differ: according to the steps, by which this table is sorted, the clock of m1 is at \
                        least 4900 s ahead of that of m2; check time synchronisation";
        assert_eq!(
            journals.contradictions.iter().map(ToString::to_string).collect::<Vec<_>>(),
            [expected]
        );
    }

    #[test]
    fn a_clock_that_is_ahead_is_found_by_the_steps() {
        let ahead =
            history("m1", vec![at("m1", 1001, 1, 1000, 3610), at("m1", 3001, 1, 3000, 3630)]);
        let right = history("m2", vec![at("m2", 501, 1, 500, 5), at("m2", 2001, 1, 2000, 20)]);
        let third = history("m3", vec![at("m3", 2501, 1, 2500, 25)]);
        let histories = [ahead, right, third];
        let contradictions = Journals::merge(&histories).contradictions;
        let found =
            contradictions.iter().map(|c| (c.ahead.as_str(), c.behind.as_str(), c.by.as_secs()));
        assert_eq!(found.collect::<Vec<_>>(), [("m1", "m2", 3590), ("m1", "m3", 3585)]);
    }

    #[test]
    fn what_was_recovered_after_a_restart_is_no_clock_error() {
        // Down from step 130 on, it takes what the publisher still has five seconds later.
        let late = vec![at("m1", 1, 1, 120, 12), at("m1", 2, 1, 169, 22), at("m1", 3, 1, 230, 23)];
        let prompt = vec![at("m2", 1, 1, 121, 12), at("m2", 2, 1, 199, 20)];
        let histories = [history("m1", late), history("m2", prompt)];
        let journals = Journals::merge(&histories);
        assert_eq!(journals.contradictions, []);
        assert_eq!(names(&journals), ["m1.1", "m2.1", "m2.2", "m1.2", "m1.3"]);
    }

    #[test]
    fn clocks_that_agree_steps_of_different_runs_and_late_orders_are_not_noted() {
        let first = history("m1", vec![at("m1", 1001, 1, 1000, 11), at("m1", 1002, 2, 10, 100)]);
        let second = history("m2", vec![at("m2", 1002, 1, 1001, 10), at("m2", 1003, 3, 20, 50)]);
        let order = acknowledged("m1", 2).order;
        let late = history("m1", vec![FaultTransition { order, ..at("m1", 1001, 1, 1000, 3600) }]);
        let other = history("m2", vec![at("m2", 2001, 1, 2000, 20)]);
        for histories in [[first, second], [late, other]] {
            assert_eq!(Journals::merge(&histories).contradictions, []);
        }
    }
}
