//! Mean wind over height and over time.
//!
//! EN 1991-1-4, 4.3: v_m(z) = k_r · ln(z/z₀) · v_b with k_r = 0.19 (z₀ / 0.05 m)^0.07, constant
//! below a least height. The standard deviation of the gusts is k_r · v_b at every height (4.4).

use crate::wind::{BaseSpeed, WindParameters};

/// Roughness length of the terrain that the base speed refers to \[m\] (EN 1991-1-4, category II).
const REFERENCE_ROUGHNESS_M: f64 = 0.05;

/// The terrain factor k_r.
fn terrain_factor(wind: &WindParameters) -> f64 {
    0.19 * (wind.roughness_length_m / REFERENCE_ROUGHNESS_M).powf(0.07)
}

/// Mean speed at a height \[m\] for a base speed \[m/s\] \[m/s\].
#[must_use]
pub fn mean_speed(wind: &WindParameters, base_speed: f64, height_m: f64) -> f64 {
    let height = height_m.max(wind.lowest_height_m);
    terrain_factor(wind) * (height / wind.roughness_length_m).ln() * base_speed
}

/// Standard deviation of the longitudinal gusts for a base speed \[m/s\] \[m/s\]; the same at every
/// height.
#[must_use]
pub fn gust_deviation(wind: &WindParameters, base_speed: f64) -> f64 {
    terrain_factor(wind) * base_speed * wind.gust_factor
}

/// Length of turbulence at a height \[m\] \[m\] (EN 1991-1-4, B.1).
#[must_use]
pub fn turbulence_length(wind: &WindParameters, height_m: f64) -> f64 {
    let height = height_m.max(wind.lowest_height_m);
    wind.turbulence_length_m * (height / 200.0).powf(wind.turbulence_length_exponent)
}

/// The base speed over a run: the drawn value, or the list of points.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SpeedOverTime {
    points: Vec<[f64; 2]>,
}

impl SpeedOverTime {
    /// If the speed is to be drawn, `drawn` from 0 to 1 selects the value within the range.
    pub(crate) fn new(base_speed: &BaseSpeed, drawn: f64) -> Self {
        let points = match base_speed {
            BaseSpeed::Drawn { from_m_per_s: from, to_m_per_s: to } => {
                vec![[0.0, from + drawn * (to - from)]]
            }
            BaseSpeed::Fixed { speed_m_per_s } => vec![[0.0, *speed_m_per_s]],
            BaseSpeed::Profile { points } => points.clone(),
        };
        Self { points }
    }

    /// The largest base speed of the run \[m/s\].
    pub(crate) fn largest(&self) -> f64 {
        self.points.iter().map(|[_, speed]| *speed).fold(0.0, f64::max)
    }

    /// The base speed at a time \[s\] \[m/s\]; 0 without points.
    pub(crate) fn at(&self, time_s: f64) -> f64 {
        let after = self.points.partition_point(|[time, _]| *time <= time_s);
        let next = self.points.get(after);
        let previous = after.checked_sub(1).and_then(|index| self.points.get(index));
        match (previous, next) {
            (Some([start, from]), Some([end, to])) => {
                from + (to - from) * (time_s - start) / (end - start)
            }
            (Some([_, speed]), None) | (None, Some([_, speed])) => *speed,
            (None, None) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_profile_is_the_norms() {
        let wind = WindParameters::default();
        // Category III: k_r = 0.2154; c_r(36 m) = 0.2154 · ln(120) = 1.0312.
        assert!((mean_speed(&wind, 10.0, 36.0) - 10.312).abs() < 0.002);
        assert_eq!(mean_speed(&wind, 10.0, 3.0), mean_speed(&wind, 10.0, 5.0));
        assert!((gust_deviation(&wind, 10.0) - 2.154).abs() < 0.001);
        assert!((turbulence_length(&wind, 200.0) - 300.0).abs() < 1e-9);
    }

    #[test]
    fn a_speed_profile_is_linear_between_its_points_and_constant_outside() {
        let points = vec![[10.0, 8.0], [20.0, 18.0]];
        let speed = SpeedOverTime::new(&BaseSpeed::Profile { points }, 0.0);
        let at = [0.0, 10.0, 15.0, 20.0, 1e9].map(|time| speed.at(time));
        assert_eq!(at, [8.0, 8.0, 13.0, 18.0, 18.0]);
        assert_eq!(speed.largest(), 18.0);
    }

    #[test]
    fn a_drawn_speed_stays_in_its_range() {
        let range = BaseSpeed::Drawn { from_m_per_s: 8.0, to_m_per_s: 14.0 };
        assert_eq!(SpeedOverTime::new(&range, 0.25).at(3.0), 9.5);
    }
}
