//! The Riccati solver against an outside solution: SciPy's, committed with the script that made it
//! (`tests/reference/riccati_scipy.py` at the top of the repository).

#![expect(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use nalgebra::DMatrix;
use plant::riccati;
use serde_json::Value;

const REFERENCE: &str = include_str!("../../../tests/reference/riccati_scipy.json");

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows: Vec<Vec<f64>> = serde_json::from_value(value.clone()).unwrap();
    DMatrix::from_fn(rows.len(), rows[0].len(), |row, column| rows[row][column])
}

#[test]
fn solutions_agree_with_scipy() {
    let document: Value = serde_json::from_str(REFERENCE).unwrap();
    let cases = document["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4);
    for case in cases {
        let [a, b, q, r, expected] = ["a", "b", "q", "r", "x"].map(|key| matrix(&case[key]));
        let x = riccati::solve_discrete(&a, &b, &q, &r).unwrap();
        let difference = (&x - &expected).amax() / expected.amax();
        // SciPy's own residual says how far its numbers can be trusted; a residual is magnified
        // by the slowness of the closed loop (some hundred steps here).
        let residual = case["relative_residual"].as_f64().unwrap();
        let tolerance = 1e-10_f64.max(1e3 * residual);
        assert!(difference < tolerance, "{}: {difference:e}", case["name"]);
    }
}

#[test]
fn solutions_satisfy_the_equation_and_stabilise() {
    let document: Value = serde_json::from_str(REFERENCE).unwrap();
    for case in document["cases"].as_array().unwrap() {
        let [a, b, q, r] = ["a", "b", "q", "r"].map(|key| matrix(&case[key]));
        let x = riccati::solve_discrete(&a, &b, &q, &r).unwrap();
        let gain = riccati::gain(&a, &b, &r, &x).unwrap();
        let closed = &a - &b * &gain;
        let residual = a.transpose() * &x * &closed + &q - &x;
        let relative = residual.amax() / x.amax();
        assert!(relative < 1e-9, "{}: residual {relative:e}", case["name"]);
        let later = (0..20).fold(closed, |power, _| &power * &power);
        assert!(later.norm() < 1e-6, "{}: not stable", case["name"]);
    }
}
