//! The slow variation of disturbances: a daily course with clouds.

use std::f64::consts::TAU;

use rand::RngExt;

use crate::streams::Stream;

const DAY_S: f64 = 86_400.0;
const CLOUD_S: f64 = 1_800.0;
/// Share of the daily course; the remainder belongs to the clouds \[E\].
const OF_DAY: f64 = 0.8;

/// Interval at which slow quantities are evaluated \[s\]; they change by less than the sensors' noise meanwhile.
pub(crate) const INTERVAL_S: f64 = 0.1;

/// A value that varies between −1 and 1.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DayCourse {
    /// Phases of day and clouds \[turns\].
    phases: [f64; 2],
}

impl DayCourse {
    /// A course with random phases.
    pub(crate) fn draw(stream: Stream, seed: u64) -> Self {
        let mut generator = stream.generator(seed);
        Self { phases: [generator.random(), generator.random()] }
    }

    pub(crate) fn at(&self, time_s: f64) -> f64 {
        let [day, cloud] = self.phases;
        OF_DAY * (TAU * (time_s / DAY_S + day)).sin()
            + (1.0 - OF_DAY) * (TAU * (time_s / CLOUD_S + cloud)).sin()
    }
}

/// Counts the steps until slowly changing quantities are evaluated again.
#[derive(Debug, Clone)]
pub(crate) struct SlowClock {
    step_s: f64,
    steps_per_interval: u64,
    step: u64,
}

impl SlowClock {
    pub(crate) fn new(step_s: f64) -> Self {
        let steps = (INTERVAL_S / step_s).round() as u64;
        Self { step_s, steps_per_interval: steps.max(1), step: 0 }
    }

    /// Advances by one step; returns the time \[s\] if an evaluation is due, first after the first step.
    pub(crate) fn tick(&mut self) -> Option<f64> {
        self.step += 1;
        let due = self.step.is_multiple_of(self.steps_per_interval);
        due.then_some(self.step as f64 * self.step_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_course_repeats_after_a_day_stays_within_one_and_starts_anywhere() {
        let courses: Vec<_> =
            (0..200).map(|channel| DayCourse::draw(Stream::Temperature(channel), 3)).collect();
        for course in &courses {
            assert!((course.at(17.0) - course.at(17.0 + DAY_S)).abs() < 1e-9);
            let largest =
                (0..1000).map(|k| course.at(86.4 * f64::from(k)).abs()).fold(0.0, f64::max);
            assert!(largest <= 1.0 && largest > 0.9, "{largest}");
        }
        let mean = courses.iter().map(|course| course.at(0.0)).sum::<f64>() / 200.0;
        assert!(mean.abs() < 0.15, "{mean}");
    }

    #[test]
    fn the_clock_asks_ten_times_a_second() {
        let mut clock = SlowClock::new(1e-3);
        let times: Vec<f64> = (0..350).filter_map(|_| clock.tick()).collect();
        assert_eq!(times.len(), 3);
        assert!((times[0] - 0.1).abs() < 1e-12);
    }
}
