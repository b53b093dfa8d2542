//! Thresholds from nominal runs: the largest divergence that a disturbed but healthy structure gives,
//! times a margin (section 4.3 of the paper).

use diagnosis::Diagnoser;

use crate::rig::{Rig, RigError};

/// The largest divergences seen so far, of every channel of every module.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Calibration {
    /// One list a module: actuators, then gages.
    pub largest: Vec<Vec<f64>>,
}

impl Calibration {
    /// Takes the divergences of another run into account.
    pub fn merge(&mut self, other: &Calibration) {
        if self.largest.is_empty() {
            self.largest = vec![Vec::new(); other.largest.len()];
        }
        for (mine, theirs) in self.largest.iter_mut().zip(&other.largest) {
            mine.resize(theirs.len(), 0.0);
            for (a, b) in mine.iter_mut().zip(theirs) {
                *a = a.max(*b);
            }
        }
    }
}

/// The largest divergences of one nominal run of `steps` steps, from the moment that every channel is
/// watched. The rig should have thresholds that are never reached.
///
/// # Errors
/// See [`Rig::step`].
pub fn largest_divergences(rig: &mut Rig, steps: u64) -> Result<Calibration, RigError> {
    let channels = |d: &Diagnoser| vec![0.0_f64; d.components().len()];
    let mut largest: Vec<_> = rig.diagnosers().iter().map(channels).collect();
    for _ in 0..steps {
        rig.step()?;
        for (diagnoser, largest) in rig.diagnosers().iter().zip(&mut largest) {
            if !matches!(diagnoser.phase(), diagnosis::Phase::InService { .. }) {
                continue;
            }
            for (evidence, largest) in diagnoser.evidence().iter().zip(largest) {
                *largest =
                    evidence.divergence.map_or(*largest, |divergence| largest.max(divergence));
            }
        }
    }
    Ok(Calibration { largest })
}
