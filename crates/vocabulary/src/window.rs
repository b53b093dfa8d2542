//! Means of a module's measurements, over windows that begin and end at the same steps in every module.

use crate::Step;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How long a window is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WindowLength {
    /// A tenth of a second: tells soon what is far off, though the structure's sway is in its means.
    Short,
    /// A second.
    Long,
}

impl WindowLength {
    /// Both.
    pub const ALL: [WindowLength; 2] = [WindowLength::Short, WindowLength::Long];

    /// In seconds, as in the parameters of a query.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            WindowLength::Short => "0.1",
            WindowLength::Long => "1",
        }
    }

    /// How long \[s\].
    #[must_use]
    pub const fn seconds(self) -> f64 {
        match self {
            WindowLength::Short => 0.1,
            WindowLength::Long => 1.0,
        }
    }
}

/// A gage over a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GageMeans {
    /// Mean residual (eq. 14) \[m\].
    pub residual_m: f64,
    /// Variance of the reading's white noise \[m²\].
    pub scatter_m2: f64,
    /// Variance of the residual within the window \[m²\]: how much the structure swings.
    pub swing_m2: f64,
}

/// A cylinder over a window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CylinderMeans {
    /// Mean observed force (eq. 8) \[N\].
    pub force_n: f64,
    /// How fast it rises: the mean over the second half less that over the first, over half a window \[N/s\].
    pub rate_n_per_s: f64,
    /// Mean residual: what the nominal cylinder gives beyond the observed force \[N\].
    pub tracking_n: f64,
    /// Mean pressure of both chambers, weighted by their areas, (p_A A_A + p_B A_B)/(A_A + A_B) \[Pa\]: a measure of
    /// the oil in them.
    pub content_pa: f64,
}

/// A module over a window.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindowMeans {
    /// How long the window is.
    pub length: WindowLength,
    /// Its last step.
    pub until: Step,
    /// The gages, in the order of the description; `None` without enough values.
    pub gages: Vec<Option<GageMeans>>,
    /// The cylinders, likewise.
    pub cylinders: Vec<Option<CylinderMeans>>,
}
