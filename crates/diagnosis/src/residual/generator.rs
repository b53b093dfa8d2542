//! All residuals of a module, sample by sample (eq. 13 and 14).
//!
//! - `demand`: r = u − F_act, the paper's (eq. 13);
//! - `tracking`: r = F̂(u) − F_act with the nominal force loop F̂ driven by the same demand;
//! - sensors: r = y − ζ, with ζ from the local model driven by the module's observed forces and
//!   nominal gain 1 (eq. 14; with the faulty gain a zero output would cancel itself).

use serde::{Deserialize, Serialize};
use truss::{LocalModel, ModelError, Structure};

use super::force_loop::ForceLoop;
use super::nominal_hydraulics::NominalHydraulics;
use crate::sample::Sample;

/// Longest gap, in steps, that the force loops are stepped through under demands on a straight line. Their
/// time constant is ten: after 20 steps a healthy tower's divergences stay below half their thresholds, after
/// 50 they are above. Beyond it the loops take up the forces that are measured after the gap.
const LONGEST_GAP_OF_LOOPS: u64 = 20;

/// How long, in steps, a force loop that took up a measured force remembers that measurement's noise: five
/// time constants.
const LOOPS_SETTLE: u64 = 50;

/// Longest gap, in steps, that the structure is stepped through under forces on a straight line: a third of
/// the period of its first mode. After 500 steps divergences still stay below their thresholds, after 1000 not.
const LONGEST_GAP_OF_STRUCTURE: u64 = 200;

/// Which residual an actuator is watched by.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActuatorResidual {
    /// u − F_act (eq. 13).
    Demand,
    /// F̂(u) − F_act.
    #[default]
    Tracking,
}

/// What drives the models at a step.
#[derive(Debug, Clone)]
struct Signals {
    forces: Vec<f64>,
    demands: Vec<f64>,
}

impl Signals {
    fn none(actuators: usize) -> Self {
        Self { forces: vec![0.0; actuators], demands: vec![0.0; actuators] }
    }
}

/// Values on the straight line from one to the other.
fn blend(into: &mut [f64], from: &[f64], to: &[f64], share: f64) {
    for (value, (from, to)) in into.iter_mut().zip(from.iter().zip(to)) {
        *value = from + share * (to - from);
    }
}

/// Turns samples into residuals: actuators first, then gages, in the order of the description.
#[derive(Debug, Clone)]
pub struct ResidualGenerator {
    kind: ActuatorResidual,
    hydraulics: NominalHydraulics,
    local: LocalModel,
    loops: Vec<ForceLoop>,
    forces: Vec<f64>,
    demands: Vec<f64>,
    /// Those of the sample before, and between the two.
    earlier: Signals,
    between: Signals,
    /// Lost samples before the next one.
    missing: u64,
    /// How far each actuator's demand moved across the latest gap \[N\]. On which way is not known: the nominal
    /// force may be wrong by as much.
    swings_n: Vec<f64>,
    residuals: Vec<f64>,
    structure_follows: bool,
    loops_follow: bool,
    /// Steps until the force loops have forgotten where they began.
    unsettled: u64,
}

impl ResidualGenerator {
    /// A generator for the one module of `local`, sampled every `step_s` seconds.
    ///
    /// # Errors
    /// A structure of which no model can be made.
    pub fn new(
        local: &Structure,
        hydraulics: NominalHydraulics,
        kind: ActuatorResidual,
        step_s: f64,
    ) -> Result<Self, ModelError> {
        let local = LocalModel::new(local, step_s)?;
        let actuators = local.actuator_count();
        Ok(Self {
            kind,
            loops: vec![ForceLoop::new(hydraulics, step_s, [0.0; 2]); actuators],
            hydraulics,
            forces: vec![0.0; actuators],
            demands: vec![0.0; actuators],
            earlier: Signals::none(actuators),
            between: Signals::none(actuators),
            missing: 0,
            swings_n: vec![0.0; actuators],
            residuals: vec![0.0; actuators + local.gage_count()],
            local,
            structure_follows: false,
            loops_follow: false,
            unsettled: 0,
        })
    }

    /// Forgets the past: the next sample settles the models.
    pub fn restart(&mut self) {
        self.structure_follows = false;
        self.loops_follow = false;
        self.unsettled = 0;
        self.missing = 0;
    }

    /// Will the residuals of the next sample count? Soon after a gap they do not.
    #[must_use]
    pub fn is_settled(&self) -> bool {
        self.unsettled == 0
    }

    /// Notes that `missing` samples are lost before the next one: the models are stepped through them under
    /// signals on a straight line from the sample before the gap to the one after it. Returns whether the
    /// residuals after the gap can be compared with those before it; otherwise the models restart.
    #[must_use]
    pub fn bridge(&mut self, missing: u64) -> bool {
        if missing > LONGEST_GAP_OF_STRUCTURE {
            self.restart();
            return false;
        }
        self.missing = missing;
        if missing > LONGEST_GAP_OF_LOOPS {
            self.loops_follow = false;
            self.unsettled = LOOPS_SETTLE;
        }
        true
    }

    /// The residuals of a sample, which must have been checked: actuators \[N\], then gages \[m\].
    pub fn push(&mut self, sample: &Sample) -> &[f64] {
        self.earlier.forces.copy_from_slice(&self.forces);
        self.earlier.demands.copy_from_slice(&self.demands);
        for (force, pressures) in self.forces.iter_mut().zip(&sample.pressures_pa) {
            *force = self.hydraulics.force_n(*pressures);
        }
        self.demands.copy_from_slice(&sample.demands_n);
        self.cross_gap();
        self.settle(sample);
        let actuators = self.forces.len();
        let (of_actuators, of_gages) = self.residuals.split_at_mut(actuators);
        for (i, residual) in of_actuators.iter_mut().enumerate() {
            let expected = match self.kind {
                ActuatorResidual::Demand => self.demands[i],
                ActuatorResidual::Tracking => self.loops[i].force_n(),
            };
            *residual = expected - self.forces[i];
        }
        self.local.elongations(of_gages);
        for (residual, measured) in of_gages.iter_mut().zip(&sample.elongations_m) {
            *residual = measured - *residual;
        }
        self.advance();
        self.unsettled = self.unsettled.saturating_sub(1);
        &self.residuals
    }

    /// The pressures that the nominal force loop of an actuator has reached \[Pa\].
    pub(crate) fn expected_pressures_pa(&self, actuator: usize) -> [f64; 2] {
        self.loops[actuator].pressures_pa()
    }

    /// How far an actuator's demand moved across the latest gap \[N\].
    pub(crate) fn swing_n(&self, actuator: usize) -> f64 {
        self.swings_n[actuator]
    }

    /// The residuals of the latest sample.
    pub(crate) fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// Steps the models through the lost samples before the latest one.
    fn cross_gap(&mut self) {
        let missing = std::mem::take(&mut self.missing);
        if missing > 0 {
            let ends = self.demands.iter().zip(&self.earlier.demands);
            for (swing, (after, before)) in self.swings_n.iter_mut().zip(ends) {
                *swing = (after - before).abs();
            }
        }
        for place in 1..=missing {
            let share = place as f64 / (missing + 1) as f64;
            blend(&mut self.between.forces, &self.earlier.forces, &self.forces, share);
            blend(&mut self.between.demands, &self.earlier.demands, &self.demands, share);
            self.local.step(&self.between.forces);
            for (force_loop, demand) in self.loops.iter_mut().zip(&self.between.demands) {
                force_loop.step(*demand);
            }
        }
    }

    /// Moves the models on to the next step under the latest forces and demands.
    fn advance(&mut self) {
        self.local.step(&self.forces);
        for (force_loop, demand) in self.loops.iter_mut().zip(&self.demands) {
            force_loop.step(*demand);
        }
    }

    /// Lets models that do not follow the plant begin where it is.
    fn settle(&mut self, sample: &Sample) {
        if !self.structure_follows {
            self.local.settle(&self.forces);
            self.structure_follows = true;
        }
        if !self.loops_follow {
            for (force_loop, pressures) in self.loops.iter_mut().zip(&sample.pressures_pa) {
                force_loop.settle(*pressures);
            }
            self.loops_follow = true;
        }
    }
}
