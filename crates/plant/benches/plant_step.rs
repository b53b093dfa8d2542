//! How long one step of the whole tower takes.

use criterion::{Criterion, criterion_group, criterion_main};
use plant::{Plant, PlantParameters};
use truss::Structure;

const TOWER: &str = include_str!("../../../configs/tower.toml");

#[expect(clippy::expect_used, reason = "a bench without a plant has nothing to measure")]
fn advance(criterion: &mut Criterion) {
    let tower = Structure::from_toml(TOWER).expect("the shipped tower is well described");
    let mut plant =
        Plant::new(&tower, &PlantParameters::default(), 1).expect("the shipped tower has a plant");
    criterion.bench_function("advance", |bencher| bencher.iter(|| plant.advance().step));
}

criterion_group!(benches, advance);
criterion_main!(benches);
