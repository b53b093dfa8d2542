//! The latest samples of four channels and which stretches of them are lagged vectors (eq. 15).
//!
//! A vector is a window of w samples without a gap. Vectors are numbered by the position of their
//! newest sample; after a gap the next vector ends w samples later.

use std::collections::VecDeque;

use super::lanes::{Lane, splat};

/// A ring of samples written twice, so that every window is contiguous in memory, with the gaps.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct History {
    window: usize,
    capacity: usize,
    samples: Vec<Lane>,
    /// Samples taken so far; the newest one has position `taken - 1`.
    taken: u64,
    /// Position of the first sample after each gap that may still matter.
    gaps: VecDeque<u64>,
    /// Position of the newest sample of the oldest vector not yet deleted, once one was formed.
    oldest: Option<u64>,
    /// The latest gap that the oldest vector has passed.
    passed: u64,
    /// Vectors formed and not yet deleted.
    held: u64,
}

impl History {
    /// Room for `vectors` vectors of `window` samples, and half as much again for gaps.
    pub(super) fn new(window: usize, vectors: usize) -> Self {
        let capacity = vectors + vectors / 2 + 8 * window;
        Self {
            window,
            capacity,
            samples: vec![splat(0.0); 2 * capacity],
            taken: 0,
            gaps: VecDeque::new(),
            oldest: None,
            passed: 0,
            held: 0,
        }
    }

    /// Forgets every sample.
    pub(super) fn clear(&mut self) {
        self.taken = 0;
        self.gaps.clear();
        self.oldest = None;
        self.passed = 0;
        self.held = 0;
    }

    /// How many vectors were formed and not yet deleted.
    pub(super) fn held(&self) -> u64 {
        self.held
    }

    /// Appends a sample; the oldest one is forgotten.
    pub(super) fn push(&mut self, sample: Lane) {
        let place = (self.taken % self.capacity as u64) as usize;
        self.samples[place] = sample;
        self.samples[place + self.capacity] = sample;
        self.taken += 1;
        if self.newest_vector().is_some() {
            self.held += 1;
            self.oldest.get_or_insert(self.taken - 1);
        }
    }

    /// Notes that samples are missing between the newest one and the next.
    pub(super) fn gap(&mut self) {
        if self.gaps.back() == Some(&self.taken) || self.taken == 0 {
            return;
        }
        if self.oldest.is_none() {
            self.gaps.clear();
        } else if self.gaps.len() >= self.capacity {
            // Older than the whole ring: either passed already or the oldest vector is lost anyway.
            self.gaps.pop_front();
        }
        self.gaps.push_back(self.taken);
    }

    /// The newest vector, if its samples follow one another without a gap.
    pub(super) fn newest_vector(&self) -> Option<&[Lane]> {
        let start = self.gaps.back().copied().unwrap_or(self.passed);
        let whole = self.taken >= start + self.window as u64;
        whole.then(|| self.ending_at(self.taken - 1))
    }

    /// The oldest vector not yet deleted, if its samples are still held.
    pub(super) fn oldest_vector(&self) -> Option<&[Lane]> {
        let oldest = self.oldest?;
        let needed = self.taken - oldest + self.window as u64 - 1;
        (needed <= self.capacity as u64).then(|| self.ending_at(oldest))
    }

    /// Moves on to the next oldest vector.
    pub(super) fn delete_oldest(&mut self) {
        let Some(mut oldest) = self.oldest else { return };
        oldest += 1;
        self.held = self.held.saturating_sub(1);
        // Vectors across a gap were never formed: the next one ends a window after it.
        while let Some(&gap) = self.gaps.front()
            && gap <= oldest
        {
            oldest = oldest.max(gap + self.window as u64 - 1);
            self.gaps.pop_front();
            self.passed = gap;
        }
        self.oldest = Some(oldest);
    }

    fn ending_at(&self, position: u64) -> &[Lane] {
        let end = (position % self.capacity as u64) as usize + self.capacity + 1;
        &self.samples[end - self.window..end]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(vector: &[Lane]) -> Vec<f64> {
        vector.iter().map(|sample| sample[0]).collect()
    }

    /// `None` is a gap. Returns the vectors formed.
    fn vectors(window: usize, stream: &[Option<f64>]) -> Vec<Vec<f64>> {
        let mut history = History::new(window, 8);
        let mut seen = Vec::new();
        for sample in stream {
            match sample {
                Some(x) => {
                    history.push(splat(*x));
                    seen.extend(history.newest_vector().map(values));
                }
                None => history.gap(),
            }
        }
        seen
    }

    #[test]
    fn windows_follow_one_another_at_every_position_of_the_ring() {
        let stream: Vec<_> = (0..120).map(|k| Some(f64::from(k))).collect();
        let seen = vectors(3, &stream);
        assert_eq!(seen.len(), 118);
        for (k, vector) in (0_u32..).map(f64::from).zip(&seen) {
            assert_eq!(vector, &[k, k + 1.0, k + 2.0]);
        }
    }

    #[test]
    fn no_window_spans_a_gap() {
        let stream = [Some(0.0), Some(1.0), Some(2.0), None, Some(3.0), Some(4.0), Some(5.0)];
        assert_eq!(vectors(3, &stream), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
    }

    #[test]
    fn deletion_meets_the_vectors_in_the_order_they_were_formed() {
        // gaps at every distance from each other, closer than a window too
        for pattern in [vec![5, 9, 10, 14], vec![1, 2, 3, 7, 11], vec![4, 5, 6, 7, 20, 22]] {
            let mut history = History::new(3, 4);
            let mut formed = VecDeque::new();
            for k in 0..200_u32 {
                if pattern.contains(&(k % 25)) {
                    history.gap();
                }
                history.push(splat(f64::from(k)));
                if let Some(vector) = history.newest_vector() {
                    formed.push_back(values(vector));
                }
                assert_eq!(history.held(), formed.len() as u64);
                if formed.len() > 4 {
                    let expected = formed.pop_front();
                    assert_eq!(history.oldest_vector().map(values), expected);
                    history.delete_oldest();
                }
            }
        }
    }

    #[test]
    fn a_vector_older_than_the_ring_is_refused() {
        let mut history = History::new(3, 4);
        for _ in 0..4 {
            history.push(splat(0.0));
        }
        assert!(history.oldest_vector().is_some());
        for _ in 0..200 {
            history.gap();
            history.push(splat(0.0));
        }
        assert!(history.oldest_vector().is_none());
    }
}
