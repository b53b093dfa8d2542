//! The whole plant on the shipped tower.

#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use nalgebra::{DMatrix, DVector};
use plant::{
    BaseSpeed, InjectError, LoadParameters, Mismatch, MovingLoad, Plant, PlantError,
    PlantParameters, Signals,
};
use truss::{Direction, Level, Mechanics, ModalStepper, Modes, Structure};
use vocabulary::{ComponentPath, Step, fault::Fault};

const TOWER: &str = include_str!("../../../configs/tower.toml");
const BRIDGE: &str = include_str!("../../../configs/templates/bridge.toml");

fn tower() -> Structure {
    Structure::from_toml(TOWER).unwrap()
}

fn plant(parameters: &PlantParameters, seed: u64) -> Plant {
    Plant::new(&tower(), parameters, seed).unwrap()
}

fn windy(speed_m_per_s: f64) -> PlantParameters {
    let mut parameters = PlantParameters::default();
    parameters.wind.base_speed = BaseSpeed::Fixed { speed_m_per_s };
    parameters
}

/// No gusts and no noise to speak of.
fn quiet() -> PlantParameters {
    let mut parameters = windy(12.0);
    parameters.wind.gust_factor = 0.0;
    parameters.hydraulics.pressure_noise_pa = 0.0;
    parameters
}

fn path(text: &str) -> ComponentPath {
    text.parse().unwrap()
}

fn record(plant: &mut Plant, steps: usize) -> Vec<Signals> {
    (0..steps).map(|_| plant.advance().clone()).collect()
}

fn elongations(signals: &Signals) -> Vec<f64> {
    signals.modules.iter().flat_map(|module| module.elongations_m.clone()).collect()
}

fn demands(signals: &Signals) -> Vec<f64> {
    signals.modules.iter().flat_map(|module| module.demands_n.clone()).collect()
}

fn pressures(signals: &Signals) -> Vec<[f64; 2]> {
    signals.modules.iter().flat_map(|module| module.pressures_pa.clone()).collect()
}

#[test]
fn steps_count_from_zero_and_only_equipped_modules_speak() {
    let mut plant = plant(&PlantParameters::default(), 1);
    let run = record(&mut plant, 3);
    let steps: Vec<Step> = run.iter().map(|signals| signals.step).collect();
    assert_eq!(steps, [Step(0), Step(1), Step(2)]);
    assert_eq!(plant.next_step(), Step(3));
    let names: Vec<&str> = run[0].modules.iter().map(|module| module.module.as_str()).collect();
    assert_eq!(names, ["module1", "module2"]);
    for module in &run[0].modules {
        assert_eq!(module.demands_n.len(), 4);
        assert_eq!(module.pressures_pa.len(), 4);
        assert_eq!(module.elongations_m.len(), 8);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_one_others() {
    let parameters = PlantParameters::default();
    let first = record(&mut plant(&parameters, 7), 3000);
    assert_eq!(first, record(&mut plant(&parameters, 7), 3000));
    assert_ne!(elongations(&first[0]), elongations(&record(&mut plant(&parameters, 8), 1)[0]));
}

#[test]
fn one_long_run_equals_two_short_ones() {
    let parameters = PlantParameters::default();
    let long = record(&mut plant(&parameters, 7), 500);
    let mut stopped = plant(&parameters, 7);
    record(&mut stopped, 250);
    let mut resumed = stopped.clone();
    assert_eq!(record(&mut resumed, 250), long[250..]);
}

#[test]
fn without_gusts_nothing_drifts_from_the_start() {
    for step_s in [1e-3, 2e-3] {
        let nominal = PlantParameters { step_s, ..quiet() };
        // The filter is designed for the real noise, or it would have none to weigh.
        let mut parameters = nominal.clone();
        parameters.gages.noise_strain = 1e-15;
        let tower = tower();
        let mut plant = Plant::with_nominal(&tower, &tower, &parameters, &nominal, 5).unwrap();
        let run = record(&mut plant, 5000);
        let (start, first) = (&run[0], elongations(&run[0]));
        assert!(first.iter().any(|elongation| elongation.abs() > 1e-5), "{first:?}");
        assert!(demands(start).iter().any(|demand| demand.abs() > 1e3), "{:?}", demands(start));
        for signals in &run {
            for (now, then) in elongations(signals).iter().zip(&first) {
                assert!((now - then).abs() < 1e-12, "{now} {then}");
            }
            for (now, then) in demands(signals).iter().zip(demands(start)) {
                assert!((now - then).abs() < 1e-2, "{now} {then}");
            }
        }
    }
}

#[test]
fn a_structure_without_actuators_or_without_any_equipment_runs_too() {
    let parameters = PlantParameters::default();
    let mut passive = tower();
    passive.modules.iter_mut().for_each(|module| module.actuators.clear());
    let run = record(&mut Plant::new(&passive, &parameters, 1).unwrap(), 10);
    assert_eq!(elongations(&run[9]).len(), 16);
    assert!(demands(&run[9]).is_empty());

    passive.modules.iter_mut().for_each(|module| module.gages.clear());
    let run = record(&mut Plant::new(&passive, &parameters, 1).unwrap(), 10);
    assert!(run[9].modules.is_empty());
}

#[test]
fn a_start_with_gusts_has_no_jump() {
    let run = record(&mut plant(&windy(13.5), 2), 15_000);
    let largest = |range: std::ops::Range<usize>| {
        run[range]
            .windows(2)
            .flat_map(|pair| {
                let (now, next) = (elongations(&pair[0]), elongations(&pair[1]));
                now.into_iter().zip(next).map(|(a, b)| (b - a).abs()).collect::<Vec<_>>()
            })
            .fold(0.0, f64::max)
    };
    assert!(largest(0..1000) < 1.2 * largest(8000..15_000));
}

#[test]
fn levels_of_load_are_those_of_the_tower() {
    let plant = plant(&PlantParameters::default(), 3);
    let conditions = plant.conditions();
    assert_eq!(conditions.live_loads_kg.len(), 12);
    assert!(conditions.live_loads_kg.iter().all(|load| (0.0..1000.0).contains(load)));
    assert!((8.0..14.0).contains(&conditions.base_speed_m_per_s));
}

/// A force of 20 kN that drives over the bridge of the templates within 1.2 s, from 1 s on.
fn lorry() -> MovingLoad {
    MovingLoad {
        paths: vec![(0..7).map(|node| format!("B{node}").parse().unwrap()).collect()],
        axles_n: vec![20e3],
        axles_behind_m: vec![0.0],
        speed_m_per_s: [20.0; 2],
        pause_s: [1.0; 2],
        load_factor: [1.0; 2],
        direction: [0.0, 0.0, -1.0],
    }
}

#[test]
fn a_vehicle_moves_the_gages_while_it_crosses_and_not_before() {
    let bridge = Structure::from_toml(BRIDGE).unwrap();
    let without = windy(0.0);
    let with = PlantParameters { moving_loads: vec![lorry()], ..without.clone() };
    let run = |parameters| record(&mut Plant::new(&bridge, parameters, 5).unwrap(), 2000);
    let (with, again, without) = (run(&with), run(&with), run(&without));
    assert_eq!(with, again);
    assert_eq!(with[..1001], without[..1001]);
    let strain = |at: usize| elongations(&with[at])[1] - elongations(&without[at])[1];
    // The top chord of a span of 18 m, 2 m high, is pressed by 20 kN · 6 m · 12 m / 18 m / 2 m = 40 kN, before the
    // cylinders relieve it: 3 m of it, of 50 cm² of steel, become 0.11 mm shorter.
    let largest = (1001..2000).map(strain).fold(0.0_f64, |a, b| a.min(b));
    assert!((-0.25e-3..-0.03e-3).contains(&largest), "{largest}");
}

#[test]
fn a_path_over_a_node_that_is_not_there_is_refused_by_name() {
    let parameters = PlantParameters { moving_loads: vec![lorry()], ..PlantParameters::default() };
    let error = Plant::new(&tower(), &parameters, 1).err().unwrap().to_string();
    assert!(error.contains("moving_loads.0.paths") && error.contains("`B0`"), "{error}");
}

/// A bridge has no base: wind and live loads act on its deck, too.
#[test]
fn every_level_that_can_move_is_loaded() {
    let bridge = Structure::from_toml(BRIDGE).unwrap();
    let plant = Plant::new(&bridge, &PlantParameters::default(), 1).unwrap();
    assert_eq!(plant.conditions().live_loads_kg.len(), 2);
}

/// All faults: which channel differs from the fault-free run of the same seed, and when first.
#[test]
fn each_fault_shows_first_on_its_own_channel_and_nowhere_else() {
    const ONSET: usize = 200;
    let parameters = PlantParameters::default();
    let nominal = record(&mut plant(&parameters, 11), ONSET + 2);
    let sensor = "module2/sensor/g3";
    let actuator = "module1/actuator/a2";
    for (name, fault) in [
        (sensor, Fault::Bias { offset_m: 50e-6 }),
        (sensor, Fault::RandomWalk { drift_m_per_s: 20e-6, increment_m: 6e-6 }),
        (sensor, Fault::Drift { drift_m_per_s: 20e-6 }),
        (sensor, Fault::Gain { gain: 0.9 }),
        (sensor, Fault::ZeroOutput {}),
        (sensor, Fault::Stuck {}),
        (sensor, Fault::Intermittent { offset_m: 50e-6, closed_s: 0.5, open_s: 0.02 }),
        (sensor, Fault::NoSignal {}),
        (actuator, Fault::InternalLeakage { area_m2: 2e-7 }),
        (actuator, Fault::ExternalLeakageA { area_m2: 2e-7 }),
        (actuator, Fault::ExternalLeakageB { area_m2: 2e-7 }),
        (actuator, Fault::HardOver {}),
        (actuator, Fault::Stiction { band_m3_per_s: 1e-5 }),
    ] {
        let mut faulty = plant(&parameters, 11);
        assert_eq!(record(&mut faulty, ONSET), nominal[..ONSET]);
        faulty.inject(&path(name), fault).unwrap();
        assert_eq!(faulty.faults(), [(path(name), fault)]);
        let [first, second] = [faulty.advance().clone(), faulty.advance().clone()];
        let changed = |now: &Signals, then: &Signals| -> Vec<usize> {
            let pairs = elongations(now).into_iter().zip(elongations(then)).enumerate();
            pairs.filter(|(_, (a, b))| a != b).map(|(channel, _)| channel).collect()
        };
        if name == sensor {
            assert_eq!(changed(&first, &nominal[ONSET]), [10], "{fault:?}");
            assert_eq!(pressures(&first), pressures(&nominal[ONSET]), "{fault:?}");
        } else {
            // A valve or leak needs a step to change a pressure.
            assert_eq!(first, nominal[ONSET], "{fault:?}");
            let pairs = pressures(&second).into_iter().zip(pressures(&nominal[ONSET + 1]));
            for (channel, (now, then)) in pairs.enumerate() {
                assert_eq!(now != then, channel == 1, "{fault:?} {channel}");
            }
        }
    }
}

#[test]
fn a_drift_is_a_random_walk_that_never_deviates() {
    let mut drifting = plant(&PlantParameters::default(), 11);
    let mut walking = drifting.clone();
    let (gage, drift_m_per_s) = (path("module2/sensor/g3"), 20e-6);
    drifting.inject(&gage, Fault::Drift { drift_m_per_s }).unwrap();
    walking.inject(&gage, Fault::RandomWalk { drift_m_per_s, increment_m: 0.0 }).unwrap();
    assert_eq!(record(&mut drifting, 1000), record(&mut walking, 1000));
}

#[test]
fn a_gage_fault_travels_through_the_controller_to_every_demand() {
    let parameters = PlantParameters::default();
    let mut nominal = plant(&parameters, 11);
    let mut faulty = nominal.clone();
    faulty.inject(&path("module1/sensor/g1"), Fault::Bias { offset_m: 100e-6 }).unwrap();
    let (faulty, nominal) = (faulty.advance(), nominal.advance());
    assert!(demands(faulty).iter().zip(demands(nominal)).all(|(a, b)| *a != b));
}

#[test]
fn the_controller_goes_on_with_the_last_reading_of_a_gage_without_a_signal() {
    let mut plant = plant(&PlantParameters::default(), 11);
    plant.advance();
    plant.inject(&path("module1/sensor/g1"), Fault::NoSignal {}).unwrap();
    for _ in 0..1000 {
        let signals = plant.advance();
        assert!(signals.modules[0].elongations_m[0].is_nan());
        assert!(demands(signals).iter().all(|demand| demand.abs() < 1e6));
    }
}

#[test]
fn a_cleared_gage_reads_true_again_with_the_noise_it_would_have_had() {
    let parameters = PlantParameters::default();
    let mut nominal = plant(&parameters, 11);
    let mut repaired = nominal.clone();
    let gage = path("module1/sensor/g1");
    repaired.inject(&gage, Fault::Bias { offset_m: 1e-6 }).unwrap();
    repaired.clear(&gage).unwrap();
    repaired.clear(&gage).unwrap();
    assert!(repaired.faults().is_empty());
    assert_eq!(record(&mut repaired, 50), record(&mut nominal, 50));
}

#[test]
fn a_second_fault_replaces_the_first() {
    let mut plant = plant(&PlantParameters::default(), 1);
    let gage = path("module1/sensor/g1");
    plant.inject(&gage, Fault::ZeroOutput {}).unwrap();
    plant.inject(&gage, Fault::Bias { offset_m: 1e-6 }).unwrap();
    assert_eq!(plant.faults(), [(gage, Fault::Bias { offset_m: 1e-6 })]);
}

#[test]
fn what_cannot_be_injected_is_named_with_what_could() {
    let mut plant = plant(&PlantParameters::default(), 1);
    let mut refused = |name: &str, fault: Fault| plant.inject(&path(name), fault).unwrap_err();
    let bias = Fault::Bias { offset_m: 1e-6 };

    let error = refused("module9/sensor/g1", bias);
    assert!(matches!(error, InjectError::UnknownModule { .. }));
    assert!(error.to_string().contains("module9") && error.to_string().contains("`module1`"));

    let error = refused("module1/sensor/g99", bias);
    assert!(matches!(error, InjectError::UnknownComponent { .. }));
    assert!(error.to_string().contains("g99") && error.to_string().contains("`sensor/g1`"));

    let error = refused("module1/sensor/g1", Fault::HardOver {});
    assert!(matches!(error, InjectError::WrongKind { .. }));
    assert!(error.to_string().contains("hard_over") && error.to_string().contains("actuator"));

    let error = refused("module1/sensor/g1", Fault::Bias { offset_m: f64::NAN });
    assert!(error.to_string().contains("offset_m"), "{error}");
    assert!(plant.faults().is_empty());
    assert!(plant.clear(&path("module1/actuator/g1")).is_err());
}

#[test]
fn a_minute_later_the_closed_loop_is_still_bounded_under_every_fault_of_an_actuator() {
    let parameters = windy(14.0);
    for fault in [
        Fault::InternalLeakage { area_m2: 5e-7 },
        Fault::ExternalLeakageA { area_m2: 5e-7 },
        Fault::ExternalLeakageB { area_m2: 5e-7 },
        Fault::HardOver {},
        Fault::Stiction { band_m3_per_s: 1e-5 },
        Fault::Stiction { band_m3_per_s: 1e-3 },
    ] {
        let mut plant = plant(&parameters, 4);
        plant.inject(&path("module1/actuator/a1"), fault).unwrap();
        for _ in 0..60_000 {
            let signals = plant.advance();
            let bounded = signals
                .modules
                .iter()
                .flat_map(|module| &module.elongations_m)
                .all(|elongation| elongation.abs() < 2e-3);
            assert!(bounded, "{fault:?}");
        }
    }
}

#[test]
fn a_mismatched_plant_runs_and_differs() {
    let nominal = tower();
    let parameters = PlantParameters::default();
    for seed in 0..5 {
        let mismatch = Mismatch::draw(&nominal, &parameters, 0.1, seed).unwrap();
        assert_eq!(mismatch, Mismatch::draw(&nominal, &parameters, 0.1, seed).unwrap());
        let factors = &mismatch.perturbation.member_stiffness;
        assert!(factors.iter().all(|factor| (0.9..=1.1).contains(factor)));
        let gain = mismatch.parameters.hydraulics.force_gain_m3_per_s_per_n / 6.7e-9;
        assert!((0.9..=1.1).contains(&gain) && gain != 1.0);
        let truth = mismatch.structure(&nominal);
        let mut differing =
            Plant::with_nominal(&truth, &nominal, &mismatch.parameters, &parameters, seed).unwrap();
        let mut exact = plant(&parameters, seed);
        let (differing, exact) = (record(&mut differing, 3000), record(&mut exact, 3000));
        assert_ne!(differing[0], exact[0]);
        let largest = differing.iter().flat_map(elongations).map(f64::abs).fold(0.0, f64::max);
        assert!(largest < 1e-3, "{largest}");
    }
    assert!(Mismatch::draw(&nominal, &parameters, -0.1, 0).is_err());
}

#[test]
fn other_equipment_in_truth_than_in_the_nominal_model_is_refused_by_name() {
    let (truth, mut nominal) = (tower(), tower());
    let lost = nominal.modules[0].gages.pop().unwrap();
    let parameters = PlantParameters::default();
    let error = Plant::with_nominal(&truth, &nominal, &parameters, &parameters, 1).err().unwrap();
    assert!(matches!(error, PlantError::Equipment(_)));
    assert!(error.to_string().contains(lost.name.as_str()), "{error}");
}

#[test]
fn a_start_beyond_the_actuators_is_refused() {
    let mut parameters = windy(14.0);
    parameters.hydraulics.demand_limit_n = 1.0;
    let error = Plant::new(&tower(), &parameters, 1).err().unwrap();
    assert!(error.to_string().contains("demand_limit_n"), "{error}");
}

#[test]
fn parameters_out_of_range_are_refused() {
    let mut parameters = PlantParameters::default();
    parameters.gages.noise_strain = -1.0;
    assert!(matches!(Plant::new(&tower(), &parameters, 1), Err(PlantError::Parameters(_))));
}

/// Deviation of the demands' tracking over ten seconds: that of a first-order lag, noise included.
#[test]
fn observed_forces_follow_the_nominal_force_loop() {
    let parameters = PlantParameters::default();
    let run = record(&mut plant(&parameters, 6), 10_000);
    let hydraulics = &parameters.hydraulics;
    let keep = (-1e-3 / hydraulics.time_constant_s()).exp();
    let mut nominal: Vec<f64> =
        pressures(&run[0]).into_iter().map(|p| hydraulics.force_n(p)).collect();
    let mut squares = 0.0;
    for pair in run.windows(2).skip(100) {
        for (force, demand) in nominal.iter_mut().zip(demands(&pair[0])) {
            *force = keep * *force + (1.0 - keep) * demand;
        }
        for (force, measured) in nominal.iter().zip(pressures(&pair[1])) {
            squares += (hydraulics.force_n(measured) - force).powi(2) / (8.0 * 9899.0);
        }
    }
    // 163 N from the pressure sensors and 37 N of true force from their noise in the loop.
    assert!((squares.sqrt() - 167.0).abs() < 5.0, "{}", squares.sqrt());
}

#[test]
fn towers_that_stand_by_themselves_run_side_by_side() {
    let (parameters, row) = (PlantParameters::default(), tower().row(3).unwrap());
    let mut alone = plant(&parameters, 7);
    let mut towers = Plant::new(&row, &parameters, 7).unwrap();
    let (alone_loads, loads) = (alone.conditions().clone(), towers.conditions().clone());
    assert_eq!(loads.live_loads_kg.len(), 36);
    assert_eq!(loads.live_loads_kg[..12], alone_loads.live_loads_kg);
    assert_eq!(loads.base_speed_m_per_s, alone_loads.base_speed_m_per_s);
    let (alone, run) = (record(&mut alone, 500), record(&mut towers, 500));
    let names: Vec<&str> = run[0].modules.iter().map(|module| module.module.as_str()).collect();
    assert_eq!(names[..3], ["t01-module1", "t01-module2", "t02-module1"]);
    assert_eq!(names.len(), 6);
    // The first is the tower as it is alone, to the last bit; the others have gusts and noise of theirs.
    for (one, all) in alone.iter().zip(&run) {
        assert_eq!(elongations(one), elongations(all)[..16]);
        assert_eq!(pressures(one), pressures(all)[..8]);
        assert_eq!(demands(one), demands(all)[..8]);
    }
    assert_ne!(elongations(&run[499])[..16], elongations(&run[499])[16..32]);
    assert_ne!(elongations(&run[499])[16..32], elongations(&run[499])[32..]);
}

#[test]
fn a_fault_in_one_tower_is_none_in_another() {
    let (parameters, row) = (PlantParameters::default(), tower().row(2).unwrap());
    let mut nominal = Plant::new(&row, &parameters, 7).unwrap();
    let mut faulty = nominal.clone();
    let gage = path("t02-module1/sensor/g1");
    faulty.inject(&gage, Fault::Bias { offset_m: 100e-6 }).unwrap();
    assert_eq!(faulty.faults().len(), 1);
    let (with, without) = (record(&mut faulty, 200), record(&mut nominal, 200));
    assert_eq!(elongations(&with[199])[..16], elongations(&without[199])[..16]);
    assert_eq!(demands(&with[199])[..8], demands(&without[199])[..8]);
    assert!((elongations(&with[0])[16] - elongations(&without[0])[16] - 100e-6).abs() < 1e-12);
    assert_ne!(demands(&with[0])[8..], demands(&without[0])[8..]);
    faulty.clear(&gage).unwrap();
    assert!(faulty.faults().is_empty());
    let error = faulty.inject(&path("module1/sensor/g1"), Fault::ZeroOutput {}).unwrap_err();
    assert!(error.to_string().contains("`t01-module1`"), "{error}");
}

/// A row whose towers were measured again, each differently.
#[test]
fn true_and_nominal_row_are_taken_apart_alike() {
    let (parameters, nominal) = (PlantParameters::default(), tower().row(2).unwrap());
    let drawn = Mismatch::draw(&nominal, &parameters, 0.1, 5).unwrap();
    let truth = drawn.structure(&nominal);
    let mut plant =
        Plant::with_nominal(&truth, &nominal, &drawn.parameters, &parameters, 5).unwrap();
    let run = record(&mut plant, 2000);
    let largest = run.iter().flat_map(elongations).map(f64::abs).fold(0.0, f64::max);
    assert!(largest > 1e-5 && largest < 1e-3, "{largest}");
}

/// Another program may step a structure of its own beside the plant. With the same model it responds as the plant's own.
#[test]
fn a_structure_stepped_beside_the_plant_responds_as_its_own() {
    let structure = tower();
    let loads = LoadParameters { live_load_max_kg: 0.0, ..LoadParameters::default() };
    let parameters = PlantParameters { loads, ..PlantParameters::default() };
    let mut alone = Plant::new(&structure, &parameters, 5).unwrap();
    let mut coupled = alone.clone();
    let mechanics = Mechanics::assemble(&structure).unwrap();
    let levels = structure.levels();
    let is_free = |level: &&Level| level.height_m > levels[0].height_m;
    let free: Vec<&Level> = levels.iter().filter(is_free).collect();
    let mut columns: Vec<DVector<f64>> =
        mechanics.actuator_map.column_iter().map(|column| column.into_owned()).collect();
    for direction in [Direction::X, Direction::Y] {
        columns.extend(free.iter().map(|level| {
            let mut column = DVector::zeros(mechanics.dofs.len());
            for &node in &level.nodes {
                let dof = mechanics.dof_index(node, direction).unwrap();
                column[dof] = 1.0 / level.nodes.len() as f64;
            }
            column
        }));
    }
    let modes = Modes::of(&mechanics, structure.damping, None).unwrap();
    let input_map = DMatrix::from_columns(&columns);
    let mut beside = ModalStepper::new(&modes, parameters.step_s, &input_map, &mechanics.gage_map);
    let inputs = |plant: &Plant| {
        let (mut inputs, levels_n) = plant.loads();
        assert_eq!(levels_n.len(), free.len());
        inputs.extend(levels_n.iter().map(|[x, _]| *x));
        inputs.extend(levels_n.iter().map(|[_, y]| *y));
        inputs
    };
    let no_wind = vec![0.0; modes.shapes.ncols()];
    beside.settle(&inputs(&coupled), &no_wind);
    let mut elongations_m = vec![0.0; mechanics.gage_map.nrows()];
    assert!(!coupled.respond(&elongations_m[1..]));
    for step in 0..3000 {
        beside.outputs(&mut elongations_m);
        assert!(coupled.respond(&elongations_m));
        let (own, other) = (alone.advance(), coupled.advance());
        for (own, other) in own.modules.iter().zip(&other.modules) {
            let both = own.true_elongations_m.iter().zip(&other.true_elongations_m);
            for (own, other) in both {
                assert!((own - other).abs() < 1e-12, "step {step}: {own} {other}");
            }
        }
        beside.step(&inputs(&coupled), &no_wind);
    }
}
