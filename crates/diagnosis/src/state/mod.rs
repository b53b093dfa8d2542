//! Is it healthy now? The second answer, beside that to "what changed just now?".
//!
//! Means over windows of a second, and of a tenth of one, are compared with a reference that was learnt from the healthy
//! module.

mod commissioning;
mod detector;
mod detectors;
mod fault_set;
mod gaussian;
pub mod learned;
mod reconstruction;
mod reference;
mod snippet;
mod threshold;
mod track;
mod window;

pub use commissioning::{CommissioningError, LEAST_THRESHOLD, commission};
pub(crate) use detector::{Conclusion, Reaction};
pub(crate) use detectors::Detectors;
pub use gaussian::Gaussian;
pub use reconstruction::ReconstructionError;
pub(crate) use reconstruction::{CHANGE_RIDGE, LEVEL_RIDGE, Reconstruction, ReconstructionNoise};
pub use reference::{
    ForceRange, GageReference, MeansReference, REFERENCE_VERSION, Reference, ReferenceProblem,
    fingerprint, residual_settings,
};
pub use snippet::Snippet;
pub(crate) use track::{Departed, Shares, WindowFinding};
pub use vocabulary::{Condition, CylinderMeans, GageMeans, Obstacle, WindowLength, WindowMeans};
pub(crate) use window::{MeansCollector, MeasuredStep};
