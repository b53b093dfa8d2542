//! Means of a module's measurements over windows that begin and end at the same steps in every module.
//!
//! A channel that lacked more than a tenth of its values in a window has no mean in it. The scatter of a gage is the
//! variance of its white noise: a sixth of the mean square of the residual's second differences, in which the
//! structure's slow motion leaves nothing.

use std::collections::VecDeque;

use vocabulary::{CylinderMeans, GageMeans, Step, WindowLength, WindowMeans};

/// Windows that are kept, for peers that ask late.
const KEPT: usize = 8;
/// Share of the values that a mean needs at least.
const LEAST_SHARE: f64 = 0.9;

/// What the Gaussian of a cylinder is of: tracking residual, oil content; and what they depend on, force and its rate.
pub(super) fn cylinder_values(means: &CylinderMeans) -> [f64; 4] {
    [means.tracking_n, means.content_pa, means.force_n, means.rate_n_per_s]
}

/// What a module measures at one step; without a number where a channel has no usable value.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MeasuredStep<'a> {
    /// Residuals of the actuators \[N\], then of the gages \[m\].
    pub(crate) residuals: &'a [f64],
    /// Observed forces \[N\].
    pub(crate) forces_n: &'a [f64],
    /// Oil contents \[Pa\].
    pub(crate) contents_pa: &'a [f64],
}

/// A sum of so many values.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Sum {
    sum: f64,
    count: u64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        if value.is_finite() {
            self.sum += value;
            self.count += 1;
        }
    }

    fn less(self, other: Sum) -> Sum {
        Sum { sum: self.sum - other.sum, count: self.count - other.count }
    }

    fn mean(self, least: u64) -> Option<f64> {
        (self.count >= least).then(|| self.sum / self.count as f64)
    }
}

/// Collects windows of one length, step by step. Allocates nothing after it was made.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct MeansCollector {
    length: WindowLength,
    window_steps: u64,
    /// The present window: steps since the run's beginning over a window's length.
    number: u64,
    /// It has begun and has not ended.
    is_open: bool,
    cylinders: Vec<[Sum; 3]>,
    /// The forces of the first half.
    early: Vec<Sum>,
    gages: Vec<[Sum; 3]>,
    /// The residuals of each gage at the two steps before.
    before: Vec<[f64; 2]>,
    last_step: Option<Step>,
    /// Complete windows, oldest first.
    kept: VecDeque<WindowMeans>,
    spare: Vec<WindowMeans>,
}

impl MeansCollector {
    pub(crate) fn new(
        length: WindowLength,
        window_steps: u64,
        actuators: usize,
        gages: usize,
    ) -> Self {
        let empty = WindowMeans {
            length,
            until: Step(0),
            gages: vec![None; gages],
            cylinders: vec![None; actuators],
        };
        Self {
            length,
            window_steps: window_steps.max(2),
            number: 0,
            is_open: false,
            cylinders: vec![[Sum::default(); 3]; actuators],
            early: vec![Sum::default(); actuators],
            gages: vec![[Sum::default(); 3]; gages],
            before: vec![[f64::NAN; 2]; gages],
            last_step: None,
            kept: VecDeque::with_capacity(KEPT),
            spare: vec![empty; KEPT],
        }
    }

    /// Forgets everything: another run begins, or the models do.
    pub(crate) fn restart(&mut self) {
        self.begin(0);
        self.spare.extend(self.kept.drain(..));
        self.before.fill([f64::NAN; 2]);
        self.last_step = None;
    }

    /// Takes what was measured at a step. Did a window end with it, or before it, its last samples lost?
    pub(crate) fn take(&mut self, step: Step, measured: MeasuredStep<'_>) -> bool {
        let number = step.0 / self.window_steps;
        let mut ended = false;
        if number != self.number {
            if self.is_open {
                ended = true;
                self.close();
            }
            self.begin(number);
        }
        self.is_open = true;
        if self.last_step.is_none_or(|last| last.plus(1) != step) {
            self.before.fill([f64::NAN; 2]);
        }
        self.last_step = Some(step);
        self.add(measured);
        if step.0 % self.window_steps < self.window_steps / 2 {
            for (early, force) in self.early.iter_mut().zip(measured.forces_n) {
                early.add(*force);
            }
        }
        if (step.0 + 1).is_multiple_of(self.window_steps) {
            ended = true;
            self.close();
        }
        ended
    }

    fn begin(&mut self, number: u64) {
        self.number = number;
        self.is_open = false;
        self.cylinders.fill([Sum::default(); 3]);
        self.early.fill(Sum::default());
        self.gages.fill([Sum::default(); 3]);
    }

    fn add(&mut self, MeasuredStep { residuals, forces_n, contents_pa }: MeasuredStep<'_>) {
        let (tracking_n, residuals_m) = residuals.split_at(self.cylinders.len());
        let values = forces_n.iter().zip(tracking_n).zip(contents_pa);
        for ([force, tracking, content], ((force_n, tracking_n), content_pa)) in
            self.cylinders.iter_mut().zip(values)
        {
            force.add(*force_n);
            tracking.add(*tracking_n);
            content.add(*content_pa);
        }
        let gages = self.gages.iter_mut().zip(&mut self.before);
        for (([residual, square, scatter], before), now) in gages.zip(residuals_m) {
            residual.add(*now);
            square.add(now * now);
            let [older, newer] = *before;
            let second = now - 2.0 * newer + older;
            scatter.add(second * second / 6.0);
            *before = [newer, *now];
        }
    }

    fn close(&mut self) {
        let oldest = if self.kept.len() == KEPT { self.kept.pop_front() } else { None };
        let Some(mut means) = oldest.or_else(|| self.spare.pop()) else { return };
        let least = (LEAST_SHARE * self.window_steps as f64) as u64;
        means.until = Step((self.number + 1) * self.window_steps - 1);
        let half_s = 0.5 * self.length.seconds();
        let cylinders = means.cylinders.iter_mut().zip(&self.cylinders).zip(&self.early);
        for ((means, [force, tracking, content]), early) in cylinders {
            let halves = early.mean(least / 3).zip(force.less(*early).mean(least / 3));
            let all = (force.mean(least), halves, tracking.mean(least), content.mean(least));
            *means = match all {
                (Some(force_n), Some((early_n, late_n)), Some(tracking_n), Some(content_pa)) => {
                    let rate_n_per_s = (late_n - early_n) / half_s;
                    Some(CylinderMeans { force_n, rate_n_per_s, tracking_n, content_pa })
                }
                _ => None,
            };
        }
        for (means, [residual, square, scatter]) in means.gages.iter_mut().zip(&self.gages) {
            // A missing sample costs three second differences.
            let all = (residual.mean(least), square.mean(least), scatter.mean(least / 2));
            *means = match all {
                (Some(residual_m), Some(square_m2), Some(scatter_m2)) => {
                    let swing_m2 = (square_m2 - residual_m * residual_m).max(0.0);
                    Some(GageMeans { residual_m, scatter_m2, swing_m2 })
                }
                _ => None,
            };
        }
        self.kept.push_back(means);
        self.begin(self.number + 1);
    }

    /// The latest window that has ended.
    pub(crate) fn latest(&self) -> Option<&WindowMeans> {
        self.kept.back()
    }

    /// The windows that are still kept, the latest first.
    pub(crate) fn latest_first(&self) -> impl Iterator<Item = &WindowMeans> {
        self.kept.iter().rev()
    }

    /// The window that ended at a step, if it is still kept.
    pub(crate) fn ended_at(&self, step: Step) -> Option<&WindowMeans> {
        self.kept.iter().find(|window| window.until == step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Windows of a hundred steps; one cylinder and one gage, whose values follow from the step.
    fn windows(steps: impl Iterator<Item = u64>) -> (MeansCollector, Vec<u64>) {
        let mut windows = MeansCollector::new(WindowLength::Long, 100, 1, 1);
        let mut ends = Vec::new();
        for step in steps {
            let value = step as f64;
            let measured = MeasuredStep {
                residuals: &[2.0 * value, if step % 2 == 0 { 1.0 } else { -1.0 }],
                forces_n: &[value],
                contents_pa: &[7.0],
            };
            let ended = windows.take(Step(step), measured);
            ends.extend(windows.latest().filter(|_| ended).map(|window| window.until.0));
        }
        (windows, ends)
    }

    #[test]
    fn means_are_those_of_the_steps_of_a_window() {
        let (windows, ends) = windows(0..2000);
        assert_eq!(ends, (0..20).map(|number| 100 * number + 99).collect::<Vec<_>>());
        assert_eq!(windows.ended_at(Step(99)), None);
        let means = windows.ended_at(Step(1299)).unwrap();
        let expected = CylinderMeans {
            force_n: 1249.5,
            rate_n_per_s: 100.0,
            tracking_n: 2499.0,
            content_pa: 7.0,
        };
        assert_eq!(means.cylinders, [Some(expected)]);
        // Readings that go up and down by 2 have second differences of 4.
        let gage = means.gages[0].unwrap();
        assert_eq!(gage.residual_m, 0.0);
        assert!((gage.scatter_m2 - 16.0 / 6.0).abs() < 1e-12 && gage.swing_m2 == 1.0);
    }

    #[test]
    fn a_window_that_begins_anywhere_ends_where_all_do() {
        let (windows, ends) = windows(1234..1460);
        assert_eq!(ends, [1299, 1399]);
        assert!(windows.ended_at(Step(1299)).unwrap().cylinders[0].is_none());
        assert_eq!(windows.ended_at(Step(1399)).unwrap().cylinders[0].unwrap().force_n, 1349.5);
    }

    #[test]
    fn a_missing_sample_leaves_a_mean_and_many_leave_none() {
        let (few, _) = windows((0..200).filter(|step| *step != 149 && *step != 155));
        let means = few.ended_at(Step(199)).unwrap();
        assert!((means.cylinders[0].unwrap().force_n - (14950.0 - 304.0) / 98.0).abs() < 1e-9);
        let (many, _) = windows((0..200).filter(|step| !(141..153).contains(step)));
        assert_eq!(many.ended_at(Step(199)).unwrap().cylinders, [None]);
    }

    #[test]
    fn a_window_ends_though_its_last_samples_are_lost() {
        let (windows, ends) = self::windows((0..250).filter(|step| *step != 199));
        assert_eq!(ends, [99, 199]);
        let means = windows.ended_at(Step(199)).unwrap();
        assert!((means.cylinders[0].unwrap().force_n - (14950.0 - 199.0) / 99.0).abs() < 1e-9);
        let (windows, ends) = self::windows((0..520).filter(|step| !(150..510).contains(step)));
        assert_eq!(ends, [99, 199]);
        assert_eq!(windows.ended_at(Step(199)).unwrap().cylinders, [None]);
        let (windows, ends) = self::windows([120, 299].into_iter());
        assert_eq!(ends, [299], "the later of two");
        assert_eq!(windows.ended_at(Step(199)).unwrap().gages, [None]);
    }

    #[test]
    fn a_value_that_is_none_costs_its_own_channel() {
        let mut windows = MeansCollector::new(WindowLength::Short, 100, 1, 2);
        for step in 0..100 {
            let measured = MeasuredStep {
                residuals: &[0.0, f64::NAN, 1.0],
                forces_n: &[0.0],
                contents_pa: &[0.0],
            };
            windows.take(Step(step), measured);
        }
        let means = windows.ended_at(Step(99)).unwrap();
        assert!(means.gages[0].is_none() && means.gages[1].is_some());
    }
}
