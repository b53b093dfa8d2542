//! The generalised Pareto distribution and its fit against an outside solution: SciPy's, committed
//! with the script that made it (`tests/reference/pareto_scipy.py` at the top of the repository).

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use serde_json::Value;
use study::tail::{Pareto, ParetoFit};

const REFERENCE: &str = include_str!("../../../tests/reference/pareto_scipy.json");

fn cases(name: &str) -> Vec<Value> {
    let document: Value = serde_json::from_str(REFERENCE).unwrap();
    document[name].as_array().unwrap().clone()
}

fn numbers(case: &Value, name: &str) -> Vec<f64> {
    serde_json::from_value(case[name].clone()).unwrap()
}

fn pareto(case: &Value) -> Pareto {
    Pareto { shape: case["shape"].as_f64().unwrap(), scale: case["scale"].as_f64().unwrap() }
}

#[track_caller]
fn assert_all_close(found: impl Iterator<Item = f64>, expected: &[f64]) {
    for (found, expected) in found.zip(expected) {
        let miss = (found - expected).abs();
        assert!(miss <= 1e-11 * expected.abs(), "{found:e} instead of {expected:e}");
    }
}

#[test]
fn probabilities_and_quantiles_agree_with_scipy() {
    let cases = cases("values");
    assert_eq!(cases.len(), 6);
    for case in &cases {
        let pareto = pareto(case);
        let x = numbers(case, "x");
        let survival = x.iter().map(|x| pareto.survival(*x));
        assert_all_close(survival, &numbers(case, "survival_of_x"));
        let survival = numbers(case, "survival");
        let x = survival.iter().map(|survival| pareto.exceeded_with(*survival));
        assert_all_close(x, &numbers(case, "x_of_survival"));
    }
}

fn log_likelihood(pareto: Pareto, sample: &[f64]) -> f64 {
    let density = |x: f64| {
        pareto.survival(x).ln() - (1.0 + pareto.shape * x / pareto.scale).ln() - pareto.scale.ln()
    };
    sample.iter().map(|x| density(*x)).sum()
}

/// The estimator is no maximum likelihood, but it must be nearly as likely: what lies 0.5 below is
/// within one standard error.
#[test]
fn estimates_are_nearly_as_likely_as_scipy_s_likeliest() {
    let cases = cases("samples");
    assert_eq!(cases.len(), 12);
    for case in &cases {
        let sample = numbers(case, "x");
        let best = case["likeliest"]["log_likelihood"].as_f64().unwrap();
        let likeliest = pareto(&case["likeliest"]);
        assert!((log_likelihood(likeliest, &sample) - best).abs() < 1e-6);
        let estimate = ParetoFit::new(&sample).unwrap().estimate();
        let less = best - log_likelihood(estimate, &sample);
        assert!((-1e-6..0.5).contains(&less), "{less} of {} {}", sample.len(), case["true_shape"]);
    }
}

/// Maximum likelihood has the standard error (1 + ξ)/√n (Smith 1987); the estimator must not be
/// worse by more than a fifth, and nearly without bias.
#[test]
fn known_shapes_are_found_with_the_error_of_maximum_likelihood() {
    let mut random = ChaCha12Rng::seed_from_u64(1);
    for (shape, size) in [(0.0, 50), (0.2, 50), (0.2, 250), (0.5, 100), (-0.1, 500)] {
        let truth = Pareto { shape, scale: 2.0 };
        let errors: Vec<f64> = (0..1000)
            .map(|_| {
                let draw = |_| truth.exceeded_with(1.0 - random.random::<f64>());
                let sample: Vec<f64> = (0..size).map(draw).collect();
                ParetoFit::new(&sample).unwrap().estimate().shape - shape
            })
            .collect();
        let mean = errors.iter().sum::<f64>() / 1000.0;
        let root_mean_square = (errors.iter().map(|e| e * e).sum::<f64>() / 1000.0).sqrt();
        let standard = (1.0 + shape) / f64::from(size).sqrt();
        assert!(mean.abs() < 0.4 * standard, "{shape} of {size}: bias {mean}, {standard}");
        assert!(root_mean_square < 1.2 * standard, "{shape} of {size}: {root_mean_square}");
    }
}

/// A further excess exceeds the level of a sample as often as promised, on average over samples. The
/// best estimate alone would promise too little.
#[test]
fn the_promise_holds_on_average_over_samples_of_known_shape() {
    let mut random = ChaCha12Rng::seed_from_u64(2);
    let truth = Pareto { shape: 0.15, scale: 1.0 };
    let wanted = 1e-4;
    let (mut promised, mut of_estimate) = (0.0, 0.0);
    for _ in 0..1000 {
        let sample: Vec<f64> =
            (0..250).map(|_| truth.exceeded_with(1.0 - random.random::<f64>())).collect();
        let fit = ParetoFit::new(&sample).unwrap();
        promised += truth.survival(fit.exceeded_with(wanted)) / 1000.0;
        of_estimate += truth.survival(fit.estimate().exceeded_with(wanted)) / 1000.0;
    }
    assert!((0.5..1.5).contains(&(promised / wanted)), "{promised:e}");
    assert!(of_estimate > 1.5 * wanted, "{of_estimate:e}");
}

#[test]
fn samples_without_spread_are_not_fitted() {
    assert_eq!(ParetoFit::new(&[1.0; 100]), None);
    assert_eq!(ParetoFit::new(&[]), None);
    assert_eq!(ParetoFit::new(&[1.0, 2.0, f64::NAN]), None);
}
