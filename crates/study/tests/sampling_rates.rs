//! The same tower sampled five times as slowly and four times as fast: times stay what they are, in steps or not.

use crate::tower;
use diagnosis::IsolationSettings;
use study::NominalRuns;
use study::scenarios::{ScenarioCampaign, ScenarioRanges, ScenarioRow};

/// The tower's campaign at this sampling period, with thresholds made for it.
fn campaign(step_s: f64) -> ScenarioCampaign {
    let (structure, mut parameters, mut setups) = tower::parts();
    parameters.step_s = step_s;
    // A sampled force control needs a time constant of more than two steps: here eight of them.
    let slower = if step_s > 1e-3 { 0.25 } else { 1.0 };
    parameters.hydraulics.force_gain_m3_per_s_per_n *= slower;
    let steps = |shipped: u64| (1e-3 * shipped as f64 / step_s).ceil() as u64;
    for setup in &mut setups {
        setup.step_s = step_s;
        setup.hydraulics.as_mut().unwrap().force_gain_m3_per_s_n *= slower;
        let IsolationSettings { hold_steps, tie_steps, effect_steps, quiet_steps, .. } =
            &mut setup.isolation;
        for setting in [hold_steps, tie_steps, effect_steps, quiet_steps] {
            *setting = steps(*setting);
        }
    }
    let warm_up_s = setups[0].detection.warm_up_vectors as f64 * step_s + 0.5;
    let steps = ((warm_up_s + 3.0) / step_s) as u64;
    let runs = NominalRuns { first_seed: 5000, runs: 12, steps, mismatch: 0.1, jobs: 2 };
    let calibration = runs.calibrate(&structure, &parameters, &setups, &|| {}).unwrap();
    for (setup, module) in setups.iter_mut().zip(&calibration.modules) {
        assert_eq!(setup.module, module.module);
        setup.thresholds =
            module.channels.iter().map(|channel| 2.5 * channel.peaks.largest()).collect();
    }
    let onset = warm_up_s + 0.5;
    let ranges = ScenarioRanges {
        length_s: onset + 2.5,
        onset_s: [onset, onset + 0.5],
        ..ScenarioRanges::default()
    };
    let mut system = tower::system(0.1, 31);
    (system.parameters, system.setups) = (parameters, setups);
    tower::scenarios(system, ranges)
}

#[test]
fn a_tower_at_200_hz_and_one_at_4_khz_are_diagnosed() {
    for (step_s, count) in [(5e-3, 28), (0.25e-3, 14)] {
        let rows = tower::rows(&campaign(step_s), 0..count, 2);
        let records: Vec<ScenarioRow> = rows.into_values().collect();
        let inexact: Vec<_> = records.iter().filter(|record| !record.is_exact()).collect();
        assert!(inexact.len() * 20 <= records.len(), "{step_s} s: {inexact:#?}");
        let wrong = records.iter().flat_map(|record| record.wrong());
        assert_eq!(wrong.count(), 0, "{step_s} s: {inexact:#?}");
    }
}
