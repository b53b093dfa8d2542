//! The divergences of all channels and what the threshold makes of them.

use diagnosis::divergence::{DivergenceBank, Outcome, Violation};

use super::arguments::Arguments;
use crate::failure::Failure;

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Reading {
    /// The divergence; `None` while undefined.
    pub(super) divergence: Option<f64>,
    /// Has the divergence reached the threshold, after the warm-up?
    pub(super) change: bool,
    /// The channel was started anew.
    pub(super) restarted: Option<Violation>,
}

/// What counts as a change.
#[derive(Debug, Clone, Copy)]
struct Criterion {
    threshold: f64,
    warm_up: u64,
}

/// The detector of all channels.
pub(super) struct Detector {
    bank: DivergenceBank,
    criterion: Criterion,
    readings: Vec<Reading>,
}

impl Detector {
    pub(super) fn new(arguments: &Arguments, channels: usize) -> Result<Detector, Failure> {
        let prior_scatters = vec![arguments.prior_scatter; channels];
        let bank = DivergenceBank::new(arguments.settings(), &prior_scatters)
            .map_err(|error| Failure::usage(error.to_string()))?;
        let threshold = arguments.threshold.unwrap_or(f64::INFINITY);
        let criterion = Criterion { threshold, warm_up: arguments.warm_up };
        Ok(Detector { bank, criterion, readings: vec![Reading::default(); channels] })
    }

    /// Takes the next row; `None` is a gap.
    pub(super) fn take(&mut self, values: Option<&[f64]>) -> &[Reading] {
        let Some(values) = values else {
            self.bank.gap();
            self.readings.fill(Reading::default());
            return &self.readings;
        };
        for (reading, &outcome) in self.readings.iter_mut().zip(self.bank.push(values)) {
            *reading = self.criterion.judge(outcome);
        }
        &self.readings
    }
}

impl Criterion {
    fn judge(&self, outcome: Outcome) -> Reading {
        match outcome {
            Outcome::Undefined => Reading::default(),
            Outcome::Restarted(violation) => {
                Reading { restarted: Some(violation), ..Reading::default() }
            }
            Outcome::Defined { divergence, age } => Reading {
                divergence: Some(divergence),
                change: divergence >= self.threshold && age >= self.warm_up,
                restarted: None,
            },
        }
    }
}
