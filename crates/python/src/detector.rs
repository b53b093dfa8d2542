//! The change detector alone.

use diagnosis::detector::{ChannelGroup, ChannelReading, GapRule, TableDetector, Tuning};
use diagnosis::divergence::{DivergenceSettings, Interval};
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays::{Count, PerChannel, matrix, rows, value_error};

/// The Kullback-Leibler change detector, as `trusswatch detect` runs it on a table.
///
/// For every step and channel it gives the divergence between the running Gaussian of the last vectors of `window`
/// samples and that of `lag` steps ago: about 0 as long as the statistics of the channel stay what they are, large when
/// they change. State is kept between blocks: blocks of any lengths give the same bits as one.
///
/// Parameters
/// ----------
/// prior_scatter : float, or one for each channel
///     Scatter to start from, above 0: about the square of the sensor's noise (standard deviation), in squared units of
///     the channel. Keeps a stuck or silent channel well defined.
/// channels : int, optional
///     Number of channels, if `prior_scatter` is one number; else 1.
/// window : int
///     Samples in a vector, 1 to 256.
/// lag : int
///     Steps between the two Gaussians that are compared, 1 to 4096.
/// interval : int or None
///     Vectors that a Gaussian rests on, 2 to 10000000; None for all since the start.
/// threshold : float, one for each channel, or None
///     Divergence from which on a step counts as a change; without it none does.
/// warm_up : int
///     Vectors that must have been taken before a step can count as a change.
/// quiet_steps : int
///     Steps below the threshold after which a change has ended, at least 1.
///
/// Raises
/// ------
/// ValueError
///     A setting is out of its range.
#[pyclass(module = "trusswatch")]
pub(crate) struct Detector {
    detector: TableDetector,
    /// Number of channels.
    #[pyo3(get)]
    channels: usize,
    /// Steps taken so far.
    #[pyo3(get)]
    steps: u64,
}

/// What a detector made of a block: arrays of the shape (steps, channels).
#[pyclass(module = "trusswatch", frozen, get_all)]
pub(crate) struct Readings {
    /// The divergence, float64; NaN while it is undefined: before there are enough vectors, or if the sample is missing.
    divergence: Py<PyArray2<f64>>,
    /// Has the divergence risen to the threshold, after the warm-up, and not become quiet since? bool.
    change: Py<PyArray2<bool>>,
    /// Is it an earlier change that leaves the interval, which looks like another one? bool.
    leaving: Py<PyArray2<bool>>,
    /// Channels whose Gaussian was lost and started anew: step of the block, channel, reason.
    restarts: Vec<(usize, usize, String)>,
}

impl Detector {
    pub(crate) fn of(group: ChannelGroup) -> PyResult<Self> {
        let channels = group.channels.len();
        let detector = TableDetector::new(&[group]).map_err(value_error)?;
        Ok(Self { detector, channels, steps: 0 })
    }
}

#[pymethods]
impl Detector {
    #[new]
    #[pyo3(signature = (
        prior_scatter, *, channels=None, window=Count(10), lag=Count(10), interval=Some(Count(2000)), threshold=None,
        warm_up=Count(0), quiet_steps=Count(1)
    ), text_signature = "(prior_scatter, *, channels=None, window=10, lag=10, interval=2000, threshold=None, warm_up=0, quiet_steps=1)")]
    #[expect(clippy::too_many_arguments, reason = "arguments by name")]
    fn new(
        prior_scatter: PerChannel,
        channels: Option<Count>,
        window: Count,
        lag: Count,
        interval: Option<Count>,
        threshold: Option<PerChannel>,
        warm_up: Count,
        quiet_steps: Count,
    ) -> PyResult<Self> {
        let channels = channels.map_or(prior_scatter.count().unwrap_or(1), Count::size);
        if channels == 0 || channels > LARGEST {
            return Err(value_error(format!("{channels} channels; use 1 to {LARGEST}")));
        }
        if quiet_steps.0 == 0 {
            return Err(value_error("quiet_steps is 0; use at least 1"));
        }
        let prior_scatters = prior_scatter.of(channels, "prior_scatter")?;
        let thresholds = match threshold {
            None => vec![f64::INFINITY; channels],
            Some(threshold) => threshold.of(channels, "threshold")?,
        };
        if let Some(wrong) = thresholds.iter().find(|one| one.is_nan() || **one <= 0.0) {
            return Err(value_error(format!("threshold is {wrong}; use a number above 0")));
        }
        let interval = interval
            .map_or(Interval::Growing, |vectors| Interval::Sliding { vectors: vectors.size() });
        let tunings = prior_scatters.into_iter().zip(thresholds);
        Self::of(ChannelGroup {
            settings: DivergenceSettings { window: window.size(), lag: lag.size(), interval },
            warm_up: warm_up.0,
            quiet_steps: quiet_steps.0,
            gaps: GapRule::OPEN,
            marks_leaving: true,
            channels: tunings
                .map(|(prior_scatter, threshold)| Tuning { prior_scatter, threshold })
                .collect(),
        })
    }

    /// Takes the next steps.
    ///
    /// Parameters
    /// ----------
    /// block : array, shape (steps, channels)
    ///     Samples in the units of the channels. NaN is a missing sample: no vector is formed across it.
    ///
    /// Returns
    /// -------
    /// Readings
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     The block has another shape; then nothing was taken.
    fn push(&mut self, block: &Bound<'_, PyAny>) -> PyResult<Readings> {
        let py = block.py();
        let block = rows(block, &[self.channels], "the block")?;
        let samples = block.as_slice()?;
        let mut divergence = Vec::with_capacity(samples.len());
        let mut change = Vec::with_capacity(samples.len());
        let mut leaving = Vec::with_capacity(samples.len());
        let mut restarts = Vec::new();
        for (step, row) in samples.chunks_exact(self.channels).enumerate() {
            let readings = self.detector.take(Some((self.steps, row)));
            self.steps += 1;
            for (channel, reading) in readings.iter().enumerate() {
                let ChannelReading { divergence: found, restarted, .. } = reading;
                divergence.push(found.unwrap_or(f64::NAN));
                change.push(reading.change);
                leaving.push(reading.leaving);
                restarts.extend(restarted.map(|why| (step, channel, why.to_string())));
            }
        }
        Ok(Readings {
            divergence: matrix(py, divergence, self.channels)?,
            change: matrix(py, change, self.channels)?,
            leaving: matrix(py, leaving, self.channels)?,
            restarts,
        })
    }
}

/// Most channels of a detector.
const LARGEST: usize = 100_000;
