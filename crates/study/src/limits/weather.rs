//! The curves of several kinds of weather.

use serde::Serialize;

use super::curve::{Detector, LimitCurve, SizedKind};

/// What was measured in one weather.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WeatherLimits {
    /// What it is called.
    pub weather: &'static str,
    /// A curve of each detector and kind of fault.
    pub limits: Vec<LimitCurve>,
}

/// The curves of a kind of fault, those of each detector side by side.
pub fn curves(
    weathers: &[WeatherLimits],
    kind: SizedKind,
) -> impl Iterator<Item = (&WeatherLimits, &LimitCurve)> {
    let of_detector = move |detector| {
        weathers.iter().flat_map(move |of| {
            let is_asked =
                move |curve: &&LimitCurve| (curve.detector, curve.kind) == (detector, kind);
            of.limits.iter().filter(is_asked).map(move |curve| (of, curve))
        })
    };
    Detector::ALL.into_iter().flat_map(of_detector)
}
