//! References of healthy modules: their measurements under changing weather and during strokes of their cylinders.
//! Commissioning is simulated by snippets of one plant under changing weather, and by strokes of every cylinder.

mod collector;
mod site;

use diagnosis::ModuleSetup;
use diagnosis::state::{CommissioningError, Reference, Snippet, commission};
use plant::{Plant, StrokeTest};
use vocabulary::{ComponentPath, ModuleName, RunId};

pub use collector::{SETTLING_S, WindowCollector};
pub use site::PlantSite;

use crate::error::StudyError;
use crate::parallel;
use crate::rig::{RigError, advance, check_modules};

/// Usual false-alarm rate of a module for which thresholds are chosen \[1/h\].
pub const FALSE_ALARMS_PER_HOUR: f64 = 0.001;

/// A snippet of data.
#[derive(Debug, Clone, PartialEq)]
pub struct SnippetPlan {
    /// Seed of its wind, loads, noise and time of day.
    pub seed: u64,
    /// Its duration \[s\].
    pub seconds: f64,
    /// The stroke in it, if any.
    pub stroke: Option<StrokeTest>,
}

impl SnippetPlan {
    /// The name of the snippet.
    #[must_use]
    pub fn label(&self) -> String {
        match &self.stroke {
            Some(stroke) => format!("seed {}, stroke of {}", self.seed, stroke.actuator),
            None => format!("seed {}", self.seed),
        }
    }
}

/// Simulates snippets, `jobs` at a time; returns them in order. `done` is called after each.
///
/// # Errors
/// A plant or a diagnoser cannot be created.
pub fn record_snippets(
    site: &PlantSite,
    setups: &[ModuleSetup],
    plans: &[SnippetPlan],
    jobs: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Snippet>, StudyError> {
    parallel::map(plans, jobs, |plan| record(site, setups, plan), done)
}

fn record(
    site: &PlantSite,
    setups: &[ModuleSetup],
    plan: &SnippetPlan,
) -> Result<Snippet, StudyError> {
    let mut plant = site.plant(plan.seed)?;
    check_modules(&plant, setups)?;
    let steps = |seconds: f64| (seconds / site.true_parameters.step_s).round() as u64;
    let mut collectors = setups.iter().map(WindowCollector::new).collect::<Result<Vec<_>, _>>()?;
    let mut samples = Vec::new();
    let mut go_on = |plant: &mut Plant, steps: u64| {
        for _ in 0..steps {
            advance(plant, RunId(plan.seed), &mut samples);
            let both = collectors.iter_mut().zip(&samples);
            both.for_each(|(collector, sample)| collector.take(sample));
        }
    };
    go_on(&mut plant, steps(SETTLING_S));
    if let Some(stroke) = &plan.stroke {
        plant.begin_stroke(stroke.clone()).map_err(RigError::from)?;
    }
    go_on(&mut plant, steps(plan.seconds));
    let modules = collectors.into_iter().map(WindowCollector::finish).collect();
    Ok(Snippet { label: plan.label(), modules })
}

/// The usual snippets: so many under changing weather, and two strokes of each cylinder, so that each can validate the
/// other. The second strokes have another order, because snippets whose numbers differ by a multiple of the number of
/// folds are left out together.
#[must_use]
pub fn usual_snippets(
    actuators: &[ComponentPath],
    first_seed: u64,
    weather: u64,
    seconds: f64,
    stroke_n: f64,
) -> Vec<SnippetPlan> {
    let seeds = |from: u64| (0..).map(move |number| first_seed.wrapping_add(from + number));
    let mut plans: Vec<SnippetPlan> = seeds(0)
        .take(weather as usize)
        .map(|seed| SnippetPlan { seed, seconds, stroke: None })
        .collect();
    let strokes = actuators.iter().chain(actuators.iter().skip(1)).chain(actuators.first());
    plans.extend(strokes.zip(seeds(weather)).map(|(actuator, seed)| SnippetPlan {
        seed,
        seconds,
        stroke: Some(StrokeTest {
            actuator: actuator.clone(),
            force_n: stroke_n,
            duration_s: seconds,
            largest_strain: 1e-3,
        }),
    }));
    plans
}

impl PlantSite {
    /// Gives each diagnoser the reference learned from these snippets.
    ///
    /// # Errors
    /// Snippets cannot be simulated, or are too few.
    pub fn commission(
        &self,
        setups: &[ModuleSetup],
        plans: &[SnippetPlan],
        jobs: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<ModuleSetup>, StudyError> {
        let snippets = record_snippets(self, setups, plans, jobs, done)?;
        let references = learn_all(setups, &snippets, FALSE_ALARMS_PER_HOUR, jobs, &|| ())
            .map_err(|(_, error)| error)?;
        let both = setups.iter().zip(references);
        let with_reference = |(setup, reference): (&ModuleSetup, Reference)| ModuleSetup {
            reference: Some(reference.into()),
            ..setup.clone()
        };
        Ok(both.map(with_reference).collect())
    }
}

/// Learns the reference of every module, `jobs` at a time, as [`learn`] does; returns them in order. `done` is called
/// after each.
///
/// # Errors
/// The module whose snippets are too few, or do not differ.
pub fn learn_all(
    setups: &[ModuleSetup],
    snippets: &[Snippet],
    false_alarms_per_hour: f64,
    jobs: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Reference>, (ModuleName, CommissioningError)> {
    let places: Vec<usize> = (0..setups.len()).collect();
    let learn_one = |place: &usize| {
        learn(setups, *place, snippets, false_alarms_per_hour)
            .map_err(|error| (setups[*place].module.clone(), error))
    };
    parallel::map(&places, jobs, learn_one, done)
}

/// Learns the reference of the module at index `own` from its own values and those of its peers. The setups are those
/// of the snippets' modules, in the same order; modules that it does not query are left out. Thresholds are chosen for
/// at most this many false alarms of the module per hour, with 95 % confidence.
///
/// # Errors
/// There are too few snippets, or they do not differ.
pub fn learn(
    setups: &[ModuleSetup],
    own: usize,
    snippets: &[Snippet],
    false_alarms_per_hour: f64,
) -> Result<Reference, CommissioningError> {
    let is_known =
        |place: &usize| *place == own || setups[own].peers.contains(&setups[*place].module);
    let known: Vec<usize> = (0..setups.len()).filter(is_known).collect();
    let place = known.iter().take_while(|place| **place != own).count();
    let of_known = |snippet: &Snippet| Snippet {
        label: snippet.label.clone(),
        modules: known.iter().map(|place| snippet.modules[*place].clone()).collect(),
    };
    let snippets: Vec<Snippet> = snippets.iter().map(of_known).collect();
    let setups: Vec<ModuleSetup> = known.iter().map(|place| setups[*place].clone()).collect();
    commission(&setups, place, &snippets, false_alarms_per_hour)
}
