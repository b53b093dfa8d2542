//! The central controller: a Kalman filter on the gages and the observed forces of the whole
//! structure, and a regulator that turns the estimate into demands (section 5 of the paper).
//!
//! At sample k, with the forces F and the readings y of that sample:
//!
//! 1. x⁺ = A x + B (F_{k−1} + F_k)/2: forces between samples are their average
//! 2. x = x⁺ + L (y − C x⁺)
//! 3. u = −K x, limited
//!
//! Cylinders that are lost exert F_l in place of u_l. The others, h, make up for it as far as they can:
//! u_h = −K_h x − R (F_l − u_l), R = (E_hᵀ E_h + ρ tr(E_hᵀ E_h)/n_h I)⁻¹ E_hᵀ E_l, with the energy map E: the elastic energy of
//! the difference is least (a damped pseudo-inverse; Johansen and Fossen, Automatica 49, 2013, section 2.2).

use nalgebra::{DMatrix, DVector};
use truss::{BlockMatrix, Direction, Gage, Mechanics, Member, Modes, Structure};

use crate::error::PlantError;
use crate::gains;
use crate::loads::{heights_above_ground, level_map, loaded_levels};
use crate::nominal::NominalModel;
use crate::parameters::PlantParameters;
use crate::wind::profile::{gust_deviation, mean_speed, turbulence_length};
use crate::wind::spectrum::GustSpectrum;

/// The design of the controller: model and gains.
#[derive(Debug, Clone)]
pub(crate) struct Design {
    pub(crate) model: NominalModel,
    /// K (actuators × states) \[N\].
    pub(crate) regulator: DMatrix<f64>,
    /// L (states × gages) \[1/m\].
    pub(crate) filter: DMatrix<f64>,
    /// The members of the gages.
    gage_members: Vec<Member>,
}

impl Design {
    /// Designs the controller on the nominal model of structure and hardware.
    pub(crate) fn new(
        structure: &Structure,
        parameters: &PlantParameters,
    ) -> Result<Self, PlantError> {
        let mechanics = Mechanics::assemble(structure)?;
        let modes = Modes::of(&mechanics, structure.damping, Some(parameters.controller.modes))?;
        let levels = loaded_levels(structure);
        let x = level_map(&mechanics, &levels, Direction::X);
        let y = level_map(&mechanics, &levels, Direction::Y);
        let disturbances = beside(&x, &y);
        let model = NominalModel::new(&mechanics, &modes, &disturbances, parameters.step_s);
        let lowest_hz = modes.frequencies_hz().iter().copied().fold(f64::INFINITY, f64::min);
        let heights = heights_above_ground(structure, &levels);
        // The wind's direction is unknown: the design assumes full-strength gusts in both directions.
        let mut power = white_force_power(parameters, &heights, lowest_hz);
        power.extend_from_within(..);
        let noise_factor = parameters.controller.gage_noise_factor;
        let variances: Vec<f64> = gage_lengths_m(structure)
            .iter()
            .map(|length| (noise_factor * (parameters.gages.noise_strain * length)).powi(2))
            .collect();
        Ok(Self {
            regulator: gains::regulator(&model, parameters.controller.effort_weight)?,
            filter: gains::filter(&model, &power, &variances, parameters.step_s)?,
            gage_members: gages(structure)
                .map(|gage| structure.gage_member(gage).clone())
                .collect(),
            model,
        })
    }

    /// The equilibrium of structure, actuators, filter and regulator under constant loads.
    ///
    /// Forces equal demands, F = u = −K x. The structure's elongations are y = y₀ + G F, with y₀ under the loads alone
    /// and G the static response of the true structure. The filter is stationary when x = x⁺ + L (y − C x⁺) with
    /// x⁺ = A x + B F. Substitution yields a linear system for x:
    ///
    /// (I − (I − L C)(A − B K) + L G K) x = L y₀
    ///
    /// `response`: G (gages × actuators) \[m/N\]; `elongations`: y₀ (gages) \[m\]. Returns the estimated state and the
    /// forces \[N\].
    pub(crate) fn at_rest(
        &self,
        response: &DMatrix<f64>,
        elongations: &DVector<f64>,
        demand_limit_n: f64,
    ) -> Result<(Vec<f64>, Vec<f64>), PlantError> {
        let model = &self.model;
        let identity = DMatrix::identity(model.states(), model.states());
        let correction = &identity - &self.filter * &model.gage_map;
        let regulated = model.transition() - &model.force_map * &self.regulator;
        let system = &identity - correction * regulated + &self.filter * response * &self.regulator;
        let state =
            system.lu().solve(&(&self.filter * elongations)).ok_or(PlantError::NoEquilibrium)?;
        let forces = -(&self.regulator * &state);
        let largest = forces.amax();
        if !largest.is_finite() {
            return Err(PlantError::NoEquilibrium);
        }
        if largest > demand_limit_n {
            return Err(PlantError::DemandAtStart { demand_n: largest, limit_n: demand_limit_n });
        }
        Ok((state.as_slice().to_vec(), forces.as_slice().to_vec()))
    }
}

/// Two matrices side by side.
pub(crate) fn beside(left: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
    let columns: Vec<_> = left.column_iter().chain(right.column_iter()).collect();
    if columns.is_empty() { left.clone() } else { DMatrix::from_columns(&columns) }
}

/// Length of the member of each gage, all modules in order \[m\].
pub(crate) fn gage_lengths_m(structure: &Structure) -> Vec<f64> {
    gages(structure).map(|gage| structure.gage_length_m(gage)).collect()
}

fn gages(structure: &Structure) -> impl Iterator<Item = &Gage> {
    structure.modules.iter().flat_map(|module| &module.gages)
}

/// Two-sided power density of each level's gust force at a frequency \[Hz\] \[N²/Hz\].
fn white_force_power(
    parameters: &PlantParameters,
    heights_m: &[f64],
    frequency_hz: f64,
) -> Vec<f64> {
    let (wind, loads) = (&parameters.wind, &parameters.loads);
    let base_speed = parameters.controller.base_speed_m_per_s;
    // The filter is designed for gusts even if the run has none.
    let with_gusts = crate::wind::WindParameters { gust_factor: 1.0, ..wind.clone() };
    let gust_variance = gust_deviation(&with_gusts, base_speed).powi(2);
    let drag = wind.air_density_kg_per_m3 * loads.drag_coefficient * loads.area_per_level_m2;
    let power = |&height: &f64| {
        let speed = mean_speed(wind, base_speed, height);
        let spectrum = GustSpectrum { time_scale_s: turbulence_length(wind, height) / speed };
        0.5 * (drag * speed).powi(2) * gust_variance * spectrum.density(frequency_hz)
    };
    heights_m.iter().map(power).collect()
}

/// Time constant of the means about which innovations are limited \[s\].
const MEAN_S: f64 = 1.0;
/// From when on innovations are limited: the filter has found its state \[s\].
const LIMITED_FROM_S: f64 = 2.0;

/// Limits innovations about their running means: a wrong reading moves the estimate no more than a small disturbance does,
/// and the less the further off it is (a redescending M-estimator; Huber and Ronchetti, Robust Statistics, 2nd ed., 4.8).
///
/// A few modes do not tell what a cylinder does to the members beside it. While one pushes F beyond its demand, the limit is
/// wider by what that force does to the gage's member alone, F L/(E A).
#[derive(Debug, Clone)]
struct InnovationLimit {
    gages: Vec<GageLimit>,
    /// How far each cylinder pushes beyond its demand, in the mean \[N\].
    excess_means_n: Vec<f64>,
    /// The largest departure from these means.
    excess_n: f64,
    share: f64,
    steps_left: u64,
}

/// The limit of a gage \[m\].
#[derive(Debug, Clone)]
struct GageLimit {
    /// While all cylinders follow their demands.
    least: f64,
    /// L/(E A) \[m/N\].
    compliance: f64,
    mean: f64,
}

impl InnovationLimit {
    fn new(largest_strain: f64, members: &[Member], actuators: usize, step_s: f64) -> Self {
        let gage = |member: &Member| GageLimit {
            least: largest_strain * member.length_m,
            compliance: member.length_m / (member.effective_young_pa() * member.area_m2),
            mean: 0.0,
        };
        Self {
            gages: members.iter().map(gage).collect(),
            excess_means_n: vec![0.0; actuators],
            excess_n: 0.0,
            share: (step_s / MEAN_S).min(1.0),
            steps_left: (LIMITED_FROM_S / step_s).round() as u64,
        }
    }

    fn apply(&mut self, innovation_m: &mut [f64]) {
        let is_limited = self.steps_left == 0;
        self.steps_left = self.steps_left.saturating_sub(1);
        for (gage, innovation) in self.gages.iter_mut().zip(innovation_m) {
            if is_limited {
                *innovation = gage.limited(*innovation, self.excess_n);
            }
            gage.mean += self.share * (*innovation - gage.mean);
        }
    }

    /// Takes the forces and demands of a step.
    fn follow(&mut self, forces_n: &[f64], demands_n: &[f64]) {
        self.excess_n = 0.0;
        let excesses = forces_n.iter().zip(demands_n).map(|(force, demand)| force - demand);
        for (mean, excess) in self.excess_means_n.iter_mut().zip(excesses) {
            self.excess_n = self.excess_n.max((excess - *mean).abs());
            *mean += self.share * (excess - *mean);
        }
    }
}

impl GageLimit {
    fn limited(&self, innovation: f64, excess_n: f64) -> f64 {
        let off = innovation - self.mean;
        let largest = self.least + self.compliance * excess_n;
        if off.abs() > largest {
            self.mean + (largest * (largest / off.abs()).sqrt()).copysign(off)
        } else {
            innovation
        }
    }
}

/// ρ: a larger one spares the other cylinders, a smaller one the structure.
const SPARING: f64 = 0.1;

/// How the other cylinders make up for those that are lost.
#[derive(Debug, Clone)]
struct Reallocation {
    is_lost: Vec<bool>,
    /// −R, with rows and columns for all cylinders.
    minus_share: BlockMatrix,
    /// F_l − u_l \[N\]; zero for the others.
    difference_n: Vec<f64>,
}

impl Reallocation {
    /// `None` if no cylinder is lost, or all are.
    fn new(energy_map: &DMatrix<f64>, is_lost: &[bool]) -> Option<Self> {
        let of = |lost: bool| -> Vec<usize> {
            (0..is_lost.len()).filter(|place| is_lost[*place] == lost).collect()
        };
        let (lost, left) = (of(true), of(false));
        if lost.is_empty() || left.is_empty() {
            return None;
        }
        let (of_left, of_lost) =
            (energy_map.select_columns(&left), energy_map.select_columns(&lost));
        let mut square = of_left.tr_mul(&of_left);
        let sparing = SPARING * square.trace() / left.len() as f64;
        for place in 0..left.len() {
            square[(place, place)] += sparing;
        }
        let share = square.cholesky()?.solve(&of_left.tr_mul(&of_lost));
        let mut minus_share = DMatrix::zeros(is_lost.len(), is_lost.len());
        for (row, to) in left.iter().enumerate() {
            for (column, from) in lost.iter().enumerate() {
                minus_share[(*to, *from)] = -share[(row, column)];
            }
        }
        Some(Self {
            is_lost: is_lost.to_vec(),
            minus_share: BlockMatrix::new(&minus_share),
            difference_n: vec![0.0; is_lost.len()],
        })
    }

    /// Nothing is demanded of the lost, and more of the others.
    fn apply(&mut self, forces_n: &[f64], demands_n: &mut [f64]) {
        let lost = self.is_lost.iter().zip(forces_n);
        for ((difference, (is_lost, force)), demand) in
            self.difference_n.iter_mut().zip(lost).zip(demands_n.iter_mut())
        {
            if *is_lost {
                *difference = force - *demand;
                *demand = 0.0;
            }
        }
        self.minus_share.add_product(&self.difference_n, demands_n);
    }
}

/// Time in which demands get from what they were before a reallocation to what they are after it \[s\], and time constant of
/// a cylinder's mean excess over its demand.
const BLENDING_S: f64 = 0.3;

/// A bumpless transfer from a former reallocation. The structure has come to rest with what a lost cylinder has pushed for long,
/// and is brought back smoothly; what it has begun to push is made up for at once.
#[derive(Debug, Clone)]
struct Blend {
    from: Option<Reallocation>,
    /// What it demands \[N\].
    demands_n: Vec<f64>,
    /// What each cylinder pushes beyond its demand, in the mean: now, and at the switch \[N\].
    means_n: Vec<f64>,
    held_n: Vec<f64>,
    /// Steps since the switch, of so many.
    taken: u64,
    steps: u64,
}

impl Blend {
    /// The share of the new demands, from 0 at the switch to 1.
    fn share(&self) -> f64 {
        let time = (self.taken as f64 / self.steps as f64).min(1.0);
        0.5 * (1.0 - (std::f64::consts::PI * time).cos())
    }

    /// Takes the forces and the demands of a step, before reallocation.
    fn begin(&mut self, forces_n: &[f64], demands_n: &[f64]) {
        let beyond = forces_n.iter().zip(demands_n).map(|(force, demand)| force - demand);
        for (mean, beyond) in self.means_n.iter_mut().zip(beyond) {
            *mean += (beyond - *mean) / self.steps as f64;
        }
        if self.taken < self.steps {
            self.demands_n.copy_from_slice(demands_n);
            if let Some(from) = &mut self.from {
                from.apply(forces_n, &mut self.demands_n);
            }
        }
    }

    /// Blends the demands after reallocation with those of the former one.
    fn end(&mut self, reallocation: Option<&mut Reallocation>, demands_n: &mut [f64]) {
        let share = self.share();
        self.taken = self.taken.saturating_add(1);
        if share >= 1.0 {
            return;
        }
        for (demand, before) in demands_n.iter_mut().zip(&self.demands_n) {
            *demand = before + share * (*demand - before);
        }
        let Some(Reallocation { minus_share, difference_n, .. }) = reallocation else { return };
        let was_lost = |place: usize| self.from.as_ref().is_some_and(|from| from.is_lost[place]);
        for (place, difference) in difference_n.iter_mut().enumerate() {
            let fresh = *difference - self.held_n[place];
            let counts = *difference != 0.0 && !was_lost(place);
            *difference = if counts { (1.0 - share) * fresh } else { 0.0 };
        }
        minus_share.add_product(difference_n, demands_n);
    }
}

/// The controller with its present state.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    transitions: Vec<[[f64; 2]; 2]>,
    force_map: BlockMatrix,
    /// −C and −K: both are only used with this sign.
    minus_gage_map: BlockMatrix,
    minus_regulator: BlockMatrix,
    filter: BlockMatrix,
    demand_limit_n: f64,
    state: Vec<f64>,
    innovation: Vec<f64>,
    limit: Option<InnovationLimit>,
    gage_members: Vec<Member>,
    step_s: f64,
    energy_map: DMatrix<f64>,
    reallocation: Option<Reallocation>,
    blend: Blend,
    previous_forces_n: Vec<f64>,
    mean_forces_n: Vec<f64>,
}

impl Controller {
    /// Starts from an estimated state and forces \[N\].
    pub(crate) fn new(
        design: &Design,
        demand_limit_n: f64,
        step_s: f64,
        state: Vec<f64>,
        forces_n: Vec<f64>,
    ) -> Self {
        Self {
            transitions: design.model.transitions.clone(),
            force_map: BlockMatrix::new(&design.model.force_map),
            minus_gage_map: BlockMatrix::new(&-&design.model.gage_map),
            minus_regulator: BlockMatrix::new(&-&design.regulator),
            filter: BlockMatrix::new(&design.filter),
            demand_limit_n,
            state,
            innovation: vec![0.0; design.model.gage_map.nrows()],
            limit: None,
            gage_members: design.gage_members.clone(),
            step_s,
            energy_map: design.model.energy_map.clone(),
            reallocation: None,
            blend: Blend {
                from: None,
                demands_n: vec![0.0; forces_n.len()],
                means_n: vec![0.0; forces_n.len()],
                held_n: vec![0.0; forces_n.len()],
                taken: u64::MAX,
                steps: (BLENDING_S / step_s).round().max(1.0) as u64,
            },
            mean_forces_n: vec![0.0; forces_n.len()],
            previous_forces_n: forces_n,
        }
    }

    /// From now on, what a gage reads may differ by so much from what is expected, or by any amount.
    pub(crate) fn limit_innovations(&mut self, largest_strain: Option<f64>) {
        let actuators = self.previous_forces_n.len();
        self.limit = largest_strain
            .map(|strain| InnovationLimit::new(strain, &self.gage_members, actuators, self.step_s));
    }

    /// Which cylinders are lost from now on. Demands follow smoothly.
    pub(crate) fn reallocate(&mut self, is_lost: &[bool]) {
        let after = Reallocation::new(&self.energy_map, is_lost);
        self.blend.from = std::mem::replace(&mut self.reallocation, after);
        self.blend.held_n.copy_from_slice(&self.blend.means_n);
        self.blend.taken = 0;
    }

    /// Computes the demands \[N\] from the readings \[m\] and observed forces \[N\] of a sample.
    pub(crate) fn step(&mut self, readings_m: &[f64], forces_n: &[f64], demands_n: &mut [f64]) {
        self.predict(forces_n);
        self.innovation.copy_from_slice(readings_m);
        self.minus_gage_map.add_product(&self.state, &mut self.innovation);
        if let Some(limit) = &mut self.limit {
            limit.apply(&mut self.innovation);
        }
        self.filter.add_product(&self.innovation, &mut self.state);
        demands_n.fill(0.0);
        self.minus_regulator.add_product(&self.state, demands_n);
        self.blend.begin(forces_n, demands_n);
        if let Some(reallocation) = &mut self.reallocation {
            reallocation.apply(forces_n, demands_n);
        }
        self.blend.end(self.reallocation.as_mut(), demands_n);
        for demand in demands_n.iter_mut() {
            *demand = demand.clamp(-self.demand_limit_n, self.demand_limit_n);
        }
        if let Some(limit) = &mut self.limit {
            limit.follow(forces_n, demands_n);
        }
    }

    fn predict(&mut self, forces_n: &[f64]) {
        let forces = self.previous_forces_n.iter_mut().zip(forces_n);
        for (mean, (previous, now)) in self.mean_forces_n.iter_mut().zip(forces) {
            *mean = 0.5 * (*previous + now);
            *previous = *now;
        }
        for (state, [[a, b], [c, d]]) in self.state.chunks_exact_mut(2).zip(&self.transitions) {
            if let [first, second] = state {
                (*first, *second) = (a * *first + b * *second, c * *first + d * *second);
            }
        }
        self.force_map.add_product(&self.mean_forces_n, &mut self.state);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;

    const TOWER: &str = include_str!("../../../configs/tower.toml");

    /// The linear closed loop over a step, applied to (structure state of all modes given to it,
    /// forces, estimate, previous forces).
    fn closed_loop(plant: &NominalModel, design: &Design, force_keep: f64) -> DMatrix<f64> {
        let (states, estimates) = (plant.states(), design.model.states());
        let actuators = plant.force_map.ncols();
        let size = states + 2 * actuators + estimates;
        let mut matrix = DMatrix::zeros(size, size);
        let transition = plant.transition();
        for column in 0..size {
            let mut all = DVector::zeros(size);
            all[column] = 1.0;
            let state = all.rows(0, states).into_owned();
            let forces = all.rows(states, actuators).into_owned();
            let estimate = all.rows(states + actuators, estimates).into_owned();
            let previous = all.rows(states + actuators + estimates, actuators).into_owned();
            let predicted = design.model.transition() * estimate
                + &design.model.force_map * (&forces + previous) * 0.5;
            let innovation = &plant.gage_map * &state - &design.model.gage_map * &predicted;
            let estimate = predicted + &design.filter * innovation;
            let demands = -(&design.regulator * &estimate);
            let next_forces = &forces * force_keep + demands * (1.0 - force_keep);
            let next = &transition * state + &plant.force_map * (&forces + &next_forces) * 0.5;
            let stacked: Vec<f64> = next
                .iter()
                .chain(next_forces.iter())
                .chain(estimate.iter())
                .chain(forces.iter())
                .copied()
                .collect();
            matrix.set_column(column, &DVector::from_vec(stacked));
        }
        matrix
    }

    /// Mechanics of the tower, its nominal model with as many modes, and the closed loop of both.
    fn tower(modes: usize) -> (Modes, DMatrix<f64>) {
        let structure = Structure::from_toml(TOWER).unwrap();
        let parameters = PlantParameters::default();
        let design = Design::new(&structure, &parameters).unwrap();
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let modes = Modes::of(&mechanics, structure.damping, Some(modes)).unwrap();
        let no_disturbance = DMatrix::zeros(mechanics.dofs.len(), 0);
        let plant = NominalModel::new(&mechanics, &modes, &no_disturbance, parameters.step_s);
        let force_keep = (-parameters.step_s / parameters.hydraulics.time_constant_s()).exp();
        (modes, closed_loop(&plant, &design, force_keep))
    }

    /// The eigenvalue s \[1/s\] of the loop nearest to a guess, by inverse iteration.
    fn pole_near(closed: &DMatrix<f64>, guess: Complex<f64>) -> Complex<f64> {
        let step = 1e-3;
        let shift = (guess * step).exp();
        let complex = closed.map(|value| Complex::new(value, 0.0));
        let size = closed.nrows();
        let shifted = &complex - DMatrix::from_diagonal_element(size, size, shift);
        let factor = shifted.lu();
        let mut vector = DVector::from_fn(size, |row, _| Complex::new(1.0 + row as f64 % 7.0, 0.0));
        for _ in 0..200 {
            vector = factor.solve(&vector).unwrap();
            vector.unscale_mut(vector.norm());
        }
        let pole = vector.dotc(&(&complex * &vector));
        assert!((&complex * &vector - &vector * pole).norm() < 1e-4);
        pole.ln() / step
    }

    #[test]
    fn the_loop_raises_the_first_modes_damping_from_three_to_thirteen_per_cent() {
        let (modes, closed) = tower(40);
        assert!((modes.damping_ratios[0] - 0.029).abs() < 1e-3, "{}", modes.damping_ratios[0]);
        let omega = modes.angular_frequencies[0];
        let pole = pole_near(&closed, Complex::new(-0.13 * omega, omega));
        let damping = -pole.re / pole.norm();
        assert!((damping - 0.13).abs() < 0.01, "{damping}");
        assert!((pole.norm() / omega - 1.0).abs() < 0.1, "{pole}");
    }

    /// With all modes, lags of the actuators and of the filter, by raising to the power 2^17.
    #[test]
    fn the_loop_is_stable_with_the_modes_that_the_controller_ignores() {
        let (_, mut closed) = tower(144);
        for _ in 0..17 {
            closed = &closed * &closed;
        }
        let left = closed.norm();
        assert!(left < 1e-6, "{left}");
    }

    /// Without sparing, the remaining difference has no energy that the others could take off: it is orthogonal to them.
    #[test]
    fn what_a_lost_cylinder_does_is_made_up_for_with_the_least_energy_left() {
        let structure = Structure::from_toml(TOWER).unwrap();
        let design = Design::new(&structure, &PlantParameters::default()).unwrap();
        let map = &design.model.energy_map;
        let mut is_lost = vec![false; map.ncols()];
        is_lost[0] = true;
        let mut reallocation = Reallocation::new(map, &is_lost).unwrap();
        let mut forces = vec![0.0; map.ncols()];
        forces[0] = 77e3;
        let mut demands = vec![0.0; map.ncols()];
        reallocation.apply(&forces, &mut demands);
        let alone = (map * DVector::from_column_slice(&forces)).norm();
        let (pushed, mut together) = (demands.clone(), forces);
        together.iter_mut().zip(&pushed).for_each(|(force, demand)| *force += demand);
        let left = (map * DVector::from_column_slice(&together)).norm();
        assert_eq!(pushed[0], 0.0);
        assert!(left < 0.7 * alone, "{left} of {alone}");
        for other in 1..map.ncols() {
            for more in [-1e3, 1e3] {
                let mut changed = together.clone();
                changed[other] += more;
                let energy = (map * DVector::from_column_slice(&changed)).norm_squared();
                let sparing = SPARING * map.columns(1, map.ncols() - 1).norm_squared()
                    / (map.ncols() - 1) as f64;
                let effort = |extra: f64| sparing * ((pushed[other] + extra).powi(2));
                assert!(energy + effort(more) > left * left + effort(0.0));
            }
        }
        assert!(Reallocation::new(map, &vec![false; map.ncols()]).is_none());
        assert!(Reallocation::new(map, &vec![true; map.ncols()]).is_none());
    }

    /// A controller at rest whose first cylinder pushes that much after so many steps, and counts as lost from then on. The
    /// other demands, at each step.
    fn made_up_for(begins: usize, lost: usize, force_n: f64) -> Vec<Vec<f64>> {
        let structure = Structure::from_toml(TOWER).unwrap();
        let design = Design::new(&structure, &PlantParameters::default()).unwrap();
        let state = vec![0.0; design.model.states()];
        let mut controller = Controller::new(&design, 1e6, 1e-3, state, vec![0.0; 8]);
        let mut demands = [0.0; 8];
        let step = |step: usize| {
            let mut is_lost = [false; 8];
            is_lost[0] = true;
            if step == lost {
                controller.reallocate(&is_lost);
            }
            let mut forces = [0.0; 8];
            forces[0] = if step >= begins { force_n } else { 0.0 };
            // The structure stays where it is.
            controller.state.fill(0.0);
            controller.previous_forces_n.fill(0.0);
            controller.step(&[0.0; 16], &forces, &mut demands);
            demands[1..].to_vec()
        };
        (0..lost + 1000).map(step).collect()
    }

    #[test]
    fn what_a_lost_cylinder_begins_to_push_is_made_up_for_at_once_and_what_it_has_pushed_smoothly()
    {
        let step = |demands: &[Vec<f64>], at: usize| {
            let both = demands[at - 1].iter().zip(&demands[at]);
            both.map(|(before, after)| (after - before).abs()).fold(0.0, f64::max)
        };
        let largest = |demands: &[f64]| demands.iter().fold(0.0, |most: f64, n| most.max(n.abs()));
        let (fresh, old) = (made_up_for(2500, 2520, 77e3), made_up_for(0, 2520, 77e3));
        let end = largest(&old[3500]);
        assert!(end > 20e3, "{end}");
        assert!((largest(&fresh[3500]) - end).abs() < 0.1 * end);
        assert!(step(&fresh, 2520) > 0.8 * end, "{}", step(&fresh, 2520));
        let steps = (2520..3500).map(|at| step(&old, at)).fold(0.0, f64::max);
        assert!(steps < 0.01 * end, "{steps}");
    }

    #[test]
    fn what_a_reading_says_counts_less_the_further_off_it_is_unless_a_cylinder_follows_no_demand() {
        let structure = Structure::from_toml(TOWER).unwrap();
        let member = structure.gage_member(&structure.modules[0].gages[0]);
        let limited = |innovation: f64, force_n: f64| {
            let member = Member { length_m: 1.0, ..member.clone() };
            let mut limit = InnovationLimit::new(1e-6, &[member], 2, 1e-3);
            for _ in 0..=limit.steps_left {
                limit.apply(&mut [0.0]);
            }
            limit.follow(&[force_n, 0.0], &[0.0, 0.0]);
            let mut innovation = [innovation];
            limit.apply(&mut innovation);
            innovation[0]
        };
        assert_eq!(limited(-1e-6, 0.0), -1e-6);
        assert!((limited(-4e-6, 0.0) + 0.5e-6).abs() < 1e-15);
        assert!((limited(100e-6, 0.0) - 0.1e-6).abs() < 1e-15);
        // 77 kN strain the column by 32 µε.
        assert_eq!(limited(30e-6, -77e3), 30e-6);
        assert!(limited(100e-6, -77e3) < 30e-6);
    }

    #[test]
    fn the_demand_is_limited() {
        let structure = Structure::from_toml(TOWER).unwrap();
        let design = Design::new(&structure, &PlantParameters::default()).unwrap();
        let mut controller =
            Controller::new(&design, 1.0, 1e-3, vec![0.0; design.model.states()], vec![0.0; 8]);
        let mut demands = [0.0; 8];
        let mut readings = [0.0; 16];
        readings[0] = 0.01;
        controller.step(&readings, &[0.0; 8], &mut demands);
        assert!(demands.iter().all(|demand| demand.abs() <= 1.0));
        assert!(demands.iter().any(|demand| demand.abs() == 1.0));
    }
}
