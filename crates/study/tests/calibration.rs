//! Calibration: simulated, recorded, and from the tail.

use crate::tower;
use diagnosis::ModuleSetup;
use study::tail::TailError;
use study::{Calibration, NominalRuns, ResidualRecording, StepOrder};

const STEPS: u64 = 5000;

fn simulate(runs: u64, steps: u64, jobs: usize) -> Calibration {
    let (structure, parameters, setups) = tower::parts();
    let runs = NominalRuns { first_seed: 1, runs, steps, mismatch: 0.0, jobs };
    runs.calibrate(&structure, &parameters, &setups, &|| {}).unwrap()
}

/// Records the first module's residuals of the run with this seed.
fn record(seed: u64) -> Vec<Vec<f64>> {
    let mut rig = tower::rig(seed, Vec::new());
    (0..STEPS)
        .map(|_| {
            rig.step().unwrap();
            rig.diagnosers()[0].evidence().iter().map(|evidence| evidence.residual).collect()
        })
        .collect()
}

fn setup() -> ModuleSetup {
    tower::parts().2.remove(0)
}

#[test]
fn a_calibration_does_not_depend_on_the_number_of_jobs() {
    assert_eq!(simulate(3, STEPS, 1), simulate(3, STEPS, 3));
}

#[test]
fn recorded_residuals_give_the_very_peaks_of_the_runs_that_they_were_recorded_from() {
    let mut recording = ResidualRecording::new(&setup()).unwrap();
    for seed in [1, 2] {
        for (step, residuals) in record(seed).iter().enumerate() {
            recording.push((seed == 1).then_some(step as u64), residuals).unwrap();
        }
        recording.end_run();
    }
    assert_eq!(recording.finish(), simulate(2, STEPS, 1).modules[0]);
}

#[test]
fn missing_steps_are_a_gap_and_others_must_rise() {
    let rows = record(1);
    let mut all = ResidualRecording::new(&setup()).unwrap();
    let mut gappy = ResidualRecording::new(&setup()).unwrap();
    for (step, residuals) in rows.iter().enumerate() {
        let step = step as u64;
        let missing = (4000..4100).contains(&step);
        if missing {
            all.skip();
        } else {
            all.push(None, residuals).unwrap();
            gappy.push(Some(step), residuals).unwrap();
        }
    }
    let order = gappy.push(Some(4999), &rows[0]).unwrap_err();
    assert_eq!(order, StepOrder { step: 4999, last: 4999 });
    assert_eq!(all.finish(), gappy.finish());
}

/// As a diagnoser does it: what the gages read before a long gap, for instance before a new tare, is forgotten.
#[test]
fn after_a_long_gap_the_channels_are_learnt_anew() {
    let (before, after) = (record(1), record(2));
    let tared: Vec<Vec<f64>> =
        after.iter().map(|row| row.iter().map(|value| value + 1e-4).collect()).collect();
    let mut two_runs = ResidualRecording::new(&setup()).unwrap();
    let [mut numbered, mut skipped] = [two_runs.clone(), two_runs.clone()];
    for row in &before {
        for recording in [&mut two_runs, &mut numbered, &mut skipped] {
            recording.push(None, row).unwrap();
        }
    }
    two_runs.end_run();
    let gap = 1 + diagnosis::residual::longest_gap_of_structure(setup().step_s);
    (0..gap).for_each(|_| skipped.skip());
    for (place, row) in tared.iter().enumerate() {
        let step = before.len() as u64 + gap + place as u64;
        numbered.push(Some(step), row).unwrap();
        skipped.push(None, row).unwrap();
        two_runs.push(None, row).unwrap();
    }
    let largest = |recording: ResidualRecording| -> Vec<f64> {
        let peaks = recording.finish();
        peaks.channels.iter().map(|channel| channel.peaks.largest()).collect()
    };
    let expected = largest(two_runs);
    assert!(expected.iter().all(|peak| *peak > 0.0), "{expected:?}");
    assert_eq!((largest(numbered), largest(skipped)), (expected.clone(), expected));
}

#[test]
fn the_largest_peak_is_the_largest_divergence() {
    let mut rig = tower::rig(1, Vec::new());
    let mut largest = vec![0.0_f64; setup().thresholds.len()];
    for step in 0..STEPS {
        rig.step().unwrap();
        for (largest, evidence) in largest.iter_mut().zip(rig.diagnosers()[0].evidence()) {
            let watched = if step < 2600 { None } else { evidence.divergence };
            *largest = watched.map_or(*largest, |d| largest.max(d));
        }
    }
    for (largest, channel) in largest.iter().zip(&simulate(1, STEPS, 1).modules[0].channels) {
        assert!(channel.peaks.largest() >= *largest);
    }
}

#[test]
fn too_little_data_for_a_tail_is_an_error_that_names_the_channel_and_the_hours() {
    let error = simulate(1, STEPS, 1).tail_thresholds(1e-3, 0.01).unwrap_err();
    let TailError::TooFew { needed_hours, .. } = error else { panic!("{error}") };
    assert!(needed_hours > 0.05, "{needed_hours}");
    assert!(error.to_string().contains("`module1/") || error.to_string().contains("`module2/"));
}

#[test]
fn tail_thresholds_fall_with_the_tolerated_rate_and_lie_above_the_tail() {
    let calibration = simulate(10, 60_000, 2);
    let often = calibration.tail_thresholds(1e-3, 100.0).unwrap();
    let seldom = calibration.tail_thresholds(1e-3, 20.0).unwrap();
    assert_eq!([often[0].len(), often[1].len()], [12, 12]);
    for (often, seldom) in often.iter().flatten().zip(seldom.iter().flatten()) {
        assert!(often.level < often.threshold && often.threshold < seldom.threshold);
        assert!(often.tail.shape > -0.5 && often.tail.shape < 0.7, "{often:?}");
    }
}
