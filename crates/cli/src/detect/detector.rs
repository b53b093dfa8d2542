//! The divergences of all channels and what the threshold makes of them.

use diagnosis::divergence::{DivergenceBank, Outcome, Violation};

use super::arguments::Arguments;
use crate::failure::Failure;

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Reading {
    /// The divergence; `None` while undefined.
    pub(super) divergence: Option<f64>,
    /// Has the divergence reached the threshold?
    pub(super) change: bool,
    /// The channel was started anew.
    pub(super) restarted: Option<Violation>,
}

/// The detector of all channels.
pub(super) struct Detector {
    bank: DivergenceBank,
    threshold: f64,
    readings: Vec<Reading>,
}

impl Detector {
    pub(super) fn new(arguments: &Arguments, channels: usize) -> Result<Detector, Failure> {
        let prior_scatters = vec![arguments.prior_scatter; channels];
        let bank = DivergenceBank::new(arguments.settings(), &prior_scatters)
            .map_err(|error| Failure::usage(error.to_string()))?;
        let threshold = arguments.threshold.unwrap_or(f64::INFINITY);
        Ok(Detector { bank, threshold, readings: vec![Reading::default(); channels] })
    }

    /// Takes the next row; `None` is a gap.
    pub(super) fn take(&mut self, values: Option<&[f64]>) -> &[Reading] {
        let Some(values) = values else {
            self.bank.gap();
            self.readings.fill(Reading::default());
            return &self.readings;
        };
        let threshold = self.threshold;
        for (reading, &outcome) in self.readings.iter_mut().zip(self.bank.push(values)) {
            *reading = judge(outcome, threshold);
        }
        &self.readings
    }
}

fn judge(outcome: Outcome, threshold: f64) -> Reading {
    let divergence = outcome.divergence();
    let restarted = match outcome {
        Outcome::Restarted(violation) => Some(violation),
        Outcome::Undefined | Outcome::Defined { .. } => None,
    };
    Reading { divergence, change: divergence.is_some_and(|d| d >= threshold), restarted }
}
