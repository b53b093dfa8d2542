//! The campaign as one JSON object. It holds nothing that depends on the clock or on the number of
//! jobs: the same command gives the same bytes.

use serde::Serialize;
use study::summary::Summary;
use study::{Campaign, Controller};

use crate::versioned;

/// What was asked for and what came of it.
#[derive(Debug, Serialize)]
pub(super) struct Document<'a> {
    preset: &'a str,
    seed: u64,
    mismatch: f64,
    controllers: &'a [Controller],
    /// Were all runs made that were asked for?
    complete: bool,
    #[serde(flatten)]
    summary: &'a Summary,
}

impl<'a> Document<'a> {
    pub(super) fn new(
        preset: &'a str,
        campaign: &'a Campaign,
        complete: bool,
        summary: &'a Summary,
    ) -> Self {
        let Campaign { seed, mismatch, controllers, .. } = campaign;
        Self { preset, seed: *seed, mismatch: *mismatch, controllers, complete, summary }
    }

    /// The text, with a line end.
    pub(super) fn text(&self) -> Result<String, serde_json::Error> {
        versioned::text(self)
    }
}
