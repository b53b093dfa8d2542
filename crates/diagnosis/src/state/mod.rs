//! Is it healthy now? The second answer, beside that to "what changed just now?".
//!
//! Means over windows of a second are compared with a reference that was learnt from the healthy module.

mod commissioning;
mod condition;
mod detector;
mod fault_set;
mod gaussian;
mod reference;
mod track;
mod window;

pub use commissioning::{CommissioningError, Snippet, commission};
pub use condition::{Condition, Obstacle};
pub(crate) use detector::{Conclusion, Reaction, StateDetector};
pub use gaussian::Gaussian;
pub use reference::{
    ForceRange, GageReference, REFERENCE_VERSION, Reference, ReferenceProblem, residual_settings,
};
pub(crate) use track::{Departed, Finding};
pub use window::{CylinderMeans, GageMeans, WINDOW_S, WindowMeans};
pub(crate) use window::{Measured, Windows};
