//! The divergences of all channels and what the thresholds make of them.

use diagnosis::Monitor;
use diagnosis::divergence::{DivergenceBank, DivergenceOutcome, SettingsError, Violation};
use vocabulary::Step;

use super::plan::{Group, Plan};
use crate::failure::Failure;

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Reading {
    /// The divergence; `None` while undefined.
    pub(super) divergence: Option<f64>,
    /// Has the divergence risen to the threshold, after the warm-up, and not become quiet since?
    pub(super) change: bool,
    /// The channel was restarted.
    pub(super) restarted: Option<Violation>,
}

/// The detector of all channels.
pub(super) struct Detector {
    parts: Vec<Part>,
    readings: Vec<Reading>,
    row: Step,
}

impl Detector {
    pub(super) fn new(plan: &Plan) -> Result<Detector, Failure> {
        let parts = plan.groups.iter().map(Part::new).collect::<Result<Vec<_>, _>>();
        let parts = parts.map_err(|error| Failure::usage(error.to_string()))?;
        let channels = parts.iter().map(|part| part.monitors.len()).sum();
        Ok(Detector { parts, readings: vec![Reading::default(); channels], row: Step(0) })
    }

    /// Takes the next row; `None` is a gap.
    pub(super) fn take(&mut self, values: Option<&[f64]>) -> &[Reading] {
        let mut begin = 0;
        for part in &mut self.parts {
            let channels = begin..begin + part.monitors.len();
            begin = channels.end;
            let readings = &mut self.readings[channels.clone()];
            match values {
                Some(values) => part.take(self.row, &values[channels], readings),
                None => part.gap(readings),
            }
        }
        self.row = self.row.plus(1);
        &self.readings
    }
}

/// The channels of a group, watched exactly as a diagnoser watches its own.
struct Part {
    bank: DivergenceBank,
    monitors: Vec<Monitor>,
}

impl Part {
    fn new(group: &Group) -> Result<Part, SettingsError> {
        let prior_scatters: Vec<f64> =
            group.channels.iter().map(|tuning| tuning.prior_scatter).collect();
        let monitors = group
            .channels
            .iter()
            .map(|channel| Monitor::new(channel.threshold, group.warm_up, group.quiet_steps));
        let monitors = monitors.collect();
        Ok(Part { bank: DivergenceBank::new(group.settings, &prior_scatters)?, monitors })
    }

    fn take(&mut self, row: Step, values: &[f64], readings: &mut [Reading]) {
        let outcomes = values.iter().zip(self.bank.push(values));
        let channels = readings.iter_mut().zip(&mut self.monitors);
        for ((reading, monitor), (&value, &outcome)) in channels.zip(outcomes) {
            monitor.observe(row, value, outcome);
            *reading = Reading {
                divergence: outcome.divergence(),
                change: monitor.is_active(),
                restarted: match outcome {
                    DivergenceOutcome::Restarted(violation) => Some(violation),
                    DivergenceOutcome::Undefined | DivergenceOutcome::Defined { .. } => None,
                },
            };
        }
    }

    /// A row without a sample neither begins nor ends a change.
    fn gap(&mut self, readings: &mut [Reading]) {
        self.bank.gap();
        for (reading, monitor) in readings.iter_mut().zip(&self.monitors) {
            *reading = Reading { change: monitor.is_active(), ..Reading::default() };
        }
    }
}
