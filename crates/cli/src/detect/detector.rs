//! The divergences of all channels and what the thresholds make of them.

use std::ops::Range;

use diagnosis::Monitor;
use diagnosis::divergence::{DivergenceBank, DivergenceOutcome, SettingsError, Violation};
use serde::Serialize;
use vocabulary::Step;

use super::channels::{ChannelGroup, DetectionPlan, GapRule};
use super::leaving::Leaving;
use crate::failure::Failure;

/// Channels that share a bank, and its arithmetic, until one of them has a gap of its own.
const TOGETHER: usize = 4;

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub(super) struct ChannelReading {
    /// The divergence; `None` while undefined.
    pub(super) divergence: Option<f64>,
    /// Has the divergence risen to the threshold, after the warm-up, and not become quiet since?
    pub(super) change: bool,
    /// An earlier change is leaving the interval, which looks like another one.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) leaving: bool,
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
        let groups: Vec<GroupDetector> =
            groups.map_err(|error| Failure::usage(error.to_string()))?;
        let channels = groups.iter().map(|group| group.monitors.len()).sum();
        Ok(TableDetector {
            groups,
            readings: vec![ChannelReading::default(); channels],
            row: Step(0),
        })
    }

    /// Takes the next row, its step and a value for each channel, NaN for none; `None` is a bad row.
    pub(super) fn take(&mut self, row: Option<(u64, &[f64])>) -> &[ChannelReading] {
        let mut begin = 0;
        for group in &mut self.groups {
            let channels = begin..begin + group.monitors.len();
            begin = channels.end;
            let readings = &mut self.readings[channels.clone()];
            for (reading, monitor) in readings.iter_mut().zip(&group.monitors) {
                // A row without a value neither begins nor ends a change.
                *reading =
                    ChannelReading { change: monitor.is_active(), ..ChannelReading::default() };
            }
            if let Some((step, values)) = row {
                group.take(self.row, step, &values[channels], readings);
            }
        }
        self.row = self.row.plus(1);
        &self.readings
    }
}

/// The channels of a group, watched exactly as a diagnoser watches its own.
struct GroupDetector {
    gaps: GapRule,
    banks: Vec<ChannelBank>,
    monitors: Vec<Monitor>,
    leaving: Vec<Leaving>,
    /// The latest value of each channel.
    latest: Vec<f64>,
}

/// Channels that had their values and gaps at the same steps.
#[derive(Clone)]
struct ChannelBank {
    bank: DivergenceBank,
    /// Its channels' place in the group, some of which other banks have taken over.
    channels: Range<usize>,
    taken_over: Vec<bool>,
    /// The latest step with values.
    last: Option<u64>,
    sample: Vec<f64>,
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
        let bank = |number: usize, scatters: &[f64]| {
            let begin = number * TOGETHER;
            Ok(ChannelBank {
                bank: DivergenceBank::new(group.settings, scatters)?,
                channels: begin..begin + scatters.len(),
                taken_over: vec![false; scatters.len()],
                last: None,
                sample: vec![0.0; scatters.len()],
            })
        };
        // Settings are checked even if there are no channels.
        group.settings.check()?;
        let chunks = prior_scatters.chunks(TOGETHER).enumerate();
        let banks = chunks.map(|(number, scatters)| bank(number, scatters));
        Ok(GroupDetector {
            gaps: group.gaps,
            banks: banks.collect::<Result<_, _>>()?,
            monitors,
            leaving: group.channels.iter().map(|tuning| Leaving::new(group, tuning)).collect(),
            latest: vec![0.0; group.channels.len()],
        })
    }

    fn take(&mut self, row: Step, step: u64, values: &[f64], readings: &mut [ChannelReading]) {
        let mut number = 0;
        while let Some(bank) = self.banks.get_mut(number) {
            number += 1;
            let has_value = |channel: &usize| values[*channel].is_finite();
            if !bank.own().any(|channel| has_value(&channel)) {
                continue;
            }
            if !bank.own().all(|channel| has_value(&channel)) {
                let without = bank.split_off(values);
                self.banks.push(without);
            }
            self.push(number - 1, row, step, values, readings);
        }
    }

    /// Gives a bank the values of all its channels.
    fn push(
        &mut self,
        number: usize,
        row: Step,
        step: u64,
        values: &[f64],
        readings: &mut [ChannelReading],
    ) {
        let GroupDetector { gaps, banks, monitors, leaving, latest } = self;
        let bank = &mut banks[number];
        let missing = bank.last.map_or(0, |last| step.saturating_sub(last + 1));
        bank.last = Some(step);
        if missing > gaps.longest_bridged {
            bank.bank.restart();
            bank.own().for_each(|channel| monitors[channel].relearn());
        } else if missing > gaps.longest_filled {
            bank.bank.gap();
        } else {
            for place in 1..=missing {
                let share = place as f64 / (missing + 1) as f64;
                bank.push(|channel| latest[channel] + share * (values[channel] - latest[channel]));
            }
        }
        let channels = bank.channels.clone().zip(bank.taken_over.clone());
        let outcomes = bank.push(|channel| values[channel]);
        for ((channel, taken_over), &outcome) in channels.zip(outcomes) {
            if taken_over {
                continue;
            }
            latest[channel] = values[channel];
            let monitor = &mut monitors[channel];
            monitor.observe(row, values[channel], outcome);
            readings[channel] = ChannelReading {
                divergence: outcome.divergence(),
                change: monitor.is_active(),
                leaving: leaving[channel].observe(outcome, monitor.is_active()),
                restarted: match outcome {
                    DivergenceOutcome::Restarted(violation) => Some(violation),
                    DivergenceOutcome::Undefined | DivergenceOutcome::Defined { .. } => None,
                },
            };
        }
    }
}

impl ChannelBank {
    /// The channels that no other bank has taken over.
    fn own(&self) -> impl Iterator<Item = usize> {
        let channels = self.channels.clone().zip(&self.taken_over);
        channels.filter(|(_, taken_over)| !**taken_over).map(|(channel, _)| channel)
    }

    /// Another bank for the channels without a value at this row.
    fn split_off(&mut self, values: &[f64]) -> ChannelBank {
        let mut without = self.clone();
        let flags = self.taken_over.iter_mut().zip(&mut without.taken_over);
        for (channel, (here, there)) in self.channels.clone().zip(flags) {
            if values[channel].is_finite() {
                *there = true;
            } else {
                *here = true;
            }
        }
        without
    }

    /// Takes a value of each own channel.
    fn push(&mut self, value: impl Fn(usize) -> f64) -> &[DivergenceOutcome] {
        let own = self.channels.clone().zip(&self.taken_over);
        for (sample, (channel, taken_over)) in self.sample.iter_mut().zip(own) {
            *sample = if *taken_over { 0.0 } else { value(channel) };
        }
        self.bank.push(&self.sample)
    }
}
