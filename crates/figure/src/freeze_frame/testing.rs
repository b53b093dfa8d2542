//! A made-up frame, for tests of those who draw it.

use vocabulary::{FreezeFrame, FrozenSignals, RunId, Step, Trace};

/// A gage's frame: 0.2 s with a jump in the middle, and a step that is missing.
#[must_use]
#[expect(clippy::unwrap_used, reason = "names that are right")]
pub fn frame() -> FreezeFrame {
    let steps: Vec<u64> = (1000..1200).filter(|step| *step != 1010).collect();
    let trace = |name: &str, unit: &str, [before, after]: [f64; 2]| Trace {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: steps
            .iter()
            .map(|step| Some(if *step < 1100 { before } else { after }))
            .map(|value| value.filter(|value| value.is_finite()))
            .collect(),
    };
    FreezeFrame {
        structure: "tower".parse().unwrap(),
        module: "m1".parse().unwrap(),
        component: "m1/sensor/g2".parse().unwrap(),
        incarnation: 0,
        time_unix_ns: 1_000_000_000,
        signals: FrozenSignals {
            sequence: 7,
            run: RunId(3),
            step_s: 1e-3,
            onset_step: Step(1100),
            detection_step: Step(1102),
            decided_step: Step(1150),
            threshold: 0.5,
            traces: vec![
                trace("reading", "m", [1e-6, 46e-6]),
                trace("residual", "m", [0.0, 45e-6]),
                trace("divergence", "1", [f64::NAN, 50.0]),
            ],
            steps: steps.iter().map(|step| Step(*step)).collect(),
        },
    }
}
