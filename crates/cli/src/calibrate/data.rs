//! The divergences that thresholds are made of, and where they come from.

use daemon::thresholds::Provenance;
use study::Calibration;

use super::arguments::Wanted;
use super::digits::round;

/// The divergences that thresholds are made of.
#[derive(Debug)]
pub(super) struct Data {
    pub(super) calibration: Calibration,
    /// Length of a step [s].
    pub(super) step_s: f64,
    pub(super) origin: Origin,
}

/// Where data come from.
#[derive(Debug)]
pub(super) enum Origin {
    /// Simulated runs with seeds that follow one another.
    Simulated { first_seed: u64, runs: u64, mismatch: f64 },
    /// Files of residuals.
    Recorded { files: Vec<String> },
}

impl Data {
    /// The provenance for a module's thresholds file; `watched_steps` of its data were judged.
    pub(super) fn provenance(&self, wanted: Wanted, watched_steps: u64) -> Provenance {
        let (method, margin, false_alarms_per_hour) = match wanted {
            Wanted::Max { margin } => {
                ("largest divergence without a fault, times the margin", margin, None)
            }
            Wanted::Tail { per_hour } => (
                "generalised Pareto tail of the divergence's peaks without a fault, to false_alarms_per_hour",
                1.0,
                Some(per_hour),
            ),
        };
        let (seeds, recordings, runs, mismatch) = match &self.origin {
            Origin::Simulated { first_seed, runs, mismatch } => {
                let last = first_seed.saturating_add(runs.saturating_sub(1));
                let mismatch = Some(*mismatch).filter(|mismatch| *mismatch > 0.0);
                (Some(format!("{first_seed}..={last}")), Vec::new(), *runs, mismatch)
            }
            Origin::Recorded { files } => (None, files.clone(), files.len() as u64, None),
        };
        Provenance {
            method: method.into(),
            seeds,
            recordings,
            runs,
            hours: round(watched_steps as f64 * self.step_s / 3600.0),
            margin,
            mismatch,
            false_alarms_per_hour,
            note: None,
        }
    }
}
