//! What was measured of a fault, and what its likeliest hypothesis makes of it: for people to see how well that fits.

use names::Step;

/// A step of a signature. The unit is that of the component's series: of a gage, how much it reads too much \[m\]; of a
/// cylinder, how much oil its chambers lack against their balance \[m³\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SignaturePoint {
    /// The step.
    pub step: Step,
    /// What was measured, in the unit of the series.
    pub measured: f64,
    /// What the most probable kind says that should have been measured, in the unit of the series.
    pub fitted: f64,
}
