//! Stroke tests of the simulated plant.

use crate::{ComponentPath, Mention, Step};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// Let one cylinder push and pull while the demands of the others stand still.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Stroke {
    /// The actuator, with its module, or without if only one module has it.
    pub component: Mention,
    /// Largest change of its demand, both ways \[N\].
    #[serde(default = "force_n")]
    pub force_n: f64,
    /// How long it takes \[s\].
    #[serde(default = "duration_s")]
    pub duration_s: f64,
    /// It ends early once a gage of the tower reads more than this strain, either way \[–\].
    #[serde(default = "largest_strain")]
    pub largest_strain: f64,
}

impl Stroke {
    /// The force of a stroke that names none \[N\].
    pub const FORCE_N: f64 = 50e3;
    /// The duration of a stroke that names none \[s\].
    pub const DURATION_S: f64 = 12.0;
    /// The largest strain of a stroke that names none \[–\].
    pub const LARGEST_STRAIN: f64 = 2e-4;
}

fn force_n() -> f64 {
    Stroke::FORCE_N
}

fn duration_s() -> f64 {
    Stroke::DURATION_S
}

fn largest_strain() -> f64 {
    Stroke::LARGEST_STRAIN
}

/// The plant began the stroke.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StrokeBegun {
    /// The actuator.
    pub component: ComponentPath,
    /// The first step of the stroke.
    pub first_step: Step,
    /// The last step of the stroke, unless a strain ends it early.
    pub last_step: Step,
}

impl Message for Stroke {
    const WHAT: &'static str = "stroke";
}

impl Message for StrokeBegun {
    const WHAT: &'static str = "stroke's reply";
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode;

    #[test]
    fn what_is_left_out_has_its_usual_figure() {
        let stroke: Stroke = decode(br#"{"v":1,"component":"actuator/a3"}"#).unwrap();
        let figures = [stroke.force_n, stroke.duration_s, stroke.largest_strain];
        assert_eq!(figures, [50e3, 12.0, 2e-4]);
    }

    #[test]
    fn a_figure_that_is_no_number_is_refused() {
        for text in [
            r#"{"v":1,"component":"actuator/a3","force_n":null}"#,
            r#"{"v":1,"component":"actuator/a3","duration_s":"12 s"}"#,
            r#"{"v":1,"force_n":5e4}"#,
        ] {
            assert!(decode::<Stroke>(text.as_bytes()).is_err(), "{text}");
        }
    }
}
