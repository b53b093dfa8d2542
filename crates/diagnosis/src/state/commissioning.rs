//! Learning a reference from snippets of healthy data.
//!
//! Windows of one snippet share wind, loads and temperature, so everything is cross-validated over snippets, never over
//! windows: each fold of snippets is compared with what the others say. The thresholds are the largest departures of
//! healthy values found that way, times a margin, and no less than six.

use names::{Component, ComponentPath, ModuleName};
use serde::{Deserialize, Serialize};

use super::gaussian::{Gaussian, Observation};
use super::reference::{
    ForceRange, GageReference, REFERENCE_VERSION, Reference, residual_settings,
};
use super::window::{CylinderMeans, WINDOW_S, WindowMeans};
use crate::settings::ModuleSetup;

/// Folds of the cross-validation.
const FOLDS: usize = 8;
/// Least thresholds, and what they exceed the largest healthy departure by.
const LEAST_THRESHOLD: f64 = 6.0;
const MARGIN: f64 = 1.3;
/// No deviation of a mean is smaller: it could not be resolved \[m\], \[N\], \[Pa\].
const LEAST_GAGE_M: f64 = 1e-9;
const LEAST_FORCE_N: f64 = 1.0;
const LEAST_CONTENT_PA: f64 = 1e3;
/// Place of the force among a cylinder's values.
const FORCE: usize = 2;
/// Snippets beyond the number of values that a Gaussian needs.
const SPARE_SNIPPETS: usize = 12;

/// What the modules measured for a while without a break.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Snippet {
    /// Where it comes from.
    pub label: String,
    /// The windows of each module, in the order of the modules.
    pub modules: Vec<Vec<WindowMeans>>,
}

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

/// The windows in which every channel of every module has a mean: the values of one module and its peers.
struct Data {
    snippets: Vec<usize>,
    /// Gages of all, then forces of all.
    means: Vec<Vec<f64>>,
    /// By cylinder: [`CylinderMeans::values`].
    cylinders: Vec<Vec<Vec<f64>>>,
    scatters: Vec<Vec<f64>>,
    swings: Vec<Vec<f64>>,
}

impl Data {
    /// `own` is the module's place among those of the snippets.
    fn collect(snippets: &[Snippet], own: usize) -> Self {
        let mut data = Self {
            snippets: Vec::new(),
            means: Vec::new(),
            cylinders: Vec::new(),
            scatters: Vec::new(),
            swings: Vec::new(),
        };
        for (number, snippet) in snippets.iter().enumerate() {
            for window in &snippet.modules[own] {
                data.add(number, snippet, window, own);
            }
        }
        data
    }

    fn add(
        &mut self,
        number: usize,
        snippet: &Snippet,
        window: &WindowMeans,
        own: usize,
    ) -> Option<()> {
        let same_time = |windows: &Vec<WindowMeans>| {
            windows.iter().find(|other| other.until == window.until).cloned()
        };
        let others = snippet.modules.iter().enumerate().filter(|(place, _)| *place != own);
        let others: Option<Vec<_>> = others.map(|(_, windows)| same_time(windows)).collect();
        let all: Vec<&WindowMeans> = std::iter::once(window).chain(others.as_ref()?).collect();
        let gages: Option<Vec<_>> = all.iter().flat_map(|window| window.gages.clone()).collect();
        let cylinders: Option<Vec<_>> =
            all.iter().flat_map(|window| window.cylinders.clone()).collect();
        let (gages, cylinders) = (gages?, cylinders?);
        let residuals = gages.iter().map(|gage| gage.residual_m);
        self.means.push(residuals.chain(cylinders.iter().map(|c| c.force_n)).collect());
        let own_cylinders = cylinders.iter().take(window.cylinders.len());
        self.cylinders.push(own_cylinders.map(CylinderMeans::values).map(Vec::from).collect());
        let own_gages = || gages.iter().take(window.gages.len());
        self.scatters.push(own_gages().map(|gage| gage.scatter_m2).collect());
        self.swings.push(own_gages().map(|gage| gage.swing_m2).collect());
        self.snippets.push(number);
        Some(())
    }

    fn usable_snippets(&self) -> usize {
        let mut snippets = self.snippets.clone();
        snippets.dedup();
        snippets.len()
    }

    fn observations<'a>(&'a self, values: &'a [Vec<f64>]) -> Vec<Observation<'a>> {
        let both = self.snippets.iter().zip(values);
        both.map(|(snippet, values)| Observation { snippet: *snippet, values }).collect()
    }
}

/// Learns the reference of a module. `setups` are those of all modules, in the order of the snippets' modules; `own` is
/// the module's place among them.
///
/// # Errors
/// Too few snippets, or none that differ.
pub fn commission(
    setups: &[ModuleSetup],
    own: usize,
    snippets: &[Snippet],
) -> Result<Reference, CommissioningError> {
    let setup = &setups[own];
    let data = Data::collect(snippets, own);
    let peers = setups.iter().enumerate().filter(|(place, _)| *place != own);
    let all: Vec<&ModuleSetup> =
        std::iter::once(setup).chain(peers.map(|(_, peer)| peer)).collect();
    let (gages, actuators) = (paths(&all, false), paths(&all, true));
    let values = gages.len() + actuators.len();
    let (found, needed) = (data.usable_snippets(), values + SPARE_SNIPPETS);
    if found < needed {
        return Err(CommissioningError::TooFew { found, values, needed });
    }
    let least = [vec![LEAST_GAGE_M; gages.len()], vec![LEAST_FORCE_N; actuators.len()]].concat();
    let observations = data.observations(&data.means);
    let means = Gaussian::learn(&observations, &least);
    if !means.is_sound(values) {
        return Err(CommissioningError::Singular);
    }
    let own_gages = setup.components().len() - setup.actuators();
    let candidates: Vec<usize> = (0..own_gages).collect();
    let own_values: Vec<bool> = (0..values)
        .map(|k| k < own_gages || (gages.len()..gages.len() + setup.actuators()).contains(&k))
        .collect();
    let alone =
        LeftOut { least: &least, candidates: &candidates, there: &own_values, within: None }
            .largest(&observations);
    let together = LeftOut {
        least: &least,
        candidates: &candidates,
        there: &vec![true; values],
        within: None,
    }
    .largest(&observations);
    let (cylinders, of_cylinders) = learn_cylinders(&data, setup.actuators());
    let range = |(place, actuator): (usize, ComponentPath)| {
        let forces = data.means.iter().map(|values| values[gages.len() + place]);
        let (least_n, largest_n) = forces.fold((f64::MAX, f64::MIN), |(least, largest), force| {
            (least.min(force), largest.max(force))
        });
        ForceRange { actuator, least_n, largest_n }
    };
    Ok(Reference {
        version: REFERENCE_VERSION,
        module: setup.module.clone(),
        settings: residual_settings(setup),
        hours: data.means.len() as f64 * WINDOW_S / 3600.0,
        gage_threshold: (MARGIN * alone.max(together)).max(LEAST_THRESHOLD),
        cylinder_threshold: (MARGIN * of_cylinders).max(LEAST_THRESHOLD),
        largest_left_out: [alone, together],
        forces: actuators.into_iter().enumerate().map(range).collect(),
        means,
        own_gages: learn_gages(&data, own_gages),
        cylinders,
        gages,
    })
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

/// How snippets that are left out are compared with what the others say.
struct LeftOut<'a> {
    least: &'a [f64],
    /// Whose departures count.
    candidates: &'a [usize],
    /// Which values are known.
    there: &'a [bool],
    /// Windows in which this value is beyond what the others have seen do not count: nor are they compared in service.
    within: Option<usize>,
}

impl LeftOut<'_> {
    /// The largest z' of healthy windows.
    fn largest(&self, observations: &[Observation<'_>]) -> f64 {
        (0..FOLDS).map(|fold| self.largest_in(fold, observations)).fold(0.0, f64::max)
    }

    fn largest_in(&self, fold: usize, observations: &[Observation<'_>]) -> f64 {
        let is_out = |one: &&Observation| one.snippet % FOLDS == fold;
        let rest: Vec<_> = observations.iter().filter(|one| !is_out(one)).copied().collect();
        let gaussian = Gaussian::learn(&rest, self.least);
        let seen = |one: &&Observation| {
            self.within.is_none_or(|place| {
                let of_rest = || rest.iter().map(|one| one.values[place]);
                of_rest().any(|value| value <= one.values[place])
                    && of_rest().any(|value| value >= one.values[place])
            })
        };
        let largest = |one: &Observation| {
            let known = one.values.iter().zip(self.there);
            let known: Vec<f64> =
                known.map(|(value, there)| if *there { *value } else { f64::NAN }).collect();
            let comparison = gaussian.compare(&known)?;
            let departures = self.candidates.iter().filter_map(|k| comparison.departure(*k));
            Some(departures.map(|departure| departure.predicted).fold(0.0, f64::max))
        };
        observations.iter().filter(is_out).filter(seen).filter_map(largest).fold(0.0, f64::max)
    }
}

fn learn_cylinders(data: &Data, actuators: usize) -> (Vec<Gaussian>, f64) {
    let least = [LEAST_FORCE_N, LEAST_CONTENT_PA, LEAST_FORCE_N, LEAST_FORCE_N];
    let mut largest: f64 = 0.0;
    let learn = |place: usize| {
        let values: Vec<Vec<f64>> = data.cylinders.iter().map(|all| all[place].clone()).collect();
        let observations = data.observations(&values);
        let left_out =
            LeftOut { least: &least, candidates: &[0, 1], there: &[true; 4], within: Some(FORCE) };
        largest = largest.max(left_out.largest(&observations));
        Gaussian::learn(&observations, &least)
    };
    let gaussians = (0..actuators).map(learn).collect();
    (gaussians, largest)
}

fn learn_gages(data: &Data, gages: usize) -> Vec<GageReference> {
    let windows = data.scatters.len().max(1) as f64;
    let gage = |place: usize| GageReference {
        scatter_m2: data.scatters.iter().map(|all| all[place]).sum::<f64>() / windows,
        largest_swing_m2: data.swings.iter().map(|all| all[place]).fold(0.0, f64::max),
    };
    (0..gages).map(gage).collect()
}
