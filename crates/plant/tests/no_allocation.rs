//! A step of the plant allocates nothing, whatever is wrong with it.
#![expect(clippy::unwrap_used, reason = "test code")]

use std::alloc::System;

use plant::{Plant, PlantParameters};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use truss::Structure;
use vocabulary::fault::Fault;

#[global_allocator]
static GLOBAL: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

const TOWER: &str = include_str!("../../../configs/tower.toml");
const BRIDGE: &str = include_str!("../../../configs/templates/bridge.toml");
const TRAFFIC: &str = include_str!("../../../configs/templates/bridge-traffic.toml");

const FAULTS: [(&str, Fault); 13] = [
    ("module1/actuator/a1", Fault::InternalLeakage { area_m2: 2e-7 }),
    ("module1/actuator/a2", Fault::ExternalLeakageA { area_m2: 2e-7 }),
    ("module1/actuator/a3", Fault::ExternalLeakageB { area_m2: 2e-7 }),
    ("module1/actuator/a4", Fault::HardOver {}),
    ("module2/actuator/a1", Fault::Stiction { band_m3_per_s: 1e-5 }),
    ("module1/sensor/g1", Fault::Bias { offset_m: 50e-6 }),
    ("module1/sensor/g2", Fault::Drift { drift_m_per_s: 20e-6 }),
    ("module1/sensor/g3", Fault::RandomWalk { drift_m_per_s: 20e-6, increment_m: 6e-6 }),
    ("module1/sensor/g4", Fault::Gain { gain: 0.9 }),
    ("module1/sensor/g5", Fault::ZeroOutput {}),
    ("module1/sensor/g6", Fault::Stuck {}),
    ("module1/sensor/g7", Fault::Intermittent { offset_m: 5e-5, closed_s: 0.01, open_s: 0.002 }),
    ("module1/sensor/g8", Fault::NoSignal {}),
];

// A program of its own: the test harness's own thread allocates too, now and then, and would be counted.
fn main() {
    a_step_allocates_nothing();
    nor_does_one_under_traffic();
}

fn a_step_allocates_nothing() {
    let tower = Structure::from_toml(TOWER).unwrap();
    let mut plant = Plant::new(&tower, &PlantParameters::default(), 1).unwrap();
    assert_eq!(allocations(&mut plant), 0);
    for (component, fault) in FAULTS {
        plant.inject(&component.parse().unwrap(), fault).unwrap();
    }
    assert_eq!(allocations(&mut plant), 0);
}

fn nor_does_one_under_traffic() {
    let bridge = Structure::from_toml(BRIDGE).unwrap();
    let mut traffic: toml::Table = TRAFFIC.parse().unwrap();
    let parameters: PlantParameters = traffic.remove("plant").unwrap().try_into().unwrap();
    assert_eq!(parameters.moving_loads.len(), 2);
    let mut plant = Plant::new(&bridge, &parameters, 1).unwrap();
    // crossings begin and end
    for _ in 0..20 {
        assert_eq!(allocations(&mut plant), 0);
    }
}

fn allocations(plant: &mut Plant) -> usize {
    let region = Region::new(GLOBAL);
    for _ in 0..1000 {
        plant.advance();
    }
    region.change().allocations
}
