//! The columns and rows of a module's table.

use std::collections::BTreeMap;
use std::sync::Arc;

use diagnosis::{Measurements, ModuleSetup};
use vocabulary::{Component, ComponentPath, CorrectedReadings, Divergences, RunId, Signal, Step};

use crate::collection::ModuleRecord;
use crate::player::corrected;
use crate::residuals::ResidualReplay;
use crate::shortfall::Shortfall;

/// A row; NaN marks a missing value.
pub struct TableRow {
    /// The step.
    pub step: u64,
    /// When its sample was published \[ns since 1970\].
    pub published_ns: u64,
    /// The values in the order of [`RunRows::names`].
    pub values: Vec<f64>,
}

/// The columns of a table.
struct TableColumns {
    step_s: Option<f64>,
    actuators: Vec<ComponentPath>,
    gages: Vec<ComponentPath>,
    /// What the gages measure.
    measured: Signal,
    /// The components of residuals and divergences.
    channels: Vec<ComponentPath>,
    /// What gages should read stands last.
    has_corrected: bool,
}

impl TableColumns {
    /// Columns named according to the setup; without one, numbered from 1 in the order of the samples.
    fn new(
        record: &ModuleRecord,
        sample: Option<&Measurements>,
        setup: Option<&ModuleSetup>,
        channels: Vec<Component>,
    ) -> Self {
        let (demands, elongations) =
            sample.map_or((0, 0), |first| (first.demands_n.len(), first.elongations_m.len()));
        let path =
            |component: Component| ComponentPath { module: record.module.clone(), component };
        let components = setup.map(ModuleSetup::components).unwrap_or_default();
        let (actuators, gages): (Vec<Component>, Vec<Component>) =
            components.into_iter().partition(|c| matches!(c, Component::Actuator(_)));
        let named = |components: Vec<Component>, count: usize, kind: &str| -> Vec<ComponentPath> {
            if components.len() == count {
                return components.into_iter().map(path).collect();
            }
            let numbered = (1..=count).map(|number| format!("{kind}/{number}").parse());
            // A number is a name.
            numbered.filter_map(Result::ok).map(path).collect()
        };
        Self {
            step_s: setup.map(|setup| setup.step_s),
            actuators: named(actuators, demands, "actuator"),
            gages: named(gages, elongations, "sensor"),
            measured: match setup {
                Some(setup) if setup.measures_readings() => Signal::Reading,
                _ => Signal::Elongation,
            },
            channels: channels.into_iter().map(path).collect(),
            has_corrected: false,
        }
    }

    /// The names of the values in a row.
    fn names(&self) -> Vec<String> {
        let mut names = vec!["time_s".to_owned()];
        names.extend(self.actuators.iter().map(|path| Signal::Demand.column(path)));
        for path in &self.actuators {
            names.extend([Signal::PressureA, Signal::PressureB].map(|signal| signal.column(path)));
        }
        names.extend(self.gages.iter().map(|path| self.measured.column(path)));
        for path in &self.channels {
            names.extend([Signal::Residual, Signal::Divergence].map(|signal| signal.column(path)));
        }
        for path in self.gages.iter().filter(|_| self.has_corrected) {
            names.extend(CORRECTED.map(|signal| signal.column(path)));
        }
        names
    }

    fn row(
        &self,
        sample: &Measurements,
        divergences: Option<&Divergences>,
        corrected: Option<&CorrectedReadings>,
    ) -> Vec<f64> {
        let time_s = self.step_s.map_or(f64::NAN, |step_s| sample.step.0 as f64 * step_s);
        let mut row = vec![time_s];
        let mut add = |values: &mut dyn Iterator<Item = f64>, count: usize| {
            // A sample with a different length must not shift the following columns.
            row.extend((0..count).map(|_| values.next().unwrap_or(f64::NAN)));
        };
        let actuators = self.actuators.len();
        add(&mut sample.demands_n.iter().copied(), actuators);
        add(&mut sample.pressures_pa.iter().flatten().copied(), 2 * actuators);
        add(&mut sample.elongations_m.iter().copied(), self.gages.len());
        let channels = divergences.map_or(&[][..], |message| &message.channels);
        for (place, path) in self.channels.iter().enumerate() {
            let is_its = |channel: &&vocabulary::Channel| channel.component == path.component;
            let usual = channels.get(place).filter(is_its);
            let channel = usual.or_else(|| channels.iter().find(is_its));
            let residual = channel.map_or(f64::NAN, |channel| channel.residual);
            let divergence = channel.and_then(|channel| channel.divergence).unwrap_or(f64::NAN);
            row.extend([residual, divergence]);
        }
        if self.has_corrected {
            let values = |gage: usize| {
                let all = corrected.map(|all| [&all.elongations_m, &all.low_m, &all.high_m]);
                let all = all.map(|all| all.map(|values| values.get(gage).copied().flatten()));
                all.unwrap_or_default().map(|value| value.unwrap_or(f64::NAN))
            };
            row.extend((0..self.gages.len()).flat_map(values));
        }
        row
    }
}

/// Where residuals and divergences come from.
enum DivergenceSource {
    /// They were published.
    Published(BTreeMap<Step, Divergences>),
    /// A diagnoser computes them at every step.
    Replayed(Box<ResidualReplay>),
}

/// The rows of one run of a module.
pub struct RunRows {
    record: Arc<ModuleRecord>,
    columns: TableColumns,
    indices: std::vec::IntoIter<usize>,
    evidence: DivergenceSource,
    corrected: BTreeMap<Step, CorrectedReadings>,
    run: RunId,
}

/// What a gage should read, and its interval.
const CORRECTED: [Signal; 3] = [Signal::Corrected, Signal::CorrectedLow, Signal::CorrectedHigh];

impl RunRows {
    /// The rows of a run with what was published.
    #[must_use]
    pub fn published(record: &Arc<ModuleRecord>, run: RunId, setup: Option<&ModuleSetup>) -> Self {
        let mut channels: Vec<Component> = Vec::new();
        let mut messages = BTreeMap::new();
        for message in record.divergences.iter().filter(|message| message.run == run) {
            for channel in &message.channels {
                if !channels.contains(&channel.component) {
                    channels.push(channel.component.clone());
                }
            }
            messages.insert(message.step, message.clone());
        }
        Self::new(record, run, setup, (channels, DivergenceSource::Published(messages)))
    }

    /// The rows of a run with residuals and divergences at every step, as a diagnoser of this setup computes them
    /// from the first recorded step of the run.
    ///
    /// # Errors
    /// A setup that no diagnoser can be made of.
    pub fn replayed(
        record: &Arc<ModuleRecord>,
        run: RunId,
        setup: &ModuleSetup,
    ) -> Result<Self, Shortfall> {
        let replay = ResidualReplay::new(record.structure.clone(), setup)?;
        let evidence = (setup.components(), DivergenceSource::Replayed(Box::new(replay)));
        Ok(Self::new(record, run, Some(setup), evidence))
    }

    fn new(
        record: &Arc<ModuleRecord>,
        run: RunId,
        setup: Option<&ModuleSetup>,
        (channels, evidence): (Vec<Component>, DivergenceSource),
    ) -> Self {
        let is_of_run = |index: &usize| record.samples.head(*index).is_some_and(|h| h.run == run);
        let indices: Vec<usize> = (0..record.samples.len()).filter(is_of_run).collect();
        let first = indices.first().and_then(|index| record.samples.get(*index));
        let columns = TableColumns::new(record, first.as_ref(), setup, channels);
        let (record, indices) = (Arc::clone(record), indices.into_iter());
        Self { record, columns, indices, evidence, corrected: BTreeMap::new(), run }
    }

    /// With what the gages should read, see [`corrected`].
    ///
    /// # Errors
    /// No process of the module can be replayed.
    pub fn with_corrected(mut self) -> Result<Self, Shortfall> {
        self.corrected = corrected(&self.record, self.run)?;
        self.columns.has_corrected = true;
        Ok(self)
    }

    /// The names of the values in a row.
    #[must_use]
    pub fn names(&self) -> Vec<String> {
        self.columns.names()
    }
}

impl Iterator for RunRows {
    type Item = TableRow;

    fn next(&mut self) -> Option<TableRow> {
        let index = self.indices.next()?;
        let sample = self.record.samples.get(index)?;
        let published_ns = self.record.samples.head(index).map_or(0, |head| head.time_unix_ns);
        let replayed;
        let divergences = match &mut self.evidence {
            DivergenceSource::Published(messages) => messages.get(&sample.step),
            DivergenceSource::Replayed(replay) => {
                replayed = replay.take(&sample);
                replayed.as_ref()
            }
        };
        let values = self.columns.row(&sample, divergences, self.corrected.get(&sample.step));
        Some(TableRow { step: sample.step.0, published_ns, values })
    }
}
