//! What holds of divergences whatever comes.

use crate::definition::{Definition, error_in_tolerances};
use diagnosis::divergence::{DivergenceBank, DivergenceOutcome, DivergenceSettings, Interval};
use proptest::prelude::*;

fn settings(window: usize, lag: usize, interval: usize) -> DivergenceSettings {
    let interval = match interval {
        0 => Interval::Growing,
        vectors => Interval::Sliding { vectors },
    };
    DivergenceSettings { window, lag, interval }
}

fn divergences(bank: &mut DivergenceBank, samples: &[f64]) -> Vec<Option<f64>> {
    samples.iter().map(|x| bank.push(&[*x])[0].divergence()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..Default::default() })]

    #[test]
    fn the_divergence_agrees_with_its_definition_for_any_setting(
        window in 1_usize..12,
        lag in 1_usize..12,
        interval in prop_oneof![Just(0_usize), 8_usize..40],
        scale in -9_i32..3,
        samples in prop::collection::vec(-1.0..1.0_f64, 60..90),
    ) {
        let scale = 10_f64.powi(scale);
        let samples: Vec<f64> = samples.iter().map(|x| scale * x).collect();
        let prior_scatter = 0.01 * scale * scale;
        let definition = Definition { window, lag, interval, prior_scatter };
        let mut bank = DivergenceBank::new(settings(window, lag, interval), &[prior_scatter]).unwrap();
        let found = divergences(&mut bank, &samples);
        for index in (0..samples.len()).rev().step_by(13) {
            let expected = definition.divergence(&samples, index);
            prop_assert_eq!(found[index].is_some(), expected.is_some());
            if let (Some(found), Some(expected)) = (found[index], expected) {
                prop_assert!(error_in_tolerances(found, expected) <= 1.0, "{} {}", found, expected);
            }
        }
    }

    #[test]
    fn channels_never_touch_each_other(
        samples in prop::collection::vec(prop::array::uniform5(-1e3..1e3_f64), 30..60),
    ) {
        let setting = settings(4, 3, 12);
        let mut together = DivergenceBank::new(setting, &[0.1; 5]).unwrap();
        let mut alone: Vec<_> = (0..5).map(|_| DivergenceBank::new(setting, &[0.1]).unwrap()).collect();
        for sample in &samples {
            let outcomes = together.push(sample).to_vec();
            for (channel, bank) in alone.iter_mut().enumerate() {
                prop_assert_eq!(bank.push(&sample[channel..=channel])[0], outcomes[channel]);
            }
        }
    }

    #[test]
    fn a_divergence_is_never_negative_nor_infinite_whatever_comes(
        samples in prop::collection::vec(any::<f64>(), 30..120),
    ) {
        let mut bank = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        for sample in samples {
            if let DivergenceOutcome::Defined { divergence, .. } = bank.push(&[sample])[0] {
                prop_assert!(divergence.is_finite() && divergence >= 0.0);
            }
        }
    }

    #[test]
    fn after_rubbish_a_channel_comes_back_as_if_it_had_just_started(
        rubbish in prop::collection::vec(-1e200..1e200_f64, 1..40),
        samples in prop::collection::vec(-1.0..1.0_f64, 60),
    ) {
        let mut bank = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        divergences(&mut bank, &rubbish);
        bank.restart();
        let mut new = DivergenceBank::new(settings(3, 2, 10), &[1e-6]).unwrap();
        prop_assert_eq!(divergences(&mut bank, &samples), divergences(&mut new, &samples));
    }
}
