//! Minimum isolable fault: probability and delay of isolation against the fault's size.

use serde::{Deserialize, Serialize};

/// Power against one kind of fault.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PowerCurve {
    /// What is wrong, e.g. `bias`.
    pub title: String,
    /// Unit of the size, e.g. `µε`.
    pub unit: String,
    /// The sizes tried, ascending.
    pub points: Vec<PowerPoint>,
    /// The smallest size found in at least 95 % of the runs, if any size tried was.
    pub smallest_95: Option<f64>,
}

/// What became of the runs with a fault of one size.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PowerPoint {
    /// Size of the fault, above 0, in the unit of the curve.
    pub size: f64,
    /// Share of the runs in which the fault was found, 0 to 1.
    pub probability: f64,
    /// Lower end of the probability's confidence interval.
    pub low: f64,
    /// Upper end of the probability's confidence interval.
    pub high: f64,
    /// Median time from the fault to its detection \[ms\], over the runs in which it was found.
    pub median_delay_ms: Option<f64>,
}
