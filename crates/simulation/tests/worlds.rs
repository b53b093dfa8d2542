//! Worlds of seeds: the same twice, nothing in them that must never happen, and found if something is wrong.

#![expect(clippy::unwrap_used, reason = "test code")]

use std::collections::BTreeMap;
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

use simulation::{
    Disturbance, DisturbanceKind, SeedResult, SeedSummary, Setup, SimulationError, WorldScenario,
    missing, run, run_all, shrink, svg,
};

static SETUP: LazyLock<Setup> = LazyLock::new(|| Setup::tower(2).unwrap());

fn results(setup: &Setup, seeds: std::ops::Range<u64>) -> BTreeMap<u64, SeedResult> {
    let seeds: Vec<u64> = seeds.collect();
    let (stop, mut results) = (AtomicBool::new(false), BTreeMap::new());
    run_all::<SimulationError>(setup, &seeds, 2, &stop, |result| {
        results.insert(result.seed, result);
        Ok(())
    })
    .unwrap();
    results
}

#[test]
fn a_seed_has_the_same_history_byte_for_byte() {
    for seed in 0..6 {
        let scenario = WorldScenario::draw(seed, &SETUP);
        let [first, second] = [(); 2].map(|()| run(&SETUP, &scenario, true).unwrap());
        assert!(first.trace.lines().len() > 50);
        assert_eq!(first.trace, second.trace, "seed {seed}");
        let without = run(&SETUP, &scenario, false).unwrap();
        assert_eq!(first.trace.hash(), without.trace.hash());
    }
    let hashes = [1, 2]
        .map(|seed| run(&SETUP, &WorldScenario::draw(seed, &SETUP), false).unwrap().trace.hash());
    assert_ne!(hashes[0], hashes[1]);
}

#[test]
fn nothing_happens_that_must_never_happen_and_much_of_what_must_sometimes() {
    let summary = SeedSummary::of(&results(&SETUP, 0..150));
    assert_eq!(summary.violated, BTreeMap::new());
    assert_eq!((summary.seeds, summary.violations), (150, 0));
    assert!(summary.module_hours > 5.0);
    assert!(summary.unreached.len() < 20, "{:?}", summary.unreached);
}

/// Thresholds below what healthy channels reach.
#[test]
fn what_is_wrong_is_found_shrunk_and_drawn() {
    let setup = SETUP.clone().with_thresholds(1e-4);
    let results = results(&setup, 0..4);
    let summary = SeedSummary::of(&results);
    assert!(summary.violations > 0 && !summary.violated.is_empty());
    assert!(summary.in_words().contains("violations in"), "{}", summary.in_words());
    let seed = *summary.violated.keys().next().unwrap();
    let smallest = shrink(&setup, &WorldScenario::draw(seed, &setup)).unwrap();
    assert_eq!((smallest.disturbances.len(), smallest.orders.len()), (0, 0), "none is needed");
    let outcome = run(&setup, &smallest, true).unwrap();
    assert!(outcome.violations[0].contains("is healthy, and latched"), "{:?}", outcome.violations);
    let picture = svg(&setup, &smallest, &outcome);
    assert!(picture.starts_with("<svg") && picture.contains("is healthy, and latched"));
}

#[test]
fn a_result_is_read_as_it_is_written_and_its_seed_is_not_run_again() {
    let result = results(&SETUP, 7..8).remove(&7).unwrap();
    let text = serde_json::to_string(&result).unwrap();
    assert_eq!(serde_json::from_str::<SeedResult>(&text).unwrap(), result);
    let known = BTreeMap::from([(7, result)]);
    assert_eq!(missing(5..9, None, &known), [5, 6, 8]);
    let part = |number| Some(study::Shard { number, of: 2 });
    assert_eq!(missing(5..9, part(0), &known), [5, 6]);
    assert_eq!(missing(5..9, part(1), &known), [8]);
}

/// A gap, then no way to the publisher, which falls silent: the sample behind the gap is old once the gap is filled.
#[test]
fn one_old_sample_is_no_backlog() {
    let at = |from_ms, until_ms, what| Disturbance { from_ms, until_ms, what, waits_for: None };
    let scenario = WorldScenario {
        faults: Vec::new(),
        orders: Vec::new(),
        disturbances: vec![
            at(6_000, 6_052, DisturbanceKind::Deaf(0)),
            at(6_000, 7_500, DisturbanceKind::Mute(0)),
            at(6_056, 9_000, DisturbanceKind::SilentPublisher),
        ],
        ..WorldScenario::draw(0, &SETUP)
    };
    let outcome = run(&SETUP, &scenario, true).unwrap();
    let told = |what: &str| outcome.trace.lines().iter().any(|line| line.contains(what));
    assert!(told("module1 fetches 1199 to "), "{:#?}", outcome.trace.lines());
    assert_eq!((told("drops its backlog"), outcome.violations), (false, vec![]));
}
