//! From numbers to places.

/// The lowest and the highest number that are shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Scale {
    /// One that shows all of these. Of numbers that are all the same it shows a little around them.
    pub(super) fn of(numbers: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for number in numbers.filter(|number| number.is_finite()) {
            (low, high) = (low.min(number), high.max(number));
        }
        if low > high {
            return Self { low: 0.0, high: 1.0 };
        }
        let around = if high > low { 0.0 } else { (0.01 * high.abs()).max(f64::MIN_POSITIVE) };
        Self { low: low - around, high: high + around }
    }

    /// Where a number is between the lowest, 0, and the highest, 1.
    pub(super) fn share(&self, number: f64) -> f64 {
        ((number - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_shows_all_numbers() {
        let scale = Scale::of([3.0, -1.0, f64::NAN, 1.0].into_iter());
        assert_eq!(scale, Scale { low: -1.0, high: 3.0 });
        assert_eq!([-1.0, 1.0, 3.0, 9.0].map(|number| scale.share(number)), [0.0, 0.5, 1.0, 1.0]);
    }

    #[test]
    fn one_number_is_in_the_middle_whatever_it_is() {
        for number in [0.0, 1.0, -7e-9, 1e300] {
            let share = Scale::of([number, number].into_iter()).share(number);
            assert!((share - 0.5).abs() < 0.01, "{number}: {share}");
        }
        assert!(Scale::of(std::iter::empty()).share(0.5).is_finite());
    }
}
