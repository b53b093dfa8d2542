//! Learning a reference from snippets of healthy data.
//!
//! Windows of one snippet share wind, loads and temperature, so everything is cross-validated over snippets, never over
//! windows: each fold of snippets is compared with what the others say. What healthy values reach that way gives the
//! thresholds, for the rate of false alarms that is wanted; none is less than six.

use std::collections::BTreeMap;

use vocabulary::{Component, ComponentPath, ModuleName};

use super::gaussian::{Gaussian, Inverses, SnippetValues};
use super::reconstruction::{ReconstructionError, ReconstructionNoise, errors};
use super::reference::{
    ForceRange, GageReference, MeansReference, REFERENCE_VERSION, Reference, residual_settings,
};
use super::snippet::{Snippet, SnippetData};
use super::threshold::exceeded_once_in;
use crate::settings::ModuleSetup;
use vocabulary::WindowLength;

/// The least threshold.
pub const LEAST_THRESHOLD: f64 = 6.0;
/// Kinds of comparison that may raise a false alarm, each with its share of them: gages over short and over long windows,
/// cylinders.
const KINDS: f64 = 3.0;
/// No deviation of a mean is smaller: it could not be resolved \[m\], \[N\], \[Pa\].
const LEAST_GAGE_M: f64 = 1e-9;
const LEAST_FORCE_N: f64 = 1.0;
const LEAST_CONTENT_PA: f64 = 1e3;
/// Place of the force among a cylinder's values.
const FORCE: usize = 2;
/// Folds of the cross-validation, over snippets.
pub(super) const FOLDS: usize = 8;
/// Snippets beyond the number of values that a Gaussian needs.
const SPARE_SNIPPETS: usize = 12;

/// Why no reference can be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommissioningError {
    /// Too few snippets with usable windows.
    #[error("{found} usable snippets are too few for {values} values; give at least {needed}")]
    TooFew {
        /// Snippets with at least one window in which every channel has a mean.
        found: usize,
        /// Values of the Gaussian.
        values: usize,
        /// Snippets needed.
        needed: usize,
    },
    /// What was learnt cannot be inverted.
    #[error("what was measured has no usable covariance; are the snippets all alike?")]
    Singular,
}

/// Learns the reference of a module. `setups` are those of all modules, in the order of the snippets' modules; `own` is
/// the module's place among them. The thresholds are for so many false alarms of the module an hour at most, with 95 %
/// confidence.
///
/// # Errors
/// Too few snippets, or none that differ.
pub fn commission(
    setups: &[ModuleSetup],
    own: usize,
    snippets: &[Snippet],
    false_alarms_per_hour: f64,
) -> Result<Reference, CommissioningError> {
    let setup = &setups[own];
    let peers = setups.iter().enumerate().filter(|(place, _)| *place != own);
    let all: Vec<&ModuleSetup> =
        std::iter::once(setup).chain(peers.map(|(_, peer)| peer)).collect();
    let places = ValuePlaces::of(setup, &all);
    let [short, long] = WindowLength::ALL.map(|length| SnippetData::collect(snippets, own, length));
    let hours = long.means.len() as f64 * WindowLength::Long.seconds() / 3600.0;
    let (found, values) = (long.usable_snippets(), places.values());
    let needed = values + SPARE_SNIPPETS;
    if found.min(short.usable_snippets()) < needed {
        return Err(CommissioningError::TooFew { found, values, needed });
    }
    let once_in = KINDS * found as f64 / (hours * false_alarms_per_hour);
    let (cylinders, of_cylinders) = learn_cylinders(&long, setup.actuators());
    Ok(Reference {
        version: REFERENCE_VERSION,
        module: setup.module.clone(),
        settings: residual_settings(setup),
        hours,
        false_alarms_per_hour,
        cylinder_threshold: threshold(once_in, &of_cylinders),
        forces: places.ranges(&long),
        reconstructions: places.reconstructions(&short, setup)?,
        moving: Gaussian::learn_moving(&short.observations(&short.means), &places.least()),
        long: places.learn(&long, once_in)?,
        short: places.learn(&short, once_in)?,
        cylinders,
        gages: places.gages,
    })
}

fn threshold(once_in: f64, largest: &BTreeMap<usize, f64>) -> f64 {
    let largest: Vec<f64> = largest.values().copied().collect();
    exceeded_once_in(once_in, &largest).max(LEAST_THRESHOLD)
}

/// Where which value stands: gages of all, then forces of all, the module's own first.
struct ValuePlaces {
    gages: Vec<ComponentPath>,
    actuators: Vec<ComponentPath>,
    own_gages: usize,
    own_actuators: usize,
}

impl ValuePlaces {
    fn of(own: &ModuleSetup, all: &[&ModuleSetup]) -> Self {
        let own_actuators = own.actuators();
        Self {
            gages: paths(all, false),
            actuators: paths(all, true),
            own_gages: own.components().len() - own_actuators,
            own_actuators,
        }
    }

    fn values(&self) -> usize {
        self.gages.len() + self.actuators.len()
    }

    /// The module's own values, or all of them.
    fn known(&self, with_peers: bool) -> Vec<bool> {
        let own_forces = self.gages.len()..self.gages.len() + self.own_actuators;
        let is_own = |k: usize| k < self.own_gages || own_forces.contains(&k);
        (0..self.values()).map(|k| with_peers || is_own(k)).collect()
    }

    /// The least deviation of each value.
    fn least(&self) -> Vec<f64> {
        [vec![LEAST_GAGE_M; self.gages.len()], vec![LEAST_FORCE_N; self.actuators.len()]].concat()
    }

    /// How well each of the module's own gages follows from the others.
    fn reconstructions(
        &self,
        data: &SnippetData,
        setup: &ModuleSetup,
    ) -> Result<Vec<ReconstructionError>, CommissioningError> {
        let noise = ReconstructionNoise::of(setup);
        let forces: Vec<usize> = (self.gages.len()..self.values()).collect();
        let forces = [&forces[..self.own_actuators], &forces];
        let observations = data.observations(&data.means);
        errors(&observations, &self.least(), self.own_gages, forces, &noise)
            .ok_or(CommissioningError::Singular)
    }

    /// Learns the means over windows of one length.
    fn learn(
        &self,
        data: &SnippetData,
        once_in: f64,
    ) -> Result<MeansReference, CommissioningError> {
        let least = self.least();
        let observations = data.observations(&data.means);
        let means = Gaussian::learn(&observations, &least);
        if !means.is_sound(self.values()) {
            return Err(CommissioningError::Singular);
        }
        let candidates: Vec<usize> = (0..self.own_gages).collect();
        let [alone, together] = [false, true].map(|with_peers| {
            let there = self.known(with_peers);
            let is_force = |k: &usize| *k >= self.gages.len() && there[*k];
            let forces: Vec<usize> = (0..self.values()).filter(is_force).collect();
            largest_left_out(&observations, &least, &candidates, &there, &forces)
        });
        let most = |largest: &BTreeMap<usize, f64>| largest.values().copied().fold(0.0, f64::max);
        Ok(MeansReference {
            gage_threshold: threshold(once_in, &together),
            gage_threshold_alone: threshold(once_in, &alone),
            largest_left_out: [most(&alone), most(&together)],
            means,
            own_gages: learn_gages(data, self.own_gages),
        })
    }

    /// The forces that were seen.
    fn ranges(&self, data: &SnippetData) -> Vec<ForceRange> {
        let range = |(place, actuator): (usize, &ComponentPath)| {
            let forces = data.means.iter().map(|values| values[self.gages.len() + place]);
            let (least_n, largest_n) = forces
                .fold((f64::MAX, f64::MIN), |(low, high), force| (low.min(force), high.max(force)));
            ForceRange { actuator: actuator.clone(), least_n, largest_n }
        };
        self.actuators.iter().enumerate().map(range).collect()
    }
}

fn paths(setups: &[&ModuleSetup], actuators: bool) -> Vec<ComponentPath> {
    let of_module = |setup: &&ModuleSetup| -> Vec<ComponentPath> {
        let module: ModuleName = setup.module.clone();
        let path = |component| ComponentPath { module: module.clone(), component };
        let wanted =
            |component: &Component| matches!(component, Component::Actuator(_)) == actuators;
        setup.components().into_iter().filter(wanted).map(path).collect()
    };
    setups.iter().flat_map(of_module).collect()
}

/// The Gaussian of each cylinder, and the largest z' of any of them in each snippet that was left out.
fn learn_cylinders(data: &SnippetData, actuators: usize) -> (Vec<Gaussian>, BTreeMap<usize, f64>) {
    let least = [LEAST_FORCE_N, LEAST_CONTENT_PA, LEAST_FORCE_N, LEAST_FORCE_N];
    let mut largest = BTreeMap::<usize, f64>::new();
    let learn = |place: usize| {
        let values: Vec<Vec<f64>> = data.cylinders.iter().map(|all| all[place].clone()).collect();
        let observations = data.observations(&values);
        let left_out = largest_left_out(&observations, &least, &[0, 1], &[true; 4], &[FORCE]);
        for (snippet, most) in left_out {
            let of_snippet = largest.entry(snippet).or_default();
            *of_snippet = of_snippet.max(most);
        }
        Gaussian::learn(&observations, &least)
    };
    let gaussians = (0..actuators).map(learn).collect();
    (gaussians, largest)
}

fn learn_gages(data: &SnippetData, gages: usize) -> Vec<GageReference> {
    let windows = data.scatters.len().max(1) as f64;
    let gage = |place: usize| GageReference {
        scatter_m2: data.scatters.iter().map(|all| all[place]).sum::<f64>() / windows,
        largest_swing_m2: data.swings.iter().map(|all| all[place]).fold(0.0, f64::max),
    };
    (0..gages).map(gage).collect()
}

/// The largest z' of each snippet in comparison with what the other folds of snippets say. `least` is the least deviation of
/// each value; departures of the `candidates` count, of the values that are `there`. Windows in which one of the `forces` is
/// beyond what the others have seen do not count: nor are they compared in service.
fn largest_left_out(
    observations: &[SnippetValues<'_>],
    least: &[f64],
    candidates: &[usize],
    there: &[bool],
    forces: &[usize],
) -> BTreeMap<usize, f64> {
    let mut largest = BTreeMap::new();
    for fold in 0..FOLDS {
        let is_out = |one: &&SnippetValues| one.snippet % FOLDS == fold;
        let rest: Vec<_> = observations.iter().filter(|one| !is_out(one)).copied().collect();
        let gaussian = Gaussian::learn(&rest, least);
        let range = |&place: &usize| {
            let values = rest.iter().map(|one| one.values[place]);
            let least = values.clone().fold(f64::MAX, f64::min);
            (place, least..=values.fold(f64::MIN, f64::max))
        };
        let seen: Vec<_> = forces.iter().map(range).collect();
        let is_seen = |one: &&SnippetValues| {
            seen.iter().all(|(place, range)| range.contains(&one.values[*place]))
        };
        let mut inverses = Inverses::default();
        for one in observations.iter().filter(is_out).filter(is_seen) {
            let known = one.values.iter().zip(there);
            let known: Vec<f64> =
                known.map(|(value, there)| if *there { *value } else { f64::NAN }).collect();
            let Some(comparison) = gaussian.compare_with(&known, &mut inverses) else { continue };
            let departures = candidates.iter().filter_map(|k| comparison.departure(*k));
            let most = departures.map(|departure| departure.predicted).fold(0.0, f64::max);
            let of_snippet: &mut f64 = largest.entry(one.snippet).or_default();
            *of_snippet = of_snippet.max(most);
        }
    }
    largest
}
