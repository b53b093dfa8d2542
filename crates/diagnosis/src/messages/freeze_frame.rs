//! From what was seen around the latching of a fault to the message.

use crate::FreezeFrame;
use vocabulary::{MAX_MESSAGE_BYTES, Step, Trace};

use super::Speaker;

/// Every step this close to the detection is in the message, however many there are \[s\].
const WHOLE_S: f64 = 0.1;
/// At most every so many-th step far from the detection is shown; if that is too much, what is near is thinned as well.
const MOST_THINNED: usize = 20;
/// So many steps fit in any case: seven numbers of at most 25 bytes each.
const ANYWAY_STEPS: usize = 5000;

impl Speaker {
    /// The message on what was seen around the latching of a fault. The values are verbatim. If all of them are more than
    /// a message holds, as they are at a few kilohertz, only every second step is in it, or every third, and so on; but
    /// every one within a tenth of a second of the detection, unless these alone are too many.
    #[must_use]
    pub fn freeze_frame(&self, frame: FreezeFrame, time_unix_ns: u64) -> vocabulary::FreezeFrame {
        let trace = |trace: crate::Trace| Trace {
            name: trace.name.to_owned(),
            unit: trace.unit.to_owned(),
            values: trace.values,
        };
        let message = vocabulary::FreezeFrame {
            structure: self.structure.clone(),
            module: self.module.clone(),
            component: self.path(&frame.component),
            sequence: frame.sequence,
            incarnation: self.incarnation,
            run: frame.run,
            step_s: frame.step_s,
            onset_step: frame.onset,
            detection_step: frame.detection,
            decided_step: frame.decided,
            threshold: frame.threshold,
            time_unix_ns,
            steps: frame.steps,
            traces: frame.traces.into_iter().map(trace).collect(),
        };
        fitting(message)
    }
}

/// The message, thinned until it is no longer than a message may be.
fn fitting(message: vocabulary::FreezeFrame) -> vocabulary::FreezeFrame {
    if fits(&message) {
        return message;
    }
    let whole = (WHOLE_S / message.step_s).ceil();
    for every in 2..=MOST_THINNED {
        let detection = message.detection_step;
        #[expect(clippy::cast_precision_loss, reason = "a distance of seconds")]
        let is_near = |step: Step| step.0.abs_diff(detection.0) as f64 <= whole;
        let thinned = thinned(&message, |place, step| place % every == 0 || is_near(step));
        if fits(&thinned) {
            return thinned;
        }
    }
    let every = message.steps.len().div_ceil(ANYWAY_STEPS).max(1);
    thinned(&message, |place, _| place % every == 0)
}

fn fits(message: &vocabulary::FreezeFrame) -> bool {
    vocabulary::encode(message).is_ok_and(|bytes| bytes.len() <= MAX_MESSAGE_BYTES)
}

fn thinned(
    message: &vocabulary::FreezeFrame,
    is_kept: impl Fn(usize, Step) -> bool,
) -> vocabulary::FreezeFrame {
    let kept: Vec<bool> =
        message.steps.iter().enumerate().map(|(place, step)| is_kept(place, *step)).collect();
    let mut thinned = message.clone();
    thinned.steps = chosen(&message.steps, &kept);
    for trace in &mut thinned.traces {
        trace.values = chosen(&trace.values, &kept);
    }
    thinned
}

fn chosen<T: Copy>(values: &[T], kept: &[bool]) -> Vec<T> {
    values.iter().zip(kept).filter(|(_, kept)| **kept).map(|(value, _)| *value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::RunId;

    /// A frame of six seconds with so many traces, detected after two.
    fn message(step_s: f64, traces: usize) -> vocabulary::FreezeFrame {
        let steps = (6.0 / step_s).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "test code")]
        let steps = steps as u64;
        let detection = steps / 3;
        #[expect(clippy::cast_precision_loss, reason = "test code")]
        let values = (0..steps).map(|step| (step != 5).then_some(-(step as f64).sqrt() * 1e-9));
        let trace = crate::Trace { name: "force", unit: "N", values: values.collect() };
        let frame = FreezeFrame {
            run: RunId(u64::MAX),
            component: "actuator/a1".parse().unwrap(),
            sequence: 3,
            onset: Step(detection - 4),
            detection: Step(detection),
            decided: Step(detection + 6),
            threshold: 0.3,
            step_s,
            steps: (0..steps).map(Step).collect(),
            traces: vec![trace; traces],
        };
        let speaker = Speaker::of("tower".parse().unwrap(), "m1".parse().unwrap());
        speaker.freeze_frame(frame, 7)
    }

    #[test]
    fn at_a_kilohertz_everything_is_in_the_message_verbatim() {
        for traces in [3, 6] {
            let message = message(1e-3, traces);
            assert_eq!(message.steps.len(), 6000);
            let bytes = vocabulary::encode(&message).unwrap();
            assert!(bytes.len() <= MAX_MESSAGE_BYTES, "{}", bytes.len());
            assert_eq!(vocabulary::decode::<vocabulary::FreezeFrame>(&bytes), Ok(message));
        }
    }

    #[test]
    fn a_longer_one_is_thinned_but_not_around_the_detection() {
        let message = message(1e-4, 6);
        assert!(fits(&message));
        let steps: Vec<u64> = message.steps.iter().map(|step| step.0).collect();
        let near: Vec<u64> =
            steps.iter().copied().filter(|step| step.abs_diff(20_000) <= 1000).collect();
        assert_eq!(near, (19_000..=21_000).collect::<Vec<_>>());
        assert!(steps.len() > 4000, "{}", steps.len());
        assert!(message.traces.iter().all(|trace| trace.values.len() == steps.len()));
        let far: Vec<u64> = steps.iter().copied().filter(|step| *step > 21_000).collect();
        let every = far[1] - far[0];
        assert!(far.windows(2).all(|two| two[1] - two[0] == every), "evenly");
    }

    #[test]
    fn what_is_too_much_even_around_the_detection_is_thinned_there_too() {
        let message = message(2e-5, 6);
        assert!(fits(&message) && message.steps.len() > 1000);
    }
}
