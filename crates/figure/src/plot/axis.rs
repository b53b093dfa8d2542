//! Axes: map values to positions along them.

use super::ticks::{self, Tick};

/// Share of an automatic range left empty at either end.
const PADDING: f64 = 0.05;

/// The mapping of values to positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Logarithmic; values must be above 0, others are not drawn.
    Log,
}

impl Scale {
    /// The transformed value; NaN for a value without a position.
    fn transformed(self, value: f64) -> f64 {
        match self {
            Scale::Linear => value,
            Scale::Log if value > 0.0 => value.log10(),
            Scale::Log => f64::NAN,
        }
    }
}

/// An axis of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotAxis {
    /// The quantity, with its unit.
    pub label: String,
    /// The mapping of values to positions.
    pub scale: Scale,
    /// First and last value; taken from the data if `None`.
    pub range: Option<[f64; 2]>,
    /// Whether ticks have labels; of panels above one another only the lowest needs them.
    pub tick_labels: bool,
}

impl PlotAxis {
    /// A linear axis that fits its data.
    #[must_use]
    pub fn linear(label: impl Into<String>) -> Self {
        Self::new(label.into(), Scale::Linear)
    }

    /// A logarithmic axis that fits its data.
    #[must_use]
    pub fn log(label: impl Into<String>) -> Self {
        Self::new(label.into(), Scale::Log)
    }

    fn new(label: String, scale: Scale) -> Self {
        Self { label, scale, range: None, tick_labels: true }
    }

    /// The same axis over this range.
    #[must_use]
    pub fn over(self, range: [f64; 2]) -> Self {
        Self { range: Some(range), ..self }
    }

    /// The same axis without its label and tick labels, for a panel placed above another with the same axis.
    #[must_use]
    pub fn bare(self) -> Self {
        Self { label: String::new(), tick_labels: false, ..self }
    }

    /// The axis over its own range, or else over the range of the data.
    pub(super) fn fit(&self, values: impl Iterator<Item = f64>) -> Fitted {
        let scale = self.scale;
        let [low, high] = match self.range {
            Some(range) => range.map(|value| scale.transformed(value)),
            None => padded(values.map(|value| scale.transformed(value))),
        };
        Fitted { scale, low, high }
    }

    /// The ticks of the fitted axis, about `target` in number.
    pub(super) fn ticks(&self, fitted: &Fitted, target: f64) -> Vec<Tick> {
        let mut ticks = match self.scale {
            Scale::Linear => ticks::linear(fitted.low, fitted.high, target),
            Scale::Log => ticks::log(fitted.low, fitted.high, target),
        };
        if !self.tick_labels {
            ticks.iter_mut().for_each(|tick| tick.label.clear());
        }
        ticks
    }
}

/// An axis with a known range.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fitted {
    scale: Scale,
    /// The transformed ends.
    low: f64,
    high: f64,
}

impl Fitted {
    /// The relative position of a value: 0 at the axis's start, 1 at its end, beyond that outside; NaN for a value
    /// without a position.
    pub(super) fn place(&self, value: f64) -> f64 {
        (self.scale.transformed(value) - self.low) / (self.high - self.low)
    }
}

/// The range of the finite values, with some padding at either end.
fn padded(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite = values.filter(|value| value.is_finite());
    let all = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = finite.fold(all, |[low, high], x| [low.min(x), high.max(x)]);
    if low > high {
        return [0.0, 1.0];
    }
    let room = match PADDING * (high - low) {
        0.0 => 0.5,
        room => room,
    };
    [low - room, high + room]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_of_the_range_are_ends_of_the_axis() {
        let linear = PlotAxis::linear("x").over([2.0, 4.0]).fit(std::iter::empty());
        assert_eq!([2.0, 3.0, 4.0, 5.0].map(|x| linear.place(x)), [0.0, 0.5, 1.0, 1.5]);
        let log = PlotAxis::log("x").over([0.01, 100.0]).fit(std::iter::empty());
        assert_eq!([0.01, 1.0, 100.0].map(|x| log.place(x)), [0.0, 0.5, 1.0]);
        assert!(log.place(0.0).is_nan() && log.place(-1.0).is_nan());
    }

    #[test]
    fn a_range_from_data_holds_all_of_it_and_needs_none() {
        let fitted = PlotAxis::linear("x").fit([3.0, f64::NAN, -1.0].into_iter());
        assert!(fitted.place(-1.0) > 0.0 && fitted.place(3.0) < 1.0);
        let single = PlotAxis::log("x").fit([5.0].into_iter());
        assert!((single.place(5.0) - 0.5).abs() < 1e-12);
        assert_eq!(PlotAxis::linear("x").fit(std::iter::empty()).place(0.5), 0.5);
    }
}
