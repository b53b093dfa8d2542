//! A stroke test: one cylinder pushes and pulls while the demands of the others are constant.
//!
//! It shows every module the effect of each cylinder's force on its residuals, far beyond the forces that wind
//! requires. The demand swings smoothly: up to +F and back in the first half of the time, down to −F and back in the
//! second, F sin²(2πt/T). At both ends the controller's demands are blended with the constant ones. A reading or a
//! force beyond its limit ends the stroke at once, with the same blending.

use std::f64::consts::TAU;

use vocabulary::ComponentPath;

/// Duration of blending from and to the controller's demands \[s\].
const BLENDING_S: f64 = 0.5;

/// A stroke test of one cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct StrokeTest {
    /// The cylinder.
    pub actuator: ComponentPath,
    /// Largest change of its demand in either direction, F \[N\].
    pub force_n: f64,
    /// Duration, T \[s\].
    pub duration_s: f64,
    /// The stroke ends when the reading of a gage in the tower exceeds this strain in either direction \[–\].
    pub largest_strain: f64,
}

/// Why a stroke cannot be started; nothing was changed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StrokeError {
    /// A parameter is out of range.
    #[error("`{name}` of a stroke is {value}; use {expected}")]
    Figure {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is expected.
        expected: String,
    },
    /// Unknown cylinder.
    #[error("unknown actuator `{actuator}`: expected one of {known}")]
    Actuator {
        /// The requested cylinder.
        actuator: ComponentPath,
        /// The existing ones.
        known: String,
    },
    /// Another cylinder is performing its stroke.
    #[error("`{0}` is making its stroke; wait until it has ended")]
    Busy(ComponentPath),
}

impl StrokeTest {
    /// Checks the parameters against the largest demand \[N\].
    pub(crate) fn check(&self, demand_limit_n: f64) -> Result<(), StrokeError> {
        let within = |name, value: f64, least: f64, most: f64| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            Err(StrokeError::Figure { name, value, expected: format!("{least} to {most}") })
        };
        within("force_n", self.force_n, 1.0, demand_limit_n)?;
        within("duration_s", self.duration_s, 2.0, 600.0)?;
        within("largest_strain", self.largest_strain, 1e-6, 1e-3)
    }
}

/// A stroke in progress in one part of the plant.
#[derive(Debug, Clone)]
pub(crate) struct StrokeUnderWay {
    pub(crate) stroke: StrokeTest,
    /// The actuator's number in the part.
    actuator: usize,
    /// The controller's demands at the first step of the stroke \[N\].
    held_n: Vec<f64>,
    step_s: f64,
    steps: u64,
    /// The time when it was cut short \[s\], and the displacement of the demand at that time \[N\].
    cut: Option<(f64, f64)>,
}

impl StrokeUnderWay {
    /// A stroke of one of so many actuators, given by its number.
    pub(crate) fn new(stroke: StrokeTest, actuator: usize, actuators: usize, step_s: f64) -> Self {
        Self { stroke, actuator, held_n: vec![0.0; actuators], step_s, steps: 0, cut: None }
    }

    /// Replaces the controller's demands \[N\] of this step and advances; false when the stroke has ended. Readings are
    /// strains.
    pub(crate) fn step(
        &mut self,
        demands_n: &mut [f64],
        strains: impl Iterator<Item = f64>,
    ) -> bool {
        if self.steps == 0 {
            self.held_n.copy_from_slice(demands_n);
        }
        let largest = strains.fold(0.0, |largest: f64, strain| largest.max(strain.abs()));
        if largest > self.stroke.largest_strain && self.cut.is_none() {
            self.cut = Some((self.time_s(), self.moved_n()));
        }
        let (moved, held) = (self.moved_n(), self.held_share());
        for (actuator, (demand, held_n)) in demands_n.iter_mut().zip(&self.held_n).enumerate() {
            *demand += held * (held_n - *demand);
            if actuator == self.actuator {
                *demand += moved;
            }
        }
        self.steps += 1;
        self.time_s() < self.end_s()
    }

    /// The number of steps left.
    pub(crate) fn steps_left(&self) -> u64 {
        let end_s = self.end_s();
        let mut end = (end_s / self.step_s).floor() as u64;
        // The quotient is rounded; `step` compares the product.
        if end as f64 * self.step_s < end_s {
            end += 1;
        }
        end.saturating_sub(self.steps)
    }

    fn time_s(&self) -> f64 {
        self.steps as f64 * self.step_s
    }

    fn end_s(&self) -> f64 {
        self.cut.map_or(self.stroke.duration_s, |(since, _)| since + BLENDING_S)
    }

    /// The difference of the demand from the constant one \[N\].
    fn moved_n(&self) -> f64 {
        if let Some((since, moved_n)) = self.cut {
            return moved_n * fall((self.time_s() - since) / BLENDING_S);
        }
        let place = self.time_s() / self.stroke.duration_s;
        let sign = if place < 0.5 { 1.0 } else { -1.0 };
        sign * self.stroke.force_n * (TAU * place).sin().powi(2)
    }

    /// 1 while the constant demands apply, 0 while the controller's do.
    fn held_share(&self) -> f64 {
        let left_s = self.end_s() - self.time_s();
        fall(1.0 - self.time_s() / BLENDING_S).min(fall(1.0 - left_s / BLENDING_S))
    }
}

/// 1 up to 0, then smoothly down to 0 at 1.
fn fall(place: f64) -> f64 {
    let place = place.clamp(0.0, 1.0);
    1.0 - place * place * (3.0 - 2.0 * place)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn under_way() -> StrokeUnderWay {
        let stroke = StrokeTest {
            actuator: "module1/actuator/a2".parse().unwrap(),
            force_n: 50e3,
            duration_s: 8.0,
            largest_strain: 1e-4,
        };
        stroke.check(120e3).unwrap();
        StrokeUnderWay::new(stroke, 1, 2, 1e-3)
    }

    /// The demands while the controller asks for 1 and 2 kN at first, then for a newton more every ten steps.
    fn demands(stroke: &mut StrokeUnderWay, strain: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
        let mut all = Vec::new();
        loop {
            let asked = 0.1 * all.len() as f64;
            let mut demands = [1e3 + asked, 2e3 + asked];
            let goes_on = stroke.step(&mut demands, [strain(all.len())].into_iter());
            all.push(demands);
            if !goes_on {
                return all;
            }
        }
    }

    #[test]
    fn one_cylinder_goes_both_ways_smoothly_and_the_others_stand() {
        let all = demands(&mut under_way(), |_| 0.0);
        assert_eq!(all.len(), 8000);
        assert!((all[2000][1] - 52e3).abs() < 1e-6 && (all[6000][1] + 48e3).abs() < 1e-6);
        for pair in all.windows(2) {
            assert!((pair[1][1] - pair[0][1]).abs() < 50.0, "{pair:?}");
        }
        assert!(all[600..7400].iter().all(|demands| (demands[0] - 1e3).abs() < 1e-9));
        assert_eq!(all[0], [1e3, 2e3]);
        let last = all[7999];
        assert!((last[0] - 1.8e3).abs() < 1.0 && (last[1] - 2.8e3).abs() < 1.0, "{last:?}");
    }

    #[test]
    fn a_strain_beyond_the_limit_ends_it_within_half_a_second_and_without_a_jump() {
        let all = demands(&mut under_way(), |step| if step < 1500 { 0.0 } else { -2e-4 });
        assert_eq!(all.len(), 2000);
        for pair in all.windows(2) {
            assert!((pair[1][1] - pair[0][1]).abs() < 200.0, "{pair:?}");
        }
        assert!((all[1999][1] - 2.2e3).abs() < 10.0, "{:?}", all[1999]);
    }

    #[test]
    fn the_steps_that_are_left_are_counted_whatever_the_step() {
        for step_s in [1e-3, 1.0 / 3000.0, 0.7e-3, 0.02] {
            let stroke = StrokeTest { duration_s: 2.1, ..under_way().stroke };
            let mut stroke = StrokeUnderWay::new(stroke, 1, 2, step_s);
            let promised = stroke.steps_left();
            let mut steps = 1;
            while stroke.step(&mut [0.0; 2], [0.0].into_iter()) {
                assert_eq!(stroke.steps_left(), promised - steps, "{step_s}");
                steps += 1;
            }
            assert_eq!(steps, promised, "{step_s}");
            assert_eq!(stroke.steps_left(), 0, "{step_s}");
        }
    }

    #[test]
    fn figures_out_of_range_are_named() {
        let stroke = StrokeTest { duration_s: 0.5, ..under_way().stroke };
        let error = stroke.check(120e3).unwrap_err();
        assert_eq!(error.to_string(), "`duration_s` of a stroke is 0.5; use 2 to 600");
    }
}
