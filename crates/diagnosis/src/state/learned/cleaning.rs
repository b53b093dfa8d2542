//! Takes faults out of healthy recordings: a fault that is learnt is not found again.
//!
//! Each recording is judged by itself: the residual of each channel given all others, by a Gaussian of the windows that
//! are kept, from its median and in units of its median absolute deviation. What departs is dropped, and the Gaussian
//! fitted again.
//!
//! A Gaussian of few windows and many channels follows every window that it is fitted to, faults too, and misses by far
//! those that it is not. Recordings that are so short are judged by all of them together, each channel from its mean in
//! each recording, since its zero may differ.
//!
//! A fault that lasts long hides itself: in a Gaussian of all windows it is one more cause of scatter, and the residual
//! of its channel is wide in healthy windows too. Then the Gaussian is begun with the three quarters of the windows that
//! are nearest to it (Rousseeuw and van Driessen, *A fast algorithm for the minimum covariance determinant estimator*,
//! 1999). Only then, because such a core may lack the loads that are rare, and takes them for faults.

use super::super::gaussian::{Gaussian, Inverses};
use super::window::median;

/// Residual beyond which a window is dropped, in median absolute deviations.
const LIMIT: f64 = 20.0;
/// Share of the windows that make the core.
const CORE: f64 = 0.75;
/// So many times narrower is a channel's residual in the Gaussian from the core if a fault hides in that of all.
const HIDES: f64 = 2.5;
/// A residual below this share of its channel's scatter is the resolution of the readings.
const RESOLUTION: f64 = 1e-3;
/// Windows dropped on either side of one that is.
const MARGIN: usize = 10;
/// Share of a recording that may be dropped.
pub(super) const MOST_DROPPED: f64 = 0.1;
/// Windows for each channel of which a Gaussian tells faults: with these a single window, however far off, exceeds the
/// limit beside what it adds to the residuals of the others.
const WINDOWS_PER_CHANNEL: usize = 3;
/// Times a Gaussian is fitted at most.
const ROUNDS: usize = 20;
/// Taken off each correlation, so that channels that repeat each other can be inverted.
const SHRINKAGE: f64 = 1e-4;
/// The least scale of a residual, as a share of the standard deviation of those that may not be faults: most of a
/// coarsely quantised one are zero.
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

/// What a Gaussian, fitted again and again, makes of the windows.
struct Refit {
    /// The channel that departs most, in each window that is dropped.
    dropped: Vec<Option<usize>>,
    /// Scale of each channel's residual in all windows.
    scales: Vec<f64>,
}

/// Complete windows that are needed to judge so many channels.
pub(super) fn least_windows(channels: usize) -> usize {
    WINDOWS_PER_CHANNEL * channels
}

/// Which windows of each recording are kept, with the channel that departs most in each of the others. Windows are
/// complete or not; the incomplete ones are kept, for they are no evidence.
pub(super) fn suspects(recordings: &[Vec<Vec<f64>>]) -> Vec<Vec<Option<usize>>> {
    let is_short = |windows: &Vec<Vec<f64>>| {
        let channels = windows.first().map_or(0, Vec::len);
        windows.iter().filter(|window| is_complete(window)).count() < least_windows(channels)
    };
    let mut together: Vec<Option<usize>> = match recordings.iter().any(is_short) {
        true => departing(
            &recordings.iter().flat_map(|windows| from_means(windows)).collect::<Vec<_>>(),
        ),
        false => Vec::new(),
    };
    let of_recording = |windows: &Vec<Vec<f64>>| {
        let rest = together.split_off(windows.len().min(together.len()));
        let of_all = std::mem::replace(&mut together, rest);
        with_margin(&if is_short(windows) { of_all } else { departing(windows) })
    };
    recordings.iter().map(of_recording).collect()
}

fn is_complete(window: &[f64]) -> bool {
    window.iter().all(|x| x.is_finite())
}

/// Each channel less its mean: medians would not follow from each other as the channels do.
fn from_means(windows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let complete: Vec<&Vec<f64>> = windows.iter().filter(|window| is_complete(window)).collect();
    let mean = |k: usize| complete.iter().map(|w| w[k]).sum::<f64>() / complete.len() as f64;
    let means: Vec<f64> = (0..windows.first().map_or(0, Vec::len)).map(mean).collect();
    windows.iter().map(|w| w.iter().zip(&means).map(|(x, mean)| x - mean).collect()).collect()
}

/// The channel that departs most, in each window that does not belong to the others.
fn departing(windows: &[Vec<f64>]) -> Vec<Option<usize>> {
    let complete: Vec<bool> = windows.iter().map(|window| is_complete(window)).collect();
    let Some(of_all) = refit(windows, &complete, complete.clone()) else {
        return vec![None; windows.len()];
    };
    hidden(windows, &complete, &of_all).unwrap_or(of_all.dropped)
}

/// What is dropped if the windows begin with their core, and faults of some channels had been hidden; only these are taken
/// from there.
fn hidden(windows: &[Vec<f64>], complete: &[bool], of_all: &Refit) -> Option<Vec<Option<usize>>> {
    let of_core = refit(windows, complete, core(windows, complete)?)?;
    let rows = chosen(windows, complete);
    let hides = |channel: usize| {
        let (_, scatter) = robust(&rows.iter().map(|row| row[channel]).collect::<Vec<_>>());
        of_all.scales[channel] > HIDES * of_core.scales[channel].max(RESOLUTION * scatter)
    };
    let hides: Vec<bool> = (0..of_all.scales.len()).map(hides).collect();
    if !hides.contains(&true) {
        return None;
    }
    let is_kept =
        |k: usize| complete[k] && !of_core.dropped[k].is_some_and(|channel| hides[channel]);
    let kept = (0..windows.len()).map(is_kept).collect();
    Some(refit(windows, complete, kept)?.dropped)
}

fn chosen(windows: &[Vec<f64>], which: &[bool]) -> Vec<Vec<f64>> {
    windows.iter().zip(which).filter(|(_, chosen)| **chosen).map(|(w, _)| w.clone()).collect()
}

fn gaussian(rows: &[Vec<f64>]) -> Option<Gaussian> {
    let channels = rows.first()?.len();
    let mut gaussian = Gaussian::of_rows(
        rows.iter().map(Vec::as_slice),
        &vec![f64::MIN_POSITIVE.sqrt(); channels],
    );
    gaussian.correlations.iter_mut().flatten().for_each(|r| *r *= 1.0 - SHRINKAGE);
    Some(gaussian)
}

/// The windows that are nearest to their own Gaussian.
fn core(windows: &[Vec<f64>], complete: &[bool]) -> Option<Vec<bool>> {
    let all = complete.iter().filter(|complete| **complete).count();
    let count = (CORE * all as f64).ceil() as usize;
    let mut kept = complete.to_vec();
    for _ in 0..ROUNDS {
        let fitted = gaussian(&chosen(windows, &kept))?;
        let mut inverses = Inverses::default();
        let mut distance = |k: usize| match complete[k] {
            true => Some(fitted.compare_with(&windows[k], &mut inverses)?.distance()),
            false => Some(f64::INFINITY),
        };
        let distances: Vec<f64> = (0..windows.len()).map(&mut distance).collect::<Option<_>>()?;
        let mut sorted = distances.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let farthest = *sorted.get(count.checked_sub(1)?)?;
        let next: Vec<bool> = distances.iter().map(|distance| *distance <= farthest).collect();
        if next == kept {
            break;
        }
        kept = next;
    }
    Some(kept)
}

/// Fits a Gaussian to the windows that are kept, drops what departs from it and keeps the others, until nothing changes.
fn refit(windows: &[Vec<f64>], complete: &[bool], mut kept: Vec<bool>) -> Option<Refit> {
    let mut latest = None;
    for _ in 0..ROUNDS {
        let fitted = judge(windows, complete, &kept)?;
        let next: Vec<bool> =
            complete.iter().zip(&fitted.dropped).map(|(c, d)| *c && d.is_none()).collect();
        let settled = next == kept;
        latest = Some(fitted);
        if settled {
            break;
        }
        kept = next;
    }
    latest
}

fn judge(windows: &[Vec<f64>], complete: &[bool], kept: &[bool]) -> Option<Refit> {
    let gaussian = gaussian(&chosen(windows, kept))?;
    let places: Vec<usize> = (0..gaussian.mean.len()).collect();
    let mut worst: Vec<Option<(f64, usize)>> = vec![None; windows.len()];
    let mut scales = Vec::with_capacity(places.len());
    for &channel in &places {
        let (weights, _) = gaussian.regression(&places, channel)?;
        let residual = |window: &Vec<f64>| -> f64 {
            let terms = window.iter().zip(&gaussian.mean).zip(&weights);
            terms.map(|((x, mean), weight)| (x - mean) * weight).sum()
        };
        let residuals: Vec<f64> = windows.iter().map(residual).collect();
        let of = |which: &[bool]| -> Vec<f64> {
            residuals.iter().zip(which).filter(|(_, chosen)| **chosen).map(|(r, _)| *r).collect()
        };
        let (centre, scale) = robust(&of(kept));
        scales.push(robust(&of(complete)).1);
        for k in (0..windows.len()).filter(|k| complete[*k]) {
            let ratio = (residuals[k] - centre).abs() / scale;
            if ratio > LIMIT && worst[k].is_none_or(|(largest, _)| ratio > largest) {
                worst[k] = Some((ratio, channel));
            }
        }
    }
    let dropped = worst.into_iter().map(|found| found.map(|(_, channel)| channel)).collect();
    Some(Refit { dropped, scales })
}

/// Median and scale of residuals, a tenth of which may be faults.
fn robust(residuals: &[f64]) -> (f64, f64) {
    let centre = median(&mut residuals.to_vec());
    let mut off: Vec<f64> = residuals.iter().map(|residual| (residual - centre).abs()).collect();
    off.sort_unstable_by(f64::total_cmp);
    let spread = median(&mut off);
    off.truncate(((1.0 - MOST_DROPPED) * off.len() as f64).ceil() as usize);
    let deviation = (off.iter().map(|x| x * x).sum::<f64>() / off.len().max(1) as f64).sqrt();
    (centre, spread.max(LEAST_SCALE * deviation).max(f64::MIN_POSITIVE))
}

/// Drops windows next to dropped ones too.
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
