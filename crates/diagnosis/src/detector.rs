//! The change detector alone, on rows of numbers: the divergences of all channels and what the thresholds make of them.

use std::ops::Range;

use serde::Serialize;
use vocabulary::Step;

use crate::divergence::{
    DivergenceBank, DivergenceOutcome, DivergenceSettings, SettingsError, Violation,
};
use crate::monitor::{Monitor, Observation};
use crate::residual::longest_gap_of_structure;
use crate::settings::ModuleSetup;

/// Channels that share a bank, and its arithmetic, until one of them has a gap of its own.
const TOGETHER: usize = 4;

/// How one channel is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// ε, in squared units of the channel.
    pub prior_scatter: f64,
    /// γ; infinite if nothing is to count as a change.
    pub threshold: f64,
}

/// What becomes of a channel that has had no value for some steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GapRule {
    /// Up to so many missing values are filled in, on a straight line.
    pub longest_filled: u64,
    /// After more than so many the channel is learnt anew. In between, no window is formed across the gap.
    pub longest_bridged: u64,
}

impl GapRule {
    /// No window is formed across any gap.
    pub const OPEN: GapRule = GapRule { longest_filled: 0, longest_bridged: u64::MAX };
}

/// Channels that have their settings in common; they stand side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelGroup {
    /// Window, lag and interval.
    pub settings: DivergenceSettings,
    /// Vectors that must have been taken before a change counts.
    pub warm_up: u64,
    /// Rows below the threshold after which a change has ended.
    pub quiet_steps: u64,
    /// What becomes of gaps.
    pub gaps: GapRule,
    /// Is a change that leaves the interval told from one that enters it?
    pub marks_leaving: bool,
    /// Each channel.
    pub channels: Vec<Tuning>,
}

impl ChannelGroup {
    /// The channels of a module, watched as its diagnoser does it, in the order of [`ModuleSetup::components`].
    #[must_use]
    pub fn of_module(setup: &ModuleSetup) -> ChannelGroup {
        let tunings = setup.prior_scatters().into_iter().zip(&setup.thresholds);
        let channels = tunings
            .map(|(prior_scatter, &threshold)| Tuning { prior_scatter, threshold })
            .collect();
        ChannelGroup {
            settings: setup.detection.divergence,
            warm_up: setup.detection.warm_up_vectors,
            quiet_steps: setup.isolation.quiet_steps,
            gaps: GapRule {
                longest_filled: setup.isolation.tie_steps,
                longest_bridged: longest_gap_of_structure(setup.step_s),
            },
            // A diagnoser leaves that to its isolation.
            marks_leaving: false,
            channels,
        }
    }
}

/// One channel at one row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ChannelReading {
    /// The divergence; `None` while undefined.
    pub divergence: Option<f64>,
    /// Has the divergence risen to the threshold, after the warm-up, and not become quiet since?
    pub change: bool,
    /// An earlier change that leaves the interval causes this one, not the new samples.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub leaving: bool,
    /// The channel was restarted.
    #[serde(skip)]
    pub restarted: Option<Violation>,
}

/// The detector of all channels.
#[derive(Debug, Clone)]
pub struct TableDetector {
    groups: Vec<GroupDetector>,
    readings: Vec<ChannelReading>,
    row: Step,
}

impl TableDetector {
    /// A detector of all channels of these groups, one group after the other.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn new(groups: &[ChannelGroup]) -> Result<TableDetector, SettingsError> {
        let groups: Vec<GroupDetector> =
            groups.iter().map(GroupDetector::new).collect::<Result<_, _>>()?;
        let channels = groups.iter().map(|group| group.monitors.len()).sum();
        Ok(TableDetector {
            groups,
            readings: vec![ChannelReading::default(); channels],
            row: Step(0),
        })
    }

    /// Takes the next row, its step and a value for each channel, NaN for none; `None` is a bad row.
    pub fn take(&mut self, row: Option<(u64, &[f64])>) -> &[ChannelReading] {
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
#[derive(Debug, Clone)]
struct GroupDetector {
    gaps: GapRule,
    banks: Vec<ChannelBank>,
    monitors: Vec<Monitor>,
    /// Is a change told from one that leaves the interval?
    marks_leaving: bool,
    /// Whether samples that leave the interval cause the present change of each channel.
    leaving: Vec<bool>,
    /// The latest value of each channel.
    latest: Vec<f64>,
}

/// Channels that had their values and gaps at the same steps.
#[derive(Debug, Clone)]
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
            marks_leaving: group.marks_leaving,
            leaving: vec![false; group.channels.len()],
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
        let GroupDetector { gaps, banks, monitors, marks_leaving, leaving, latest } = self;
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
                bank.fill(|channel| latest[channel] + share * (values[channel] - latest[channel]));
                bank.bank.push(&bank.sample);
            }
        }
        bank.fill(|channel| values[channel]);
        bank.bank.push(&bank.sample);
        for (place, channel) in bank.channels.clone().enumerate() {
            if bank.taken_over[place] {
                continue;
            }
            let outcome = bank.bank.outcomes()[place];
            latest[channel] = values[channel];
            let monitor = &mut monitors[channel];
            let begins = matches!(
                monitor.observe(row, values[channel], outcome),
                Observation::Changed { .. }
            );
            if *marks_leaving && (begins || leaving[channel]) {
                let [entering, left] = bank.bank.parts(place);
                // It stays one until it ends, unless something enters that is a change by itself.
                let is_more = left > entering || !begins;
                let is_change = entering >= monitor.evidence().threshold;
                leaving[channel] = monitor.is_active() && is_more && !is_change;
            }
            readings[channel] = ChannelReading {
                divergence: outcome.divergence(),
                change: monitor.is_active(),
                leaving: leaving[channel],
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

    /// Sets the sample to a value of each own channel.
    fn fill(&mut self, value: impl Fn(usize) -> f64) {
        let own = self.channels.clone().zip(&self.taken_over);
        for (sample, (channel, taken_over)) in self.sample.iter_mut().zip(own) {
            *sample = if *taken_over { 0.0 } else { value(channel) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::divergence::Interval;

    const INTERVAL: usize = 2000;

    /// Numbers with about the normal distribution.
    fn normal(count: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    /// Rows at which a change begins, each with whether it is one that leaves the interval.
    fn changes(values: &[f64]) -> Vec<(usize, bool)> {
        let group = ChannelGroup {
            settings: DivergenceSettings {
                window: 10,
                lag: 10,
                interval: Interval::Sliding { vectors: INTERVAL },
            },
            warm_up: 300,
            quiet_steps: 40,
            gaps: GapRule::OPEN,
            marks_leaving: true,
            channels: vec![Tuning { prior_scatter: 1.0, threshold: 0.25 }],
        };
        let mut detector = TableDetector::new(&[group]).unwrap();
        let mut before = ChannelReading::default();
        let mut found = Vec::new();
        for (row, value) in values.iter().enumerate() {
            let reading = detector.take(Some((row as u64, &[*value])))[0];
            if reading.change && (!before.change || before.leaving != reading.leaving) {
                found.push((row, reading.leaving));
            }
            before = reading;
        }
        found
    }

    fn is_near(row: usize, to: usize) -> bool {
        row.abs_diff(to) < 60
    }

    #[test]
    fn neither_the_begin_nor_the_end_of_a_fault_is_a_change_when_it_leaves_the_interval() {
        for (size, length) in [(10.0, 200), (4.0, 200), (10.0, 1000), (100.0, 60), (60.0, 1)] {
            let mut values = normal(6000);
            let end = 500 + length;
            values[500..end].iter_mut().for_each(|value| *value += size);
            let found = changes(&values);
            println!("{size} for {length} rows: {found:?}");
            let leaves = found.iter().any(|(row, leaving)| *leaving && *row > INTERVAL);
            assert!(leaves || length != 200 || size < 10.0, "{found:?}");
            let counted: Vec<usize> =
                found.iter().filter(|(_, leaving)| !leaving).map(|(row, _)| *row).collect();
            assert!(is_near(counted[0], 505), "{counted:?}");
            assert!(counted[1..].iter().all(|row| is_near(*row, end)), "{counted:?}");
        }
    }

    #[test]
    fn a_change_is_one_though_another_leaves_the_interval_meanwhile() {
        for begin in [2480, 2500, 2520, 2690, 2705] {
            let mut values = normal(4000);
            values[500..700].iter_mut().for_each(|value| *value += 10.0);
            values[begin..].iter_mut().for_each(|value| *value += 30.0);
            let found = changes(&values);
            println!("{begin}: {found:?}");
            let is_found =
                |(row, leaving): &(usize, bool)| !leaving && (begin..begin + 20).contains(row);
            assert!(found.iter().any(is_found), "{begin}: {found:?}");
        }
    }

    #[test]
    fn what_stays_changed_changes_once() {
        let mut values = normal(6000);
        values[1000..].iter_mut().for_each(|value| *value += 10.0);
        let found = changes(&values);
        println!("{found:?}");
        assert!(found.iter().filter(|(_, leaving)| !leaving).count() == 1, "{found:?}");
    }
}
