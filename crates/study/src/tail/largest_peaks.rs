//! The stored peaks of a channel.

/// Number of peaks stored: the tail of some hours of data.
const KEPT: usize = 2000;

/// The largest peaks of a channel, in bounded memory.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LargestPeaks {
    count: u64,
    falling: Vec<f64>,
}

impl LargestPeaks {
    /// Adds a peak.
    pub fn push(&mut self, peak: f64) {
        self.count += 1;
        let place = self.falling.partition_point(|kept| *kept >= peak);
        if place < KEPT {
            self.falling.insert(place, peak);
            self.falling.truncate(KEPT);
        }
    }

    /// Adds all peaks of another collection of the same channel. The order does not matter.
    pub fn merge(&mut self, other: &LargestPeaks) {
        self.count += other.count;
        self.falling.extend(&other.falling);
        self.falling.sort_by(|a, b| b.total_cmp(a));
        self.falling.truncate(KEPT);
    }

    /// The total number of peaks.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The largest peaks, descending.
    #[must_use]
    pub fn falling(&self) -> &[f64] {
        &self.falling
    }

    /// The largest peak; 0 without peaks.
    #[must_use]
    pub fn largest(&self) -> f64 {
        self.falling.first().copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(peaks: impl IntoIterator<Item = u64>) -> LargestPeaks {
        let mut all = LargestPeaks::default();
        peaks.into_iter().for_each(|peak| all.push(peak as f64));
        all
    }

    #[test]
    fn the_largest_are_kept_and_all_are_counted() {
        // 7 is prime to 5000: every number once, in disorder
        let all = of((0..5000).map(|k| k * 7 % 5000));
        assert_eq!(all.count(), 5000);
        let expected: Vec<f64> = (3000..5000).rev().map(f64::from).collect();
        assert_eq!(all.falling(), expected);
        assert_eq!(all.largest(), 4999.0);
    }

    #[test]
    fn merging_is_independent_of_order_and_grouping() {
        let parts = [of(0..1500), of(1000..2500), of([7, 9000])];
        let mut forwards = LargestPeaks::default();
        parts.iter().for_each(|part| forwards.merge(part));
        let mut backwards = LargestPeaks::default();
        parts.iter().rev().for_each(|part| backwards.merge(part));
        assert_eq!(forwards, backwards);
        assert_eq!(forwards, of((0..1500).chain(1000..2500).chain([7, 9000])));
    }
}
