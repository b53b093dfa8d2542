//! What is known of a faulty component around the onset of its fault: everything that its identification needs.

use std::sync::Arc;

use vocabulary::{Component, RunId, Step};

use super::level::Prior;
use crate::residual::NominalHydraulics;
use crate::state::learned::DisplacedChannel;

/// A request to identify a fault; [`super::identify`] answers it.
#[derive(Debug, Clone, PartialEq)]
pub struct Excerpt {
    /// The run that steps are counted in.
    pub run: RunId,
    /// The number of the transition that declared the component faulty.
    pub sequence: u64,
    /// The component.
    pub component: Component,
    /// The latest step that counts.
    pub as_of: Step,
    pub(crate) step_s: f64,
    pub(crate) seen: FaultOnset,
    pub(crate) measured: MeasuredSeries,
}

/// What was seen of the onset.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) enum FaultOnset {
    /// A change: it rose from `onset` until it was noticed at `detection`.
    Change { onset: Step, detection: Step },
    /// Nothing: it was noticed at `detection`, and may have begun long before.
    Departure { detection: Step },
}

impl FaultOnset {
    pub(crate) fn detection(self) -> Step {
        match self {
            FaultOnset::Change { detection, .. } | FaultOnset::Departure { detection } => detection,
        }
    }
}

/// What was measured.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum MeasuredSeries {
    Gage(GageSeries),
    Cylinder(CylinderSeries),
    /// A channel of a learned module.
    Displaced(DisplacedChannel),
    /// No usable signal.
    Nothing,
}

/// A gage, step by step around the onset, and second by second before and after.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GageSeries {
    pub(crate) steps: Arc<[GageStep]>,
    /// Means over the second that ended with each step.
    pub(crate) seconds: Vec<GageStep>,
    /// How far off a healthy gage may be \[m\].
    pub(crate) level_m: Prior,
    /// The noise of its own \[m\], as configured.
    pub(crate) noise_m: f64,
}

/// A gage at a step that has a usable value.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct GageStep {
    pub(crate) step: Step,
    /// How much more it reads than the others and the forces say \[m\].
    pub(crate) off_m: f64,
    /// What it reads \[m\].
    pub(crate) reading_m: f64,
}

impl GageStep {
    /// `None` without a usable value.
    pub(crate) fn if_usable(self) -> Option<Self> {
        (self.off_m.is_finite() && self.reading_m.is_finite()).then_some(self)
    }
}

/// A cylinder, step by step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CylinderSeries {
    pub(crate) steps: Arc<[CylinderStep]>,
    pub(crate) hydraulics: NominalHydraulics,
    /// What a closed valve lets through at the full drop \[m³/s\].
    pub(crate) null_flow: Prior,
}

/// A cylinder at a step that has usable values.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct CylinderStep {
    pub(crate) step: Step,
    pub(crate) demand_n: f64,
    pub(crate) pressures_pa: [f64; 2],
}

impl CylinderStep {
    /// `None` without usable values.
    pub(crate) fn if_usable(self) -> Option<Self> {
        let values = [self.demand_n].into_iter().chain(self.pressures_pa);
        values.into_iter().all(f64::is_finite).then_some(self)
    }
}
