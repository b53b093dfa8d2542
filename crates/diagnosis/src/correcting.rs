//! Readings in place of those of faulty gages, from the verdict until the reset.
//!
//! What a faulty gage should read is what the local model says plus what its residual should be ([`Reconstruction`]).
//! Readings are computed only when they are asked for; beside that, something is done only when the verdict on a gage
//! changes.
//!
//! Weather and loads that the reference does not know give a reconstruction an error, which is nearly constant. A gage is
//! reconstructed from what has changed since before the onset, therefore: the offset is what the reconstruction missed then. It
//! fades within an hour. What peers' forces were is known once they have answered; until then, and while a peer is silent, the
//! gage follows from the module's own values alone.
//!
//! How large the rest of the error is now, the healthy gages tell: each is reconstructed like the lost ones.

use std::sync::Arc;

use vocabulary::{
    CorrectedReadings, ModuleName, ReadingSource, ReplacedReading, StateAnswer, StateQuestion,
    Step, Symptom, WindowMeans,
};

use crate::channels::{ChannelLayout, Channels};
use crate::comparing::Comparing;
use crate::event::{Action, Handling};
use crate::ledger::Ledger;
use crate::settings::{ModuleSetup, Sampling, shared};
use crate::state::{
    CHANGE_RIDGE, LEVEL_RIDGE, Reconstruction, ReconstructionError, ReconstructionNoise, Reference,
    WindowLength,
};

/// Long windows whose mean gives the offset: the latest that ended this long before the onset \[s\]. A slow fault begins before
/// its change is found.
const HELD_WINDOWS: usize = 2;
const BEFORE_ONSET_S: f64 = 2.0;
/// Time constant with which the offset fades \[s\]: the weather that made it changes within an hour.
const OFFSET_LASTS_S: f64 = 3600.0;
/// A peer's forces may be so old \[s\].
const FRESH_S: f64 = 0.05;
/// Two-sided 95 % of the standard normal distribution.
const NORMAL_95: f64 = 1.96;

/// Time constant of the means that tell what has changed slowly \[s\]: as long as a snippet, in which the reference has seen how
/// values move about their mean.
const SLOW_S: f64 = 6.0;

/// So many of the latest short windows tell how large the error is; at first, the reference counts as so many.
const LATEST_WINDOWS: f64 = 20.0;
const REFERENCE_WINDOWS: f64 = 5.0;
/// Without an offset, the error's variance counts as so much of that of the reference at least.
const LEAST_PLAIN_RATIO: f64 = 0.6;
/// No reading is given while the error's variance is so many times that of the reference.
const LARGEST_RATIO: f64 = 100.0;

/// What is added to a reconstruction, because it was missing before the onset.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Offset {
    value_m: f64,
    since: Step,
}

/// From what a gage is reconstructed.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Replacement {
    /// From what is now.
    plain: Weighting,
    /// From how values move about their slow means.
    held: Weighting,
    /// `None` if nothing is known of before the onset.
    offset: Option<Offset>,
    /// After so many steps 1/e of an offset is left.
    lasting_steps: f64,
}

/// A reconstruction and its errors.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Weighting {
    known: Reconstruction,
    /// Mean square error in the reference \[m²\].
    error_m2: f64,
    /// Variance due to the noise of the other values \[m²\].
    noise_m2: f64,
}

impl Replacement {
    /// The share of an offset that is left: the weather that made it passes.
    fn left(&self, now: Step) -> f64 {
        let left = |offset: Offset| (-(now.since(offset.since) as f64) / self.lasting_steps).exp();
        self.offset.map_or(0.0, left)
    }

    /// What the residual should be, of values and their slow means \[m\].
    fn residual_m(
        &self,
        left: f64,
        value: impl Fn(usize) -> f64,
        slow: impl Fn(usize) -> f64,
    ) -> f64 {
        let plain_m = self.plain.known.residual_m(&value);
        self.offset.map_or(plain_m, |offset| {
            let moved_m = self.held.known.residual_m(&value) - self.held.known.residual_m(&slow);
            let held_m = self.plain.known.residual_m(&slow) + offset.value_m + moved_m;
            left * held_m + (1.0 - left) * plain_m
        })
    }

    /// Variance of its error in the reference \[m²\].
    fn error_m2(&self, left: f64) -> f64 {
        left * left * self.held.error_m2 + (1.0 - left * left) * self.plain.error_m2
    }

    /// Variance due to the noise of the other values \[m²\].
    fn noise_m2(&self, left: f64) -> f64 {
        left * self.held.noise_m2 + (1.0 - left) * self.plain.noise_m2
    }

    /// Continues where a former replacement was, or where the gage itself was, by what was measured before the onset.
    fn hold(&mut self, former: Option<&Self>, gage: usize, before: &Before) {
        let Before { onset, values, .. } = before;
        let value = |place: usize| values[place];
        let (was_m, since) = match former {
            Some(former) => (
                former.residual_m(former.left(*onset), value, value),
                former.offset.map(|offset| offset.since),
            ),
            None => (values[gage], Some(*onset)),
        };
        self.offset = since.map(|since| Offset { value_m: 0.0, since });
        let left = self.left(*onset);
        let missing_m = (was_m - self.residual_m(left, value, value)) / left;
        self.offset = since
            .filter(|_| missing_m.is_finite())
            .map(|since| Offset { value_m: missing_m, since });
    }
}

/// What a gage is reconstructed from: the module's own values; and its peers' forces too.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Replacements {
    alone: Replacement,
    with_peers: Replacement,
}

impl Replacements {
    /// Peers' forces serve if they are heard, unless the offset is known only without them.
    fn best(&self, hears_all: bool) -> &Replacement {
        let has_offset = |one: &Replacement| one.offset.is_some();
        if hears_all && (has_offset(&self.with_peers) || !has_offset(&self.alone)) {
            &self.with_peers
        } else {
            &self.alone
        }
    }
}

/// What a peer has told.
#[derive(Debug, Clone, Copy, Default, serde::Serialize, serde::Deserialize)]
struct Heard {
    latest: Option<Step>,
    /// So many times since the latest short window ended.
    times: u32,
}

/// The forces of the peers, in the order of the reference \[N\].
#[derive(Debug, Clone, Default, serde::Serialize, serde::Deserialize)]
struct PeersForces {
    heard: Vec<Heard>,
    /// Whose the forces are, by place among the peers.
    peers: Vec<usize>,
    latest_n: Vec<f64>,
    /// Since the latest short window ended.
    sums_n: Vec<f64>,
    /// Over that window.
    means_n: Vec<f64>,
}

impl PeersForces {
    fn of(reference: &Reference) -> Self {
        let peers = reference.peers().enumerate();
        let peers: Vec<usize> =
            peers.flat_map(|(place, peer)| reference.forces_of(peer).map(move |_| place)).collect();
        let unknown = vec![f64::NAN; peers.len()];
        Self {
            heard: vec![Heard::default(); reference.peers().count()],
            latest_n: unknown.clone(),
            sums_n: vec![0.0; peers.len()],
            means_n: unknown,
            peers,
        }
    }

    fn forget(&mut self) {
        self.heard.fill(Heard::default());
        self.latest_n.fill(f64::NAN);
        self.sums_n.fill(0.0);
        self.means_n.fill(f64::NAN);
    }

    fn take(&mut self, peer: usize, step: Step, forces_n: &[f64]) {
        self.heard[peer].latest = Some(step);
        self.heard[peer].times += 1;
        let first = self.peers.iter().take_while(|of| **of != peer).count();
        for (place, force_n) in (first..).zip(forces_n) {
            self.latest_n[place] = *force_n;
            self.sums_n[place] += force_n;
        }
    }

    fn end_window(&mut self) {
        for ((mean, sum), peer) in self.means_n.iter_mut().zip(&mut self.sums_n).zip(&self.peers) {
            *mean = std::mem::take(sum) / f64::from(self.heard[*peer].times);
        }
        self.heard.iter_mut().for_each(|heard| heard.times = 0);
    }

    /// Has every peer told its forces since then?
    fn are_all_since(&self, oldest: Step) -> bool {
        self.heard.iter().all(|heard| heard.latest.is_some_and(|latest| latest >= oldest))
    }
}

/// What was measured before the latest onset, as far as it is known.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Before {
    onset: Step,
    windows: Vec<Step>,
    /// In the order of the reference; NaN while unknown.
    values: Vec<f64>,
    /// Peers' windows: whose, which, its forces \[N\].
    answers: Vec<(ModuleName, Step, Vec<f64>)>,
    /// By gage that was lost before, the replacement with peers that was followed until then.
    former: Vec<Option<Replacement>>,
}

/// The gages whose readings are replaced, and by what.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Correcting {
    layout: ChannelLayout,
    sampling: Sampling,
    noise: ReconstructionNoise,
    #[serde(with = "shared")]
    reference: Option<Arc<Reference>>,
    /// By gage: is it lost?
    lost: Vec<bool>,
    /// By gage, if any is lost and this one can be reconstructed.
    replacements: Vec<Option<Replacements>>,
    before: Option<Before>,
    /// Slow means of the reference's values since then; NaN where nothing is known of before.
    slow: Vec<f64>,
    /// The variance of the healthy gages' errors over that of the reference, and from how many short windows it is known.
    error_ratio: f64,
    windows: f64,
    /// The latest of them.
    noted: Option<Step>,
    /// The number that the next transition had when that was decided.
    decided: u64,
    peers: PeersForces,
}

impl Correcting {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        let layout = ChannelLayout::of(setup);
        let reference = setup.reference.clone();
        Self {
            layout,
            sampling: setup.sampling(),
            noise: ReconstructionNoise::of(setup),
            peers: reference.as_deref().map(PeersForces::of).unwrap_or_default(),
            reference,
            lost: vec![false; layout.gages],
            replacements: vec![None; layout.gages],
            before: None,
            slow: Vec::new(),
            error_ratio: 1.0,
            windows: REFERENCE_WINDOWS,
            noted: None,
            decided: 0,
        }
    }

    /// A run begins: nothing is known of before.
    pub(crate) fn restart(&mut self) {
        self.lost.fill(false);
        self.replacements.fill(None);
        self.before = None;
        self.peers.forget();
        self.decided = 0;
    }

    /// Is the reading of any gage replaced, or to be?
    pub(crate) fn replaces_any(&self) -> bool {
        self.lost.contains(&true)
    }

    /// Takes a peer's forces at a step of the present run; false if they are not those that the reference knows.
    pub(crate) fn hear(&mut self, peer: &ModuleName, step: Step, forces_n: &[f64]) -> bool {
        let Some(reference) = &self.reference else { return true };
        let Some(place) = reference.peers().position(|known| known == peer) else { return true };
        let fits = reference.forces_of(peer).count() == forces_n.len();
        if fits {
            self.peers.take(place, step, forces_n);
        }
        fits
    }

    /// Follows the verdicts on gages, and how large errors are.
    pub(crate) fn follow(
        &mut self,
        ledger: &Ledger,
        comparing: &Comparing,
        handling: &mut Handling<'_>,
    ) {
        if self.replaces_any() {
            self.note_errors(handling.channels);
        }
        if self.decided == ledger.next_sequence() {
            return;
        }
        self.decided = ledger.next_sequence();
        let channel = |gage| self.layout.channel_of_gage(gage);
        let is_lost = |gage: usize| ledger.verdict(channel(gage)).is_latched();
        let lost: Vec<bool> = (0..self.layout.gages).map(is_lost).collect();
        if lost == self.lost {
            return;
        }
        let before_onset = self.sampling.steps(BEFORE_ONSET_S);
        // Of a departure only the end is known for certain; and a change that comes late follows windows that depart.
        let onset = |gage: usize| {
            let latest = ledger.latest(&handling.channels.components()[channel(gage)])?;
            let is_known = !latest.before_service
                && !latest.run_ended
                && matches!(latest.symptom, Symptom::Change | Symptom::NoSignal);
            let agreed = comparing.agreed_before(channel(gage));
            let sure = agreed.map(|agreed| agreed.plus(before_onset + 1));
            is_known.then(|| sure.map_or(latest.onset, |until| until.min(latest.onset)))
        };
        let newly = (0..lost.len()).filter(|gage| lost[*gage] && !self.lost[*gage]);
        let before = newly.filter_map(onset).min();
        let replacements = self.all_replacements(&lost);
        let mut former = std::mem::replace(&mut self.replacements, replacements);
        let was_lost = std::mem::replace(&mut self.lost, lost);
        (self.error_ratio, self.windows, self.noted) = (1.0, REFERENCE_WINDOWS, None);
        self.before = before.and_then(|onset| self.values_before(handling.channels, onset));
        for (gage, (replacements, former)) in
            self.replacements.iter_mut().zip(&mut former).enumerate()
        {
            let Some(replacements) = replacements else { continue };
            match &self.before {
                Some(before) => {
                    former.take_if(|_| !was_lost[gage]);
                    let former = former.as_ref().map(|former| &former.alone);
                    replacements.alone.hold(former, gage, before);
                    replacements.with_peers.hold(None, gage, before);
                }
                // A gage was reset, or nothing is known of before: what is known of the others stays.
                None => {
                    let Some(former) = former else { continue };
                    replacements.alone.offset = former.alone.offset;
                    replacements.with_peers.offset = former.with_peers.offset;
                }
            }
        }
        let Some(before) = &mut self.before else { return };
        self.slow.clone_from(&before.values);
        before.former = former.into_iter().map(|former| Some(former?.with_peers)).collect();
        let peers = self.reference.iter().flat_map(|reference| reference.peers());
        for peer in peers {
            for as_of in &before.windows {
                let (run, window) = (handling.run, Some(WindowLength::Long));
                let question = StateQuestion { run, from: *as_of, as_of: *as_of, window };
                handling.counters.questions_asked += 1;
                handling.actions.push(Action::Ask { peer: peer.clone(), question });
            }
        }
    }

    /// Takes what a peer measured before the onset, if this is about that.
    pub(crate) fn answered(&mut self, answer: &StateAnswer) {
        let Some((before, reference)) = self.before.as_mut().zip(self.reference.as_ref()) else {
            return;
        };
        let Some(window) = &answer.window else { return };
        let forces: Option<Vec<f64>> =
            window.cylinders.iter().map(|means| Some(means.as_ref()?.force_n)).collect();
        let Some(forces) = forces else { return };
        let is_known = |(peer, until, _): &(ModuleName, Step, _)| {
            *peer == answer.module && *until == window.until
        };
        let fits = window.length == WindowLength::Long
            && before.windows.contains(&window.until)
            && reference.forces_of(&answer.module).count() == forces.len()
            && !before.answers.iter().any(is_known);
        if !fits {
            return;
        }
        before.answers.push((answer.module.clone(), window.until, forces));
        let first = reference.gages.len();
        let mut place = first + self.layout.actuators;
        for peer in reference.peers() {
            let of_peer = || before.answers.iter().filter(|(other, ..)| other == peer);
            let forces = reference.forces_of(peer).count();
            if of_peer().count() < before.windows.len() {
                return;
            }
            for force in 0..forces {
                let sum: f64 = of_peer().map(|(.., forces_n)| forces_n[force]).sum();
                before.values[place + force] = sum / before.windows.len() as f64;
            }
            place += forces;
        }
        let peers = first + self.layout.actuators;
        self.slow[peers..].copy_from_slice(&before.values[peers..]);
        let replacements = self.replacements.iter_mut().zip(&before.former).enumerate();
        for (gage, (replacements, former)) in replacements {
            let Some(replacements) = replacements else { continue };
            replacements.with_peers.hold(former.as_ref(), gage, before);
        }
    }

    fn all_replacements(&self, lost: &[bool]) -> Vec<Option<Replacements>> {
        let replacements = |gage: usize| {
            let error = *self.reference.as_ref()?.reconstructions.get(gage)?;
            let ReconstructionError { alone_m, alone_held_m, with_peers_m, with_peers_held_m } =
                error;
            let of = |with_peers, [plain_m, held_m]: [f64; 2]| {
                let weighed = |held, error_m| self.weighed(gage, lost, (with_peers, held), error_m);
                Some(Replacement {
                    plain: weighed(false, plain_m)?,
                    held: weighed(true, held_m)?,
                    offset: None,
                    lasting_steps: self.sampling.steps(OFFSET_LASTS_S) as f64,
                })
            };
            Some(Replacements {
                alone: of(false, [alone_m, alone_held_m])?,
                with_peers: of(true, [with_peers_m, with_peers_held_m])?,
            })
        };
        let any = lost.contains(&true);
        (0..lost.len()).map(|gage| any.then(|| replacements(gage))?).collect()
    }

    /// How a gage follows from those that are not lost. `error_m` is known if it alone is; without others it grows as the
    /// Gaussian says.
    fn weighed(
        &self,
        gage: usize,
        lost: &[bool],
        (with_peers, held): (bool, bool),
        error_m: f64,
    ) -> Option<Weighting> {
        let reference = self.reference.as_ref()?;
        let by = if held {
            (&reference.moving, CHANGE_RIDGE)
        } else {
            (&reference.short.means, LEVEL_RIDGE)
        };
        let first_force = reference.gages.len();
        let forces = if with_peers { reference.forces.len() } else { self.layout.actuators };
        let without = |is_lost: &dyn Fn(usize) -> bool| {
            let gages = (0..self.layout.gages).filter(|other| *other != gage && !is_lost(*other));
            let from: Vec<usize> = gages.chain(first_force..first_force + forces).collect();
            Reconstruction::new(by, gage, &from, &self.noise)
        };
        let known = without(&|other| lost[other])?;
        let growth = (known.deviation_m / without(&|_| false)?.deviation_m).max(1.0);
        let noise_m2 = known.noise_m2(&self.noise);
        Some(Weighting { known, error_m2: (growth * error_m).powi(2), noise_m2 })
    }

    /// The module's own values over the windows before a step, at their places in the reference; NaN at the others.
    fn values_before(&self, channels: &Channels, onset: Step) -> Option<Before> {
        let reference = self.reference.as_ref()?;
        let latest = onset.minus(self.sampling.steps(BEFORE_ONSET_S));
        let windows = channels.windows_latest_first(WindowLength::Long);
        let windows: Vec<&WindowMeans> =
            windows.filter(|window| window.until < latest).take(HELD_WINDOWS).collect();
        if windows.len() < HELD_WINDOWS {
            return None;
        }
        let mean = |of: &dyn Fn(&WindowMeans) -> Option<f64>| {
            let values = windows.iter().map(|window| of(window).unwrap_or(f64::NAN));
            values.sum::<f64>() / windows.len() as f64
        };
        let gages = (0..reference.gages.len())
            .map(|gage| mean(&|window| Some(window.gages.get(gage)?.as_ref()?.residual_m)));
        let forces = (0..reference.forces.len())
            .map(|force| mean(&|window| Some(window.cylinders.get(force)?.as_ref()?.force_n)));
        Some(Before {
            onset,
            values: gages.chain(forces).collect(),
            windows: windows.iter().map(|window| window.until).collect(),
            answers: Vec::new(),
            former: Vec::new(),
        })
    }

    /// Notes the errors of healthy gages over the latest short window, once.
    fn note_errors(&mut self, channels: &Channels) {
        let Some(window) = channels.windows_latest_first(WindowLength::Short).next() else {
            return;
        };
        if self.noted == Some(window.until) {
            return;
        }
        self.noted = Some(window.until);
        self.peers.end_window();
        let gages = window.gages.iter();
        let gages: Vec<f64> =
            gages.map(|gage| gage.as_ref().map_or(f64::NAN, |means| means.residual_m)).collect();
        let forces = window.cylinders.iter();
        let forces: Vec<f64> =
            forces.map(|one| one.as_ref().map_or(f64::NAN, |means| means.force_n)).collect();
        let healthy = (0..gages.len()).filter(|gage| !self.lost[*gage]);
        let ratios = healthy.filter_map(|gage| {
            let replacement = self.replacements[gage].as_ref()?.best(self.hears_all(window.until));
            let value = |place: usize| self.value(place, &gages, &forces, &self.peers.means_n);
            let left = replacement.left(window.until);
            let error_m = gages[gage] - replacement.residual_m(left, value, self.slow_mean());
            error_m.is_finite().then(|| error_m * error_m / replacement.error_m2(left))
        });
        let (sum, count) =
            ratios.fold((0.0, 0.0), |(sum, count), ratio| (sum + ratio, count + 1.0));
        if count > 0.0 {
            self.windows = (self.windows + 1.0).min(LATEST_WINDOWS);
            self.error_ratio += (sum / count - self.error_ratio) / self.windows;
        }
        let share = (WindowLength::Short.seconds() / SLOW_S).min(1.0);
        let mut slow = std::mem::take(&mut self.slow);
        for (place, slow) in slow.iter_mut().enumerate() {
            let off = self.value(place, &gages, &forces, &self.peers.means_n) - *slow;
            if off.is_finite() {
                *slow += share * off;
            }
        }
        self.slow = slow;
    }

    /// The slow mean of a value.
    fn slow_mean(&self) -> impl Fn(usize) -> f64 {
        |place| self.slow.get(place).copied().unwrap_or(f64::NAN)
    }

    /// Writes what each gage reads, or should.
    pub(crate) fn write(&self, channels: &Channels, now: Step, readings: &mut CorrectedReadings) {
        readings.clear();
        for (gage, reading_m) in channels.readings_m().iter().enumerate() {
            if self.lost[gage] {
                let known = self.replaced(gage, channels, now);
                let (reading_m, error_m) = known.unwrap_or((f64::NAN, f64::NAN));
                readings.push(reading_m, error_m, ReadingSource::Replaced);
            } else {
                let noise_m = self.noise.gages_m2.get(gage).map_or(f64::NAN, |noise| noise.sqrt());
                readings.push(*reading_m, NORMAL_95 * noise_m, ReadingSource::Own);
            }
        }
    }

    /// What each lost gage reads, and should read; its place among the gages.
    pub(crate) fn lost<'a>(
        &'a self,
        channels: &'a Channels,
        now: Step,
    ) -> impl Iterator<Item = (usize, ReplacedReading)> + 'a {
        let lost = (0..self.lost.len()).filter(|gage| self.lost[*gage]);
        lost.map(move |gage| {
            let own_m = Some(channels.readings_m()[gage]).filter(|reading_m| reading_m.is_finite());
            let known = self.replaced(gage, channels, now);
            let known = known.filter(|(reading_m, off_m)| (reading_m + off_m).is_finite());
            let reading = ReplacedReading {
                step: now,
                own_m,
                elongation_m: known.map(|(reading_m, _)| reading_m),
                low_m: known.map(|(reading_m, off_m)| reading_m - off_m),
                high_m: known.map(|(reading_m, off_m)| reading_m + off_m),
            };
            (gage, reading)
        })
    }

    /// What a lost gage should read, and half the width of its 95 % interval \[m\]. None if a force is beyond those that the
    /// reference has seen, or the healthy gages' errors are beyond all that it knows.
    fn replaced(&self, gage: usize, channels: &Channels, now: Step) -> Option<(f64, f64)> {
        let (reference, replacements) =
            (self.reference.as_ref()?, self.replacements[gage].as_ref()?);
        let (residuals, forces_n) = channels.measured();
        let residuals = residuals.get(self.layout.actuators..)?;
        let replacement = replacements.best(self.hears_all(now));
        let value = |place: usize| self.value(place, residuals, forces_n, &self.peers.latest_n);
        let gages = reference.gages.len();
        let mut forces =
            replacement.plain.known.places().filter_map(|place| place.checked_sub(gages));
        let all_seen = forces.all(|force| reference.forces[force].has_seen(value(gages + force)));
        if !all_seen || self.error_ratio > LARGEST_RATIO {
            return None;
        }
        // Errors that last as long as the weather are too few to tell that the rest are small.
        let ratio = match replacement.offset {
            Some(_) => self.error_ratio,
            None => self.error_ratio.max(LEAST_PLAIN_RATIO),
        };
        let left = replacement.left(now);
        let error_m2 = ratio * replacement.error_m2(left) + replacement.noise_m2(left);
        let reading_m =
            channels.modelled_m()?[gage] + replacement.residual_m(left, value, self.slow_mean());
        Some((reading_m, NORMAL_95 * error_m2.sqrt()))
    }

    /// A value of the reference, of these residuals and forces.
    fn value(&self, place: usize, residuals_m: &[f64], own_n: &[f64], peers_n: &[f64]) -> f64 {
        let gages = self.reference.as_ref().map_or(0, |reference| reference.gages.len());
        let Some(force) = place.checked_sub(gages) else {
            return residuals_m.get(place).copied().unwrap_or(f64::NAN);
        };
        let force_n = match force.checked_sub(own_n.len()) {
            None => own_n.get(force),
            Some(of_peers) => peers_n.get(of_peers),
        };
        force_n.copied().unwrap_or(f64::NAN)
    }

    /// Has every peer that the reference knows told its forces lately?
    fn hears_all(&self, now: Step) -> bool {
        self.peers.are_all_since(now.minus(self.sampling.steps(FRESH_S)))
    }
}
