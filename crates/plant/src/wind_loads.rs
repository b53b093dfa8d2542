//! Wind forces on the levels.
//!
//! A level's wind force is ½ ρ c_d A |V| V, with V the vector of mean wind and gusts. Forces are
//! evaluated every [`INTERVAL_S`] and interpolated by cubics through four neighbouring instants
//! (Catmull–Rom), so that a step costs little and no kink shakes the structure. What the structure's modes feel of them
//! is evaluated and interpolated instead where that is asked for.
//!
//! Mean and gusts scale with the base speed, so forces scale with its square; a storm is a factor on the speed.

use nalgebra::DMatrix;
use rand::RngExt;
use truss::{BlockMatrix, vectorised};

use crate::loads::LoadParameters;
use crate::streams::Stream;
use crate::wind::WindParameters;
use crate::wind::field::GustField;
use crate::wind::profile::{SpeedOverTime, mean_speed};

/// Interval between evaluations of the wind \[s\]: five per period of the highest frequency.
const INTERVAL_S: f64 = 0.02;

/// The values drawn for the wind of a run.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct WindConditions {
    pub(crate) speed: SpeedOverTime,
    pub(crate) direction_rad: f64,
}

impl WindConditions {
    pub(crate) fn draw(wind: &WindParameters, seed: u64) -> Self {
        let mut generator = Stream::WindConditions.generator(seed);
        // Both are always drawn, so that fixing one does not change the other.
        let (speed, direction): (f64, f64) = (generator.random(), generator.random());
        let direction_deg = wind.direction_deg.unwrap_or(360.0 * direction);
        Self {
            speed: SpeedOverTime::new(&wind.base_speed, speed),
            direction_rad: direction_deg.to_radians(),
        }
    }
}

/// Wind forces of all levels, step by step.
#[derive(Debug, Clone)]
pub(crate) struct WindLoads {
    gusts: GustField,
    gust_values: Vec<f64>,
    conditions: WindConditions,
    /// Mean speed of each level at the largest base speed \[m/s\].
    mean_speeds: Vec<f64>,
    /// ½ ρ c_d A \[kg/m\].
    drag: f64,
    fade_in_s: f64,
    interval_s: f64,
    /// Instants evaluated so far; the first lies one interval before the start.
    instants: u64,
    /// The forces of all levels in x, then in y \[N\], at the newest instant.
    forces_n: Vec<f64>,
    /// What they are mapped to, if they are, and the forces themselves at the instants of the knots.
    map: Option<(BlockMatrix, [Vec<f64>; 4])>,
    /// Forces, or what they are mapped to, at the last four instants, the oldest first.
    knots: [Vec<f64>; 4],
    steps_per_interval: usize,
    step_in_interval: usize,
}

impl WindLoads {
    pub(crate) fn new(
        wind: &WindParameters,
        loads: &LoadParameters,
        conditions: WindConditions,
        heights_m: &[f64],
        step_s: f64,
        seed: u64,
    ) -> Self {
        let largest = conditions.speed.largest();
        // In a run without wind the shape of the spectrum does not matter, but has to exist.
        let base_speed = if largest > 0.0 { largest } else { 1.0 };
        let steps_per_interval = ((INTERVAL_S / step_s).round() as usize).max(1);
        let interval_s = steps_per_interval as f64 * step_s;
        let mut generator = Stream::Turbulence.generator(seed);
        let gusts = GustField::draw(wind, base_speed, heights_m, interval_s, &mut generator);
        let signals = vec![0.0; 2 * heights_m.len()];
        let mut wind_loads = Self {
            gusts,
            gust_values: signals.clone(),
            conditions,
            mean_speeds: heights_m.iter().map(|&z| mean_speed(wind, base_speed, z)).collect(),
            drag: 0.5
                * wind.air_density_kg_per_m3
                * loads.drag_coefficient
                * loads.area_per_level_m2,
            fade_in_s: wind.fade_in_s,
            interval_s,
            instants: 0,
            map: None,
            knots: std::array::from_fn(|_| signals.clone()),
            forces_n: signals,
            steps_per_interval,
            step_in_interval: 0,
        };
        for _ in 0..wind_loads.knots.len() {
            wind_loads.next_knot();
        }
        wind_loads
    }

    /// Forces at the start, under mean wind \[N\], or what they are mapped to.
    pub(crate) fn at_start(&self) -> &[f64] {
        &self.knots[1]
    }

    /// From now on gives what this maps the forces to. Not after the start.
    pub(crate) fn mapped(mut self, map: &DMatrix<f64>) -> Self {
        let map = BlockMatrix::new(map);
        let unmapped = self.knots.clone();
        for (knot, forces_n) in self.knots.iter_mut().zip(&unmapped) {
            *knot = vec![0.0; map.rows()];
            map.add_product(forces_n, knot);
        }
        self.map = Some((map, unmapped));
        self
    }

    /// The forces on all levels in x, then in y, that [`WindLoads::next`] gave last or mapped; before, those at the start
    /// \[N\].
    pub(crate) fn on_levels(&self) -> Vec<f64> {
        let knots = self.map.as_ref().map_or(&self.knots, |(_, unmapped)| unmapped);
        let mut forces_n = knots[1].clone();
        if self.step_in_interval > 0 {
            interpolate(catmull_rom(self.place(self.step_in_interval - 1)), knots, &mut forces_n);
        }
        forces_n
    }

    /// Where between two instants the middle of a step is.
    fn place(&self, step: usize) -> f64 {
        (step as f64 + 0.5) / self.steps_per_interval as f64
    }

    /// Writes the forces at the middle of this step \[N\], or what they are mapped to, and advances to the next step.
    pub(crate) fn next(&mut self, forces_n: &mut [f64]) {
        if self.step_in_interval == self.steps_per_interval {
            self.step_in_interval = 0;
            self.next_knot();
        }
        let place = self.place(self.step_in_interval);
        self.step_in_interval += 1;
        let (weights, knots) = (catmull_rom(place), &self.knots);
        vectorised(
            #[inline(always)]
            || interpolate(weights, knots, forces_n),
        );
    }

    /// Drops the oldest instant and evaluates the next.
    fn next_knot(&mut self) {
        self.gusts.next(&mut self.gust_values);
        let time_s = (self.instants as f64 - 1.0) * self.interval_s;
        self.instants += 1;
        self.knots.rotate_left(1);
        let gust_strength = smooth_rise(time_s, self.fade_in_s);
        let scale = self.speed_scale(time_s);
        let (sine, cosine) = self.conditions.direction_rad.sin_cos();
        let (along, across) = self.gust_values.split_at(self.mean_speeds.len());
        let (x, y) = self.forces_n.split_at_mut(self.mean_speeds.len());
        let gusts = along.iter().zip(across);
        for (((fx, fy), mean), (u, v)) in x.iter_mut().zip(y).zip(&self.mean_speeds).zip(gusts) {
            let speed_along = scale * (mean + gust_strength * u);
            let speed_across = scale * gust_strength * v;
            let pressure = self.drag * (speed_along.powi(2) + speed_across.powi(2)).sqrt();
            *fx = pressure * (cosine * speed_along - sine * speed_across);
            *fy = pressure * (sine * speed_along + cosine * speed_across);
        }
        let [.., newest] = &mut self.knots;
        if let Some((map, unmapped)) = &mut self.map {
            newest.fill(0.0);
            map.add_product(&self.forces_n, newest);
            unmapped.rotate_left(1);
            let [.., newest] = unmapped;
            newest.copy_from_slice(&self.forces_n);
        } else {
            newest.copy_from_slice(&self.forces_n);
        }
    }

    /// Base speed at a time over the largest one.
    fn speed_scale(&self, time_s: f64) -> f64 {
        let largest = self.conditions.speed.largest();
        if largest > 0.0 { self.conditions.speed.at(time_s) / largest } else { 0.0 }
    }
}

/// The sum of four knots with their weights.
#[inline(always)]
fn interpolate(weights: [f64; 4], [k0, k1, k2, k3]: &[Vec<f64>; 4], out: &mut [f64]) {
    let [w0, w1, w2, w3] = weights;
    let knots = k0.iter().zip(k1).zip(k2.iter().zip(k3));
    for (value, ((k0, k1), (k2, k3))) in out.iter_mut().zip(knots) {
        *value = w3.mul_add(*k3, w2.mul_add(*k2, w1.mul_add(*k1, w0 * k0)));
    }
}

/// 0 up to time 0, then smoothly up to 1 at `duration_s`.
fn smooth_rise(time_s: f64, duration_s: f64) -> f64 {
    if time_s <= 0.0 {
        return 0.0;
    }
    let place = (time_s / duration_s).min(1.0);
    place * place * (3.0 - 2.0 * place)
}

/// Weights of four equidistant values, at a position from 0 to 1 between the middle two.
fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [
        0.5 * (-t + 2.0 * t2 - t3),
        0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
        0.5 * (t + 4.0 * t2 - 3.0 * t3),
        0.5 * (t3 - t2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wind::BaseSpeed;

    const HEIGHTS: [f64; 3] = [12.0, 24.0, 36.0];

    fn run(wind: &WindParameters, steps: usize) -> Vec<[f64; 6]> {
        let loads = LoadParameters::default();
        let conditions = WindConditions::draw(wind, 9);
        let mut wind_loads = WindLoads::new(wind, &loads, conditions, &HEIGHTS, 1e-3, 9);
        let mut forces = [0.0; 6];
        (0..steps)
            .map(|_| {
                wind_loads.next(&mut forces);
                forces
            })
            .collect()
    }

    fn fixed(speed: f64) -> WindParameters {
        WindParameters {
            base_speed: BaseSpeed::Fixed { speed_m_per_s: speed },
            direction_deg: Some(30.0),
            ..WindParameters::default()
        }
    }

    #[test]
    fn the_mean_force_is_drag_times_dynamic_pressure_in_the_winds_direction() {
        let wind = WindParameters { gust_factor: 0.0, ..fixed(12.0) };
        let forces = run(&wind, 100)[99];
        for (level, height) in HEIGHTS.into_iter().enumerate() {
            let speed = mean_speed(&wind, 12.0, height);
            let size = 0.5 * 1.25 * 1.3 * 14.25 * speed * speed;
            let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
            assert!((forces[level] - size * cosine).abs() < 1e-9 * size);
            assert!((forces[level + 3] - size * sine).abs() < 1e-9 * size);
        }
    }

    #[test]
    fn a_run_starts_in_the_mean_wind_and_without_a_jump() {
        let calm = run(&WindParameters { gust_factor: 0.0, ..fixed(12.0) }, 1);
        let gusty = run(&fixed(12.0), 20_000);
        assert!((gusty[0][0] / calm[0][0] - 1.0).abs() < 1e-4);
        let largest_jump =
            gusty.windows(2).map(|pair| (pair[1][2] - pair[0][2]).abs()).fold(0.0, f64::max);
        assert!(largest_jump < 0.05 * calm[0][2], "{largest_jump}");
        let spread = gusty.iter().map(|forces| (forces[2] - calm[0][2]).abs()).fold(0.0, f64::max);
        assert!(spread > 0.1 * calm[0][2], "{spread}");
    }

    #[test]
    fn forces_of_a_storm_scale_with_the_square_of_its_speed() {
        let steady = run(&fixed(20.0), 10_001);
        let points = vec![[0.0, 10.0], [10.0, 20.0]];
        let storm = WindParameters { base_speed: BaseSpeed::Profile { points }, ..fixed(20.0) };
        let storm = run(&storm, 10_001);
        assert!((storm[0][0] / steady[0][0] - 0.25).abs() < 1e-3);
        assert!((storm[10_000][0] / steady[10_000][0] - 1.0).abs() < 5e-3);
    }

    #[test]
    fn no_wind_is_no_force() {
        assert!(run(&fixed(0.0), 5000).iter().flatten().all(|force| *force == 0.0));
    }

    #[test]
    fn drawn_conditions_stay_in_their_ranges_and_differ_between_seeds() {
        let wind = WindParameters::default();
        let drawn: Vec<WindConditions> =
            (0..200).map(|seed| WindConditions::draw(&wind, seed)).collect();
        for conditions in &drawn {
            assert!((8.0..=14.0).contains(&conditions.speed.largest()));
            assert!((0.0..std::f64::consts::TAU).contains(&conditions.direction_rad));
        }
        let mean = drawn.iter().map(|c| c.speed.largest()).sum::<f64>() / 200.0;
        assert!((mean - 11.0).abs() < 0.5);
        assert_ne!(drawn[0], drawn[1]);
    }

    #[test]
    fn interpolation_reproduces_parabolas() {
        for place in [0.0, 0.3, 0.975] {
            let weights = catmull_rom(place);
            let value: f64 =
                weights.iter().enumerate().map(|(i, w)| w * (i as f64 - 1.0).powi(2)).sum();
            assert!((value - place * place).abs() < 1e-15);
        }
    }
}
