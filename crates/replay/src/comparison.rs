//! Compares a replay with the recording.

use std::collections::BTreeMap;

use diagnosis::identification::{Excerpt, identify};
use diagnosis::messages::{Speaker, from_transition};
use diagnosis::{Diagnoser, Transition};
use serde_json::Value;
use vocabulary::{
    Channel, Divergences, FaultTransition, Identification, ModuleName, RunId, Step, StructureName,
};

use crate::collection::{ModulePosition, ModuleRecord};
use crate::course::ProcessCourse;
use crate::difference::{Difference, FieldValues, first_field};

/// A killed process leaves at most this much unpublished \[s\].
const UNPUBLISHED_S: f64 = 1.0;

/// A fault is identified at most this long after the last sample used for it \[ns\].
const IDENTIFIED_WITHIN_NS: u64 = 10_000_000_000;

/// While a process goes on for this long, what it decides is published \[ns\].
const PUBLISHED_WITHIN_NS: u64 = 1_500_000_000;

/// A process publishes divergences several times in so many steps, unless its settings say otherwise.
const STEPS_WITH_DIVERGENCES: u64 = 1000;

/// The position of differences that are found at the end, after all others.
const AT_END: u64 = u64::MAX - 1;

/// A recorded message, and how and after how many samples it differed from the replay.
type Waiting = (Divergences, Option<(u64, Difference)>);

/// The result of a comparison.
#[derive(Debug)]
pub struct ReplayComparison {
    /// The number of equal verdicts.
    pub verdicts: u64,
    /// The number of equal divergence messages.
    pub divergences: u64,
    /// The number of equal identifications.
    pub identifications: u64,
    /// The number of recorded verdicts that the replay did not reach.
    pub verdicts_unverified: u64,
    /// The number of recorded divergence messages that it did not reach.
    pub divergences_unverified: u64,
    /// The number of recorded identifications that it did not reach.
    pub identifications_unverified: u64,
    /// The number of verdicts of the replay that the recording lacks, although it has later ones, or a later status that
    /// counts them.
    pub verdicts_unrecorded: u64,
    /// The number of verdicts of the replay from before the recording began that it does not have: nothing fetches those.
    pub verdicts_before: u64,
    /// The recording has no divergences of the process, although its statuses show that there were some.
    pub divergences_absent: bool,
    /// The recording has no identifications of the process, although it went on long enough after a fault.
    pub identifications_absent: bool,
    /// The number of verdicts of the replay after the last recorded one: a process that ends does not publish everything.
    pub verdicts_beyond: u64,
    /// The first difference.
    pub difference: Option<Difference>,
    module: ModuleName,
    structure: StructureName,
    /// Recorded verdicts not yet replayed, by sequence number; several if one was published again.
    recorded: BTreeMap<u64, Vec<FaultTransition>>,
    /// Every verdict with a lower sequence number was published.
    published_below: u64,
    /// The first step of which the recording heard.
    begins: Option<(RunId, Step)>,
    /// Verdicts up to this number were before the replay.
    remembered: u64,
    /// When each step as of which a new fault was to be identified had been taken, if the recording has no identification.
    unidentified: Option<Vec<u64>>,
    /// When it was heard for the first and the last time, and between these its positions by time.
    heard: (u64, u64),
    positions: Vec<ModulePosition>,
    /// Verdicts of the replay after the last recorded one.
    beyond: Vec<Transition>,
    /// Recorded divergences by run and step, each with how it differed from the replay.
    messages: BTreeMap<(RunId, Step), Vec<Waiting>>,
    /// Recorded identifications not yet replayed, by the verdict's sequence number and the latest step used.
    found: BTreeMap<(u64, Step), Vec<Identification>>,
    /// The number of samples so far, and at the first difference.
    steps: u64,
    difference_at: u64,
}

/// Whether an identification was computed from samples before the state: its thread may take some time.
fn is_seen_before(found: &Identification, course: &ProcessCourse) -> bool {
    let begins = course.state.as_ref().and_then(|state| state.position);
    found.time_unix_ns.saturating_sub(course.from()) < IDENTIFIED_WITHIN_NS
        && begins.is_some_and(|(run, step)| found.run == run && found.as_of_step <= step)
}

impl ReplayComparison {
    pub(crate) fn new(record: &ModuleRecord, course: &ProcessCourse) -> Self {
        let is_own = |time: u64| time >= course.from() && time < course.until;
        let own = record.transitions.iter().filter(|message| is_own(message.time_unix_ns));
        let mut recorded: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for message in own.filter(|message| message.sequence > course.memory.sequence) {
            recorded.entry(message.sequence).or_default().push(message.clone());
        }
        let mut found: BTreeMap<_, Vec<_>> = BTreeMap::new();
        let own = record.identifications.iter().filter(|found| is_own(found.time_unix_ns));
        let is_identified = own.clone().next().is_some();
        for message in own.filter(|found| !is_seen_before(found, course)) {
            let at = (message.sequence, message.as_of_step);
            found.entry(at).or_default().push(message.clone());
        }
        let mut messages: BTreeMap<_, Vec<_>> = BTreeMap::new();
        for message in record.divergences.iter().filter(|message| is_own(message.time_unix_ns)) {
            let at = (message.run, message.step);
            messages.entry(at).or_default().push((message.clone(), None));
        }
        let statuses = record.statuses.iter().filter(|status| is_own(status.time_unix_ns));
        let positions = record.positions.iter().filter(|one| is_own(one.time_unix_ns)).copied();
        let positions: Vec<ModulePosition> = positions.collect();
        let times = positions.last().map(|last| last.time_unix_ns).into_iter();
        let last_heard = times.chain(statuses.clone().map(|status| status.time_unix_ns)).max();
        let heard = (record.heard_since().unwrap_or(u64::MAX), last_heard.unwrap_or_default());
        let is_published = |time: u64| time.saturating_add(PUBLISHED_WITHIN_NS) <= heard.1;
        let counted = statuses.clone().filter(|status| is_published(status.time_unix_ns));
        let published_below = counted.map(|status| status.next_sequence).max();
        let last_recorded = recorded.keys().next_back().copied();
        let steps: u64 = statuses
            .clone()
            .zip(statuses.skip(1))
            .filter_map(|(one, next)| one.position.zip(next.position))
            .filter(|(one, next)| one.0 == next.0 && one.1 <= next.1)
            .map(|(one, next)| next.1.since(one.1))
            .sum();
        Self {
            divergences_absent: messages.is_empty() && steps >= STEPS_WITH_DIVERGENCES,
            identifications_absent: false,
            verdicts: 0,
            divergences: 0,
            identifications: 0,
            verdicts_unverified: 0,
            divergences_unverified: 0,
            identifications_unverified: 0,
            verdicts_unrecorded: 0,
            verdicts_before: 0,
            verdicts_beyond: 0,
            difference: None,
            module: record.module.clone(),
            structure: record.structure.clone(),
            published_below: published_below.max(last_recorded).unwrap_or_default(),
            begins: record.begins(),
            remembered: course.memory.sequence,
            unidentified: (!is_identified).then(Vec::new),
            heard,
            positions,
            recorded,
            beyond: Vec::new(),
            messages,
            found,
            steps: 0,
            difference_at: u64::MAX,
        }
    }

    /// Keeps the earliest difference; `at` is the number of samples before it.
    fn differs(&mut self, at: u64, difference: Difference) {
        if at < self.difference_at {
            self.difference_at = at;
            self.difference = Some(difference);
        }
    }

    /// Compares a verdict of the replay, decided after a sample of this time \[ns since 1970\].
    pub(crate) fn transition(&mut self, replayed: &Transition, time_unix_ns: u64) {
        let Some(recorded) = self.recorded.remove(&replayed.sequence) else {
            let is_before = match self.begins {
                Some((run, step)) if run == replayed.run => replayed.decided < step,
                _ => time_unix_ns < self.heard.0,
            };
            if is_before {
                self.verdicts_before += 1;
            } else if replayed.sequence < self.published_below {
                self.verdicts_unrecorded += 1;
            } else {
                self.beyond.push(replayed.clone());
            }
            return;
        };
        match recorded.into_iter().find_map(|recorded| self.compare(recorded, replayed)) {
            None => self.verdicts += 1,
            Some(difference) => self.differs(self.steps, difference),
        }
    }

    /// Identifies a fault as the replayed process would, and compares the result.
    pub(crate) fn identification(&mut self, excerpt: &Excerpt) {
        // What is found of an earlier fault may be nothing new.
        if excerpt.sequence > self.remembered
            && let Some(unidentified) = &mut self.unidentified
        {
            let is_reached =
                |one: &&ModulePosition| one.run == excerpt.run && one.step >= excerpt.as_of;
            let reached = self.positions.iter().find(is_reached);
            unidentified.extend(reached.map(|one| one.time_unix_ns));
        }
        let Some(recorded) = self.found.remove(&(excerpt.sequence, excerpt.as_of)) else { return };
        let speaker = Speaker::of(self.structure.clone(), self.module.clone());
        let replayed = speaker.identification(identify(excerpt, None), 0);
        for recorded in recorded {
            match identification_difference(recorded, &replayed) {
                None => self.identifications += 1,
                Some(difference) => self.differs(self.steps, difference),
            }
        }
    }

    fn compare(&self, mut recorded: FaultTransition, replayed: &Transition) -> Option<Difference> {
        // A transition that is published again states whether its run has ended meanwhile.
        recorded.run_ended = replayed.run_ended;
        let speaker = Speaker::of(self.structure.clone(), self.module.clone());
        let (run, step) = (recorded.run?, recorded.decided_step?);
        let component = recorded.component.component.clone();
        let said = recorded.state();
        let value = |transition| serde_json::to_value(speaker.transition(transition, 0));
        let recorded = from_transition(recorded).and_then(|known| value(known).ok());
        let replayed = value(replayed.clone()).ok();
        let (recorded, replayed) = match (recorded, replayed) {
            (Some(recorded), Some(replayed)) => (recorded, replayed),
            (_, replayed) => (Value::from(said.to_string()), replayed.unwrap_or_default()),
        };
        let fields = first_field(&recorded, &replayed)?;
        Some(Difference::new(&self.module, (run, step), &component, fields))
    }

    /// Compares the divergences after a sample of the replay.
    pub(crate) fn step(&mut self, diagnoser: &Diagnoser) {
        self.steps += 1;
        let Some(at) = diagnoser.run().zip(diagnoser.last_step()) else { return };
        let Some(waiting) = self.messages.get_mut(&at) else { return };
        let speaker = Speaker::of(self.structure.clone(), self.module.clone());
        let replayed = speaker.divergences(at, diagnoser, 0);
        let differences: Vec<Option<Difference>> =
            waiting.iter().map(|(recorded, _)| channel_difference(recorded, &replayed)).collect();
        if let Some(same) = differences.iter().position(Option::is_none) {
            waiting.remove(same);
            self.divergences += 1;
            if waiting.is_empty() {
                self.messages.remove(&at);
            }
            return;
        }
        // A run that starts again reaches this step again, and the message may belong to that pass.
        for ((_, kept), difference) in waiting.iter_mut().zip(differences) {
            if kept.is_none() {
                *kept = difference.map(|difference| (self.steps, difference));
            }
        }
    }

    /// Ends the replay; `falls_short` if it did not reach the end of the recording.
    pub(crate) fn finish(&mut self, course: &ProcessCourse, falls_short: bool) {
        for (message, difference) in std::mem::take(&mut self.messages).into_values().flatten() {
            match difference {
                Some((at, difference)) => self.differs(at, difference),
                None if falls_short => self.divergences_unverified += 1,
                None => {
                    if let Some(channel) = message.channels.first() {
                        let at = (message.run, message.step);
                        let fields = ("divergence message", "there", "not at a replayed step");
                        let difference =
                            Difference::of_presence(&self.module, at, &channel.component, fields);
                        self.differs(AT_END, difference);
                    }
                }
            }
        }
        for messages in std::mem::take(&mut self.recorded).into_values() {
            if falls_short {
                self.verdicts_unverified += 1;
            } else {
                messages.iter().for_each(|message| self.lacks(message));
            }
        }
        for message in std::mem::take(&mut self.found).into_values().flatten() {
            if falls_short {
                self.identifications_unverified += 1;
            } else {
                let Identification { run, as_of_step: step, component, .. } = message;
                let fields = ("identification", "there", "none");
                let difference = Difference::of_presence(
                    &self.module,
                    (run, step),
                    &component.component,
                    fields,
                );
                self.differs(AT_END, difference);
            }
        }
        let (first, last) = self.heard;
        let is_published =
            |time: &u64| *time >= first && time.saturating_add(PUBLISHED_WITHIN_NS) <= last;
        self.identifications_absent = self.unidentified.iter().flatten().any(is_published);
        let margin = (UNPUBLISHED_S / course.setup.step_s).round() as u64;
        for transition in std::mem::take(&mut self.beyond) {
            let is_beyond = course.known_until.is_none_or(|(run, step)| {
                transition.run != run || transition.decided.plus(margin) >= step
            });
            if is_beyond {
                self.verdicts_beyond += 1;
            } else {
                self.adds(&transition);
            }
        }
    }

    /// Records that the replay lacks a recorded verdict.
    fn lacks(&mut self, message: &FaultTransition) {
        let (Some(run), Some(step)) = (message.run, message.decided_step) else { return };
        let component = &message.component.component;
        let fields = ("verdict", message.state().as_str(), "none");
        let difference = Difference::of_presence(&self.module, (run, step), component, fields);
        self.differs(AT_END, difference);
    }

    /// Records that the recording lacks a verdict of the replay.
    fn adds(&mut self, transition: &Transition) {
        let at = (transition.run, transition.decided);
        let fields = ("verdict", "none", transition.verdict.as_str());
        let difference = Difference::of_presence(&self.module, at, &transition.component, fields);
        self.differs(AT_END, difference);
    }
}

/// The first field that differs, times of day apart. Only replies to queries have the signature.
fn identification_difference(
    mut recorded: Identification,
    replayed: &Identification,
) -> Option<Difference> {
    recorded.time_unix_ns = replayed.time_unix_ns;
    recorded.since_unix_ns = replayed.since_unix_ns;
    let replayed = match &recorded.signature {
        Some(_) => replayed.clone(),
        None => replayed.clone().without_signature(),
    };
    let value = |message: &Identification| serde_json::to_value(message).unwrap_or_default();
    let (field, one, other) = first_field(&value(&recorded), &value(&replayed))?;
    let fields = (format!("identification.{field}"), one, other);
    let Identification { module, run, as_of_step: step, component, .. } = recorded;
    Some(Difference::new(&module, (run, step), &component.component, fields))
}

/// The first channel and figure that differ.
fn channel_difference(recorded: &Divergences, replayed: &Divergences) -> Option<Difference> {
    let (one, other) = (&recorded.channels, &replayed.channels);
    let pairs = one.iter().zip(other);
    let found = pairs.clone().find_map(|(one, other)| {
        let value = |channel: &Channel| serde_json::to_value(channel).unwrap_or_default();
        let difference = (!same(one, other)).then(|| first_field(&value(one), &value(other)));
        difference.flatten().map(|fields| (one.component.clone(), fields))
    });
    let (component, fields): (_, FieldValues) = match found {
        Some(found) => found,
        None if one.len() == other.len() => return None,
        None => {
            let component = one.iter().chain(other).next()?.component.clone();
            let counts = ("channels".to_owned(), one.len().to_string(), other.len().to_string());
            (component, counts)
        }
    };
    Some(Difference::new(&recorded.module, (recorded.run, recorded.step), &component, fields))
}

/// Whether all bits are equal.
fn same(one: &Channel, other: &Channel) -> bool {
    let bits = |channel: &Channel| {
        let Channel { residual, divergence, threshold, .. } = *channel;
        (residual.to_bits(), divergence.map(f64::to_bits), threshold.to_bits())
    };
    one.component == other.component && bits(one) == bits(other)
}
