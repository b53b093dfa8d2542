//! The divergence against values computed at 400 bits straight from the definition, outside this
//! project; and against the same definition in 256 bits on further series.

use crate::definition::{Definition, error_in_tolerances};
use diagnosis::divergence::{DivergenceBank, DivergenceSettings, Interval};

fn settings(d: &Definition) -> DivergenceSettings {
    let interval = match d.interval {
        0 => Interval::Growing,
        vectors => Interval::Sliding { vectors },
    };
    DivergenceSettings { window: d.window, lag: d.lag, interval }
}

#[test]
fn every_golden_value_is_met() {
    let text = include_str!("data/kl_divergence.json");
    let cases: Vec<serde_json::Value> = serde_json::from_str(text).unwrap();
    assert_eq!(cases.len(), 5);
    for case in &cases {
        let size = |name: &str| case[name].as_u64().unwrap() as usize;
        let definition = Definition {
            window: size("window"),
            lag: size("lag"),
            interval: size("interval"),
            prior_scatter: case["regularization"].as_f64().unwrap(),
        };
        let mut estimator =
            DivergenceBank::new(settings(&definition), &[definition.prior_scatter]).unwrap();
        let found: Vec<Option<f64>> = case["samples"]
            .as_array()
            .unwrap()
            .iter()
            .map(|x| estimator.push(&[x.as_f64().unwrap()])[0].divergence())
            .collect();
        let mut worst = 0.0_f64;
        for pair in case["divergence"].as_array().unwrap() {
            let index = pair[0].as_u64().unwrap() as usize;
            let expected = pair[1].as_f64().unwrap();
            worst = worst.max(error_in_tolerances(found[index].unwrap(), expected));
        }
        println!("{}: {worst:.2e} of the tolerance", case["series"]);
        assert!(worst <= 1.0, "{} misses by {worst} tolerances", case["series"]);
    }
}
