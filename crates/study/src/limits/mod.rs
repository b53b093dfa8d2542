//! Smallest fault against time, for each of the two detectors: the change detector, which sees faults that jump, and
//! the comparison with a reference, which also sees those that have always been there.

mod curve;
mod draw;
mod measure;
mod run;
mod weather;

pub use curve::{Detector, LimitCurve, LimitPoint, Reached, SizedKind, Within, smallest_within};
pub use measure::LimitStudy;
pub use weather::{WeatherLimits, curves};
