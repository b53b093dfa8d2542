//! One step of a diagnoser with twelve channels: module 1 of the shipped tower.
//!
//! `cargo bench -p diagnosis --bench diagnoser_step`

#![allow(clippy::expect_used, reason = "a benchmark may stop")]

#[path = "../tests/fixture/mod.rs"]
mod fixture;

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use diagnosis::divergence::{DivergenceSettings, Interval};
use diagnosis::state::{Reference, residual_settings};
use diagnosis::{Diagnoser, Event, GivenOrder, GivenOrderKind, ModuleSetup, OrderToken, Rule};
use fixture::RestingSignals;
use truss::Structure;
use vocabulary::CorrectedReadings;

fn tower_setup() -> ModuleSetup {
    let tower = Structure::from_toml(include_str!("../../../configs/tower.toml"))
        .expect("the shipped tower is valid");
    let module = fixture::name("module1");
    let mut setup = fixture::setup("lower", Rule::FirstChange);
    setup.structure = tower.local(&module).expect("the shipped tower has a first module");
    setup.module = module;
    setup.thresholds = vec![1e9; 12];
    setup.detection.divergence =
        DivergenceSettings { window: 12, lag: 5, interval: Interval::Sliding { vectors: 2000 } };
    setup.detection.warm_up_vectors = 2500;
    setup
}

/// With the shipped reference, from which these signals depart: each second peers are asked and fault sets are sought.
fn with_reference() -> ModuleSetup {
    let mut reference: Reference =
        toml::from_str(include_str!("../../../configs/references/module1.toml"))
            .expect("the shipped reference is valid");
    let setup = ModuleSetup { peers: vec![fixture::name("module2")], ..tower_setup() };
    reference.settings = residual_settings(&setup);
    ModuleSetup { reference: Some(Arc::new(reference)), ..setup }
}

fn diagnoser_step(c: &mut Criterion) {
    step_of(c, "diagnoser_step", tower_setup(), None);
    step_of(c, "diagnoser_step_with_reference", with_reference(), None);
    step_of(c, "diagnoser_step_with_a_lost_gage", with_reference(), Some(Reads(false)));
    step_of(c, "diagnoser_step_with_its_corrected_reading", with_reference(), Some(Reads(true)));
}

/// A gage is declared faulty; does anyone read what it should read?
struct Reads(bool);

fn step_of(c: &mut Criterion, name: &str, setup: ModuleSetup, lost: Option<Reads>) {
    let mut signals = RestingSignals::new(4, 8);
    let mut samples: Vec<_> = (0..8192).map(|_| signals.sample()).collect();
    let mut diagnoser = Diagnoser::new(setup).expect("the setup is valid");
    let mut actions = Vec::new();
    let mut next = 0_u64;
    if lost.is_some() {
        for sample in &mut samples {
            sample.step = vocabulary::Step(next);
            next += 1;
            diagnoser.take_sample(sample, &mut actions);
        }
        let component = "sensor/g1".parse().expect("a component");
        let (kind, by) = (GivenOrderKind::Declare, "bench".to_owned());
        let order = GivenOrder { kind, by, on_behalf_of: None, note: None };
        let token = OrderToken(0);
        diagnoser.handle(Event::Ordered { token, component, order }, &mut actions);
    }
    let reads = lost.is_some_and(|Reads(reads)| reads);
    let mut readings = CorrectedReadings::default();
    c.bench_function(name, |b| {
        b.iter(|| {
            let count = samples.len() as u64;
            let sample = &mut samples[usize::try_from(next % count).unwrap_or(0)];
            sample.step = vocabulary::Step(next);
            next += 1;
            diagnoser.take_sample(black_box(sample), &mut actions);
            actions.clear();
            if reads {
                diagnoser.write_readings(black_box(&mut readings));
            }
        });
    });
}

criterion_group!(benches, diagnoser_step);
criterion_main!(benches);
