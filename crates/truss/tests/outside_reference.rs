//! Authority: OpenSees, an outside finite-element program, which repeated each model from its
//! export alone, without condensation (`tests/reference/fe_reference.py`).
#![allow(clippy::unwrap_used, clippy::panic, reason = "a failing test may panic")]

mod shared;

use serde_json::Value;
use truss::{Mechanics, Modes, Structure};

/// How far results may differ, relative to the largest of their kind.
const TOLERANCE: f64 = 1e-9;

fn compare(structure: &Structure, reference: &str) {
    let reference: Value = serde_json::from_str(reference).unwrap();
    let export = serde_json::to_value(structure.export().unwrap()).unwrap();
    compare_frequencies(&export, &reference);
    compare_responses(&export, &reference);
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

fn compare_frequencies(export: &Value, reference: &Value) {
    let expected = numbers(&reference["natural_frequencies_hz"]);
    assert!(expected.len() >= 4);
    for (own, expected) in numbers(&export["natural_frequencies_hz"]).iter().zip(&expected) {
        assert!((own / expected - 1.0).abs() < TOLERANCE, "{own} Hz instead of {expected} Hz");
    }
}

fn compare_responses(export: &Value, reference: &Value) {
    let own = export["static_responses"].as_array().unwrap();
    let expected = reference["static_responses"].as_array().unwrap();
    assert_eq!(own.len(), expected.len());
    for (own, expected) in own.iter().zip(expected) {
        assert_eq!(own["actuator"], expected["actuator"]);
        let elongations = numbers(&expected["static_elongations_m_per_n"]);
        let largest = elongations.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let own = numbers(&own["static_elongations_m_per_n"]);
        assert_eq!(own.len(), elongations.len());
        for (own, expected) in own.iter().zip(&elongations) {
            assert!((own - expected).abs() < TOLERANCE * largest, "{own} instead of {expected}");
        }
    }
}

#[test]
fn the_tower_agrees_with_the_outside_program() {
    compare(&shared::tower(), include_str!("../../../tests/reference/tower.json"));
}

#[test]
fn the_towers_local_models_agree_with_the_outside_program() {
    let tower = shared::tower();
    let module1 = include_str!("../../../tests/reference/tower_module1.json");
    let module2 = include_str!("../../../tests/reference/tower_module2.json");
    compare(&shared::local(&tower, "module1"), module1);
    compare(&shared::local(&tower, "module2"), module2);
}

#[test]
fn the_small_structure_and_its_local_models_agree_with_the_outside_program() {
    let small = shared::small();
    compare(&small, include_str!("../../../tests/reference/small.json"));
    let lower = include_str!("../../../tests/reference/small_lower.json");
    let upper = include_str!("../../../tests/reference/small_upper.json");
    compare(&shared::local(&small, "lower"), lower);
    compare(&shared::local(&small, "upper"), upper);
}

#[test]
fn the_tower_has_the_known_size_and_frequencies() {
    let tower = shared::tower();
    assert_eq!(tower.nodes.len(), 52);
    assert!(tower.modules.iter().all(|module| module.members.len() == 38));
    let mechanics = Mechanics::assemble(&tower).unwrap();
    assert_eq!(mechanics.dofs.len(), 144);
    assert_eq!(mechanics.actuator_map.ncols(), 8);
    assert_eq!(mechanics.gage_map.nrows(), 16);
    let modes = Modes::of(&mechanics, tower.damping, None).unwrap();
    let frequencies = modes.frequencies_hz();
    for (own, known) in frequencies.iter().zip([1.70, 1.70, 2.52, 4.79]) {
        assert!((own - known).abs() < 0.005, "{own} Hz instead of {known} Hz");
    }
    assert!((modes.damping_ratios[0] - 0.029).abs() < 0.0005);
}

/// Relative difference (Frobenius) of own-actuator-to-own-gage responses, local against whole.
fn static_error(whole: &Structure, module: &str) -> f64 {
    let responses = |structure: &Structure| {
        let export = structure.export().unwrap();
        let mut own = Vec::new();
        for response in &export.static_responses {
            for (gage, value) in export.gages.iter().zip(&response.static_elongations_m_per_n) {
                if response.actuator.starts_with(module) && gage.path.starts_with(module) {
                    own.push(*value);
                }
            }
        }
        own
    };
    let (whole, local) = (responses(whole), responses(&shared::local(whole, module)));
    assert_eq!(whole.len(), local.len());
    let norm = |values: &[f64]| values.iter().map(|x| x * x).sum::<f64>().sqrt();
    let difference: Vec<f64> = whole.iter().zip(&local).map(|(a, b)| a - b).collect();
    norm(&difference) / norm(&whole)
}

#[test]
fn the_towers_local_models_have_the_known_static_error() {
    let tower = shared::tower();
    assert!((static_error(&tower, "module1") - 0.175).abs() < 0.005);
    assert!((static_error(&tower, "module2") - 0.440).abs() < 0.005);
}
