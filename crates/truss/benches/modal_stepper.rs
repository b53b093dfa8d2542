//! Time of one step of the whole tower: 144 modes, 32 inputs, 16 outputs.
#![allow(clippy::unwrap_used, reason = "a measurement may panic")]

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::DMatrix;
use truss::{Mechanics, ModalStepper, Modes, Structure};

fn whole_tower(criterion: &mut Criterion) {
    let tower = Structure::from_toml(include_str!("../../../configs/tower.toml")).unwrap();
    let mechanics = Mechanics::assemble(&tower).unwrap();
    let modes = Modes::of(&mechanics, tower.damping, None).unwrap();
    let inputs = DMatrix::from_fn(mechanics.dofs.len(), 32, |dof, input| {
        ((dof * 31 + input * 17) % 7) as f64 - 3.0
    });
    let mut stepper = ModalStepper::new(&modes, 1e-3, &inputs, &mechanics.gage_map);
    let forces: Vec<f64> = (0..32).map(|input| f64::from(input) * 100.0).collect();
    let mut elongations = [0.0; 16];
    criterion.bench_function("step and outputs of the tower", |bencher| {
        bencher.iter(|| {
            stepper.step(black_box(&forces), &[]);
            stepper.outputs(&mut elongations);
            elongations[0]
        });
    });
}

criterion_group!(benches, whole_tower);
criterion_main!(benches);
