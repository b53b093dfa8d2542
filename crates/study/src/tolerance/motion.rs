//! The motion of the structure and the work of its cylinders in a run.

use vocabulary::{ComponentPath, fault::FaultKind};

use crate::draw::components_that_can_have;
use crate::rig::Rig;
use crate::system::System;

/// From one point of a trace to the next, and how many there are \[s\].
pub const TRACE_EVERY_S: f64 = 0.02;
const TRACED: usize = 250;

/// The spread of a value about its mean, and how far it gets from it.
#[derive(Debug, Clone, Copy, Default)]
struct Motion {
    count: f64,
    sum: f64,
    squares: f64,
    least: f64,
    largest: f64,
}

impl Motion {
    fn add(&mut self, value: f64) {
        if self.count == 0.0 {
            (self.least, self.largest) = (value, value);
        }
        self.count += 1.0;
        self.sum += value;
        self.squares += value * value;
        self.least = self.least.min(value);
        self.largest = self.largest.max(value);
    }

    fn mean(&self) -> f64 {
        self.sum / self.count
    }

    fn variance(&self) -> f64 {
        (self.squares / self.count - self.mean().powi(2)).max(0.0)
    }

    fn peak(&self) -> f64 {
        (self.largest - self.mean()).max(self.mean() - self.least)
    }
}

/// What a run is measured by, means taken off.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RunMotion {
    /// Root mean square of the top's displacement \[m\].
    pub rms_top_m: f64,
    /// The largest displacement of a node of the top in a direction \[m\].
    pub peak_top_m: f64,
    /// The largest strain of a gage's member \[m/m\].
    pub peak_strain: f64,
    /// Root mean square of the forces of the cylinders, without a faulty one \[N\].
    pub rms_force_n: f64,
    /// What the supply spends on the oil that these cylinders move to follow their demands \[J\].
    pub energy_j: f64,
    /// The largest demand \[N\], mean included; never relative.
    pub largest_demand_n: f64,
    /// The top's displacement in x and in y, from the onset on, every [`TRACE_EVERY_S`] \[µm\]; never relative. Only
    /// where the fault moves it much.
    pub top_um: Vec<[i32; 2]>,
}

impl RunMotion {
    /// Relative to another.
    #[must_use]
    pub fn over(&self, other: &Self) -> Self {
        Self {
            rms_top_m: self.rms_top_m / other.rms_top_m,
            peak_top_m: self.peak_top_m / other.peak_top_m,
            peak_strain: self.peak_strain / other.peak_strain,
            rms_force_n: self.rms_force_n / other.rms_force_n,
            energy_j: self.energy_j / other.energy_j,
            largest_demand_n: self.largest_demand_n,
            top_um: self.top_um.clone(),
        }
    }
}

/// Follows a run.
#[derive(Debug)]
pub(super) struct MotionFollower {
    tops: Vec<Motion>,
    strains: Vec<Motion>,
    forces: Vec<Motion>,
    lengths_m: Vec<f64>,
    /// The place of a cylinder whose force does not count.
    without: Option<usize>,
    largest_demand_n: f64,
    /// The demands, as late as forces follow them.
    followed_n: Vec<f64>,
    /// The share of a demand's change that a force follows in a step.
    following: f64,
    joules_per_n: f64,
    energy_j: f64,
    steps: u64,
    trace_every: u64,
    top_um: Vec<[i32; 2]>,
}

impl MotionFollower {
    pub(super) fn new(system: &System, faulty: &ComponentPath) -> Self {
        let (structure, hydraulics) = (&system.structure, &system.parameters.hydraulics);
        let cylinders = components_that_can_have(structure, FaultKind::HardOver);
        let without = cylinders.iter().position(|cylinder| cylinder == faulty);
        let gages = structure.equipped().flat_map(|module| &module.gages);
        let lengths_m: Vec<f64> = gages.map(|gage| structure.gage_length_m(gage)).collect();
        let strains = vec![Motion::default(); lengths_m.len()];
        Self {
            tops: Vec::new(),
            strains,
            forces: Vec::new(),
            lengths_m,
            without,
            largest_demand_n: 0.0,
            followed_n: Vec::new(),
            following: -(-system.parameters.step_s / hydraulics.time_constant_s()).exp_m1(),
            joules_per_n: hydraulics.supply_pa / hydraulics.newtons_per_m3(),
            energy_j: 0.0,
            steps: 0,
            trace_every: system.steps(TRACE_EVERY_S).max(1),
            top_um: Vec::new(),
        }
    }

    /// Takes the latest step.
    pub(super) fn take(&mut self, rig: &Rig) {
        let add = |motions: &mut Vec<Motion>, place: usize, value: f64| {
            if motions.len() == place {
                motions.push(Motion::default());
            }
            motions[place].add(value);
        };
        let tops = rig.plant().tops_m().flatten();
        tops.enumerate().for_each(|(place, top_m)| add(&mut self.tops, place, *top_m));
        if self.steps.is_multiple_of(self.trace_every) && self.top_um.len() < TRACED {
            let um = |top_m: Option<&f64>| (top_m.copied().unwrap_or(0.0) * 1e6).round() as i32;
            let top_m = rig.plant().tops_m().next().unwrap_or_default();
            self.top_um.push([um(top_m.first()), um(top_m.get(1))]);
        }
        self.steps += 1;
        let modules = &rig.plant().signals().modules;
        let elongations = modules.iter().flat_map(|module| &module.true_elongations_m);
        let strains = elongations.zip(&self.lengths_m).map(|(m, length)| m / length);
        self.strains.iter_mut().zip(strains).for_each(|(motion, strain)| motion.add(strain));
        let demands = modules.iter().flat_map(|module| &module.demands_n);
        self.largest_demand_n =
            demands.clone().fold(self.largest_demand_n, |most, demand| most.max(demand.abs()));
        if self.followed_n.is_empty() {
            self.followed_n.extend(demands.clone());
        }
        let followed = self.followed_n.iter_mut().zip(demands).enumerate();
        for (_, (followed_n, demand_n)) in followed.filter(|(at, _)| Some(*at) != self.without) {
            let change_n = self.following * (demand_n - *followed_n);
            *followed_n += change_n;
            self.energy_j += self.joules_per_n * change_n.abs();
        }
        let forces = rig.diagnosers().iter().flat_map(|one| one.forces_n());
        let forces = forces.enumerate().filter(|(place, _)| Some(*place) != self.without);
        forces.enumerate().for_each(|(place, (_, force_n))| add(&mut self.forces, place, *force_n));
    }

    pub(super) fn finish(&self) -> RunMotion {
        let variance = |motions: &[Motion]| motions.iter().map(Motion::variance).sum::<f64>();
        let peaks = self.strains.iter().map(Motion::peak);
        RunMotion {
            rms_top_m: variance(&self.tops).sqrt(),
            peak_top_m: self.tops.iter().map(Motion::peak).fold(0.0, f64::max),
            peak_strain: peaks.fold(0.0, f64::max),
            rms_force_n: (variance(&self.forces) / self.forces.len().max(1) as f64).sqrt(),
            energy_j: self.energy_j,
            largest_demand_n: self.largest_demand_n,
            top_um: self.top_um.clone(),
        }
    }
}
