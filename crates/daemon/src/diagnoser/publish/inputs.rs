//! Keeps inputs as they were published: the first for good, of the others the latest. Those that an earlier process left in
//! the journal stand before them: a process that is killed may not have published its last ones.

use std::collections::VecDeque;
use std::sync::Arc;

use parking_lot::Mutex;
use vocabulary::{Input, InputQuestion, encode};
use zenoh::bytes::ZBytes;

/// Most of the latest inputs that are kept,
const KEPT: usize = 4096;
/// and their bytes. Answers with the means of windows make up most of them.
const KEPT_BYTES: usize = 4 << 20;

/// Filled by the thread that publishes them, read by the one that replies.
#[derive(Debug, Clone)]
pub(crate) struct InputCache {
    process: u64,
    /// With the process that took each, and its number.
    earlier: Arc<[(u64, u64, ZBytes)]>,
    kept: Arc<Mutex<KeptInputs>>,
}

#[derive(Debug, Default)]
struct KeptInputs {
    first: Option<ZBytes>,
    /// With their numbers, in order.
    latest: VecDeque<(u64, ZBytes)>,
    bytes: usize,
}

impl InputCache {
    /// For the inputs of this process, after those of earlier ones.
    pub(crate) fn new<'a>(process: u64, earlier: impl Iterator<Item = &'a Input>) -> Self {
        let as_published = |input: &Input| {
            let bytes = encode(input).map_err(|error| tracing::error!("{error}")).ok()?;
            Some((input.process, input.number, ZBytes::from(bytes)))
        };
        let earlier = earlier.filter_map(as_published);
        Self { process, earlier: earlier.collect(), kept: Arc::default() }
    }

    /// Keeps an input, which is newer than those before, in place of the oldest.
    pub(crate) fn keep(&self, number: u64, input: ZBytes) {
        let mut kept = self.kept.lock();
        if number == 1 {
            kept.first = Some(input);
            return;
        }
        kept.bytes += input.len();
        kept.latest.push_back((number, input));
        while kept.latest.len() > KEPT || kept.bytes > KEPT_BYTES {
            let Some((_, oldest)) = kept.latest.pop_front() else { return };
            kept.bytes -= oldest.len();
        }
    }

    /// The inputs asked for that are still kept, oldest first.
    pub(crate) fn asked(&self, question: InputQuestion) -> Vec<ZBytes> {
        let from = question.from.unwrap_or(0);
        let wanted = from..=question.to.unwrap_or(u64::MAX);
        let kept = self.kept.lock();
        let first = kept.first.iter().map(|input| (1, input));
        let latest = kept.latest.iter().map(|(number, input)| (*number, input));
        let own = first.chain(latest).map(|(number, input)| (self.process, number, input));
        let earlier =
            self.earlier.iter().map(|(process, number, input)| (*process, *number, input));
        let is_wanted = |process: u64, number: u64| {
            wanted.contains(&number) && question.process.is_none_or(|wanted| wanted == process)
        };
        let all = earlier.chain(own).filter(|(process, number, _)| is_wanted(*process, *number));
        all.map(|(.., input)| input.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache(inputs: u64, bytes: usize) -> InputCache {
        let cache = InputCache::new(7, std::iter::empty());
        for number in 1..=inputs {
            cache.keep(number, ZBytes::from(format!("{number:>bytes$}")));
        }
        cache
    }

    fn numbers(cache: &InputCache, question: InputQuestion) -> Vec<u64> {
        let texts = cache.asked(question).into_iter();
        texts.map(|bytes| bytes.try_to_string().unwrap().trim().parse().unwrap()).collect()
    }

    fn from_to(from: Option<u64>, to: Option<u64>) -> InputQuestion {
        InputQuestion { process: None, from, to }
    }

    #[test]
    fn the_first_is_kept_for_good_and_the_latest() {
        let cache = cache(10_000, 1);
        let expected: Vec<u64> = std::iter::once(1).chain(10_001 - KEPT as u64..=10_000).collect();
        assert_eq!(numbers(&cache, InputQuestion::default()), expected);
        assert_eq!(numbers(&cache, from_to(Some(9_998), None)), [9_998, 9_999, 10_000]);
        assert_eq!(numbers(&cache, from_to(None, Some(5_905))), [1, 5_905]);
        assert_eq!(numbers(&cache, from_to(Some(9), Some(8))), [0; 0]);
    }

    #[test]
    fn long_ones_take_the_place_of_more() {
        let cache = cache(1000, 1 << 15);
        let expected: Vec<u64> = std::iter::once(1).chain(873..=1000).collect();
        assert_eq!(numbers(&cache, InputQuestion::default()), expected);
    }

    #[test]
    fn of_another_process_there_are_none() {
        let of = |process| InputQuestion { process: Some(process), ..InputQuestion::default() };
        assert_eq!(numbers(&cache(3, 1), of(7)), [1, 2, 3]);
        assert_eq!(numbers(&cache(3, 1), of(8)), [0; 0]);
    }
}
