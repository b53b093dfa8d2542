//! The campaign as one JSON object. It holds nothing that depends on the clock or on the number of
//! jobs: the same command gives the same bytes.

use serde::Serialize;
use study::summary::Summary;

use super::arguments::Arguments;
use super::preset;

/// Version of the object's shape.
const VERSION: u32 = 1;

/// What was asked for and what came of it.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    v: u32,
    preset: &'a str,
    seed: u64,
    mismatch: f64,
    /// Were all runs made that were asked for?
    complete: bool,
    #[serde(flatten)]
    summary: &'a Summary,
    #[serde(skip_serializing_if = "Option::is_none")]
    power: Option<&'a [study::PowerCurve]>,
}

impl<'a> Document<'a> {
    pub(super) fn new(
        arguments: &Arguments,
        complete: bool,
        summary: &'a Summary,
        power: Option<&'a [study::PowerCurve]>,
    ) -> Self {
        let (seed, mismatch) = (arguments.seed, arguments.mismatch);
        let preset = preset::name(arguments);
        Self { v: VERSION, preset, seed, mismatch, complete, summary, power }
    }

    /// The text, with a line end.
    pub(super) fn text(&self) -> Result<String, serde_json::Error> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }
}
