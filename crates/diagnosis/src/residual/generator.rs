//! All residuals of a module, sample by sample (eq. 13 and 14).
//!
//! - `demand`: r = u − F_act, the paper's (eq. 13);
//! - `tracking`: r = F̂(u) − F_act with the nominal force loop F̂ driven by the same demand;
//! - sensors: r = y − ζ, with ζ from the local model driven by the module's observed forces and
//!   nominal gain 1 (eq. 14; with the faulty gain a zero output would cancel itself).

use std::fmt;

use serde::{Deserialize, Serialize};
use truss::{ModalStepper, ModelError, Structure};

use super::nominal_hydraulics::NominalHydraulics;
use super::tracked_force::TrackedForce;
use crate::sample::Measurements;

/// Longest gap, in time constants of the force loops, that these are stepped through under demands on a straight line:
/// after two a healthy tower's divergences stay below half their thresholds, after five they are above. Beyond it the
/// loops take up the forces that are measured after the gap.
const LONGEST_GAP_OF_LOOPS: f64 = 2.0;

/// How many time constants a force loop that took up a measured force remembers that measurement's noise.
const LOOPS_SETTLE: f64 = 5.0;

/// Longest gap that the structure is stepped through under forces on a straight line \[s\]: a third of the period of a
/// tower's first mode. After half a second divergences still stay below their thresholds, after a whole one not.
const LONGEST_GAP_OF_STRUCTURE_S: f64 = 0.2;

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

impl fmt::Display for ActuatorResidual {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ActuatorResidual::Demand => "`demand`",
            ActuatorResidual::Tracking => "`tracking`",
        })
    }
}

/// What drives the models at a step.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct ModelInputs {
    forces: Vec<f64>,
    demands: Vec<f64>,
}

impl ModelInputs {
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

/// Most samples that may be missing in a row, sampled every `step_s` seconds, before a diagnoser learns its channels
/// anew.
#[must_use]
pub fn longest_gap_of_structure(step_s: f64) -> u64 {
    ((LONGEST_GAP_OF_STRUCTURE_S / step_s).round() as u64).max(1)
}

/// Lost samples that the force loops are stepped through. Without loops the structure's model is the only limit.
pub(crate) fn longest_gap_of_loops(hydraulics: Option<&NominalHydraulics>, step_s: f64) -> u64 {
    let Some(hydraulics) = hydraulics else { return longest_gap_of_structure(step_s) };
    ((LONGEST_GAP_OF_LOOPS * hydraulics.time_constant_s() / step_s).round() as u64).max(1)
}

/// Turns samples into residuals: actuators first, then gages, in the order of the description.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ResidualGenerator {
    kind: ActuatorResidual,
    /// Deviation of an observed force due to the noise of its pressures \[N\].
    force_noise_n: f64,
    hydraulics: Option<NominalHydraulics>,
    local: ModalStepper,
    loops: Vec<TrackedForce>,
    contents_pa: Vec<f64>,
    /// At the latest sample, at the one before, and between the two.
    now: ModelInputs,
    earlier: ModelInputs,
    between: ModelInputs,
    /// Lost samples before the next one.
    missing: u64,
    /// How far each actuator's demand moved across the latest gap \[N\]. On which way is not known: the nominal
    /// force may be wrong by as much.
    swings_n: Vec<f64>,
    residuals: Vec<f64>,
    /// What the local model says that the gages read, at the latest sample \[m\].
    modelled_m: Vec<f64>,
    longest_gap_of_loops: u64,
    longest_gap_of_structure: u64,
    loops_settle: u64,
    structure_follows: bool,
    loops_follow: bool,
    /// Steps until the force loops have forgotten where they began.
    unsettled: u64,
}

impl ResidualGenerator {
    /// A generator for the one module of `local`, sampled every `step_s` seconds. `hydraulics` may be left out only if
    /// the module has no actuators.
    ///
    /// # Errors
    /// A structure of which no model can be made.
    pub fn new(
        local: &Structure,
        hydraulics: Option<NominalHydraulics>,
        kind: ActuatorResidual,
        step_s: f64,
    ) -> Result<Self, ModelError> {
        let local = ModalStepper::of_module(local, step_s)?;
        let actuators = local.input_count();
        let steps = |seconds: f64| ((seconds / step_s).round() as u64).max(1);
        let time_constant_s = hydraulics.as_ref().map_or(0.0, NominalHydraulics::time_constant_s);
        let force_loop = hydraulics.map(|hydraulics| TrackedForce::new(hydraulics, step_s));
        Ok(Self {
            kind,
            longest_gap_of_loops: longest_gap_of_loops(hydraulics.as_ref(), step_s),
            longest_gap_of_structure: longest_gap_of_structure(step_s),
            loops_settle: steps(LOOPS_SETTLE * time_constant_s),
            loops: force_loop.map_or_else(Vec::new, |force_loop| vec![force_loop; actuators]),
            force_noise_n: hydraulics.map_or(0.0, |known| known.force_variance().sqrt()),
            hydraulics,
            contents_pa: vec![0.0; actuators],
            now: ModelInputs::none(actuators),
            earlier: ModelInputs::none(actuators),
            between: ModelInputs::none(actuators),
            missing: 0,
            swings_n: vec![0.0; actuators],
            residuals: vec![0.0; actuators + local.output_count()],
            modelled_m: vec![0.0; local.output_count()],
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
        if missing > self.longest_gap_of_structure {
            self.restart();
            return false;
        }
        self.missing = missing;
        if missing > self.longest_gap_of_loops {
            self.loops_follow = false;
            self.unsettled = self.loops_settle;
        }
        true
    }

    /// The residuals of a sample, which must have been checked: actuators \[N\], then gages \[m\].
    pub fn push(&mut self, sample: &Measurements) -> &[f64] {
        self.earlier.forces.copy_from_slice(&self.now.forces);
        self.earlier.demands.copy_from_slice(&self.now.demands);
        if let Some(hydraulics) = &self.hydraulics {
            let observed = self.now.forces.iter_mut().zip(&mut self.contents_pa);
            for ((force, content), pressures) in observed.zip(&sample.pressures_pa) {
                *force = hydraulics.force_n(*pressures);
                *content = hydraulics.content_pa(*pressures);
            }
        }
        self.now.demands.copy_from_slice(&sample.demands_n);
        self.cross_gap();
        if self.structure_follows {
            self.move_structure();
        }
        self.settle(sample);
        let actuators = self.now.forces.len();
        let (of_actuators, of_gages) = self.residuals.split_at_mut(actuators);
        for (i, residual) in of_actuators.iter_mut().enumerate() {
            *residual = match self.kind {
                ActuatorResidual::Demand => self.now.demands[i] - self.now.forces[i],
                ActuatorResidual::Tracking => self.loops[i].force_n() - self.now.forces[i],
            };
        }
        for (force_loop, pressures) in self.loops.iter_mut().zip(&sample.pressures_pa) {
            force_loop.lean(*pressures);
        }
        self.local.outputs(&mut self.modelled_m);
        let both = sample.elongations_m.iter().zip(&self.modelled_m);
        for (residual, (measured, modelled)) in of_gages.iter_mut().zip(both) {
            *residual = measured - modelled;
        }
        self.advance();
        self.unsettled = self.unsettled.saturating_sub(1);
        &self.residuals
    }

    /// The pressures that the nominal force loop of an actuator has reached \[Pa\].
    pub(crate) fn expected_pressures_pa(&self, actuator: usize) -> [f64; 2] {
        self.loops[actuator].pressures_pa()
    }

    /// How far a channel's residual may be off because the demand moved \[N\], noise included: 0 while that is less
    /// than noise, for a gage, and where an actuator's residual is its distance from the demand.
    pub(crate) fn margin_n(&self, channel: usize) -> f64 {
        let tracked = self.loops.get(channel).filter(|_| self.kind == ActuatorResidual::Tracking);
        let noise = self.force_noise_n;
        let margin = tracked.map(TrackedForce::margin_n).filter(|margin| *margin > noise);
        margin.map_or(0.0, |margin| margin + noise)
    }

    /// How far an actuator's demand moved across the latest gap \[N\].
    pub(crate) fn swing_n(&self, actuator: usize) -> f64 {
        self.swings_n[actuator]
    }

    /// The observed forces of the latest sample \[N\].
    pub(crate) fn forces_n(&self) -> &[f64] {
        &self.now.forces
    }

    /// The oil contents of the cylinders at the latest sample \[Pa\].
    pub(crate) fn contents_pa(&self) -> &[f64] {
        &self.contents_pa
    }

    /// What the local model says that the gages read, at the latest sample \[m\].
    pub(crate) fn modelled_m(&self) -> &[f64] {
        &self.modelled_m
    }

    /// The residuals of the latest sample.
    pub(crate) fn residuals(&self) -> &[f64] {
        &self.residuals
    }

    /// Steps the models through the lost samples before the latest one.
    fn cross_gap(&mut self) {
        let missing = self.missing;
        if missing > 0 {
            let ends = self.now.demands.iter().zip(&self.earlier.demands);
            for (swing, (after, before)) in self.swings_n.iter_mut().zip(ends) {
                *swing = (after - before).abs();
            }
        }
        for place in 1..=missing {
            let share = place as f64 / (missing + 1) as f64;
            blend(&mut self.between.demands, &self.earlier.demands, &self.now.demands, share);
            for (force_loop, demand) in self.loops.iter_mut().zip(&self.between.demands) {
                force_loop.step(*demand);
            }
        }
    }

    /// Moves the structure's model from the sample before to the latest one: forces between samples are on a straight
    /// line, so over each step their mean acts.
    fn move_structure(&mut self) {
        let steps = std::mem::take(&mut self.missing) + 1;
        for place in 0..steps {
            let share = (place as f64 + 0.5) / steps as f64;
            blend(&mut self.between.forces, &self.earlier.forces, &self.now.forces, share);
            self.local.step(&self.between.forces, &[]);
        }
    }

    /// Moves the force loops on to the next step under the latest demands.
    fn advance(&mut self) {
        for (force_loop, demand) in self.loops.iter_mut().zip(&self.now.demands) {
            force_loop.step(*demand);
        }
    }

    /// Lets models that do not follow the plant begin where it is.
    fn settle(&mut self, sample: &Measurements) {
        if !self.structure_follows {
            self.local.settle(&self.now.forces, &[]);
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
