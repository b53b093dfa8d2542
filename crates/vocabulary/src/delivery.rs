//! What is numbered is delivered once and in the order of its numbers, though the network loses, repeats and reorders
//! it; what cannot be had is counted as lost. And how long to wait before something is tried again.
//!
//! No clock and no network: what came goes in, what is due and what is to be asked for comes out.

use std::collections::BTreeMap;
use std::ops::{Add, Range};

/// The numbers of a stream that are missing: they were given, and have neither come nor been given up. The greatest number
/// is that of nothing.
#[derive(Debug, Clone, Default)]
pub struct Gaps {
    end: u64,
    /// In ascending order, none of them empty.
    missing: Vec<Gap>,
}

#[derive(Debug, Clone)]
struct Gap {
    numbers: Range<u64>,
    is_asked: bool,
}

impl Gaps {
    /// Those of a stream of which this number is due next.
    #[must_use]
    pub const fn starting_at(next: u64) -> Self {
        Self { end: next, missing: Vec::new() }
    }

    /// The number after the last that is known to have been given.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.end
    }

    /// Every number below this one has come or is lost.
    #[must_use]
    pub fn complete_below(&self) -> u64 {
        self.missing.first().map_or(self.end, |gap| gap.numbers.start)
    }

    /// Those that are missing, in ascending order.
    pub fn missing(&self) -> impl Iterator<Item = Range<u64>> {
        self.missing.iter().map(|gap| gap.numbers.clone())
    }

    /// Something with this number has come. False if it came before, or was given up.
    pub fn take(&mut self, number: u64) -> bool {
        let Some(after) = number.checked_add(1) else { return false };
        if number < self.end {
            return !self.give_up(number..after).is_empty();
        }
        self.know_of(number);
        self.end = after;
        true
    }

    /// All numbers below this one have been given, whether they come or not.
    pub fn know_of(&mut self, end: u64) {
        if end > self.end {
            self.missing.push(Gap { numbers: self.end..end, is_asked: false });
            self.end = end;
        }
    }

    /// Skips to this number: whether unknown numbers below it were used cannot be determined.
    pub fn skip_to(&mut self, number: u64) {
        self.end = self.end.max(number);
    }

    /// The first numbers that are missing and have not been asked for; now they have.
    pub fn ask(&mut self) -> Option<Range<u64>> {
        let gap = self.missing.iter_mut().find(|gap| !gap.is_asked)?;
        gap.is_asked = true;
        Some(gap.numbers.clone())
    }

    /// Nothing with these numbers is waited for any more. Returns those that were missing.
    pub fn give_up(&mut self, numbers: Range<u64>) -> Vec<Range<u64>> {
        let mut given_up = Vec::new();
        let mut left = Vec::with_capacity(self.missing.len() + 1);
        for Gap { numbers: gap, is_asked } in self.missing.drain(..) {
            let common = gap.start.max(numbers.start)..gap.end.min(numbers.end);
            let parts = match common.is_empty() {
                true => [gap, 0..0],
                false => [gap.start..common.start, common.end..gap.end],
            };
            let parts = parts.into_iter().filter(|part| !part.is_empty());
            left.extend(parts.map(|numbers| Gap { numbers, is_asked }));
            given_up.extend((!common.is_empty()).then_some(common));
        }
        self.missing = left;
        given_up
    }
}

/// Something that is due.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Due<T> {
    /// What has this number.
    Item(u64, T),
    /// Those with these numbers are lost.
    Lost(Range<u64>),
}

/// Holds back what comes after a gap until that is filled or given up.
#[derive(Debug, Clone)]
pub struct GapFiller<T> {
    gaps: Gaps,
    held: BTreeMap<u64, T>,
    /// First and end of those that are lost.
    lost: BTreeMap<u64, u64>,
}

impl<T> Default for GapFiller<T> {
    fn default() -> Self {
        Self::starting_at(0)
    }
}

impl<T> GapFiller<T> {
    /// Of a stream of which this number is due next.
    #[must_use]
    pub const fn starting_at(next: u64) -> Self {
        Self { gaps: Gaps::starting_at(next), held: BTreeMap::new(), lost: BTreeMap::new() }
    }

    /// Takes something, whether it was published or is the reply to a question.
    ///
    /// # Errors
    /// What has the number came before, or is lost: the same is returned.
    pub fn take(&mut self, number: u64, item: T) -> Result<(), T> {
        if !self.gaps.take(number) {
            return Err(item);
        }
        self.held.insert(number, item);
        Ok(())
    }

    /// All numbers below this one have been given, whether they come or not.
    pub fn know_of(&mut self, end: u64) {
        self.gaps.know_of(end);
    }

    /// Nothing with these numbers is waited for any more: what of them has not come is lost.
    pub fn give_up(&mut self, numbers: Range<u64>) {
        let lost = self.gaps.give_up(numbers).into_iter();
        self.lost.extend(lost.map(|numbers| (numbers.start, numbers.end)));
    }

    /// What is due, in the order of the numbers; each once.
    pub fn due(&mut self) -> Option<Due<T>> {
        let end = self.gaps.complete_below();
        let item = self.held.first_key_value().map(|(number, _)| *number);
        let lost = self.lost.first_key_value().map(|(number, _)| *number);
        if item.is_some_and(|item| item < end && lost.is_none_or(|lost| item < lost)) {
            return self.held.pop_first().map(|(number, item)| Due::Item(number, item));
        }
        if lost? >= end {
            return None;
        }
        self.lost.pop_first().map(|(start, end)| Due::Lost(start..end))
    }

    /// What is held back, in the order of the numbers.
    pub fn held(&self) -> impl ExactSizeIterator<Item = &T> {
        self.held.values()
    }

    /// The same, out of it.
    pub fn into_held(self) -> impl Iterator<Item = (u64, T)> {
        self.held.into_iter()
    }

    /// The number that is due next.
    #[must_use]
    pub fn next(&self) -> u64 {
        self.gaps.complete_below()
    }

    /// The number after the last that has come or is known to have been given.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.gaps.end()
    }
}

/// Pauses between attempts, in a unit such as a duration: each twice as long as the one before, up to the longest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Backoff<T> {
    first: T,
    longest: T,
    latest: Option<T>,
    failures: u32,
}

impl<T: Copy + Ord + Add<Output = T>> Backoff<T> {
    /// Before any attempt.
    #[must_use]
    pub const fn new(first: T, longest: T) -> Self {
        Self { first, longest, latest: None, failures: 0 }
    }

    /// An attempt failed. Returns the pause before the next one.
    pub fn fail(&mut self) -> T {
        let pause = self.latest.map_or(self.first, |latest| latest + latest).min(self.longest);
        (self.latest, self.failures) = (Some(pause), self.failures.saturating_add(1));
        pause
    }

    /// An attempt succeeded.
    pub fn succeed(&mut self) {
        (self.latest, self.failures) = (None, 0);
    }

    /// How many attempts in a row have failed.
    #[must_use]
    pub fn failures(&self) -> u32 {
        self.failures
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    /// What becomes of a number.
    #[derive(Debug, Clone, Copy)]
    enum Fate {
        Lost,
        Comes,
        ComesTwice,
        /// After so many others.
        ComesLate(usize),
    }

    fn fate() -> impl Strategy<Value = Fate> {
        prop_oneof![
            2 => Just(Fate::Lost),
            4 => Just(Fate::Comes),
            1 => Just(Fate::ComesTwice),
            2 => (1usize..9).prop_map(Fate::ComesLate),
        ]
    }

    /// The numbers as they come.
    fn arrivals(first: u64, fates: &[Fate]) -> Vec<u64> {
        let mut placed = Vec::new();
        for (place, fate) in fates.iter().enumerate() {
            let number = first + place as u64;
            match *fate {
                Fate::Lost => {}
                Fate::Comes => placed.push((place, number)),
                Fate::ComesTwice => placed.extend([(place, number), (place, number)]),
                Fate::ComesLate(by) => placed.push((place + by, number)),
            }
        }
        placed.sort_by_key(|(place, _)| *place);
        placed.into_iter().map(|(_, number)| number).collect()
    }

    /// What a question brings, and whether what it does not bring is given up with it.
    #[derive(Debug, Clone)]
    struct Reply {
        /// After so many arrivals.
        after: usize,
        has: Vec<bool>,
        is_final: bool,
    }

    fn reply() -> impl Strategy<Value = Reply> {
        (0usize..6, vec(any::<bool>(), 1..5), any::<bool>())
            .prop_map(|(after, has, is_final)| Reply { after, has, is_final })
    }

    /// A stream, and what is known of it otherwise.
    struct Bench {
        filler: GapFiller<u64>,
        /// Came before it was given up.
        came: BTreeSet<u64>,
        handed: Vec<Due<u64>>,
    }

    impl Bench {
        fn take(&mut self, number: u64) {
            let is_new = self.filler.take(number, number).is_ok();
            assert!(!is_new || self.came.insert(number), "{number} was taken twice");
        }

        fn hand_out(&mut self) {
            self.handed.extend(std::iter::from_fn(|| self.filler.due()));
        }

        fn answer(&mut self, numbers: Range<u64>, reply: &Reply) {
            let has = reply.has.iter().cycle();
            numbers.clone().zip(has).filter(|(_, has)| **has).for_each(|(n, _)| self.take(n));
            if reply.is_final {
                self.filler.give_up(numbers);
            }
            self.hand_out();
        }
    }

    proptest! {
        #[test]
        fn each_is_handed_out_once_in_order_or_counted_as_lost(
            first in 0u64..3,
            fates in vec(fate(), 1..60),
            replies in vec(reply(), 0..20),
        ) {
            let filler = GapFiller::starting_at(first);
            let mut bench = Bench { filler, came: BTreeSet::new(), handed: Vec::new() };
            let mut replies = replies.into_iter();
            let mut asked: Vec<(usize, Range<u64>, Reply)> = Vec::new();
            for (place, number) in arrivals(first, &fates).into_iter().enumerate() {
                bench.take(number);
                bench.hand_out();
                let missing = bench.filler.gaps.ask();
                if let Some((numbers, reply)) = missing.zip(replies.next()) {
                    asked.push((place + reply.after, numbers, reply));
                }
                let (due, later) = asked.into_iter().partition(|(at, ..)| *at <= place);
                asked = later;
                for (_, numbers, reply) in due {
                    bench.answer(numbers, &reply);
                }
            }
            let end = first + fates.len() as u64;
            bench.filler.know_of(end);
            bench.filler.give_up(first..end);
            bench.hand_out();
            // Too late: it is lost, or there already.
            asked.into_iter().for_each(|(_, numbers, reply)| bench.answer(numbers, &reply));
            let (mut next, mut handed) = (first, BTreeSet::new());
            for due in bench.handed {
                let numbers = match due {
                    Due::Item(number, item) => {
                        prop_assert_eq!(number, item);
                        handed.insert(number);
                        number..number + 1
                    }
                    Due::Lost(numbers) => numbers,
                };
                prop_assert_eq!(numbers.start, next);
                next = numbers.end;
            }
            prop_assert_eq!((next, bench.filler.next()), (end, end));
            prop_assert_eq!(handed, bench.came);
        }

        #[test]
        fn where_every_question_is_answered_nothing_is_lost(
            fates in vec(fate(), 1..60),
        ) {
            let filler = GapFiller::starting_at(0);
            let mut bench = Bench { filler, came: BTreeSet::new(), handed: Vec::new() };
            let whole = Reply { after: 0, has: vec![true], is_final: true };
            for number in arrivals(0, &fates) {
                bench.take(number);
                while let Some(missing) = bench.filler.gaps.ask() {
                    bench.answer(missing, &whole);
                }
                bench.hand_out();
            }
            bench.filler.know_of(fates.len() as u64);
            while let Some(missing) = bench.filler.gaps.ask() {
                bench.answer(missing, &whole);
            }
            let expected = (0..fates.len() as u64).map(|number| Due::Item(number, number));
            prop_assert_eq!(bench.handed, expected.collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_is_missing_is_asked_for_once_and_what_nobody_knows_of_is_not_missing() {
        let mut gaps = Gaps::starting_at(1);
        assert!(gaps.take(1) && gaps.take(5) && !gaps.take(5) && !gaps.take(0));
        assert_eq!((gaps.ask(), gaps.ask()), (Some(2..5), None));
        assert!(gaps.take(3));
        assert_eq!(gaps.missing().collect::<Vec<_>>(), [2..3, 4..5]);
        gaps.skip_to(10);
        gaps.know_of(12);
        assert_eq!(gaps.ask(), Some(10..12));
        assert_eq!(gaps.give_up(4..11), [4..5, 10..11]);
        assert_eq!((gaps.complete_below(), gaps.end()), (2, 12));
        assert!(gaps.take(2) && !gaps.take(4));
        assert_eq!(gaps.complete_below(), 11);
        assert!(!gaps.take(u64::MAX) && gaps.take(u64::MAX - 1));
        assert_eq!(gaps.end(), u64::MAX);
    }

    #[test]
    fn pauses_double_up_to_the_longest_and_begin_again_after_a_success() {
        let mut backoff = Backoff::new(2_u64, 7);
        assert_eq!([backoff.fail(), backoff.fail(), backoff.fail(), backoff.fail()], [2, 4, 7, 7]);
        assert_eq!(backoff.failures(), 4);
        backoff.succeed();
        assert_eq!((backoff.fail(), backoff.failures()), (2, 1));
    }
}
