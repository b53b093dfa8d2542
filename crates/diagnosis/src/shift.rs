//! Residuals that are not after a gap what they were before it. A channel whose residual has been far off for long
//! shows no change in its divergence when it comes back within a gap: its Gaussian knows both.

/// What a residual may be off from one sample to another, in standard deviations of its noise.
const LARGEST_NOISE: f64 = 10.0;

/// The residuals before the latest gap, until they have been compared with those after it.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Shifts {
    noise: Vec<f64>,
    before: Vec<f64>,
    in_gap: bool,
}

impl Shifts {
    /// For channels with these variances of their residuals' noise.
    pub(crate) fn new(variances: &[f64]) -> Self {
        let noise = variances.iter().map(|variance| variance.sqrt()).collect();
        Self { noise, before: vec![0.0; variances.len()], in_gap: false }
    }

    /// Begins a gap after these residuals, unless one is open already.
    pub(crate) fn begin(&mut self, residuals: &[f64]) {
        if !self.in_gap {
            self.before.copy_from_slice(residuals);
            self.in_gap = true;
        }
    }

    /// Nothing is to be compared with what was before.
    pub(crate) fn forget(&mut self) {
        self.in_gap = false;
    }

    /// Ends the gap with these residuals; returns the channels that have shifted.
    pub(crate) fn end<'a>(&'a mut self, residuals: &'a [f64]) -> impl Iterator<Item = usize> + 'a {
        let was_in_gap = std::mem::take(&mut self.in_gap);
        let shifted = move |channel: &usize| {
            let off = residuals[*channel] - self.before[*channel];
            was_in_gap && off.abs() > LARGEST_NOISE * self.noise[*channel]
        };
        (0..residuals.len()).filter(shifted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_shifted_across_gaps_is_found_once_they_are_over() {
        let mut shifts = Shifts::new(&[4.0, 4.0]);
        assert_eq!(shifts.end(&[100.0, 0.0]).count(), 0, "there was no gap");
        shifts.begin(&[100.0, 0.0]);
        shifts.begin(&[50.0, 50.0]);
        assert_eq!(shifts.end(&[79.0, 19.0]).collect::<Vec<_>>(), [0]);
        assert_eq!(shifts.end(&[0.0, 100.0]).count(), 0, "the gap is over");
        shifts.begin(&[0.0, 0.0]);
        shifts.forget();
        assert_eq!(shifts.end(&[100.0, 100.0]).count(), 0);
    }
}
