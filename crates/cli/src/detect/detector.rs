//! The divergences of all channels and what the thresholds make of them.

use diagnosis::Monitor;
use diagnosis::divergence::{DivergenceBank, DivergenceOutcome, SettingsError, Violation};
use serde::Serialize;
use vocabulary::Step;

use super::channels::{ChannelGroup, DetectionPlan};
use crate::failure::Failure;

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct ChannelReading {
    /// The divergence; `None` while undefined.
    pub(super) divergence: Option<f64>,
    /// Has the divergence risen to the threshold, after the warm-up, and not become quiet since?
    pub(super) change: bool,
    /// The channel was restarted.
    #[serde(skip)]
    pub(super) restarted: Option<Violation>,
}

/// The detector of all channels.
pub(super) struct TableDetector {
    groups: Vec<GroupDetector>,
    readings: Vec<ChannelReading>,
    row: Step,
}

impl TableDetector {
    pub(super) fn new(plan: &DetectionPlan) -> Result<TableDetector, Failure> {
        let groups = plan.groups.iter().map(GroupDetector::new).collect::<Result<Vec<_>, _>>();
        let groups = groups.map_err(|error| Failure::usage(error.to_string()))?;
        let channels = groups.iter().map(|group| group.monitors.len()).sum();
        Ok(TableDetector {
            groups,
            readings: vec![ChannelReading::default(); channels],
            row: Step(0),
        })
    }

    /// Takes the next row; `None` is a gap.
    pub(super) fn take(&mut self, values: Option<&[f64]>) -> &[ChannelReading] {
        let mut begin = 0;
        for group in &mut self.groups {
            let channels = begin..begin + group.monitors.len();
            begin = channels.end;
            let readings = &mut self.readings[channels.clone()];
            match values {
                Some(values) => group.take(self.row, &values[channels], readings),
                None => group.gap(readings),
            }
        }
        self.row = self.row.plus(1);
        &self.readings
    }
}

/// The channels of a group, watched exactly as a diagnoser watches its own.
struct GroupDetector {
    bank: DivergenceBank,
    monitors: Vec<Monitor>,
}

impl GroupDetector {
    fn new(group: &ChannelGroup) -> Result<GroupDetector, SettingsError> {
        let prior_scatters: Vec<f64> =
            group.channels.iter().map(|tuning| tuning.prior_scatter).collect();
        let monitors = group
            .channels
            .iter()
            .map(|channel| Monitor::new(channel.threshold, group.warm_up, group.quiet_steps));
        let monitors = monitors.collect();
        Ok(GroupDetector { bank: DivergenceBank::new(group.settings, &prior_scatters)?, monitors })
    }

    fn take(&mut self, row: Step, values: &[f64], readings: &mut [ChannelReading]) {
        let outcomes = values.iter().zip(self.bank.push(values));
        let channels = readings.iter_mut().zip(&mut self.monitors);
        for ((reading, monitor), (&value, &outcome)) in channels.zip(outcomes) {
            monitor.observe(row, value, outcome);
            *reading = ChannelReading {
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
    fn gap(&mut self, readings: &mut [ChannelReading]) {
        self.bank.gap();
        for (reading, monitor) in readings.iter_mut().zip(&self.monitors) {
            *reading = ChannelReading { change: monitor.is_active(), ..ChannelReading::default() };
        }
    }
}
