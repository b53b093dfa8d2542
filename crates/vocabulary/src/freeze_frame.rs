//! What a diagnoser saw around the onset of a fault: two seconds before the transition that latched it, two after.
//!
//! The question travels as the parameters of a query, `freeze-frame?transition=17`. Without the parameter, every frame
//! that is kept is given, without its signals.

use crate::{ComponentPath, ModuleName, RunId, Step, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::{MAX_MESSAGE_BYTES, Message, encode};
use crate::question::{QuestionError, number};

/// Every step this close to the detection is in the message, however many there are \[s\].
const WHOLE_S: f64 = 0.1;
/// At most every so many-th step far from the detection is shown; if that is too much, what is near is thinned as well.
const MOST_THINNED: usize = 20;
/// So many steps fit in any case: seven numbers of at most 25 bytes each.
const ANYWAY_STEPS: usize = 5000;

/// A freeze frame: what was captured, and who captured it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FreezeFrame {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// The component that was latched.
    pub component: ComponentPath,
    /// What `sequence` counts in, as in [`crate::FaultTransition::incarnation`].
    pub incarnation: u64,
    /// When the frame was complete \[ns since 1970\].
    pub time_unix_ns: u64,
    /// What was captured.
    #[serde(flatten)]
    pub signals: FrozenSignals,
}

/// What was seen of a component from two seconds before the onset or the detection of its fault, whichever is earlier, to
/// two seconds after the latching, or to the end of the run. Of what lies further back than six seconds before its end
/// nothing is kept: of a fault that was latched long after its onset the beginning is missing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FrozenSignals {
    /// The number of the transition that latched the component.
    pub sequence: u64,
    /// The run that the steps are counted in.
    pub run: RunId,
    /// Length of a step \[s\].
    pub step_s: f64,
    /// Since when the residual has been changing.
    pub onset_step: Step,
    /// When the divergence reached its threshold, or the departure was found.
    pub detection_step: Step,
    /// As of which step the fault was latched.
    pub decided_step: Step,
    /// The threshold of its divergence.
    pub threshold: f64,
    /// The steps that the values belong to, in order; a step whose sample was missing is left out.
    pub steps: Vec<Step>,
    /// What was measured and computed of the component.
    pub traces: Vec<Trace>,
}

/// One signal of a freeze frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trace {
    /// `residual`, `divergence`; of a gage `reading`; of a cylinder `demand`, `force`, `pressure_a`, `pressure_b`.
    pub name: String,
    /// Its unit: `m`, `N`, `Pa`, or `1`.
    pub unit: String,
    /// One value for each of `steps`; `null` where it was missing, cannot be used or is undefined. Residuals are less what
    /// an operator had subtracted.
    pub values: Vec<Option<f64>>,
}

impl Message for FreezeFrame {
    const WHAT: &'static str = "freeze frame";
}

impl FreezeFrame {
    /// The same, no longer than a message may be. The values are verbatim. If all of them are more than a message holds, as
    /// they are at a few kilohertz, only every second step is in it, or every third, and so on; but every one within a
    /// tenth of a second of the detection, unless these alone are too many.
    #[must_use]
    pub fn fitting(self) -> Self {
        if fits(&self) {
            return self;
        }
        let whole = (WHOLE_S / self.signals.step_s).ceil();
        for every in 2..=MOST_THINNED {
            let detection = self.signals.detection_step;
            #[expect(clippy::cast_precision_loss, reason = "a distance of seconds")]
            let is_near = |step: Step| step.0.abs_diff(detection.0) as f64 <= whole;
            let thinned = thinned(&self, |place, step| place % every == 0 || is_near(step));
            if fits(&thinned) {
                return thinned;
            }
        }
        let every = self.signals.steps.len().div_ceil(ANYWAY_STEPS).max(1);
        thinned(&self, |place, _| place % every == 0)
    }
}

fn fits(frame: &FreezeFrame) -> bool {
    encode(frame).is_ok_and(|bytes| bytes.len() <= MAX_MESSAGE_BYTES)
}

fn thinned(frame: &FreezeFrame, is_kept: impl Fn(usize, Step) -> bool) -> FreezeFrame {
    let kept: Vec<bool> =
        frame.signals.steps.iter().enumerate().map(|(place, step)| is_kept(place, *step)).collect();
    let mut thinned = frame.clone();
    thinned.signals.steps = chosen(&frame.signals.steps, &kept);
    for trace in &mut thinned.signals.traces {
        trace.values = chosen(&trace.values, &kept);
    }
    thinned
}

fn chosen<T: Copy>(values: &[T], kept: &[bool]) -> Vec<T> {
    values.iter().zip(kept).filter(|(_, kept)| **kept).map(|(value, _)| *value).collect()
}

/// A question for a freeze frame, in the parameters of a query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FreezeFrameQuestion {
    /// The number of the transition; without it, which frames there are.
    pub transition: Option<u64>,
}

impl FreezeFrameQuestion {
    /// The parameters of the query.
    #[must_use]
    pub fn to_parameters(&self) -> String {
        self.transition.map_or_else(String::new, |number| format!("transition={number}"))
    }

    /// Reads the parameters of a query.
    ///
    /// # Errors
    /// A parameter repeated or not a number.
    pub fn from_parameters(text: &str) -> Result<Self, QuestionError> {
        Ok(Self { transition: number(text, "transition")? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_for_a_frame_is_written_and_read_back() {
        for transition in [None, Some(17)] {
            let question = FreezeFrameQuestion { transition };
            assert_eq!(
                FreezeFrameQuestion::from_parameters(&question.to_parameters()),
                Ok(question)
            );
        }
        assert!(FreezeFrameQuestion::from_parameters("transition=-1").is_err());
    }

    /// A frame of six seconds with so many traces, detected after two.
    fn message(step_s: f64, traces: usize) -> FreezeFrame {
        let steps = (6.0 / step_s).round();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "test code")]
        let steps = steps as u64;
        let detection = steps / 3;
        #[expect(clippy::cast_precision_loss, reason = "test code")]
        let values = (0..steps).map(|step| (step != 5).then_some(-(step as f64).sqrt() * 1e-9));
        let trace = Trace { name: "force".into(), unit: "N".into(), values: values.collect() };
        let signals = FrozenSignals {
            sequence: 3,
            run: RunId(u64::MAX),
            step_s,
            onset_step: Step(detection - 4),
            detection_step: Step(detection),
            decided_step: Step(detection + 6),
            threshold: 0.3,
            steps: (0..steps).map(Step).collect(),
            traces: vec![trace; traces],
        };
        let frame = FreezeFrame {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            component: "m1/actuator/a1".parse().unwrap(),
            incarnation: 0,
            time_unix_ns: 7,
            signals,
        };
        frame.fitting()
    }

    #[test]
    fn at_a_kilohertz_everything_is_in_the_message_verbatim() {
        for traces in [3, 6] {
            let message = message(1e-3, traces);
            assert_eq!(message.signals.steps.len(), 6000);
            let bytes = encode(&message).unwrap();
            assert!(bytes.len() <= MAX_MESSAGE_BYTES, "{}", bytes.len());
            assert_eq!(crate::decode::<FreezeFrame>(&bytes), Ok(message));
        }
    }

    #[test]
    fn a_longer_one_is_thinned_but_not_around_the_detection() {
        let message = message(1e-4, 6);
        assert!(fits(&message));
        let steps: Vec<u64> = message.signals.steps.iter().map(|step| step.0).collect();
        let near: Vec<u64> =
            steps.iter().copied().filter(|step| step.abs_diff(20_000) <= 1000).collect();
        assert_eq!(near, (19_000..=21_000).collect::<Vec<_>>());
        assert!(steps.len() > 4000, "{}", steps.len());
        assert!(message.signals.traces.iter().all(|trace| trace.values.len() == steps.len()));
        let far: Vec<u64> = steps.iter().copied().filter(|step| *step > 21_000).collect();
        let every = far[1] - far[0];
        assert!(far.windows(2).all(|two| two[1] - two[0] == every), "evenly");
    }

    #[test]
    fn what_is_too_much_even_around_the_detection_is_thinned_there_too() {
        let message = message(2e-5, 6);
        assert!(fits(&message) && message.signals.steps.len() > 1000);
    }
}
