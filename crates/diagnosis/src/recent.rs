//! What a module measured in the latest seconds, step by step, and in the latest minutes, second by second.

use std::collections::VecDeque;

use vocabulary::Step;

use crate::channels::ChannelLayout;
use crate::sample::Measurements;
use crate::settings::Sampling;

/// How long single steps are kept \[s\].
const STEPS_S: f64 = 6.0;
/// How many seconds are kept.
const SECONDS: usize = 600;
/// Share of a second's steps that its means need.
const LEAST_SHARE: f64 = 0.9;

/// A row of values with the step that it belongs to; NaN for unusable values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row<'a> {
    pub(crate) step: Step,
    values: &'a [f64],
    layout: ChannelLayout,
}

impl Row<'_> {
    /// Gage residuals \[m\].
    pub(crate) fn residuals_m(&self) -> &[f64] {
        &self.values[..self.layout.gages]
    }

    /// What the gages read \[m\].
    pub(crate) fn readings_m(&self) -> &[f64] {
        &self.values[self.layout.gages..2 * self.layout.gages]
    }

    /// Observed forces \[N\].
    pub(crate) fn forces_n(&self) -> &[f64] {
        &self.values[2 * self.layout.gages..2 * self.layout.gages + self.layout.actuators]
    }

    /// The demand on an actuator \[N\].
    pub(crate) fn demand_n(&self, actuator: usize) -> f64 {
        self.values[2 * self.layout.gages + self.layout.actuators + actuator]
    }

    /// Its pressures \[Pa\].
    pub(crate) fn pressures_pa(&self, actuator: usize) -> [f64; 2] {
        let place = 2 * (self.layout.gages + self.layout.actuators + actuator);
        [self.values[place], self.values[place + 1]]
    }

    /// The residual of a channel, in its unit: cylinders first, then gages.
    pub(crate) fn residual(&self, channel: usize) -> f64 {
        match self.layout.gage(channel) {
            Some(gage) => self.residuals_m()[gage],
            None => self.values[self.measured() + channel],
        }
    }

    /// The divergence of a channel.
    pub(crate) fn divergence(&self, channel: usize) -> f64 {
        self.values[self.measured() + self.layout.actuators + channel]
    }

    /// How many values come before those that were only computed.
    fn measured(&self) -> usize {
        2 * self.layout.gages + 4 * self.layout.actuators
    }
}

/// The latest steps and seconds of a module. Allocates nothing after it was made.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Recent {
    layout: ChannelLayout,
    width: usize,
    most: usize,
    steps: VecDeque<Step>,
    values: Vec<f64>,
    /// Where the next row goes.
    next: usize,
    second_steps: u64,
    sums: Vec<f64>,
    count: u64,
    second: u64,
    seconds: VecDeque<(Step, Vec<f64>)>,
    spare: Vec<Vec<f64>>,
}

impl Recent {
    pub(crate) fn new(layout: ChannelLayout, sampling: Sampling) -> Self {
        let ChannelLayout { actuators, gages } = layout;
        let width = 3 * gages + 6 * actuators;
        let most = sampling.steps(STEPS_S) as usize;
        let means = 2 * gages + actuators;
        Self {
            layout,
            width,
            most,
            steps: VecDeque::with_capacity(most),
            values: vec![f64::NAN; width * most],
            next: 0,
            second_steps: sampling.steps(1.0),
            sums: vec![0.0; means],
            count: 0,
            second: 0,
            seconds: VecDeque::with_capacity(SECONDS),
            spare: (0..SECONDS).map(|_| vec![0.0; means]).collect(),
        }
    }

    /// Forgets everything: another run begins.
    pub(crate) fn restart(&mut self) {
        self.steps.clear();
        self.next = 0;
        self.count = 0;
        self.sums.fill(0.0);
        self.spare.extend(self.seconds.drain(..).map(|(_, means)| means));
    }

    /// Takes a step: residuals of the cylinders \[N\] and the gages \[m\], and observed forces \[N\], not numbers where they
    /// cannot be used.
    pub(crate) fn take(&mut self, sample: &Measurements, residuals: &[f64], forces_n: &[f64]) {
        self.end_second(sample.step);
        if self.steps.len() == self.most {
            self.steps.pop_front();
        }
        self.steps.push_back(sample.step);
        let row = &mut self.values[self.next * self.width..(self.next + 1) * self.width];
        self.next = (self.next + 1) % self.most;
        let (residuals_n, residuals_m) = residuals.split_at(self.layout.actuators);
        let (of_gages, of_cylinders) = row.split_at_mut(2 * self.layout.gages);
        let (of_cylinders, computed) = of_cylinders.split_at_mut(4 * self.layout.actuators);
        computed[..self.layout.actuators].copy_from_slice(residuals_n);
        computed[self.layout.actuators..].fill(f64::NAN);
        let (residuals, readings) = of_gages.split_at_mut(self.layout.gages);
        residuals.copy_from_slice(residuals_m);
        readings.copy_from_slice(&sample.elongations_m);
        let (forces, rest) = of_cylinders.split_at_mut(self.layout.actuators);
        let (demands, pressures) = rest.split_at_mut(self.layout.actuators);
        forces.copy_from_slice(forces_n);
        demands.copy_from_slice(&sample.demands_n);
        for (place, both) in pressures.chunks_exact_mut(2).zip(&sample.pressures_pa) {
            place.copy_from_slice(both);
        }
        let means = self.sums.len();
        for (sum, value) in self.sums.iter_mut().zip(&row[..means]) {
            *sum += value;
        }
        self.count += 1;
    }

    /// The divergences at the step that was taken last, in the order of the channels; not numbers while undefined.
    pub(crate) fn take_divergences(&mut self, divergences: impl Iterator<Item = f64>) {
        if self.steps.is_empty() {
            return;
        }
        let place = (self.next + self.most - 1) % self.most;
        let row = &mut self.values[place * self.width..(place + 1) * self.width];
        let channels = self.layout.channels();
        for (place, divergence) in row[self.width - channels..].iter_mut().zip(divergences) {
            *place = divergence;
        }
    }

    fn end_second(&mut self, step: Step) {
        let second = step.0 / self.second_steps;
        if second == self.second {
            return;
        }
        let least = (LEAST_SHARE * self.second_steps as f64) as u64;
        if self.count >= least {
            let oldest =
                (self.seconds.len() == SECONDS).then(|| self.seconds.pop_front()).flatten();
            let kept = oldest.map(|(_, means)| means).or_else(|| self.spare.pop());
            if let Some(mut means) = kept {
                for (mean, sum) in means.iter_mut().zip(&self.sums) {
                    *mean = sum / self.count as f64;
                }
                let until = Step((self.second + 1) * self.second_steps - 1);
                self.seconds.push_back((until, means));
            }
        }
        self.second = second;
        self.count = 0;
        self.sums.fill(0.0);
    }

    /// The kept steps within a range, oldest first.
    pub(crate) fn rows(&self, from: Step, until: Step) -> impl Iterator<Item = Row<'_>> {
        let oldest = (self.next + self.most - self.steps.len()) % self.most;
        let begin = self.steps.partition_point(|step| *step < from);
        let end = self.steps.partition_point(|step| *step <= until);
        (begin..end.max(begin)).map(move |k| {
            let place = (oldest + k) % self.most;
            Row {
                step: self.steps[k],
                values: &self.values[place * self.width..(place + 1) * self.width],
                layout: self.layout,
            }
        })
    }

    /// The kept seconds that ended within a range, oldest first: means of residuals, readings and forces.
    pub(crate) fn seconds(&self, until: Step) -> impl Iterator<Item = (Step, Row<'_>)> {
        let ended = self.seconds.iter().take_while(move |(end, _)| *end <= until);
        ended.map(|(end, means)| (*end, Row { step: *end, values: means, layout: self.layout }))
    }
}
