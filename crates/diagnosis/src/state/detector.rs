//! Compares each window with the reference.
//!
//! What a module measures by itself tells whether something may be displaced; if so, and every few windows anyway, the
//! peers are asked for the means of the same window, with which the displaced gage can be distinguished from the others:
//! with them much smaller displacements show. What departs in two windows one after the other is found. A peer that is silent leaves less to compare with: more gages may then be meant.
//!
//! Short windows are compared by a detector of their own. It judges gages only, for a cylinder's force needs a second to
//! follow its demand, and asks peers only about what is beyond the threshold.

use std::sync::Arc;

use vocabulary::{ComponentPath, ModuleName, Step};

use super::fault_set::{SetRule, is_evidence, largest_evidence, share, smallest};
use super::gaussian::{GaussianComparison, ValueDeparture};
use super::reference::{ForceRange, MeansReference, Reference};
use super::track::{Departed, Shares, Track, WindowFinding, WindowOutcome};
use super::window::cylinder_values;
use crate::settings::{ModuleSetup, always_shared};
use vocabulary::{
    Condition, CylinderMeans, GageMeans, Obstacle, StateAnswer, Symptom, WindowLength, WindowMeans,
};

/// Windows one after the other in which a departure has to show: of a gage, of a cylinder, of a gage in short windows. What
/// a healthy cylinder makes of a demand that jumps may lie in two; and short windows lie in one sway of the structure.
const HELD: u32 = 2;
const HELD_BY_CYLINDER: u32 = 3;
const HELD_SHORT: u32 = 3;
/// Share of the threshold from which on peers are asked.
const SUSPICION: f64 = 0.5;
const SUSPICION_SHORT: f64 = 1.0;
/// Long windows after which peers are asked in any case: what only they can show is found a little later.
const ROUTINE: u32 = 5;
/// A gage whose white noise is so many times that of its reference, or so many times less, has departed.
const SCATTER: f64 = 2.0;
/// What a gage without any noise is taken to have, as a share of its reference.
const LEAST_SCATTER: f64 = 1e-12;
/// The structure swings too much for a comparison if three of its gages vary so many times as much as was seen.
const SWING: f64 = 2.0;
const SWINGING_GAGES: usize = 3;

/// What was found as of a step, channel by channel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Conclusion {
    pub(crate) until: Step,
    pub(crate) findings: Vec<(usize, WindowFinding)>,
}

/// What becomes of a window.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reaction {
    /// These peers are to be asked for theirs.
    Ask(Vec<ModuleName>),
    Concluded(Conclusion),
}

/// A window that waits for the peers' answers.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Pending {
    window: WindowMeans,
    known: Vec<bool>,
    /// Whether nothing changed during it.
    calm: bool,
    /// Were the peers asked about it?
    asked: bool,
    awaited: Vec<ModuleName>,
    answers: Vec<(ModuleName, StateAnswer)>,
}

/// A module's comparison with its reference over windows of one length.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct StateDetector {
    length: WindowLength,
    #[serde(with = "always_shared")]
    reference: Arc<Reference>,
    peers: Vec<ModuleName>,
    actuators: usize,
    window_steps: u64,
    tracks: Vec<Track>,
    pending: Option<Pending>,
    /// Windows since peers were asked.
    unasked: u32,
}

impl StateDetector {
    pub(crate) fn new(
        length: WindowLength,
        reference: Arc<Reference>,
        setup: &ModuleSetup,
    ) -> Self {
        let peers = reference.peers().cloned().collect();
        let channels = setup.components().len();
        let actuators = setup.actuators();
        let held = |channel| match length {
            WindowLength::Short => HELD_SHORT,
            WindowLength::Long if channel < actuators => HELD_BY_CYLINDER,
            WindowLength::Long => HELD,
        };
        let tracks = (0..channels).map(|channel| Track::new(held(channel))).collect();
        let window_steps = setup.sampling().steps(length.seconds());
        Self {
            length,
            reference,
            peers,
            actuators,
            window_steps,
            tracks,
            pending: None,
            unasked: 0,
        }
    }

    fn means(&self) -> &MeansReference {
        self.reference.over(self.length)
    }

    /// Nothing has been compared yet: a run begins.
    pub(crate) fn restart(&mut self) {
        for track in &mut self.tracks {
            *track = Track::new(track.held);
        }
        self.pending = None;
        self.unasked = 0;
    }

    /// Nothing that departs is taken to go on.
    pub(crate) fn skip(&mut self) {
        self.tracks.iter_mut().for_each(Track::skip);
        self.pending = None;
    }

    /// A component agreed with its reference in a window of another length.
    pub(crate) fn note_agreement(&mut self, channel: usize, until: Step) {
        let agreed = &mut self.tracks[channel].agreed;
        *agreed = (*agreed).max(Some(until));
    }

    /// A component was reset by an operator: what was found of it counts no more, but when it last agreed.
    pub(crate) fn forgive(&mut self, channel: usize) {
        let track = &mut self.tracks[channel];
        *track = Track { agreed: track.agreed, ..Track::new(track.held) };
    }

    /// The condition of a channel as of the latest comparison.
    pub(crate) fn condition(&self, channel: usize) -> &Condition {
        &self.tracks[channel].condition
    }

    /// The end of the last window that a channel agreed in before it began to depart, if it departs in the latest; at the
    /// latest the first step, if it never agreed.
    pub(crate) fn agreed_before(&self, channel: usize) -> Option<Step> {
        let Track { condition, agreed, .. } = &self.tracks[channel];
        let departs = matches!(
            condition,
            Condition::Doubtful { .. } | Condition::Departed { .. } | Condition::OneOf { .. }
        );
        departs.then(|| agreed.unwrap_or_default())
    }

    /// By how much a channel's mean, or oil content, was off in the latest window.
    pub(crate) fn departure(&self, channel: usize) -> Option<f64> {
        self.tracks[channel].off
    }

    /// How a channel departed in the latest window, if it did.
    pub(crate) fn departed(&self, channel: usize) -> Option<&Departed> {
        self.tracks[channel].departed.as_ref()
    }

    /// How near a channel is to its limits.
    pub(crate) fn shares(&self, channel: usize) -> Shares {
        self.tracks[channel].shares
    }

    /// Takes a window; `known` are the channels that are known to be faulty. One that still waits for answers is
    /// concluded with those that came.
    pub(crate) fn take(
        &mut self,
        window: &WindowMeans,
        known: Vec<bool>,
        calm: bool,
    ) -> (Option<Conclusion>, Reaction) {
        let late = self.pending.take().map(|pending| self.conclude(pending));
        let alone = Pending {
            window: window.clone(),
            known,
            calm,
            asked: false,
            awaited: self.peers.clone(),
            answers: Vec::new(),
        };
        self.unasked += 1;
        let reaction = if !self.peers.is_empty() && self.is_to_ask(&alone) {
            self.unasked = 0;
            self.pending = Some(Pending { asked: true, ..alone });
            Reaction::Ask(self.peers.clone())
        } else {
            Reaction::Concluded(self.conclude(alone))
        };
        (late, reaction)
    }

    /// Takes a peer's answer, `None` if there was none; the conclusion if it was the last.
    ///
    /// # Errors
    /// What is wrong with the answer. It counts as none.
    pub(crate) fn answered(
        &mut self,
        peer: &ModuleName,
        as_of: Step,
        answer: Option<StateAnswer>,
    ) -> (Option<Conclusion>, Result<(), String>) {
        let fits = self.check(peer, as_of, answer.as_ref());
        let Some(mut pending) = self.pending.take() else { return (None, fits) };
        if pending.window.until != as_of {
            self.pending = Some(pending);
            return (None, fits);
        }
        pending.awaited.retain(|awaited| awaited != peer);
        if let Some(answer) = answer.filter(|_| fits.is_ok()) {
            pending.answers.push((peer.clone(), answer));
        }
        if pending.awaited.is_empty() {
            (Some(self.conclude(pending)), fits)
        } else {
            self.pending = Some(pending);
            (None, fits)
        }
    }

    fn check(
        &self,
        peer: &ModuleName,
        as_of: Step,
        answer: Option<&StateAnswer>,
    ) -> Result<(), String> {
        let Some(window) = answer.and_then(|answer| answer.window.as_ref()) else { return Ok(()) };
        if window.until != as_of {
            return Err(format!("its window ends at step {}, not at {as_of}", window.until));
        }
        if window.length != self.length {
            let (found, asked) = (window.length.as_str(), self.length.as_str());
            return Err(format!("its window is {found} s long, not {asked} s"));
        }
        let (gages, forces) =
            (self.reference.gages_of(peer).count(), self.reference.forces_of(peer).count());
        if window.gages.len() != gages || window.cylinders.len() != forces {
            let (g, c) = (window.gages.len(), window.cylinders.len());
            return Err(format!(
                "its window has {g} gages and {c} cylinders; the reference knows {gages} and {forces}"
            ));
        }
        Ok(())
    }

    /// Are the peers to be asked about a window? If what the module measures by itself comes near a threshold, if a gage has
    /// begun to depart, if one that is known to be faulty has returned, or if they have not been asked for a while.
    fn is_to_ask(&self, alone: &Pending) -> bool {
        if self.swings(&alone.window) {
            return false;
        }
        let gages = self.tracks.iter().zip(&alone.known).skip(self.actuators);
        let departing = |(track, known): (&Track, &bool)| match known {
            true => matches!(track.condition, Condition::Agrees { .. }),
            false => track.departing > 0,
        };
        let is_due = self.length == WindowLength::Long
            && (self.unasked >= ROUTINE || gages.into_iter().any(departing));
        is_due || self.is_suspicious(alone)
    }

    fn is_suspicious(&self, alone: &Pending) -> bool {
        let rule = SetRule::of(self.threshold(alone));
        let suspicious = match self.length {
            WindowLength::Short => SUSPICION_SHORT,
            WindowLength::Long => SUSPICION,
        };
        let suspicion = self
            .compare(alone)
            .map(|comparison| largest_evidence(&comparison, 0..self.gages(), rule) > suspicious);
        suspicion.unwrap_or(false)
    }

    /// The threshold for a comparison with what peers have answered.
    fn threshold(&self, pending: &Pending) -> f64 {
        let answered = pending.answers.iter().filter(|(_, answer)| answer.window.is_some());
        let MeansReference { gage_threshold, gage_threshold_alone, .. } = self.means();
        if answered.count() == self.peers.len() {
            *gage_threshold
        } else {
            gage_threshold_alone.max(*gage_threshold)
        }
    }

    fn gages(&self) -> usize {
        self.tracks.len() - self.actuators
    }

    /// The values that are there against the reference, without those of components known to be faulty.
    fn compare(&self, pending: &Pending) -> Option<GaussianComparison> {
        let mut comparison = self.means().means.compare(&self.values(pending))?;
        for place in self.known_places(pending) {
            comparison = comparison.without(place);
        }
        Some(comparison)
    }

    /// Gages, then forces; those of a peer that has not answered are not numbers.
    fn values(&self, pending: &Pending) -> Vec<f64> {
        let window_of = |module: &ModuleName| {
            let answer = pending.answers.iter().find(|(peer, _)| peer == module);
            let of_peer = answer.and_then(|(_, answer)| answer.window.as_ref());
            if *module == self.reference.module { Some(&pending.window) } else { of_peer }
        };
        let modules = || std::iter::once(&self.reference.module).chain(&self.peers);
        let gages = modules().flat_map(|module| {
            let window = window_of(module);
            let gage = move |place: usize| Some(window?.gages[place]?.residual_m);
            (0..self.reference.gages_of(module).count()).map(gage)
        });
        let forces = modules().flat_map(|module| {
            let window = window_of(module);
            let force = move |place: usize| Some(window?.cylinders[place]?.force_n);
            (0..self.reference.forces_of(module).count()).map(force)
        });
        gages.chain(forces).map(|value| value.unwrap_or(f64::NAN)).collect()
    }

    /// The places of gages that are known to be faulty, here or by a peer's word.
    fn known_places<'a>(&'a self, pending: &'a Pending) -> impl Iterator<Item = usize> + 'a {
        let is_known = |(place, path): (usize, &ComponentPath)| {
            let known = if path.module == self.reference.module {
                pending.known[self.actuators + place]
            } else {
                let answer = pending.answers.iter().find(|(peer, _)| *peer == path.module);
                let alarms = answer.map(|(_, answer)| &answer.alarms);
                let faulty =
                    |alarm: &vocabulary::Alarm| alarm.faulty && alarm.component == path.component;
                alarms.is_some_and(|alarms| alarms.iter().any(faulty))
            };
            known.then_some(place)
        };
        self.reference.gages.iter().enumerate().filter_map(is_known)
    }

    fn swings(&self, window: &WindowMeans) -> bool {
        let both = window.gages.iter().zip(&self.means().own_gages);
        let swinging = both.filter(|(gage, reference)| {
            gage.is_some_and(|gage| gage.swing_m2 > SWING * SWING * reference.largest_swing_m2)
        });
        swinging.count() >= SWINGING_GAGES
    }

    fn conclude(&mut self, pending: Pending) -> Conclusion {
        let outcomes = self.outcomes(&pending);
        if pending.asked || self.peers.is_empty() {
            let shares = self.all_shares(&pending);
            for ((track, shares), outcome) in self.tracks.iter_mut().zip(shares).zip(&outcomes) {
                let is_compared =
                    !matches!(outcome, WindowOutcome::CannotTell(_) | WindowOutcome::Missing);
                track.shares = if is_compared { shares } else { Shares::default() };
            }
        }
        let until = pending.window.until;
        let window_began = until.minus(self.window_steps - 1);
        let mut findings = Vec::new();
        for (channel, (track, outcome)) in self.tracks.iter_mut().zip(outcomes).enumerate() {
            let is_known = pending.known[channel];
            if matches!(outcome, WindowOutcome::Departs(_))
                && !(channel >= self.actuators || is_known || pending.calm)
                && track.doubts(until)
            {
                continue;
            }
            let onset = track.agreed.map_or(window_began, |agreed| agreed.plus(1));
            let agreed = track.agreed;
            let found = track.take(outcome, (window_began, until), onset);
            if self.length == WindowLength::Short {
                // A short window does not show what a long one would: that it agrees in it says little.
                track.agreed = agreed;
            }
            findings.extend(found.map(|finding| (channel, finding)));
        }
        Conclusion { until, findings }
    }

    /// How near each channel is to its limits in a window.
    fn all_shares(&self, pending: &Pending) -> Vec<Shares> {
        let (window, rule) = (&pending.window, SetRule::of(self.reference.cylinder_threshold));
        let of_cylinder = |(means, reference): (&Option<CylinderMeans>, &super::Gaussian)| {
            let compared = means.as_ref().and_then(|one| reference.compare(&cylinder_values(one)));
            let share_of = |place| Some(share(compared.as_ref()?.departure(place)?, rule));
            Shares { departure: share_of(0), oil_content: share_of(1), scatter: None }
        };
        let mut shares: Vec<Shares> =
            window.cylinders.iter().zip(&self.reference.cylinders).map(of_cylinder).collect();
        let (compared, rule) = (self.compare(pending), SetRule::of(self.threshold(pending)));
        let of_gage = |place: usize| {
            let departure = compared.as_ref().and_then(|compared| compared.departure(place));
            let scatter_m2 = self.means().own_gages[place].scatter_m2;
            let scatter = window.gages[place].map(|means| means.scatter_m2 / scatter_m2);
            Shares {
                departure: departure.map(|departure| share(departure, rule)),
                oil_content: None,
                scatter: scatter.map(|ratio| ratio.max(LEAST_SCATTER).ln() / SCATTER.ln()),
            }
        };
        shares.extend((0..self.gages()).map(of_gage));
        shares
    }

    /// What the window says of each channel.
    fn outcomes(&self, pending: &Pending) -> Vec<WindowOutcome> {
        let window = &pending.window;
        if self.swings(window) {
            return vec![WindowOutcome::CannotTell(Obstacle::Swinging); self.tracks.len()];
        }
        let forces = self.reference.forces_of(&self.reference.module);
        let cylinders = window.cylinders.iter().zip(&self.reference.cylinders).zip(forces);
        let judges_cylinders = self.length == WindowLength::Long;
        let of_cylinder = |((means, reference), range): (
            (&Option<CylinderMeans>, &super::Gaussian),
            &ForceRange,
        )| {
            let Some(means) = means.as_ref().filter(|_| judges_cylinders) else {
                return WindowOutcome::Missing;
            };
            if !range.has_seen(means.force_n) {
                return WindowOutcome::CannotTell(Obstacle::UnseenForce(range.actuator.clone()));
            }
            let values = cylinder_values(means);
            let Some(comparison) = reference.compare(&values) else {
                return WindowOutcome::Missing;
            };
            self.of_cylinder(&comparison, values)
        };
        let mut outcomes: Vec<WindowOutcome> = cylinders.map(of_cylinder).collect();
        outcomes.extend(self.of_gages(pending));
        outcomes
    }

    fn of_cylinder(&self, comparison: &GaussianComparison, values: [f64; 4]) -> WindowOutcome {
        let threshold = self.reference.cylinder_threshold;
        // If not one of the two explains it, both have departed.
        let set = smallest(comparison, &[0, 1], SetRule::of(threshold));
        let place = match set.as_deref() {
            Some([]) => return WindowOutcome::Agrees,
            Some([displaced, ..]) => displaced.place,
            None => 0,
        };
        let Some(departure) = comparison.departure(place) else { return WindowOutcome::Missing };
        WindowOutcome::Departs(Departed {
            symptom: if place == 0 { Symptom::Departure } else { Symptom::OilContent },
            of_gage: false,
            measured: values[place],
            expected: values[place] - departure.size,
            statistic: departure.plain,
            threshold,
        })
    }

    fn of_gages(&self, pending: &Pending) -> Vec<WindowOutcome> {
        let gages = self.gages();
        if let Some(unseen) = self.unseen_force(pending) {
            return vec![WindowOutcome::CannotTell(Obstacle::UnseenForce(unseen)); gages];
        }
        let Some(comparison) = self.compare(pending) else {
            return vec![WindowOutcome::Missing; gages];
        };
        let candidates: Vec<usize> = (0..self.reference.gages.len()).collect();
        let threshold = self.threshold(pending);
        let Some(set) = smallest(&comparison, &candidates, SetRule::of(threshold)) else {
            return vec![WindowOutcome::CannotTell(Obstacle::NoSetFits); gages];
        };
        let rest = set.iter().fold(comparison, |rest, displaced| rest.without(displaced.place));
        let mut outcomes: Vec<WindowOutcome> =
            (0..gages).map(|place| self.of_gage(pending, place, &rest)).collect();
        let path = |place: usize| self.reference.gages[place].clone();
        for displaced in &set {
            let group: Vec<usize> =
                std::iter::once(displaced.place).chain(displaced.or.iter().copied()).collect();
            if let [place] = group[..] {
                if place < gages {
                    let mean = pending.window.gages[place].map_or(0.0, |gage| gage.residual_m);
                    outcomes[place] = displaced_gage(mean, displaced.departure, threshold);
                }
                continue;
            }
            for &place in group.iter().filter(|place| **place < gages) {
                outcomes[place] = WindowOutcome::OneOf(group.iter().map(|k| path(*k)).collect());
            }
        }
        outcomes
    }

    /// A gage that is in no fault set: it agrees with its reference, unless it is known to be faulty and still departs,
    /// or its noise is not what it was.
    fn of_gage(&self, pending: &Pending, place: usize, rest: &GaussianComparison) -> WindowOutcome {
        let Some(means) = pending.window.gages[place] else { return WindowOutcome::Missing };
        // A tenth of a second is too short to tell how much a gage scatters.
        if self.length == WindowLength::Long
            && let Some(departed) = scatter(means, self.means().own_gages[place].scatter_m2)
        {
            return WindowOutcome::Departs(departed);
        }
        if !pending.known[self.actuators + place] {
            return WindowOutcome::Agrees;
        }
        // Whether it has returned is seen with the peers, if they are there.
        if !pending.asked && !self.peers.is_empty() {
            return WindowOutcome::NotTold;
        }
        let mut values = self.values(pending);
        for (other, value) in values.iter_mut().enumerate() {
            if other != place && other < self.reference.gages.len() && !rest.considers(other) {
                *value = f64::NAN;
            }
        }
        let departure = self.means().means.compare(&values).and_then(|all| all.departure(place));
        let threshold = self.threshold(pending);
        match departure {
            Some(departure) if is_evidence(departure, SetRule::of(threshold)) => {
                displaced_gage(means.residual_m, departure, threshold)
            }
            _ => WindowOutcome::Agrees,
        }
    }

    /// A force beyond what was seen.
    fn unseen_force(&self, pending: &Pending) -> Option<ComponentPath> {
        let values = self.values(pending);
        let forces = self.reference.forces.iter().zip(&values[self.reference.gages.len()..]);
        let unseen =
            |(range, force): &(&ForceRange, &f64)| !force.is_nan() && !range.has_seen(**force);
        forces.into_iter().find(unseen).map(|(range, _)| range.actuator.clone())
    }
}

/// A gage whose mean \[m\] departs from what the others say.
fn displaced_gage(mean_m: f64, departure: ValueDeparture, threshold: f64) -> WindowOutcome {
    WindowOutcome::Departs(Departed {
        symptom: Symptom::Departure,
        of_gage: true,
        measured: mean_m,
        expected: mean_m - departure.size,
        statistic: departure.plain,
        threshold,
    })
}

/// Is the white noise of a gage not what it was?
fn scatter(means: GageMeans, reference_m2: f64) -> Option<Departed> {
    let ratio = (means.scatter_m2 / reference_m2).max(LEAST_SCATTER);
    let statistic = ratio.max(1.0 / ratio);
    (statistic > SCATTER).then(|| Departed {
        symptom: Symptom::Scatter,
        of_gage: true,
        measured: means.scatter_m2.sqrt(),
        expected: reference_m2.sqrt(),
        statistic,
        threshold: SCATTER,
    })
}
