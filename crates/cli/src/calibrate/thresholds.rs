//! From divergences to thresholds, and to a table of these.

use study::tail::{TailError, TailThreshold};
use study::{Calibration, ModulePeaks};

use super::NominalData;
use super::arguments::ThresholdRule;
use crate::failure::Failure;
use crate::table::{TextTable, table};

/// The threshold of a channel, and what it rests on.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChannelThreshold {
    /// The largest divergence.
    pub(super) largest: f64,
    /// The tail that was fitted.
    pub(super) tail: Option<TailThreshold>,
    /// γ.
    pub(super) threshold: f64,
}

/// The thresholds of all channels: a list for each module.
pub(super) fn thresholds(
    data: &NominalData,
    rule: ThresholdRule,
) -> Result<Vec<Vec<ChannelThreshold>>, Failure> {
    let calibration = &data.calibration;
    check_alive(calibration)?;
    let largest = calibration.modules.iter().map(|module| {
        let channels = module.channels.iter();
        channels.map(|channel| channel.peaks.largest()).collect::<Vec<f64>>()
    });
    match rule {
        ThresholdRule::Max { margin } => {
            let channel_threshold = |largest| ChannelThreshold {
                largest,
                tail: None,
                threshold: round(largest * margin),
            };
            Ok(largest
                .map(|channels| channels.into_iter().map(channel_threshold).collect())
                .collect())
        }
        ThresholdRule::Tail { per_hour } => {
            let tails = calibration.tail_thresholds(data.step_s, per_hour).map_err(failure)?;
            let channel_threshold = |(largest, tail): (f64, TailThreshold)| ChannelThreshold {
                largest,
                tail: Some(tail),
                threshold: round(tail.threshold),
            };
            let of_module = |(largest, tails): (Vec<f64>, Vec<TailThreshold>)| {
                largest.into_iter().zip(tails).map(channel_threshold).collect()
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

/// Four digits are plenty for a threshold, and pleasant to read.
pub(super) fn round(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// A line for each channel: its largest divergence, what was fitted, its threshold.
pub(super) fn threshold_table(module: &ModulePeaks, thresholds: &[ChannelThreshold]) -> TextTable {
    let fitted = thresholds.iter().any(|threshold| threshold.tail.is_some());
    let channels = module.channels.iter().map(|channel| &channel.component).zip(thresholds);
    let name = |component| format!("{}/{component}", module.module);
    if !fitted {
        let mut lines = table(&["channel", "largest", "threshold"]);
        for (component, threshold) in channels {
            lines.add_row([
                name(component),
                number(threshold.largest),
                number(threshold.threshold),
            ]);
        }
        return lines;
    }
    let mut lines = table(&["channel", "largest", "shape", "scale", "known within", "threshold"]);
    for (component, threshold) in channels {
        let of_tail = |text: &dyn Fn(&study::tail::TailThreshold) -> String| {
            threshold.tail.as_ref().map_or_else(String::new, text)
        };
        lines.add_row([
            name(component),
            number(threshold.largest),
            of_tail(&|tail| format!("{:.2}", tail.tail.shape)),
            of_tail(&|tail| number(tail.tail.scale)),
            of_tail(&|tail| format!("×{:.2}", tail.log_spread.exp())),
            number(threshold.threshold),
        ]);
    }
    lines
}

fn number(x: f64) -> String {
    format!("{x:.3e}")
}
