//! Readings in place of those of faulty gages, from the verdict until the reset.
//!
//! What a faulty gage should read is what the local model says plus what its residual should be ([`Reconstruction`]).
//! Readings are computed only when they are asked for; beside that, something is done only when the verdict on a gage
//! changes.
//!
//! A reconstruction is off by what weather and loads do to the other gages. What it was off before the onset is taken off:
//! the offset. That of the peers' forces is known once they have answered what they measured then; until then, and while a
//! peer is silent, the gage follows from the module's own values alone.

use std::sync::Arc;

use vocabulary::{
    ModuleName, ReadingSource, Readings, StateAnswer, StateQuestion, Step, WindowMeans,
};

use crate::channels::{ChannelLayout, Channels};
use crate::event::{Action, Handling};
use crate::ledger::Ledger;
use crate::settings::{ModuleSetup, Sampling, shared};
use crate::state::{
    Reconstruction, ReconstructionError, ReconstructionNoise, Reference, WindowLength,
};

/// Long windows whose mean gives the offset: the latest that ended this long before the onset \[s\].
const HELD_WINDOWS: usize = 2;
const BEFORE_ONSET_S: f64 = 0.5;
/// A peer's forces may be so old \[s\].
const FRESH_S: f64 = 0.05;
/// Two-sided 95 % of the standard normal distribution.
const NORMAL_95: f64 = 1.96;

/// From what a gage is reconstructed.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Rule {
    known: Reconstruction,
    /// What is added \[m\]; `None` if nothing is known of before the onset.
    offset_m: Option<f64>,
    /// Root mean square of what it is off, without an offset and with one \[m\].
    error_m: [f64; 2],
}

impl Rule {
    /// The residual \[m\], and the variance of what it is off \[m²\].
    fn residual_m(&self, value: impl Fn(usize) -> f64, noise: &ReconstructionNoise) -> (f64, f64) {
        let [plain_m, held_m] = self.error_m;
        let error_m = self.offset_m.map_or(plain_m, |_| held_m);
        let residual_m = self.known.residual_m(value) + self.offset_m.unwrap_or(0.0);
        (residual_m, error_m * error_m + self.known.noise_m2(noise))
    }

    /// Continues where a former rule was, or where the gage itself was, by what was measured before the onset.
    fn hold(&mut self, former: Option<&Self>, gage: usize, before: &[f64]) {
        let value = |place: usize| before[place];
        let was = match former {
            Some(former) => former.offset_m.map(|o| o + former.known.residual_m(value)),
            None => Some(before[gage]),
        };
        let offset = was.map(|was| was - self.known.residual_m(value));
        self.offset_m = offset.filter(|offset| offset.is_finite());
    }
}

/// What a lost gage is reconstructed from: the module's own values; and its peers' forces too.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Rules {
    alone: Rule,
    with_peers: Rule,
}

/// What was measured before the latest onset, as far as it is known.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Before {
    windows: Vec<Step>,
    /// The values of the reference; NaN while unknown.
    values: Vec<f64>,
    /// Peers' windows: whose, which, its forces \[N\].
    answers: Vec<(ModuleName, Step, Vec<f64>)>,
    /// By gage, the rule with peers that was followed until then.
    former: Vec<Option<Rule>>,
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
    /// By gage, if it is lost and can be reconstructed.
    rules: Vec<Option<Rules>>,
    before: Option<Before>,
    /// The number that the next transition had when that was decided.
    decided: u64,
    /// The latest forces of each peer that the reference knows, with their step \[N\].
    heard: Vec<Option<(Step, Vec<f64>)>>,
}

impl Correcting {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        let layout = ChannelLayout::of(setup);
        let reference = setup.reference.clone();
        Self {
            layout,
            sampling: setup.sampling(),
            noise: ReconstructionNoise::of(setup),
            heard: vec![None; reference.as_ref().map_or(0, |known| known.peers().count())],
            reference,
            lost: vec![false; layout.gages],
            rules: vec![None; layout.gages],
            before: None,
            decided: 0,
        }
    }

    /// A run begins: nothing is known of before.
    pub(crate) fn restart(&mut self) {
        self.lost.fill(false);
        self.rules.fill(None);
        self.before = None;
        self.heard.fill(None);
        self.decided = 0;
    }

    /// Is the reading of any gage replaced, or to be?
    pub(crate) fn replaces_any(&self) -> bool {
        self.lost.contains(&true)
    }

    /// Takes a peer's forces at a step of the present run.
    pub(crate) fn hear(&mut self, peer: &ModuleName, step: Step, forces_n: &[f64]) {
        let Some(reference) = &self.reference else { return };
        let Some(place) = reference.peers().position(|known| known == peer) else { return };
        if reference.forces_of(peer).count() == forces_n.len() {
            self.heard[place] = Some((step, forces_n.to_vec()));
        }
    }

    /// Follows the verdicts on gages.
    pub(crate) fn follow(&mut self, ledger: &Ledger, handling: &mut Handling<'_>) {
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
        let onset = |gage: usize| {
            let latest = ledger.latest(&handling.channels.components()[channel(gage)])?;
            (!latest.before_service && !latest.run_ended).then_some(latest.onset)
        };
        let newly = (0..lost.len()).filter(|gage| lost[*gage] && !self.lost[*gage]);
        let before = newly.filter_map(onset).min();
        let rules = self.all_rules(&lost);
        let former = std::mem::replace(&mut self.rules, rules);
        self.lost = lost;
        self.before = before.and_then(|onset| self.values_before(handling.channels, onset));
        for (gage, (rules, former)) in self.rules.iter_mut().zip(&former).enumerate() {
            let Some(rules) = rules else { continue };
            match &self.before {
                Some(Before { values, .. }) => {
                    rules.alone.hold(former.as_ref().map(|rules| &rules.alone), gage, values);
                    rules.with_peers.hold(None, gage, values);
                }
                // A gage was reset, or nothing is known of before: what is known of the others stays.
                None => {
                    let Some(former) = former else { continue };
                    rules.alone.offset_m = former.alone.offset_m;
                    rules.with_peers.offset_m = former.with_peers.offset_m;
                }
            }
        }
        let Some(before) = &mut self.before else { return };
        before.former =
            former.into_iter().map(|rules| rules.map(|rules| rules.with_peers)).collect();
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
        let rules = self.rules.iter_mut().zip(&before.former).enumerate();
        for (gage, (rules, former)) in rules {
            let Some(rules) = rules else { continue };
            rules.with_peers.hold(former.as_ref(), gage, &before.values);
        }
    }

    fn all_rules(&self, lost: &[bool]) -> Vec<Option<Rules>> {
        let rules = |gage: usize| {
            let error = *self.reference.as_ref()?.reconstructions.get(gage)?;
            let ReconstructionError { alone_m, alone_held_m, with_peers_m, with_peers_held_m } =
                error;
            Some(Rules {
                alone: self.rule(gage, lost, false, [alone_m, alone_held_m])?,
                with_peers: self.rule(gage, lost, true, [with_peers_m, with_peers_held_m])?,
            })
        };
        (0..lost.len()).map(|gage| lost[gage].then(|| rules(gage))?).collect()
    }

    /// How a gage follows from those that are not lost. `error_m` is known if it alone is; without others it grows as the
    /// Gaussian says.
    fn rule(
        &self,
        gage: usize,
        lost: &[bool],
        with_peers: bool,
        error_m: [f64; 2],
    ) -> Option<Rule> {
        let known = self.reconstruction(gage, |other| lost[other], with_peers)?;
        let least = self.reconstruction(gage, |_| false, with_peers)?;
        let growth = (known.deviation_m / least.deviation_m).max(1.0);
        Some(Rule { known, offset_m: None, error_m: error_m.map(|error_m| growth * error_m) })
    }

    fn reconstruction(
        &self,
        gage: usize,
        is_lost: impl Fn(usize) -> bool,
        with_peers: bool,
    ) -> Option<Reconstruction> {
        let reference = self.reference.as_ref()?;
        let first_force = reference.gages.len();
        let forces = if with_peers { reference.forces.len() } else { self.layout.actuators };
        let gages = (0..self.layout.gages).filter(|other| *other != gage && !is_lost(*other));
        let from: Vec<usize> = gages.chain(first_force..first_force + forces).collect();
        Reconstruction::new(&reference.short.means, gage, &from, &self.noise)
    }

    /// The values of the reference over the windows before a step; NaN of what is not the module's own.
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
            values: gages.chain(forces).collect(),
            windows: windows.iter().map(|window| window.until).collect(),
            answers: Vec::new(),
            former: Vec::new(),
        })
    }

    /// Writes what each gage reads, or should.
    pub(crate) fn write(&self, channels: &Channels, now: Step, readings: &mut Readings) {
        readings.clear();
        for (gage, reading_m) in channels.readings_m().iter().enumerate() {
            if self.lost[gage] {
                let known = self.replaced(gage, channels, now);
                let (reading_m, off_m) = known.unwrap_or((f64::NAN, f64::NAN));
                readings.push(reading_m, off_m, ReadingSource::Replaced);
            } else {
                let noise_m = self.noise.gages_m2.get(gage).map_or(f64::NAN, |noise| noise.sqrt());
                readings.push(*reading_m, NORMAL_95 * noise_m, ReadingSource::Own);
            }
        }
    }

    /// What a lost gage should read, and how far that may be off \[m\]. None beyond the forces that the reference has seen.
    fn replaced(&self, gage: usize, channels: &Channels, now: Step) -> Option<(f64, f64)> {
        let (reference, rules) = (self.reference.as_ref()?, self.rules[gage].as_ref()?);
        let (residuals, forces_n) = channels.measured();
        let residuals = residuals.get(self.layout.actuators..)?;
        let ranges = reference.forces.iter().zip(forces_n);
        if !ranges.into_iter().all(|(range, force_n)| range.has_seen(*force_n)) {
            return None;
        }
        let with_peers = self.hears_all(now)
            && (rules.with_peers.offset_m.is_some() || rules.alone.offset_m.is_none());
        let rule = if with_peers { &rules.with_peers } else { &rules.alone };
        let value = |place: usize| self.value(place, residuals, forces_n);
        let (residual_m, off_m2) = rule.residual_m(value, &self.noise);
        Some((channels.modelled_m()?[gage] + residual_m, NORMAL_95 * off_m2.sqrt()))
    }

    /// A value of the reference at the latest sample.
    fn value(&self, place: usize, residuals_m: &[f64], forces_n: &[f64]) -> f64 {
        let gages = self.reference.as_ref().map_or(0, |reference| reference.gages.len());
        let Some(force) = place.checked_sub(gages) else { return residuals_m[place] };
        let of_peers = self.heard.iter().flatten().flat_map(|(_, forces_n)| forces_n);
        forces_n.iter().chain(of_peers).nth(force).copied().unwrap_or(f64::NAN)
    }

    /// Has every peer that the reference knows told its forces lately?
    fn hears_all(&self, now: Step) -> bool {
        let oldest = now.minus(self.sampling.steps(FRESH_S));
        self.heard.iter().all(|heard| heard.as_ref().is_some_and(|(step, _)| *step >= oldest))
    }
}
