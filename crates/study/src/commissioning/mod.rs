//! References of healthy modules: what they measure under changing weather and while their cylinders move. Commissioning is
//! simulated by snippets of one plant under changing weather, and strokes of every cylinder.

mod collector;
mod site;

use std::sync::atomic::AtomicBool;

use diagnosis::ModuleSetup;
use diagnosis::state::{CommissioningError, Reference, Snippet, commission};
use plant::{Plant, StrokeTest};
use vocabulary::{ComponentPath, RunId};

pub use collector::{SETTLING_S, WindowCollector};
pub use site::PlantSite;

use crate::error::StudyError;
use crate::parallel;
use crate::rig::{RigError, advance, check_modules};

/// The rate of false alarms of a module that thresholds are usually for \[1/h\].
pub const FALSE_ALARMS_PER_HOUR: f64 = 0.001;

/// One snippet.
#[derive(Debug, Clone, PartialEq)]
pub struct SnippetPlan {
    /// Of its wind, loads, noise and hour.
    pub seed: u64,
    /// How long it is \[s\].
    pub seconds: f64,
    /// What moves in it.
    pub stroke: Option<StrokeTest>,
}

impl SnippetPlan {
    /// What the snippet is called.
    #[must_use]
    pub fn label(&self) -> String {
        match &self.stroke {
            Some(stroke) => format!("seed {}, stroke of {}", self.seed, stroke.actuator),
            None => format!("seed {}", self.seed),
        }
    }
}

/// Makes snippets, `jobs` at a time; they come back in their order. `done` is called after each.
///
/// # Errors
/// A plant or a diagnoser that cannot be made.
pub fn record_snippets(
    site: &PlantSite,
    setups: &[ModuleSetup],
    plans: &[SnippetPlan],
    jobs: usize,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Snippet>, StudyError> {
    let numbered: Vec<(usize, &SnippetPlan)> = plans.iter().enumerate().collect();
    let mut snippets: Vec<Option<Snippet>> = vec![None; plans.len()];
    parallel::for_each(
        &numbered,
        jobs,
        &AtomicBool::new(false),
        |(_, plan)| record(site, setups, plan),
        |(number, _), snippet| {
            snippets[*number] = Some(snippet);
            done();
            Ok(())
        },
    )?;
    Ok(snippets.into_iter().flatten().collect())
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

/// The usual snippets: so many under changing weather, and for each cylinder two strokes: what one of them says can be
/// checked with the other. The second ones come in another order, for snippets whose numbers differ by a multiple of the
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
    /// Gives each of its diagnosers the reference that these snippets teach.
    ///
    /// # Errors
    /// Snippets that cannot be made, or are too few.
    pub fn commission(
        &self,
        setups: &[ModuleSetup],
        plans: &[SnippetPlan],
        jobs: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<ModuleSetup>, StudyError> {
        let snippets = record_snippets(self, setups, plans, jobs, done)?;
        let with_reference = |(place, setup): (usize, &ModuleSetup)| {
            let reference = learn(setups, place, &snippets, FALSE_ALARMS_PER_HOUR)?;
            Ok::<_, CommissioningError>(ModuleSetup {
                reference: Some(reference.into()),
                ..setup.clone()
            })
        };
        Ok(setups.iter().enumerate().map(with_reference).collect::<Result<_, _>>()?)
    }
}

/// Learns the reference of the module at place `own` from its own values and those of its peers. The setups are
/// those of the snippets' modules, in their order; modules that it does not ask are left out. The thresholds are for so
/// many false alarms of the module an hour at most, with 95 % confidence.
///
/// # Errors
/// Too few snippets, or none that differ.
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
