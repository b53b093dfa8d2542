//! Takes faults out of healthy recordings: a fault that is learnt is not found again.
//!
//! Each recording is judged by itself: the residual of each channel given all others, by a Gaussian of the windows that
//! are kept, in units of its median absolute deviation.

use super::super::gaussian::Gaussian;
use super::window::median;

/// Residual beyond which a window is dropped, in median absolute deviations.
const LIMIT: f64 = 20.0;
/// The same for the first choice, by the running median of each channel.
const FIRST_LIMIT: f64 = 30.0;
/// Windows around one for its running median \[s\].
const RUNNING_S: f64 = 120.0;
/// Windows dropped on either side of one that is.
const MARGIN: usize = 10;
/// Share of a recording that may be dropped.
pub(super) const MOST_DROPPED: f64 = 0.1;
/// Times a Gaussian is fitted at most.
const ROUNDS: usize = 20;
/// Taken off each correlation, so that channels that repeat each other can be inverted.
const SHRINKAGE: f64 = 1e-4;
/// The least scale of a residual, as a share of its standard deviation: most of a coarsely quantised one are zero.
const LEAST_SCALE: f64 = 0.25;

/// Windows of a healthy recording that were not learnt from.
#[derive(Debug, Clone, PartialEq)]
pub struct CleanedInterval {
    /// The recording's name.
    pub recording: String,
    /// The channel that departs most.
    pub channel: String,
    /// First and last sample, from 0.
    pub samples: (usize, usize),
}

/// Which windows are kept, with the channel that departs most in each of the others. `windows` are complete or not; the
/// incomplete ones are kept, for they are no evidence.
pub(super) fn suspects(windows: &[Vec<f64>], window_s: f64) -> Vec<Option<usize>> {
    let complete: Vec<bool> = windows.iter().map(|w| w.iter().all(|x| x.is_finite())).collect();
    let mut dropped = outliers_of_running_median(windows, (RUNNING_S / window_s) as usize);
    for _ in 0..ROUNDS {
        let kept: Vec<Vec<f64>> = (0..windows.len())
            .filter(|k| complete[*k] && dropped[*k].is_none())
            .map(|k| windows[k].clone())
            .collect();
        let Some(found) = judge(&kept, windows, &complete) else { break };
        if found == dropped {
            break;
        }
        dropped = found;
    }
    with_margin(&dropped)
}

fn outliers_of_running_median(windows: &[Vec<f64>], around: usize) -> Vec<Option<usize>> {
    let channels = windows.first().map_or(0, Vec::len);
    let mut dropped = vec![None; windows.len()];
    for channel in 0..channels {
        let series: Vec<f64> = windows.iter().map(|window| window[channel]).collect();
        let off = |k: usize| {
            let from = k.saturating_sub(around / 2);
            let to = (k + around / 2 + 1).min(series.len());
            (series[k] - median(&mut series[from..to].to_vec())).abs()
        };
        let offs: Vec<f64> = (0..series.len()).map(off).collect();
        let scale = scale(&offs);
        for (k, off) in offs.iter().enumerate() {
            if *off > FIRST_LIMIT * scale {
                dropped[k].get_or_insert(channel);
            }
        }
    }
    dropped
}

/// A robust scale of residuals' absolute values.
fn scale(absolute: &[f64]) -> f64 {
    let finite: Vec<f64> = absolute.iter().copied().filter(|x| x.is_finite()).collect();
    let deviation = (finite.iter().map(|x| x * x).sum::<f64>() / finite.len().max(1) as f64).sqrt();
    median(&mut finite.clone()).max(LEAST_SCALE * deviation).max(f64::MIN_POSITIVE)
}

fn judge(kept: &[Vec<f64>], windows: &[Vec<f64>], complete: &[bool]) -> Option<Vec<Option<usize>>> {
    let channels = kept.first()?.len();
    let mut gaussian = Gaussian::of_rows(kept, &vec![f64::MIN_POSITIVE.sqrt(); channels]);
    gaussian.correlations.iter_mut().flatten().for_each(|r| *r *= 1.0 - SHRINKAGE);
    let places: Vec<usize> = (0..channels).collect();
    let mut worst: Vec<Option<(f64, usize)>> = vec![None; windows.len()];
    for channel in 0..channels {
        let (weights, _) = gaussian.regression(&places, channel)?;
        let residual = |window: &Vec<f64>| -> f64 {
            let terms = window.iter().zip(&gaussian.mean).zip(&weights);
            terms.map(|((x, mean), weight)| (x - mean) * weight).sum::<f64>().abs()
        };
        let scale = scale(&kept.iter().map(residual).collect::<Vec<_>>());
        for (k, window) in windows.iter().enumerate().filter(|(k, _)| complete[*k]) {
            let ratio = residual(window) / scale;
            if ratio > LIMIT && worst[k].is_none_or(|(largest, _)| ratio > largest) {
                worst[k] = Some((ratio, channel));
            }
        }
    }
    Some(worst.into_iter().map(|found| found.map(|(_, channel)| channel)).collect())
}

/// Drops the neighbours of what is dropped.
fn with_margin(dropped: &[Option<usize>]) -> Vec<Option<usize>> {
    let near = |k: usize| {
        let (from, to) = (k.saturating_sub(MARGIN), (k + MARGIN + 1).min(dropped.len()));
        dropped[k].or_else(|| dropped[from..to].iter().copied().flatten().next())
    };
    (0..dropped.len()).map(near).collect()
}

/// The intervals that were dropped.
pub(super) fn intervals(
    recording: &str,
    names: &[String],
    dropped: &[Option<usize>],
    per_window: usize,
) -> Vec<CleanedInterval> {
    let mut found: Vec<CleanedInterval> = Vec::new();
    let mut open = false;
    for (k, channel) in dropped.iter().enumerate() {
        let Some(channel) = channel else {
            open = false;
            continue;
        };
        let end = (k + 1) * per_window - 1;
        match found.last_mut().filter(|_| open) {
            Some(interval) => interval.samples.1 = end,
            None => found.push(CleanedInterval {
                recording: recording.to_owned(),
                channel: names[*channel].clone(),
                samples: (k * per_window, end),
            }),
        }
        open = true;
    }
    found
}
