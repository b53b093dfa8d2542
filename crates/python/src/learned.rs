//! Modules that are learnt from recordings alone.

use std::path::PathBuf;

use diagnosis::state::learned::{
    ChannelSummary, ChannelVerdict, HealthyRecording, LEARNED_HEADING, LearnedJudge, LearnedModule,
    LearningSettings,
};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Map, Value};
use settings::{ConfigErrors, SettingsFile};

use crate::arrays::{from_json, rows, value_error};

/// What sensors of a healthy structure read under which loads, learnt from recordings alone: the file that
/// `trusswatch learn` writes and `trusswatch detect --config` takes.
///
/// Parameters
/// ----------
/// file : str or path
///     Such a file.
///
/// Raises
/// ------
/// ValueError
///     The file cannot be read, or a value in it is out of range.
#[pyclass(module = "trusswatch", name = "LearnedModule", frozen)]
pub(crate) struct Learned {
    module: LearnedModule,
    report: Value,
}

#[pymethods]
impl Learned {
    #[new]
    fn new(file: PathBuf) -> PyResult<Self> {
        Self::of(&SettingsFile::read(&file).map_err(value_error)?)
    }

    /// The module of such a file's text.
    #[staticmethod]
    fn from_toml(text: String) -> PyResult<Self> {
        Self::of(&SettingsFile { file: "text".into(), text })
    }

    /// The text of the file, the same as the command line writes.
    fn to_toml(&self) -> PyResult<String> {
        let text = toml::to_string(&self.module).map_err(value_error)?;
        Ok(LEARNED_HEADING.to_owned() + &text)
    }

    /// Writes the file.
    fn save(&self, file: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(file, self.to_toml()?)?)
    }

    /// Names of the sensors, which follow from the inputs.
    #[getter]
    fn sensors(&self) -> Vec<&str> {
        self.names(0..self.module.sensors)
    }

    /// Names of the inputs: the loads as measured.
    #[getter]
    fn inputs(&self) -> Vec<&str> {
        self.names(self.module.sensors..self.module.channels.len())
    }

    /// Length of a window, of which medians are compared [s].
    #[getter]
    fn window_s(&self) -> f64 {
        self.module.window_s
    }

    /// What `trusswatch learn --json` says: recordings, hours, channels (range, share that the inputs explain, smallest
    /// displacement that is found) and intervals that were left out because they look faulty. Of a module from a file
    /// the last two are not known.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        from_json(py, &self.report)
    }

    /// Judges a stream of samples, block by block.
    ///
    /// Parameters
    /// ----------
    /// rate : float
    ///     Samples per second [Hz].
    fn judge(&self, rate: f64) -> PyResult<Judge> {
        let step_s = step_s(rate)?;
        self.module.check_step(step_s).map_err(value_error)?;
        let judge = LearnedJudge::new(self.module.clone(), step_s);
        let names = self.module.channels.iter().map(|channel| channel.name.clone()).collect();
        Ok(Judge { judge: Some(judge), names, window_s: self.module.window_s, steps: 0 })
    }

    /// Judges a whole recording.
    ///
    /// Parameters
    /// ----------
    /// recording : mapping of names to arrays of the shape (steps,), for example a DataFrame
    ///     At least the columns of the sensors and the inputs, in the units of the healthy recordings. NaN is missing.
    /// rate : float
    ///     Samples per second [Hz].
    ///
    /// Returns
    /// -------
    /// verdicts : list of dict
    ///     Those of `trusswatch detect --json`: component (None: all others), state (`faulty`, `no_signal`, `unknown`),
    ///     first_index, last_index, lasts, reason; of a faulty channel kind, decided, size, and the reading that it should
    ///     have had at its end, expected, expected_low, expected_high.
    /// summary : dict
    ///     For each channel its worst state, the index at which that began, and the share of windows in which it was normal.
    fn detect<'py>(
        &self,
        recording: &Bound<'py, PyAny>,
        rate: f64,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let py = recording.py();
        let mut judge = self.judge(rate)?;
        let channels = columns(recording, &judge.names, "the recording")?;
        let mut sample = vec![0.0; channels.len()];
        let mut found = Vec::new();
        for step in 0..channels.first().map_or(0, Vec::len) {
            sample.iter_mut().zip(&channels).for_each(|(value, channel)| *value = channel[step]);
            found.extend(judge.take(&sample)?);
        }
        let (last, summary) = judge.end()?;
        found.extend(last);
        Ok((from_json(py, &found)?, from_json(py, &summary)?))
    }
}

impl Learned {
    fn of(document: &SettingsFile) -> PyResult<Self> {
        let module: LearnedModule = document.parse().map_err(value_error)?;
        let wrong = |problem| value_error(ConfigErrors::one(&document.file, None, problem));
        module.check().map_err(wrong)?;
        let learnt = diagnosis::state::learned::Learnt {
            module: module.clone(),
            explained: Vec::new(),
            cleaned: Vec::new(),
        };
        Ok(Self { module, report: learnt.document() })
    }

    fn names(&self, places: std::ops::Range<usize>) -> Vec<&str> {
        self.module.channels[places].iter().map(|channel| channel.name.as_str()).collect()
    }
}

/// Judges samples by a learned module, block by block; made by `LearnedModule.judge`.
#[pyclass(module = "trusswatch")]
pub(crate) struct Judge {
    judge: Option<LearnedJudge>,
    names: Vec<String>,
    window_s: f64,
    /// Samples taken so far.
    #[pyo3(get)]
    steps: u64,
}

#[pymethods]
impl Judge {
    /// Names of the columns of a block: sensors, then inputs.
    #[getter]
    fn channels(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Takes the next samples.
    ///
    /// Parameters
    /// ----------
    /// block : array, shape (steps, channels)
    ///     Sensors, then inputs. NaN is missing.
    ///
    /// Returns
    /// -------
    /// list of dict
    ///     Verdicts that have ended, as `LearnedModule.detect` describes them. What lasts comes with `finish`.
    fn push<'py>(&mut self, block: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let py = block.py();
        let block = rows(block, &[self.names.len()], "the block")?;
        let mut found = Vec::new();
        for sample in block.as_slice()?.chunks_exact(self.names.len()) {
            found.extend(self.take(sample)?);
        }
        from_json(py, &found)
    }

    /// Ends the stream: verdicts that last until now, and the summary of each channel.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (verdicts, summary) = self.end()?;
        Ok((from_json(py, &verdicts)?, from_json(py, &summary)?))
    }
}

impl Judge {
    fn documents(&self, verdicts: &[ChannelVerdict]) -> Vec<Value> {
        verdicts.iter().map(|verdict| verdict.document(&self.names)).collect()
    }

    fn take(&mut self, sample: &[f64]) -> PyResult<Vec<Value>> {
        let judge = self.judge.as_mut().ok_or_else(ended)?;
        let found = judge.take(sample);
        self.steps += 1;
        Ok(if found.is_empty() { Vec::new() } else { self.documents(&found) })
    }

    fn end(&mut self) -> PyResult<(Vec<Value>, Map<String, Value>)> {
        let judge = self.judge.take().ok_or_else(ended)?;
        if judge.windows() == 0 {
            let (all, window_s) = (self.steps, self.window_s);
            return Err(value_error(format!(
                "nothing was judged: {all} rows are less than a window of {window_s} s"
            )));
        }
        let (verdicts, summaries) = judge.finish();
        let each = self.names.iter().zip(&summaries);
        let each = each.map(|(name, one): (_, &ChannelSummary)| (name.clone(), one.document()));
        Ok((self.documents(&verdicts), each.collect()))
    }
}

fn ended() -> PyErr {
    value_error("the judge has finished; make another one")
}

/// Learns from recordings of the healthy structure what its sensors read under which loads, as `trusswatch learn` does.
///
/// Parameters
/// ----------
/// recordings : mapping of names to recordings
///     Each recording is a mapping of columns to arrays of the shape (steps,), for example a DataFrame. At least three, of
///     different days, that cover the loads. NaN is missing.
/// sensors, inputs : list of str
///     Columns of the sensors, and of the loads from which they follow.
/// rate : float
///     Samples per second [Hz].
/// window_s : float
///     Seconds of which medians are compared; shorter than a tenth of the period of the fastest load that matters. At
///     least a row.
///
/// Returns
/// -------
/// LearnedModule
///
/// Raises
/// ------
/// ValueError
///     What cannot be learnt from, and what would help.
#[pyfunction]
#[pyo3(signature = (recordings, *, sensors, inputs, rate, window_s=1.0))]
pub(crate) fn learn(
    recordings: &Bound<'_, PyAny>,
    sensors: Vec<String>,
    inputs: Vec<String>,
    rate: f64,
    window_s: f64,
) -> PyResult<Learned> {
    let py = recordings.py();
    let step_s = step_s(rate)?;
    if !(window_s > 0.0 && window_s <= 3600.0) {
        return Err(value_error("window_s: expected a number above 0 of seconds, at most 3600"));
    }
    if sensors.is_empty() || inputs.is_empty() {
        return Err(value_error("name at least one of the sensors and one of the inputs"));
    }
    let names: Vec<String> = sensors.iter().chain(&inputs).cloned().collect();
    let by_name = PyDict::new(py);
    by_name.call_method1("update", (recordings,))?;
    let mut healthy = Vec::new();
    for (name, recording) in by_name.iter() {
        let name: String = name.str()?.extract()?;
        let channels = columns(&recording, &names, &name)?;
        healthy.push(HealthyRecording { name, step_s, channels });
    }
    if healthy.is_empty() {
        return Err(value_error("no recording; give at least three, of different days"));
    }
    let settings = LearningSettings { window_s, ..LearningSettings::default() };
    let learn = || diagnosis::state::learned::learn(&healthy, &names, sensors.len(), settings);
    let learnt = py.detach(learn).map_err(value_error)?;
    Ok(Learned { report: learnt.document(), module: learnt.module })
}

/// The time between two samples \[s\].
fn step_s(rate: f64) -> PyResult<f64> {
    if rate > 0.0 && rate <= 1e5 {
        return Ok(rate.recip());
    }
    Err(value_error("rate: expected a number above 0 of rows per second, at most 100000"))
}

/// Columns of a recording, all of one length.
fn columns(recording: &Bound<'_, PyAny>, names: &[String], what: &str) -> PyResult<Vec<Vec<f64>>> {
    let mut channels: Vec<Vec<f64>> = Vec::with_capacity(names.len());
    for name in names {
        let column = recording
            .get_item(name)
            .map_err(|_| value_error(format!("{what}: missing column `{name}`")))?;
        let column =
            rows(&column, &[], &format!("column `{name}` of {what}"))?.as_slice()?.to_vec();
        let (found, expected) = (column.len(), channels.first().map_or(column.len(), Vec::len));
        if found != expected {
            return Err(value_error(format!(
                "{what}: column `{name}` has {found} rows, the first one {expected}"
            )));
        }
        channels.push(column);
    }
    Ok(channels)
}
