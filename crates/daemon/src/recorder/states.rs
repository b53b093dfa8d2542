//! Which diagnosers owe the present file their state, so that it can be replayed from there without the files before it.
//!
//! The state has to be of no earlier step than the one before the file's first sample, because the replay goes on with the
//! samples that follow. One that is older is asked for again.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use recording::{STATE_WITHIN, Stamp};
use vocabulary::{Key, ModuleName, StatePart, StructureName, Topic};

/// States that are asked for at once: each is some megabytes.
const AT_ONCE: usize = 4;
/// So long an answer is waited for before it is asked for again.
const AGAIN_AFTER: Duration = Duration::from_secs(2);
/// How often a state is asked for, for each file.
const ATTEMPTS: u32 = (STATE_WITHIN.as_secs() / AGAIN_AFTER.as_secs()) as u32;

/// A module's part of the present file.
#[derive(Debug, Default)]
struct ModuleHead {
    /// How often its state may still be asked for.
    attempts: u32,
    /// When it was asked for, if an answer may still come.
    asked: Option<Instant>,
    /// Run and step of its first sample that was published meanwhile.
    first: Option<(u64, u64)>,
    /// Which parts have come of the state with this fingerprint.
    parts: (String, BTreeSet<u64>),
}

/// The heads of all modules.
#[derive(Debug, Default)]
pub(super) struct OwedStates(BTreeMap<(StructureName, ModuleName), ModuleHead>);

impl OwedStates {
    /// A module has told its configuration: its state is wanted.
    pub(super) fn want(&mut self, structure: StructureName, module: ModuleName) {
        self.0.entry((structure, module)).or_default().attempts = ATTEMPTS;
    }

    /// Another file begins, or the present one has a hole.
    pub(super) fn begin_file(&mut self) {
        for head in self.0.values_mut() {
            *head = ModuleHead { attempts: ATTEMPTS, ..ModuleHead::default() };
        }
    }

    /// A sample was published and is in the file.
    pub(super) fn sample(&mut self, topic: &str, stamp: &Stamp) {
        // Nearly always so: no key has to be read.
        if self.0.values().all(|head| head.first.is_some()) {
            return;
        }
        let head = key(topic).and_then(|key| self.0.get_mut(&key));
        if let Some(head) = head.filter(|head| head.first.is_none()) {
            head.first = stamp.run.zip(stamp.step);
        }
    }

    /// Is any state still to come?
    pub(super) fn are_owed(&self) -> bool {
        self.0.values().any(|head| head.attempts > 0)
    }

    /// Whose state is to be asked for now, those first that were asked least often.
    pub(super) fn due(&mut self, now: Instant) -> Vec<(StructureName, ModuleName)> {
        let is_over = |asked: Instant| now.duration_since(asked) >= AGAIN_AFTER;
        let owing = self.0.iter_mut().filter(|(_, head)| head.attempts > 0);
        let owing = owing.filter(|(_, head)| head.asked.is_none_or(is_over));
        let mut owing: Vec<_> = owing.collect();
        owing.sort_by_key(|(_, head)| Reverse(head.attempts));
        let asked = owing.into_iter().take(AT_ONCE).map(|(key, head)| {
            head.attempts -= 1;
            head.asked = Some(now);
            key.clone()
        });
        asked.collect()
    }

    /// A part of a state has come. Can the file be replayed from it, once all have? Until then the state is owed: the file must
    /// not end.
    pub(super) fn came(
        &mut self,
        topic: &str,
        stamp: &Stamp,
        part: &StatePart,
        now: Instant,
    ) -> bool {
        let Some(head) = key(topic).and_then(|key| self.0.get_mut(&key)) else { return false };
        let at = stamp.run.zip(stamp.step);
        let is_before_a_hole = |((run, step), (first_run, first)): ((u64, u64), (u64, u64))| {
            run == first_run && step.saturating_add(1) < first
        };
        let fits = !at.zip(head.first).is_some_and(is_before_a_hole);
        if !fits {
            head.asked = None;
            return false;
        }
        // The others are on their way.
        head.asked = Some(now);
        if head.parts.0 != part.fingerprint {
            head.parts = (part.fingerprint.clone(), BTreeSet::new());
        }
        head.parts.1.insert(part.part);
        if head.parts.1.len() as u64 >= part.parts {
            head.attempts = 0;
        }
        true
    }
}

fn key(topic: &str) -> Option<(StructureName, ModuleName)> {
    match topic.parse() {
        Ok(Key::Module { structure, module, topic: Topic::Sample | Topic::Input }) => {
            Some((structure, module))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLE: &str = "trusswatch/tower/m/sample";
    const INPUT: &str = "trusswatch/tower/m/input";

    fn at(run: u64, step: u64) -> Stamp {
        Stamp { run: Some(run), step: Some(step), ..Stamp::default() }
    }

    fn part(part: u64, parts: u64, text: &str) -> StatePart {
        StatePart { part, parts, fingerprint: text.to_owned(), ..StatePart::default() }
    }

    /// A state in one part.
    fn came(owed: &mut OwedStates, run: u64, step: u64) -> bool {
        owed.came(INPUT, &at(run, step), &part(0, 1, "whole"), Instant::now())
    }

    #[test]
    fn each_file_gets_a_state_that_its_samples_follow() {
        let module: (StructureName, ModuleName) = ("tower".parse().unwrap(), "m".parse().unwrap());
        let mut owed = OwedStates::default();
        let now = Instant::now();
        assert_eq!(owed.due(now), []);
        assert!(!came(&mut owed, 1, 5), "of no module that was asked");
        owed.want(module.0.clone(), module.1.clone());
        assert_eq!(owed.due(now), std::slice::from_ref(&module));
        assert_eq!(owed.due(now), [], "the answer may be on its way");
        assert!(came(&mut owed, 1, 5), "nothing is known to follow");
        assert_eq!(owed.due(now), []);
        owed.begin_file();
        owed.sample(SAMPLE, &at(1, 100));
        owed.sample(SAMPLE, &at(1, 101));
        assert_eq!(owed.due(now), std::slice::from_ref(&module));
        assert!(!came(&mut owed, 1, 98), "sample 99 is in the file before");
        assert_eq!(owed.due(now), [module]);
        assert!(owed.are_owed());
        assert!(came(&mut owed, 1, 99) && came(&mut owed, 2, 3));
        assert_eq!(owed.due(now), []);
    }

    #[test]
    fn a_state_is_owed_until_all_its_parts_have_come() {
        let (mut owed, now) = (OwedStates::default(), Instant::now());
        owed.want("tower".parse().unwrap(), "m".parse().unwrap());
        assert_eq!(owed.due(now).len(), 1);
        let later = now + AGAIN_AFTER;
        for number in 0..2 {
            assert!(owed.came(INPUT, &at(1, 5), &part(number, 3, "a"), later));
            assert!(owed.are_owed(), "after part {number}");
        }
        // Its third part was lost.
        assert_eq!(owed.due(later), [], "the others may be on their way");
        assert_eq!(owed.due(later + AGAIN_AFTER).len(), 1);
        for number in 0..3 {
            assert!(owed.are_owed());
            assert!(owed.came(INPUT, &at(1, 9), &part(number, 3, "b"), later));
        }
        assert!(!owed.are_owed());
    }

    #[test]
    fn a_part_that_came_twice_stands_for_no_other() {
        let (mut owed, now) = (OwedStates::default(), Instant::now());
        owed.want("tower".parse().unwrap(), "m".parse().unwrap());
        // The plant stands still: asked again, the diagnoser gives the same state.
        for number in [0, 1, 0, 1] {
            assert!(owed.came(INPUT, &at(1, 5), &part(number, 3, "a"), now));
            assert!(owed.are_owed());
        }
        assert!(owed.came(INPUT, &at(1, 5), &part(2, 3, "a"), now));
        assert!(!owed.are_owed());
    }

    #[test]
    fn who_does_not_answer_is_not_asked_for_ever() {
        let (mut owed, now) = (OwedStates::default(), Instant::now());
        owed.want("tower".parse().unwrap(), "m".parse().unwrap());
        let asked = (0..100).map(|times| owed.due(now + times * AGAIN_AFTER).len());
        assert_eq!(asked.sum::<usize>(), ATTEMPTS as usize);
        assert!(!owed.are_owed());
    }
}
