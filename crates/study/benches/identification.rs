//! What it costs to identify a fault: kind and size, from the excerpts of whole runs.

#![allow(clippy::print_stdout, reason = "benches print results")]

use std::cell::RefCell;
use std::hint::black_box;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use diagnosis::identification::{Excerpt, IdentificationResult, identify};
use study::{Rig, TimedFault};
use vocabulary::{
    RunId,
    fault::{Fault, FaultKind},
};

#[path = "../tests/tower/mod.rs"]
mod tower;

thread_local! {
    static EXCERPTS: RefCell<Vec<Excerpt>> = const { RefCell::new(Vec::new()) };
}

fn keep(excerpt: &Excerpt, without: Option<FaultKind>) -> IdentificationResult {
    EXCERPTS.with_borrow_mut(|excerpts| excerpts.push(excerpt.clone()));
    identify(excerpt, without)
}

/// The excerpts of a fault, from the first stage after its onset on.
#[expect(clippy::expect_used, reason = "a bench without a tower has nothing to measure")]
fn excerpts(component: &str, fault: Fault) -> Vec<Excerpt> {
    let (structure, parameters, setups) = tower::parts();
    let injection = TimedFault {
        at: vocabulary::Step(7000),
        until: None,
        component: component.parse().expect("a component"),
        fault,
    };
    let plant = study::plant(&structure, &parameters, 0.0, 1);
    let plant = plant.expect("the tower is a plant");
    let mut rig =
        Rig::new(plant, setups, vec![injection], RunId(1)).expect("the tower has modules");
    rig.identify_by(keep);
    rig.run(17_000).expect("the tower runs");
    EXCERPTS.take()
}

fn identification(criterion: &mut Criterion) {
    let faults = [
        ("bias", "module1/sensor/g1", Fault::Bias { offset_m: 45e-6 }),
        ("leak", "module1/actuator/a2", Fault::InternalLeakage { area_m2: 1e-7 }),
    ];
    for (name, component, fault) in faults {
        let excerpts = excerpts(component, fault);
        let begun = Instant::now();
        let mut longest = 0.0_f64;
        for excerpt in &excerpts {
            let begun = Instant::now();
            black_box(identify(excerpt, None));
            longest = longest.max(begun.elapsed().as_secs_f64());
        }
        let all = begun.elapsed().as_secs_f64();
        println!(
            "{name}: {} identifications take {:.2} ms on average, {:.2} ms at most",
            excerpts.len(),
            1e3 * all / excerpts.len() as f64,
            1e3 * longest
        );
        if let Some(last) = excerpts.last() {
            criterion
                .bench_function(name, |bencher| bencher.iter(|| identify(black_box(last), None)));
        }
    }
}

criterion_group!(benches, identification);
criterion_main!(benches);
