//! A kind that a fault may be of.

use vocabulary::fault::FaultKind;

use super::mixture::Size;

/// A kind that a fault may be of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The kind.
    pub kind: FaultKind,
    /// How probable it is.
    pub probability: f64,
    /// How large it is if it is of this kind, where that means anything: a bias \[m\], a drift \[m/s\], a gain \[–\], the
    /// increment of a random walk \[m per step\], what a bad contact adds \[m\], a leak's coefficient \[m²\].
    pub size: Option<Size>,
}
