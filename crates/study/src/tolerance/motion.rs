//! The motion of the structure and the work of its cylinders in a run.

use truss::Structure;
use vocabulary::{ComponentPath, fault::FaultKind};

use crate::draw::components_that_can_have;
use crate::rig::Rig;

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
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RunMotion {
    /// Root mean square of the top's displacement \[m\].
    pub rms_top_m: f64,
    /// The largest strain of a gage's member \[m/m\].
    pub peak_strain: f64,
    /// Root mean square of the forces of the cylinders, without a faulty one \[N\].
    pub rms_force_n: f64,
    /// The largest demand \[N\], mean included; never relative.
    pub largest_demand_n: f64,
}

impl RunMotion {
    /// Relative to another.
    #[must_use]
    pub fn over(&self, other: &Self) -> Self {
        Self {
            rms_top_m: self.rms_top_m / other.rms_top_m,
            peak_strain: self.peak_strain / other.peak_strain,
            rms_force_n: self.rms_force_n / other.rms_force_n,
            largest_demand_n: self.largest_demand_n,
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
}

impl MotionFollower {
    pub(super) fn new(structure: &Structure, faulty: &ComponentPath) -> Self {
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
        let modules = &rig.plant().signals().modules;
        let elongations = modules.iter().flat_map(|module| &module.true_elongations_m);
        let strains = elongations.zip(&self.lengths_m).map(|(m, length)| m / length);
        self.strains.iter_mut().zip(strains).for_each(|(motion, strain)| motion.add(strain));
        let demands = modules.iter().flat_map(|module| &module.demands_n);
        self.largest_demand_n =
            demands.fold(self.largest_demand_n, |most, demand| most.max(demand.abs()));
        let forces = rig.diagnosers().iter().flat_map(|one| one.forces_n());
        let forces = forces.enumerate().filter(|(place, _)| Some(*place) != self.without);
        forces.enumerate().for_each(|(place, (_, force_n))| add(&mut self.forces, place, *force_n));
    }

    pub(super) fn finish(&self) -> RunMotion {
        let variance = |motions: &[Motion]| motions.iter().map(Motion::variance).sum::<f64>();
        let peaks = self.strains.iter().map(Motion::peak);
        RunMotion {
            rms_top_m: variance(&self.tops).sqrt(),
            peak_strain: peaks.fold(0.0, f64::max),
            rms_force_n: (variance(&self.forces) / self.forces.len().max(1) as f64).sqrt(),
            largest_demand_n: self.largest_demand_n,
        }
    }
}
