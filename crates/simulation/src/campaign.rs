//! Many worlds: each seed once, what is wrong in it, and how it is made smaller.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use serde::{Deserialize, Serialize};
use study::{TimedFault, parallel};
use vocabulary::ComponentPath;

use crate::coverage::ReachedHistories;
use crate::scenario::WorldScenario;
use crate::setup::{Setup, SimulationError};
use crate::world::{Outcome, World};

/// Hours in a year.
const HOURS_A_YEAR: f64 = 8766.0;
/// Without an event in a time, its rate is below this over that time, with 95 % confidence (−ln 0.05).
const NONE_95: f64 = 2.996;

/// What a seed gave.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SeedResult {
    /// Version of the format: 1.
    pub v: u64,
    /// The seed.
    pub seed: u64,
    /// What must never happen, and did.
    pub violations: Vec<String>,
    /// What must sometimes happen, and did.
    pub reached: ReachedHistories,
    /// Hours that modules watched.
    pub module_hours: f64,
}

/// What many seeds gave.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeedSummary {
    /// How many seeds.
    pub seeds: u64,
    /// How often something happened that must never happen.
    pub violations: u64,
    /// Hours that modules watched.
    pub module_hours: f64,
    /// What must sometimes happen, and did in no world.
    pub unreached: Vec<&'static str>,
    /// The seeds with violations, and what these are.
    pub violated: BTreeMap<u64, Vec<String>>,
}

impl SeedSummary {
    /// Of these results, each seed once.
    #[must_use]
    pub fn of(results: &BTreeMap<u64, SeedResult>) -> Self {
        let mut coverage = ReachedHistories::default();
        results.values().for_each(|result| coverage.merge(&result.reached));
        let violated = results.values().filter(|result| !result.violations.is_empty());
        let violated: BTreeMap<u64, Vec<String>> =
            violated.map(|result| (result.seed, result.violations.clone())).collect();
        Self {
            seeds: results.len() as u64,
            violations: violated.values().map(|violations| violations.len() as u64).sum(),
            module_hours: results.values().map(|result| result.module_hours).sum(),
            unreached: coverage.unreached().collect(),
            violated,
        }
    }

    /// What follows from it, in a sentence.
    #[must_use]
    pub fn in_words(&self) -> String {
        let years = self.module_hours / HOURS_A_YEAR;
        let mut words = format!("{} worlds, {:.1} module-hours: ", self.seeds, self.module_hours);
        // Writing to a string does not fail.
        let _ = match (self.violations, years > 0.0) {
            (0, true) => write!(
                words,
                "no violation; in a module-year of such worlds at most {:.3} (95 %)",
                NONE_95 / years
            ),
            (0, false) => write!(words, "nothing was watched"),
            (1, _) => write!(words, "1 violation"),
            (many, _) => write!(words, "{many} violations in {} worlds", self.violated.len()),
        };
        words
    }
}

/// Runs a scenario. By the end the faulty components are named, and no others, whatever goes wrong around them.
///
/// # Errors
/// The plant cannot be made.
pub fn run(
    setup: &Setup,
    scenario: &WorldScenario,
    keep: bool,
) -> Result<Outcome, SimulationError> {
    let mut outcome = World::new(setup, scenario, keep)?.run()?;
    let valueless: BTreeSet<ComponentPath> = scenario.valueless(setup).collect();
    // A fault that has ended may be in doubt, or unseen if the samples of that time are gone.
    let seen = |fault: &&TimedFault| {
        let component = &fault.component;
        let unseen = scenario.forgets() || outcome.unseeing.contains(&component.module);
        let may_be_unnamed = unseen || outcome.doubted.contains(component);
        fault.until.is_none() || !may_be_unnamed || outcome.named.contains(component)
    };
    let faulty = scenario.faults.iter().filter(seen).map(|fault| fault.component.clone());
    let faulty: BTreeSet<_> = faulty.filter(|one| !valueless.contains(one)).collect();
    if outcome.named != faulty && scenario.is_honest() && scenario.is_of_one_run() {
        let list = |components: &BTreeSet<ComponentPath>| {
            let components: Vec<String> = components.iter().map(ToString::to_string).collect();
            if components.is_empty() { "none".to_owned() } else { components.join(", ") }
        };
        let (named, faulty) = (list(&outcome.named), list(&faulty));
        outcome.violations.push(format!("named: {named}; faulty: {faulty}"));
    }
    Ok(outcome)
}

/// Runs the worlds of seeds, `jobs` at a time, in any order. `done` is given each result; no more begin once `stop` is set.
///
/// # Errors
/// A plant cannot be made, or `done` failed.
pub fn run_all<E: From<SimulationError> + Send>(
    setup: &Setup,
    seeds: &[u64],
    jobs: usize,
    stop: &AtomicBool,
    mut done: impl FnMut(SeedResult) -> Result<(), E> + Send,
) -> Result<(), E> {
    let one = |seed: &u64| {
        let outcome = run(setup, &WorldScenario::draw(*seed, setup), false)?;
        let Outcome { violations, coverage, module_hours, .. } = outcome;
        Ok(SeedResult { v: 1, seed: *seed, violations, reached: coverage, module_hours })
    };
    parallel::for_each(seeds, jobs, stop, one, |_, result| done(result))
}

/// The seeds of a range that belong to a shard and have no result yet.
#[must_use]
pub fn missing(
    seeds: Range<u64>,
    shard: Option<study::Shard>,
    results: &BTreeMap<u64, SeedResult>,
) -> Vec<u64> {
    let own = shard.map_or(0..seeds.end.saturating_sub(seeds.start), |shard| {
        shard.cases(seeds.end.saturating_sub(seeds.start))
    });
    let own = own.map(|number| seeds.start + number);
    own.filter(|seed| !results.contains_key(seed)).collect()
}

/// The smallest scenario found in which still something is wrong: one thing is left out after the other.
///
/// # Errors
/// A plant cannot be made.
pub fn shrink(setup: &Setup, scenario: &WorldScenario) -> Result<WorldScenario, SimulationError> {
    let mut smallest = scenario.clone();
    'smaller: loop {
        for candidate in smallest.smaller() {
            if !run(setup, &candidate, false)?.violations.is_empty() {
                smallest = candidate;
                continue 'smaller;
            }
        }
        return Ok(smallest);
    }
}
