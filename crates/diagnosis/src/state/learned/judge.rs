//! A stream of samples, judged by what was learnt.
//!
//! A change names first, because it shows jumps several times smaller and nearly always in the right channel; the
//! reference finds what creeps or was there before. Either needs two windows, one after the other. A channel that is
//! accused or has no signal is left out while the others are judged. Beyond the loads seen nothing is called normal.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};
use vocabulary::Obstacle;

use super::super::fault_set::{is_evidence, smallest};
use super::super::gaussian::{Gaussian, GaussianComparison, Inverses, ValueDeparture};
use super::LearnedModule;
use super::kind::{DisplacedChannel, Displacement, FittedKind};
use super::learning::set_rule;
use super::window::{ConstantRun, median, samples_per_window};

/// Most channels that may be displaced at a time.
pub(super) const LARGEST_SET: usize = 3;
/// Windows of a change: those before, and the latest.
const BEFORE: usize = 4;
const LATEST: usize = 2;
/// How far an input may be beyond what was seen, as a share of its range, before nothing can be told.
const BEYOND: f64 = 0.1;
/// Factor on z'² beyond the loads seen.
const BEYOND_MARGIN: f64 = 1.5;
/// A reading this many ranges beyond the learnt range is not taken as a measurement.
const IMPLAUSIBLE: f64 = 10.0;
/// Windows in which a channel must agree before its fault has ended.
const AGREEING: usize = 10;
/// Share of the threshold below which it agrees.
const AGREES: f64 = 0.5;
/// Another channel is meant as well if its z'² is so large a share of the largest.
const AS_WELL: f64 = 0.8;
/// A change back has a size between these shares of the first.
const BACK: std::ops::Range<f64> = 0.5..2.0;
/// Most displacements of a fault that its kind is told by; of more, every second one is kept.
const MOST_DISPLACEMENTS: usize = 1200;
/// For how long displacements before the onset are remembered \[s\], and how many windows at least: a channel that creeps
/// is displaced before it is found.
const REMEMBERED_S: f64 = 60.0;
const LEAST_REMEMBERED: f64 = 60.0;

/// What is known of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum ChannelState {
    /// It agrees with the others, in loads that were seen.
    Normal,
    /// Beyond the loads seen, or several channels or the structure differ.
    Unknown,
    /// Missing, constant or implausible.
    NoSignal,
    /// Its reading is not what the others say.
    Faulty,
}

impl ChannelState {
    /// As machine output names it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Normal => "normal",
            Self::Unknown => "unknown",
            Self::NoSignal => "no_signal",
            Self::Faulty => "faulty",
        }
    }
}

/// A state that lasted from one sample to another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChannelVerdict {
    /// The channel; `None` of all that are not judged otherwise.
    pub channel: Option<usize>,
    /// Never normal.
    pub state: ChannelState,
    /// First sample, from 0.
    pub first: u64,
    /// Last sample.
    pub last: u64,
    /// Did it last until the end of the samples?
    pub lasts: bool,
    /// In words: what was departed from, or why nothing is known.
    pub reason: String,
    /// What a faulty channel has.
    pub fault: Option<FittedKind>,
}

/// What came of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelSummary {
    /// The worst state.
    pub state: ChannelState,
    /// The sample at which that began.
    pub first: u64,
    /// Share of the windows in which it was normal.
    pub normal: f64,
}

/// How a channel stands at present.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ChannelStanding {
    pub(crate) state: ChannelState,
    /// The sample at which a fault or a loss of the signal began; else the latest one.
    pub(crate) first: u64,
    /// What was found of it last.
    pub(crate) found: Option<ShownDeparture>,
}

/// How far a channel is from what the others say.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct ShownDeparture {
    /// How much too large its reading is, or has become, in its unit.
    pub(crate) size: f64,
    /// z'.
    pub(crate) statistic: f64,
    pub(crate) threshold: f64,
}

/// A channel's fault, as long as it lasts.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OpenFault {
    first: u64,
    /// The displacement, if a change named it.
    by_change: Option<f64>,
    /// Did the reference confirm it?
    by_reference: bool,
    agreeing: usize,
    agreed_since: u64,
    before: Vec<f64>,
    displacements: Vec<Displacement>,
}

/// An interval of another state, as long as it lasts.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct OpenInterval {
    first: u64,
    reason: String,
}

#[derive(Debug, Clone, Default, Serialize, Deserialize)]
struct ChannelTrack {
    run: ConstantRun,
    samples: Vec<f64>,
    no_signal: Option<OpenInterval>,
    fault: Option<OpenFault>,
    recent: VecDeque<f64>,
    found: Option<ShownDeparture>,
    worst: Option<(ChannelState, u64)>,
    normal: u64,
}

/// Judges samples, one after the other.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct LearnedJudge {
    module: LearnedModule,
    step_s: f64,
    per_window: usize,
    samples: u64,
    windows: u64,
    tracks: Vec<ChannelTrack>,
    statistics: Statistics,
    /// The channels that the reference accused in the window before; `None` if no set fitted.
    accused: Option<Vec<usize>>,
    /// Windows in a row whose distance from the reference is too large.
    far: usize,
    unknown: Option<OpenInterval>,
    /// Why nothing is called normal at present.
    obstacle: Option<Obstacle>,
    closed: Vec<ChannelVerdict>,
}

impl LearnedJudge {
    /// Judges samples that are so far apart \[s\].
    pub fn new(module: LearnedModule, step_s: f64) -> Self {
        let per_window = samples_per_window(step_s, module.window_s);
        let tracks = vec![ChannelTrack::default(); module.channels.len()];
        Self {
            module,
            step_s,
            per_window,
            samples: 0,
            windows: 0,
            tracks,
            statistics: Statistics::default(),
            accused: Some(Vec::new()),
            far: 0,
            unknown: None,
            obstacle: None,
            closed: Vec::new(),
        }
    }

    /// Forgets all samples.
    pub(crate) fn restart(&mut self) {
        *self = Self::new(self.module.clone(), self.step_s);
    }

    /// Skips samples that never arrived; no signal is lost by that. A window with less than half of its samples is not
    /// judged, and no change is computed across it.
    pub(crate) fn skip(&mut self, missing: u64) {
        let per_window = self.per_window as u64;
        let (before, after) = (self.samples, self.samples + missing);
        let ended = after / per_window - before / per_window;
        if ended > 0 {
            self.samples = (before / per_window + 1) * per_window;
            self.end_window();
            if ended > 1 {
                self.statistics.forget();
            }
        }
        self.samples = after;
    }

    /// Ends a window, of which some samples may never have come: is it judged?
    fn end_window(&mut self) -> bool {
        let enough = self.tracks.iter().all(|track| 2 * track.samples.len() >= self.per_window);
        if enough {
            self.window();
        } else {
            self.tracks.iter_mut().for_each(|track| track.samples.clear());
            self.statistics.forget();
        }
        enough
    }

    /// What is known against a channel counts no more; if it still departs, that is found anew.
    pub(crate) fn forgive(&mut self, channel: usize) {
        let track = &mut self.tracks[channel];
        if track.fault.take().is_some() | track.no_signal.take().is_some() {
            self.statistics.forget();
        }
    }

    /// How a channel stands since the latest window.
    pub(crate) fn standing(&self, channel: usize) -> ChannelStanding {
        let track = &self.tracks[channel];
        let (state, first) = match (&track.fault, &track.no_signal) {
            (Some(fault), _) => (ChannelState::Faulty, fault.first),
            (None, Some(open)) => (ChannelState::NoSignal, open.first),
            (None, None) if self.obstacle.is_some() => (ChannelState::Unknown, self.samples),
            (None, None) => (ChannelState::Normal, self.samples),
        };
        ChannelStanding { state, first, found: track.found }
    }

    /// The state of a channel since the latest window.
    pub fn state(&self, channel: usize) -> ChannelState {
        self.standing(channel).state
    }

    /// Why nothing is called normal at present.
    pub(crate) fn obstacle(&self) -> Option<&Obstacle> {
        self.obstacle.as_ref()
    }

    /// Samples of a window.
    pub(crate) fn per_window(&self) -> u64 {
        self.per_window as u64
    }

    /// Takes the next sample, a value for each channel, NaN if missing. Returns what has ended.
    pub fn take(&mut self, sample: &[f64]) -> Vec<ChannelVerdict> {
        for ((track, channel), &value) in
            self.tracks.iter_mut().zip(&self.module.channels).zip(sample)
        {
            let margin = IMPLAUSIBLE * channel.range();
            let plausible = (channel.lowest - margin..=channel.highest + margin).contains(&value);
            let run_s = track.run.take(value) as f64 * self.step_s;
            let measures = plausible && run_s <= channel.longest_constant_s;
            track.samples.push(if measures { value } else { f64::NAN });
        }
        self.samples += 1;
        if self.samples.is_multiple_of(self.per_window as u64) {
            self.end_window();
        }
        std::mem::take(&mut self.closed)
    }

    /// Ends the stream: what lasts until now, and the summary of each channel.
    pub fn finish(mut self) -> (Vec<ChannelVerdict>, Vec<ChannelSummary>) {
        for channel in 0..self.tracks.len() {
            self.end_no_signal(channel, None);
            self.end_fault(channel, None);
        }
        self.end_unknown(None);
        let windows = self.windows.max(1) as f64;
        let summary = |track: &ChannelTrack| {
            let (state, first) = track.worst.unwrap_or(match track.normal {
                0 => (ChannelState::Unknown, 0),
                _ => (ChannelState::Normal, 0),
            });
            ChannelSummary { state, first, normal: track.normal as f64 / windows }
        };
        let summaries = self.tracks.iter().map(summary).collect();
        (self.closed, summaries)
    }

    /// What a faulty channel should have read in the latest window, if the others tell, and within what (95 %).
    pub fn expected(&self, channel: usize) -> Option<[f64; 2]> {
        Some(self.displaced(channel)?.expected())
    }

    /// What tells the kind of a channel's present fault; `None` without one, and until a window has followed it.
    pub(crate) fn displaced(&self, channel: usize) -> Option<DisplacedChannel> {
        let fault = self.tracks[channel].fault.as_ref().filter(|f| !f.displacements.is_empty())?;
        Some(DisplacedChannel {
            found: fault.displacements.clone(),
            before: fault.before.clone(),
            changed: fault.by_change,
            channel: self.module.channels[channel].clone(),
            deviation: self.module.reference.deviation_given_others(channel),
        })
    }

    /// The number of whole windows so far.
    pub fn windows(&self) -> u64 {
        self.windows
    }

    /// The sample at which the window before the latest began: what two windows show began there.
    fn onset(&self) -> u64 {
        self.samples.saturating_sub(2 * self.per_window as u64)
    }

    fn window(&mut self) {
        self.windows += 1;
        let values: Vec<f64> =
            self.tracks.iter_mut().map(|track| median(&mut track.samples)).collect();
        self.tracks.iter_mut().for_each(|track| track.samples.clear());
        self.judge_signals(&values);
        let beyond = self.beyond(&values);
        let factor = match beyond {
            Some(beyond) if beyond <= BEYOND => 1.0,
            beyond => BEYOND_MARGIN.sqrt() * (1.0 + beyond.unwrap_or(0.0)),
        };
        self.statistics.push(&values);
        self.end_faults(&values);
        self.judge_changes(factor);
        let fits = self.judge_reference(&values, factor);
        self.statistics.keep();
        self.obstacle = match beyond {
            Some(beyond) if beyond <= BEYOND => (!fits).then_some(Obstacle::NoFewChannels),
            _ => Some(Obstacle::UnseenLoads),
        };
        let reason = match (&self.obstacle, beyond) {
            (None, _) => None,
            (Some(Obstacle::UnseenLoads), Some(beyond)) => Some(format!(
                "loads beyond those of the healthy recordings by {:.0} % of their range",
                100.0 * beyond
            )),
            (Some(Obstacle::UnseenLoads), None) => Some("no input has a signal".to_owned()),
            (Some(_), _) => Some(
                "no few channels explain the departure: several channels, or the structure itself"
                    .to_owned(),
            ),
        };
        self.judge_unknown(reason);
    }

    fn judge_signals(&mut self, values: &[f64]) {
        for (channel, value) in values.iter().enumerate() {
            if value.is_finite() {
                let until = self.samples - self.per_window as u64;
                self.end_no_signal(channel, Some(until));
            } else if self.tracks[channel].no_signal.is_none() {
                let first = self.samples - self.per_window as u64;
                self.end_fault(channel, Some(first));
                let limit = self.module.channels[channel].longest_constant_s;
                let reason = if self.tracks[channel].run.take(f64::NAN) as f64 * self.step_s > limit
                {
                    format!("constant for longer than {limit:.0} s")
                } else {
                    "missing or implausible".to_owned()
                };
                self.tracks[channel].no_signal = Some(OpenInterval { first, reason });
                self.reached(channel, ChannelState::NoSignal, first);
            }
        }
    }

    /// How far an input that is neither missing nor accused is beyond what was seen, as a share of its range.
    fn beyond(&self, values: &[f64]) -> Option<f64> {
        let inputs = self.module.sensors..values.len();
        let usable = inputs.filter(|k| values[*k].is_finite() && self.tracks[*k].fault.is_none());
        let beyond = |k: usize| {
            let channel = &self.module.channels[k];
            let outside = (channel.lowest - values[k]).max(values[k] - channel.highest).max(0.0);
            outside / channel.range()
        };
        usable.map(beyond).reduce(f64::max)
    }

    /// Channels that are left out.
    fn masked(&self) -> Vec<bool> {
        self.tracks.iter().map(|track| track.fault.is_some()).collect()
    }

    fn judge_changes(&mut self, factor: f64) {
        let threshold = self.module.change_threshold * factor;
        for _ in 0..LARGEST_SET {
            let masked = self.masked();
            let Some(held) = self.statistics.changes(&self.module.change, &masked) else { return };
            let largest =
                held.into_iter().max_by(|(_, a), (_, b)| a.predicted.total_cmp(&b.predicted));
            let Some((channel, departure)) = largest.filter(|(_, d)| d.predicted > threshold)
            else {
                return;
            };
            let first = self.onset();
            self.tracks[channel].found = Some(shown(departure, threshold));
            self.accuse(channel, first, Some(departure.size));
        }
    }

    /// False if the reference is departed from and no set of channels explains it, in two windows.
    fn judge_reference(&mut self, values: &[f64], factor: f64) -> bool {
        let masked = self.masked();
        let present: Vec<usize> =
            (0..values.len()).filter(|k| values[*k].is_finite() && !masked[*k]).collect();
        let Some(all) = self.compare(values, &masked) else { return true };
        self.remember(&all, &present);
        let rule = set_rule(&self.module, present.len(), self.module.reference_threshold * factor);
        let found = smallest(&all, &present, rule).map(|set| {
            let members: Vec<usize> = set.iter().map(|displaced| displaced.place).collect();
            match members[..] {
                [one] if is_shared(&all, one, &present, rule) => None,
                _ => Some(members),
            }
        });
        let (accused, fits) = match found {
            Some(Some(members)) => (Some(members), true),
            // Some channel departs, but which cannot be told.
            Some(None) => (Some(Vec::new()), false),
            None => (None, false),
        };
        let before = std::mem::replace(&mut self.accused, accused.clone());
        let first = self.onset();
        if let (Some(now), Some(before)) = (&accused, &before) {
            for &channel in now.iter().filter(|channel| before.contains(channel)) {
                self.accuse(channel, first, None);
            }
        }
        // Many channels displaced together make each other's z' small: only the distance shows them.
        let far = all.distance().sqrt() > self.module.distance_threshold * factor;
        self.far = if far { self.far + 1 } else { 0 };
        let departs = !fits && (before.is_none() || accused.is_some());
        !departs && self.far < AGREEING
    }

    fn compare(&mut self, values: &[f64], masked: &[bool]) -> Option<GaussianComparison> {
        let seen: Vec<f64> = values
            .iter()
            .zip(masked)
            .map(|(x, masked)| if *masked { f64::NAN } else { *x })
            .collect();
        self.module.reference.compare_with(&seen, &mut self.statistics.reference_inverses)
    }

    /// Remembers displacements of healthy channels, from which those after an onset are counted.
    fn remember(&mut self, all: &GaussianComparison, present: &[usize]) {
        let most = (REMEMBERED_S / self.module.window_s).max(LEAST_REMEMBERED) as usize;
        for &channel in present {
            let Some(departure) = all.departure(channel) else { continue };
            self.tracks[channel].found = Some(shown(departure, self.module.reference_threshold));
            let recent = &mut self.tracks[channel].recent;
            recent.push_back(departure.size);
            if recent.len() > most {
                recent.pop_front();
            }
        }
    }

    fn accuse(&mut self, channel: usize, first: u64, by_change: Option<f64>) {
        let track = &mut self.tracks[channel];
        if track.fault.is_some() {
            return;
        }
        // The latest two windows are the fault's.
        let healthy = track.recent.len().saturating_sub(2);
        track.fault = Some(OpenFault {
            first,
            by_change,
            by_reference: by_change.is_none(),
            agreeing: 0,
            agreed_since: first,
            before: track.recent.drain(..).take(healthy).collect(),
            displacements: Vec::new(),
        });
        self.reached(channel, ChannelState::Faulty, first);
    }

    /// Follows the faults that are known, and ends those that are gone.
    fn end_faults(&mut self, values: &[f64]) {
        let masked = self.masked();
        let window = self.per_window as u64;
        for channel in (0..masked.len()).filter(|k| masked[*k]) {
            let mut others = masked.clone();
            others[channel] = false;
            let departure = self.compare(values, &others).and_then(|all| all.departure(channel));
            let change = self.statistics.changes(&self.module.change, &others);
            let change = change.and_then(|held| held.into_iter().find(|(k, _)| *k == channel));
            let track = &mut self.tracks[channel];
            let Some(fault) = &mut track.fault else { continue };
            if let Some(departure) = departure {
                track.found = Some(shown(departure, self.module.reference_threshold));
                let displacement = Displacement {
                    at_s: (self.windows * window) as f64 * self.step_s,
                    reading: values[channel],
                    size: departure.size,
                };
                fault.displacements.push(displacement);
                if fault.displacements.len() > MOST_DISPLACEMENTS {
                    let mut even = false;
                    fault.displacements.retain(|_| {
                        even = !even;
                        even
                    });
                }
                if departure.predicted > self.module.reference_threshold {
                    fault.by_reference = true;
                }
                if departure.predicted > AGREES * self.module.reference_threshold {
                    fault.agreeing = 0;
                    fault.agreed_since = self.samples;
                } else {
                    fault.agreeing += 1;
                }
            }
            let back = fault.by_change.zip(change).is_some_and(|(size, (_, change))| {
                change.predicted > self.module.change_threshold
                    && BACK.contains(&(-change.size / size))
            });
            // A jump that the reference does not see ends by a jump back only.
            let agreed = fault.by_reference && fault.agreeing >= AGREEING;
            let until = fault.agreed_since;
            if back && fault.displacements.len() > LATEST {
                let until = self.samples - 2 * window;
                self.end_fault(channel, Some(until));
                self.statistics.forget();
            } else if agreed {
                self.end_fault(channel, Some(until));
            }
        }
    }

    fn judge_unknown(&mut self, reason: Option<String>) {
        let first = self.samples - self.per_window as u64;
        match reason {
            None => self.end_unknown(Some(first)),
            Some(reason) => {
                if self.unknown.is_none() {
                    self.unknown = Some(OpenInterval { first, reason });
                }
                for channel in 0..self.tracks.len() {
                    if self.is_open(channel) {
                        self.reached(channel, ChannelState::Unknown, first);
                    }
                }
                return;
            }
        }
        for channel in 0..self.tracks.len() {
            if self.is_open(channel) {
                self.tracks[channel].normal += 1;
            }
        }
    }

    /// Is nothing known against the channel?
    fn is_open(&self, channel: usize) -> bool {
        let track = &self.tracks[channel];
        track.fault.is_none() && track.no_signal.is_none()
    }

    fn reached(&mut self, channel: usize, state: ChannelState, first: u64) {
        let worst = &mut self.tracks[channel].worst;
        if worst.is_none_or(|(known, _)| state > known) {
            *worst = Some((state, first));
        }
    }

    fn end_fault(&mut self, channel: usize, until: Option<u64>) {
        let fitted = self.displaced(channel).and_then(|displaced| displaced.fit());
        let Some(fault) = self.tracks[channel].fault.take() else { return };
        let by = match (fault.by_change, fault.by_reference) {
            (Some(_), true) => "changed, and departs from its reference",
            (Some(_), false) => "changed",
            (None, _) => "departs from its reference",
        };
        self.close(
            Some(channel),
            ChannelState::Faulty,
            (fault.first, until),
            by.to_owned(),
            fitted,
        );
    }

    fn end_no_signal(&mut self, channel: usize, until: Option<u64>) {
        if let Some(open) = self.tracks[channel].no_signal.take() {
            let span = (open.first, until);
            self.close(Some(channel), ChannelState::NoSignal, span, open.reason, None);
            self.statistics.forget();
        }
    }

    fn end_unknown(&mut self, until: Option<u64>) {
        if let Some(open) = self.unknown.take() {
            self.close(None, ChannelState::Unknown, (open.first, until), open.reason, None);
        }
    }

    fn close(
        &mut self,
        channel: Option<usize>,
        state: ChannelState,
        (first, until): (u64, Option<u64>),
        reason: String,
        fault: Option<FittedKind>,
    ) {
        let last = until.unwrap_or(self.samples).max(first + 1) - 1;
        let lasts = until.is_none();
        self.closed.push(ChannelVerdict { channel, state, first, last, lasts, reason, fault });
    }
}

fn shown(departure: ValueDeparture, threshold: f64) -> ShownDeparture {
    ShownDeparture { size: departure.size, statistic: departure.predicted, threshold }
}

/// Do other channels explain the departure as well as this one?
fn is_shared(
    all: &GaussianComparison,
    one: usize,
    present: &[usize],
    rule: super::super::fault_set::SetRule,
) -> bool {
    let squared = |k: usize| all.departure(k).map_or(0.0, |d| d.predicted.powi(2));
    let largest = squared(one);
    let alike = present.iter().filter(|k| **k != one && squared(**k) > AS_WELL * largest);
    alike.into_iter().any(|&other| {
        let rest = all.without(other);
        let mut departures = present.iter().filter_map(|k| rest.departure(*k));
        departures.all(|departure| !is_evidence(departure, rule))
    })
}

/// The mean of the latest two windows less that of the four before, of each six windows in a row.
pub(super) fn differences(windows: &[Vec<f64>]) -> impl Iterator<Item = Vec<f64>> {
    windows.windows(BEFORE + LATEST).map(|six| {
        let (before, latest) = six.split_at(BEFORE);
        let mean = |part: &[Vec<f64>], k: usize| {
            part.iter().map(|window| window[k]).sum::<f64>() / part.len() as f64
        };
        (0..six[0].len()).map(|k| mean(latest, k) - mean(before, k)).collect()
    })
}

/// The latest windows, and the statistics of the one before.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Statistics {
    recent: VecDeque<Vec<f64>>,
    #[serde(skip)]
    reference_inverses: Inverses,
    #[serde(skip)]
    change_inverses: Inverses,
    reference: Vec<f64>,
    change: Vec<f64>,
    new_change: Vec<f64>,
}

impl Statistics {
    fn push(&mut self, window: &[f64]) {
        self.recent.push_back(window.to_vec());
        if self.recent.len() > BEFORE + LATEST {
            self.recent.pop_front();
        }
    }

    /// Forgets the windows before the latest: they would show a change that is known.
    fn forget(&mut self) {
        let latest = self.recent.pop_back();
        self.recent.clear();
        self.recent.extend(latest);
        self.change.clear();
    }

    /// What changed in two windows, one after the other.
    fn changes(
        &mut self,
        gaussian: &Gaussian,
        masked: &[bool],
    ) -> Option<Vec<(usize, ValueDeparture)>> {
        let mut difference = differences(self.recent.make_contiguous()).next()?;
        for (value, _) in difference.iter_mut().zip(masked).filter(|(_, masked)| **masked) {
            *value = f64::NAN;
        }
        let comparison = gaussian.compare_with(&difference, &mut self.change_inverses)?;
        let departures: Vec<(usize, ValueDeparture)> =
            (0..masked.len()).filter_map(|k| Some((k, comparison.departure(k)?))).collect();
        self.new_change.resize(masked.len(), 0.0);
        let held = departures.into_iter().map(|(k, departure)| {
            self.new_change[k] = departure.predicted;
            let before = self.change.get(k).copied().unwrap_or(0.0);
            (k, ValueDeparture { predicted: departure.predicted.min(before), ..departure })
        });
        Some(held.collect())
    }

    /// Ends a window.
    fn keep(&mut self) {
        self.change = std::mem::take(&mut self.new_change);
    }

    /// The largest of any channel in the last two windows.
    pub(super) fn largest_held(
        &mut self,
        reference: &Gaussian,
        change: &Gaussian,
        window: &[f64],
    ) -> Largest {
        self.push(window);
        let compared = reference.compare_with(window, &mut self.reference_inverses);
        let predicted = |k| compared.as_ref()?.departure(k).map(|departure| departure.predicted);
        let now: Vec<f64> = (0..window.len()).map(|k| predicted(k).unwrap_or(0.0)).collect();
        let before = std::mem::replace(&mut self.reference, now);
        let held = before.iter().zip(&self.reference).map(|(a, b)| a.min(*b));
        let by_reference = held.fold(0.0, f64::max);
        let changes = self.changes(change, &vec![false; window.len()]).unwrap_or_default();
        self.keep();
        Largest {
            reference: by_reference,
            change: changes.iter().map(|(_, d)| d.predicted).fold(0.0, f64::max),
            distance: compared.map_or(0.0, |all| all.distance().sqrt()),
        }
    }
}

/// The largest z' by reference and by change, and the root of the distance from the reference.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Largest {
    pub(super) reference: f64,
    pub(super) change: f64,
    pub(super) distance: f64,
}

impl Largest {
    pub(super) fn of(self, other: Self) -> Self {
        Self {
            reference: self.reference.max(other.reference),
            change: self.change.max(other.change),
            distance: self.distance.max(other.distance),
        }
    }
}
