//! Healthy recordings to a [`LearnedModule`].

use nalgebra::{DMatrix, DVector};

use super::super::fault_set::SetRule;
use super::super::gaussian::Gaussian;
use super::super::threshold::exceeded_once_in;
use super::cleaning::{self, CleanedInterval, MOST_DROPPED};
use super::judge::{LARGEST_SET, Largest, Statistics, differences};
use super::window::{longest_run, medians, samples_per_window};
use super::{LEARNED_VERSION, LearnedChannel, LearnedModule};

/// Ridge of the regression, in variances of an input.
const RIDGE: f64 = 1e-3;
/// Factor of correlations of a sensor's residual with anything else.
const SHRINKAGE: f64 = 0.98;
/// Added to the variance of each input, as a share of it.
const INPUT_RIDGE: f64 = 1e-6;
/// Factor of correlations of changes.
const CHANGE_SHRINKAGE: f64 = 1.0 - 1e-3;
/// Parts of a recording that stand for recordings if it is the only one.
const PARTS: usize = 5;
/// Least thresholds as z'²: of the reference with three recordings or more, with fewer, and of a change.
const LEAST_REFERENCE: f64 = 25.0;
const LEAST_REFERENCE_OF_FEW: f64 = 36.0;
const LEAST_CHANGE: f64 = 60.0;
/// Factor on the largest change in recordings that were left out, as z'².
const CHANGE_MARGIN: f64 = 1.5;
/// Share of the inputs' variance above which a direction counts as one in which they move.
const DIRECTION: f64 = 0.05;
/// An input whose range is below so many times its noise did not move.
const MOVED: f64 = 10.0;
/// Squared correlation above which a sensor repeats another.
const REPEATS: f64 = 1.0 - 1e-10;
/// How long a channel may keep one value: times the longest run in healthy recordings, plus seconds; of one recording,
/// and of several.
const CONSTANT_IN_ONE: (f64, f64) = (10.0, 60.0);
const CONSTANT: (f64, f64) = (3.0, 10.0);
/// Windows that a recording needs.
const LEAST_WINDOWS: usize = 30;

/// A recording of the healthy structure.
#[derive(Debug, Clone, PartialEq)]
pub struct HealthyRecording {
    /// What it is called in messages.
    pub name: String,
    /// Time between two samples \[s\].
    pub step_s: f64,
    /// The samples of each channel, sensors first; NaN is missing.
    pub channels: Vec<Vec<f64>>,
}

/// How to learn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LearningSettings {
    /// Length of a window \[s\]; that of a sample if samples are further apart.
    pub window_s: f64,
    /// False alarms of the reference per hour.
    pub alarms_per_hour: f64,
}

impl Default for LearningSettings {
    fn default() -> Self {
        Self { window_s: 1.0, alarms_per_hour: 0.01 }
    }
}

/// What was learnt, and what should be known of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Learnt {
    /// The module.
    pub module: LearnedModule,
    /// Of each sensor, the share of its variance that the inputs explain in recordings that were left out.
    pub explained: Vec<f64>,
    /// What was taken for faults and left out.
    pub cleaned: Vec<CleanedInterval>,
}

/// Why nothing can be learnt.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LearningError {
    /// Fewer windows than needed.
    #[error(
        "`{recording}` has {windows} complete windows of {window_s} s; use at least {LEAST_WINDOWS}: a longer \
         recording, or a shorter --window of one row or more"
    )]
    TooShort {
        /// The recording.
        recording: String,
        /// Its windows without a missing channel.
        windows: usize,
        /// Their length \[s\].
        window_s: f64,
    },
    /// Fewer windows than so many channels need.
    #[error(
        "{recordings} recordings have together {windows} complete windows of {window_s} s; {channels} channels need at \
         least {least}: use longer recordings or more of them, or at most {most} channels"
    )]
    TooFewWindows {
        /// How many.
        recordings: usize,
        /// Their windows without a missing channel.
        windows: usize,
        /// Their length \[s\].
        window_s: f64,
        /// Sensors and inputs.
        channels: usize,
        /// Windows needed.
        least: usize,
        /// The channels that the windows are enough for.
        most: usize,
    },
    /// More looks like faults than may be.
    #[error(
        "{percent:.0} % of `{recording}` looks faulty, most of it `{channel}`; use a healthy recording, or leave the \
         channel out"
    )]
    Unclean {
        /// The recording.
        recording: String,
        /// The channel that departs most often.
        channel: String,
        /// Share dropped.
        percent: f64,
    },
    /// An input that did not move tells nothing of its effect.
    #[error("input `{0}` never moved; use recordings in which it does, or leave it out")]
    InputStill(String),
    /// A channel that never changed.
    #[error("sensor `{0}` never changed; leave it out")]
    SensorStill(String),
    /// Two channels with the same readings.
    #[error("`{0}` repeats `{1}`; leave one of them out")]
    Repeats(String, String),
    /// Too few channels for an isolation.
    #[error(
        "{channels} channels whose inputs move in {directions} directions cannot be told apart; add sensors until \
         there are at least {least} channels"
    )]
    TooFewChannels {
        /// Sensors and inputs.
        channels: usize,
        /// Directions of the inputs.
        directions: usize,
        /// Channels needed.
        least: usize,
    },
    /// The covariance has no inverse.
    #[error("the channels cannot be told apart: {0}")]
    Singular(&'static str),
}

/// First and second moments of windows, in units common to all recordings.
#[derive(Debug, Clone)]
struct Moments {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Moments {
    fn of<'a>(windows: impl Iterator<Item = &'a Vec<f64>> + Clone, size: usize) -> Self {
        let count = windows.clone().count().max(1) as f64;
        let mut mean = DVector::zeros(size);
        windows.clone().for_each(|w| mean += DVector::from_column_slice(w));
        mean /= count;
        let mut covariance = DMatrix::zeros(size, size);
        for window in windows {
            let off = DVector::from_column_slice(window) - &mean;
            covariance.ger(1.0 / count, &off, &off, 1.0);
        }
        Self { mean, covariance }
    }

    /// Of all recordings, each with the same weight.
    fn pooled(parts: &[&Moments]) -> Self {
        let weight = 1.0 / parts.len() as f64;
        let mut mean = DVector::zeros(parts[0].mean.len());
        parts.iter().for_each(|part| mean.axpy(weight, &part.mean, 1.0));
        let mut covariance = DMatrix::zeros(mean.len(), mean.len());
        for part in parts {
            let off = &part.mean - &mean;
            covariance += &part.covariance * weight;
            covariance.ger(weight, &off, &off, 1.0);
        }
        Self { mean, covariance }
    }

    /// Of a linear transform with an offset.
    fn transformed(&self, matrix: &DMatrix<f64>, offset: &DVector<f64>) -> Self {
        Self {
            mean: matrix * &self.mean + offset,
            covariance: matrix * &self.covariance * matrix.transpose(),
        }
    }

    /// The regression of the sensors on the inputs as a transform of channels to residuals and inputs.
    fn regression(&self, sensors: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let size = self.mean.len();
        let inputs = size - sensors;
        let mut of_inputs =
            self.covariance.view((sensors, sensors), (inputs, inputs)).clone_owned();
        for k in 0..inputs {
            of_inputs[(k, k)] *= 1.0 + RIDGE;
        }
        let common = self.covariance.view((0, sensors), (sensors, inputs)).clone_owned();
        let slopes = common * of_inputs.cholesky()?.inverse();
        let mut matrix = DMatrix::identity(size, size);
        matrix.view_mut((0, sensors), (sensors, inputs)).copy_from(&-&slopes);
        let mut offset = DVector::zeros(size);
        let of_sensors = self.mean.rows(0, sensors) - slopes * self.mean.rows(sensors, inputs);
        offset.rows_mut(0, sensors).copy_from(&-of_sensors);
        Some((matrix, offset))
    }
}

/// A healthy recording in windows.
struct RecordedWindows {
    values: Vec<Vec<f64>>,
    whole: Moments,
    parts: Vec<Moments>,
    /// Differences over six windows, where there are.
    changes: Moments,
}

/// Learns a module.
///
/// # Errors
/// What cannot be learnt from, and what would help.
pub fn learn(
    recordings: &[HealthyRecording],
    names: &[String],
    sensors: usize,
    settings: LearningSettings,
) -> Result<Learnt, LearningError> {
    let size = names.len();
    // A window has at least one sample of each recording.
    let step_s = recordings.iter().map(|recording| recording.step_s).fold(0.0, f64::max);
    let settings = LearningSettings { window_s: settings.window_s.max(step_s), ..settings };
    let mut cleaned = Vec::new();
    let kept = clean(recordings, names, settings.window_s, &mut cleaned)?;
    let scales = scales(&kept, names, sensors)?;
    let windows: Vec<RecordedWindows> =
        kept.into_iter().map(|kept| in_units(kept, &scales)).collect();
    let wholes: Vec<&Moments> = windows.iter().map(|one| &one.whole).collect();
    let pooled = Moments::pooled(&wholes);
    check_repeats(&pooled, names)?;
    let directions = directions(&pooled, sensors);
    if size < directions + 2 {
        let least = directions + 2;
        return Err(LearningError::TooFewChannels { channels: size, directions, least });
    }
    let all: Vec<&RecordedWindows> = windows.iter().collect();
    let (reference, change) = gaussians(&all, sensors)?;
    let thresholds = thresholds(&windows, sensors, settings)?;
    let explained = explained(&all, sensors)?;
    let (reference, change) = (scaled(reference, &scales, 1.0), scaled(change, &scales, 0.0));
    let places: Vec<usize> = (0..size).collect();
    let smallest = reference.smallest_displacements(&places, thresholds.reference);
    let channel = |k: usize| {
        let values = windows.iter().flat_map(|one| &one.values).map(|w| w[k]);
        let finite =
            values.filter(|x| x.is_finite()).map(|x| scales.centre[k] + scales.unit[k] * x);
        let (lowest, highest) =
            finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let run_s = |r: &HealthyRecording| longest_run(&r.channels[k]) as f64 * r.step_s;
        let longest = recordings.iter().map(run_s).fold(0.0, f64::max);
        let (times, plus) = if recordings.len() == 1 { CONSTANT_IN_ONE } else { CONSTANT };
        LearnedChannel {
            name: names[k].clone(),
            lowest,
            highest,
            longest_constant_s: times * longest + plus,
            smallest_found: smallest.get(k).copied().unwrap_or(f64::INFINITY),
        }
    };
    let used = windows.iter().flat_map(|one| &one.values).filter(|w| is_complete(w)).count();
    let module = LearnedModule {
        v: LEARNED_VERSION,
        window_s: settings.window_s,
        sensors,
        directions,
        reference_threshold: thresholds.reference,
        change_threshold: thresholds.change,
        distance_threshold: thresholds.distance,
        recordings: recordings.iter().map(|recording| recording.name.clone()).collect(),
        hours: used as f64 * settings.window_s / 3600.0,
        channels: (0..size).map(channel).collect(),
        reference,
        change,
    };
    Ok(Learnt { module, explained, cleaned })
}

fn is_complete(window: &[f64]) -> bool {
    window.iter().all(|x| x.is_finite())
}

/// The windows of each recording, those that look faulty without values.
fn clean(
    recordings: &[HealthyRecording],
    names: &[String],
    window_s: f64,
    cleaned: &mut Vec<CleanedInterval>,
) -> Result<Vec<Vec<Vec<f64>>>, LearningError> {
    let mut kept = Vec::new();
    let mut together = 0;
    for recording in recordings {
        let per_window = samples_per_window(recording.step_s, window_s);
        let of_channels: Vec<Vec<f64>> =
            recording.channels.iter().map(|samples| medians(samples, per_window)).collect();
        let count = of_channels.iter().map(Vec::len).min().unwrap_or(0);
        let windows: Vec<Vec<f64>> =
            (0..count).map(|k| of_channels.iter().map(|channel| channel[k]).collect()).collect();
        let complete = windows.iter().filter(|window| is_complete(window)).count();
        if complete < LEAST_WINDOWS {
            let recording = recording.name.clone();
            return Err(LearningError::TooShort { recording, windows: complete, window_s });
        }
        together += complete;
        kept.push(windows);
    }
    let channels = names.len();
    let least = cleaning::least_windows(channels);
    if together < least {
        return Err(LearningError::TooFewWindows {
            recordings: recordings.len(),
            windows: together,
            window_s,
            channels,
            least,
            most: together * channels / least,
        });
    }
    let dropped = cleaning::suspects(&kept);
    for ((recording, windows), dropped) in recordings.iter().zip(&mut kept).zip(dropped) {
        let share = dropped.iter().flatten().count() as f64 / windows.len() as f64;
        if share > MOST_DROPPED {
            let often =
                |k: &usize| dropped.iter().flatten().filter(|channel| *channel == k).count();
            let worst = (0..channels).max_by_key(often).unwrap_or(0);
            return Err(LearningError::Unclean {
                recording: recording.name.clone(),
                channel: names[worst].clone(),
                percent: 100.0 * share,
            });
        }
        let per_window = samples_per_window(recording.step_s, window_s);
        cleaned.extend(cleaning::intervals(&recording.name, names, &dropped, per_window));
        for (window, _) in windows.iter_mut().zip(&dropped).filter(|(_, dropped)| dropped.is_some())
        {
            window.fill(f64::NAN);
        }
    }
    Ok(kept)
}

/// Units in which the channels are alike.
struct Scales {
    centre: Vec<f64>,
    unit: Vec<f64>,
}

fn scales(
    recordings: &[Vec<Vec<f64>>],
    names: &[String],
    sensors: usize,
) -> Result<Scales, LearningError> {
    let mut scales = Scales { centre: Vec::new(), unit: Vec::new() };
    for (k, name) in names.iter().enumerate() {
        let values = || recordings.iter().flatten().map(|w| w[k]).filter(|x| x.is_finite());
        let count = values().count() as f64;
        let mean = values().sum::<f64>() / count;
        let deviation = (values().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
        let (low, high) =
            values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        // Against the noise, that is the median step between windows.
        let steps = recordings.iter().flat_map(|r| r.windows(2)).map(|w| (w[1][k] - w[0][k]).abs());
        let noise = super::window::median(&mut steps.filter(|s| s.is_finite()).collect::<Vec<_>>());
        let resolution = 1e-9 * mean.abs();
        if deviation.is_nan() || deviation <= resolution {
            return Err(match k < sensors {
                true => LearningError::SensorStill(name.clone()),
                false => LearningError::InputStill(name.clone()),
            });
        }
        if k >= sensors && high - low < MOVED * noise {
            return Err(LearningError::InputStill(name.clone()));
        }
        scales.centre.push(mean);
        scales.unit.push(deviation);
    }
    Ok(scales)
}

fn in_units(kept: Vec<Vec<f64>>, scales: &Scales) -> RecordedWindows {
    let size = scales.unit.len();
    let unit = |(k, x): (usize, f64)| (x - scales.centre[k]) / scales.unit[k];
    let values: Vec<Vec<f64>> =
        kept.into_iter().map(|w| w.into_iter().enumerate().map(unit).collect()).collect();
    let complete: Vec<Vec<f64>> = values.iter().filter(|w| is_complete(w)).cloned().collect();
    let changes: Vec<Vec<f64>> = differences(&values).filter(|d| is_complete(d)).collect();
    let part = complete.len().div_ceil(PARTS).max(1);
    RecordedWindows {
        whole: Moments::of(complete.iter(), size),
        parts: complete.chunks(part).map(|part| Moments::of(part.iter(), size)).collect(),
        changes: Moments::of(changes.iter(), size),
        values,
    }
}

fn check_repeats(pooled: &Moments, names: &[String]) -> Result<(), LearningError> {
    let variance = pooled.covariance.diagonal();
    for a in 0..names.len() {
        for b in 0..a {
            let squared = pooled.covariance[(a, b)].powi(2) / (variance[a] * variance[b]);
            if squared > REPEATS {
                return Err(LearningError::Repeats(names[a].clone(), names[b].clone()));
            }
        }
    }
    Ok(())
}

/// The directions in which the inputs move.
fn directions(pooled: &Moments, sensors: usize) -> usize {
    let inputs = pooled.mean.len() - sensors;
    let of_inputs = pooled.covariance.view((sensors, sensors), (inputs, inputs)).clone_owned();
    let unit = of_inputs.diagonal().map(|variance| 1.0 / variance.sqrt());
    let correlation =
        DMatrix::from_fn(inputs, inputs, |a, b| unit[a] * of_inputs[(a, b)] * unit[b]);
    let share = |eigenvalue: &&f64| **eigenvalue > DIRECTION * inputs as f64;
    correlation.symmetric_eigenvalues().iter().filter(share).count()
}

/// The residuals that regressions on the other recordings leave, and the inputs.
fn left_out(
    recordings: &[&RecordedWindows],
    sensors: usize,
) -> Result<Vec<Moments>, LearningError> {
    // A single one is taken in parts.
    let parts: Vec<&Moments> = match recordings {
        [one] => one.parts.iter().collect(),
        several => several.iter().map(|recording| &recording.whole).collect(),
    };
    let of_part = |own: usize| {
        let others: Vec<&Moments> =
            (0..parts.len()).filter(|k| *k != own).map(|k| parts[k]).collect();
        let (matrix, offset) = Moments::pooled(&others).regression(sensors)?;
        Some(parts[own].transformed(&matrix, &offset))
    };
    let of_parts: Option<Vec<Moments>> = (0..parts.len()).map(of_part).collect();
    of_parts.ok_or(LearningError::Singular("their inputs have no inverse"))
}

/// Reference and change, in the common units.
fn gaussians(
    recordings: &[&RecordedWindows],
    sensors: usize,
) -> Result<(Gaussian, Gaussian), LearningError> {
    let left_out = left_out(recordings, sensors)?;
    let mut residuals = Moments::pooled(&left_out.iter().collect::<Vec<_>>());
    let size = residuals.mean.len();
    for a in 0..size {
        for b in (0..size).filter(|b| *b != a && (a < sensors || *b < sensors)) {
            residuals.covariance[(a, b)] *= SHRINKAGE;
        }
    }
    for k in sensors..size {
        residuals.covariance[(k, k)] *= 1.0 + INPUT_RIDGE;
    }
    // Back to the channels, by the regression on all.
    let wholes: Vec<&Moments> = recordings.iter().map(|recording| &recording.whole).collect();
    let regression = Moments::pooled(&wholes).regression(sensors);
    let (matrix, offset) =
        regression.ok_or(LearningError::Singular("the inputs have no inverse"))?;
    let back = matrix.try_inverse().ok_or(LearningError::Singular("no inverse"))?;
    let from = -(&back * offset);
    let channels = residuals.transformed(&back, &from);
    let reference = Gaussian::of_covariance(recordings.len(), &channels.mean, &channels.covariance);
    let changes: Vec<&Moments> = recordings.iter().map(|recording| &recording.changes).collect();
    let mut changes = Moments::pooled(&changes);
    let mean = std::mem::replace(&mut changes.mean, DVector::zeros(size));
    changes.covariance.ger(1.0, &mean, &mean, 1.0);
    let mut change = Gaussian::of_covariance(recordings.len(), &changes.mean, &changes.covariance);
    change.correlations.iter_mut().flatten().for_each(|r| *r *= CHANGE_SHRINKAGE);
    let sound = reference.is_sound(size) && change.is_sound(size);
    if sound { Ok((reference, change)) } else { Err(LearningError::Singular("no inverse")) }
}

/// A Gaussian of values in the common units as one of values in their own; the mean of a change has no centre.
fn scaled(mut gaussian: Gaussian, scales: &Scales, centred: f64) -> Gaussian {
    for (k, unit) in scales.unit.iter().enumerate() {
        gaussian.mean[k] = centred * scales.centre[k] + unit * gaussian.mean[k];
        gaussian.deviation[k] *= unit;
    }
    gaussian
}

/// The share of each sensor's variance that the inputs explain in recordings left out.
fn explained(recordings: &[&RecordedWindows], sensors: usize) -> Result<Vec<f64>, LearningError> {
    let left_out = left_out(recordings, sensors)?;
    let residuals = Moments::pooled(&left_out.iter().collect::<Vec<_>>());
    let wholes: Vec<&Moments> = recordings.iter().map(|recording| &recording.whole).collect();
    let all = Moments::pooled(&wholes);
    let share = |k: usize| {
        let off = residuals.mean[k];
        1.0 - (residuals.covariance[(k, k)] + off * off) / all.covariance[(k, k)]
    };
    Ok((0..sensors).map(share).collect())
}

/// The thresholds, from each recording judged by the others; of a single one, from its parts judged by it.
fn thresholds(
    recordings: &[RecordedWindows],
    sensors: usize,
    settings: LearningSettings,
) -> Result<LearnedThresholds, LearningError> {
    // Of windows longer than a minute, each stands for itself.
    let per_minute = (60.0 / settings.window_s).ceil().max(1.0) as usize;
    let mut minutes: Vec<Largest> = Vec::new();
    for own in 0..recordings.len() {
        let mut others: Vec<&RecordedWindows> = recordings.iter().collect();
        if recordings.len() > 1 {
            others.remove(own);
        }
        let (reference, change) = gaussians(&others, sensors)?;
        let mut statistics = Statistics::default();
        for minute in recordings[own].values.chunks(per_minute) {
            let each = minute.iter().map(|w| statistics.largest_held(&reference, &change, w));
            minutes.push(each.fold(Largest::default(), Largest::of));
        }
    }
    let minute_s = per_minute as f64 * settings.window_s;
    let once_in = 3600.0 / (settings.alarms_per_hour * minute_s);
    let of_minutes = |value: fn(&Largest) -> f64| -> f64 {
        exceeded_once_in(once_in, &minutes.iter().map(value).collect::<Vec<_>>())
    };
    let least = if recordings.len() < 3 { LEAST_REFERENCE_OF_FEW } else { LEAST_REFERENCE };
    let largest_change = minutes.iter().map(|minute| minute.change).fold(0.0, f64::max);
    Ok(LearnedThresholds {
        reference: of_minutes(|minute| minute.reference).max(least.sqrt()),
        change: (CHANGE_MARGIN.sqrt() * largest_change).max(LEAST_CHANGE.sqrt()),
        distance: of_minutes(|minute| minute.distance).max(least.sqrt()),
    })
}

/// Thresholds as z', and as the root of a distance.
struct LearnedThresholds {
    reference: f64,
    change: f64,
    distance: f64,
}

/// The rule for sets of displaced channels, if this many are present.
pub(super) fn set_rule(module: &LearnedModule, present: usize, threshold: f64) -> SetRule {
    // z' alone counts: with a few recordings z says little.
    let largest = present.saturating_sub(module.directions + 1).min(LARGEST_SET);
    SetRule { threshold, by_far: f64::INFINITY, largest }
}
