//! From divergences to thresholds.

use study::Calibration;
use study::tail::{TailError, TailThreshold};

use super::arguments::Wanted;
use super::data::Data;
use super::digits::round;
use crate::failure::Failure;

/// The threshold of a channel, and what it rests on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gamma {
    /// The largest divergence.
    pub(super) largest: f64,
    /// The tail that was fitted.
    pub(super) tail: Option<TailThreshold>,
    /// γ.
    pub(super) threshold: f64,
}

/// The thresholds of all channels: a list for each module.
pub(super) fn gammas(data: &Data, wanted: Wanted) -> Result<Vec<Vec<Gamma>>, Failure> {
    let calibration = &data.calibration;
    check_alive(calibration)?;
    let largest = calibration.modules.iter().map(|module| {
        let channels = module.channels.iter();
        channels.map(|channel| channel.peaks.largest()).collect::<Vec<f64>>()
    });
    match wanted {
        Wanted::Max { margin } => {
            let gamma = |largest| Gamma { largest, tail: None, threshold: round(largest * margin) };
            Ok(largest.map(|channels| channels.into_iter().map(gamma).collect()).collect())
        }
        Wanted::Tail { per_hour } => {
            let tails = calibration.tail_thresholds(data.step_s, per_hour).map_err(failure)?;
            let gamma = |(largest, tail): (f64, TailThreshold)| Gamma {
                largest,
                tail: Some(tail),
                threshold: round(tail.threshold),
            };
            let of_module = |(largest, tails): (Vec<f64>, Vec<TailThreshold>)| {
                largest.into_iter().zip(tails).map(gamma).collect()
            };
            Ok(largest.zip(tails).map(of_module).collect())
        }
    }
}

fn check_alive(calibration: &Calibration) -> Result<(), Failure> {
    for module in &calibration.modules {
        let dead = module.channels.iter().find(|channel| channel.peaks.largest() <= 0.0);
        if let Some(channel) = dead {
            let (module, component) = (&module.module, &channel.component);
            return Err(Failure::input(format!(
                "`{module}/{component}`: the divergence is always 0; is its residual stuck?"
            )));
        }
    }
    Ok(())
}

fn failure(error: TailError) -> Failure {
    match error {
        TailError::Rate(_) | TailError::TooFrequent { .. } => Failure::usage(error.to_string()),
        TailError::TooFew { .. } | TailError::TooUncertain { .. } | TailError::Alike { .. } => {
            Failure::runtime(error.to_string())
        }
    }
}
