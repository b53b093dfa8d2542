//! Keeps inputs as they were published: the first for good, of the others the latest.

use std::collections::VecDeque;
use std::sync::Arc;

use parking_lot::Mutex;
use vocabulary::InputQuestion;
use zenoh::bytes::ZBytes;

/// Most of the latest inputs that are kept,
const KEPT: usize = 4096;
/// and their bytes. Answers with the means of windows make up most of them.
const KEPT_BYTES: usize = 4 << 20;

/// Filled by the thread that publishes them, read by the one that replies.
#[derive(Debug, Clone)]
pub(crate) struct InputCache {
    process: u64,
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
    /// For the inputs of this process.
    pub(crate) fn new(process: u64) -> Self {
        Self { process, kept: Arc::default() }
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
        if question.process.is_some_and(|process| process != self.process) {
            return Vec::new();
        }
        let from = question.from.unwrap_or(0);
        let wanted = from..=question.to.unwrap_or(u64::MAX);
        let kept = self.kept.lock();
        let first = kept.first.iter().map(|input| (1, input));
        let latest = kept.latest.iter().map(|(number, input)| (*number, input));
        let all = first.chain(latest).filter(|(number, _)| wanted.contains(number));
        all.map(|(_, input)| input.clone()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cache(inputs: u64, bytes: usize) -> InputCache {
        let cache = InputCache::new(7);
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
