//! The columns of a module's table, and the table as CSV.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use ::replay::ModuleRecord;
use diagnosis::ModuleSetup;
use vocabulary::Component;

/// A row; NaN marks a missing value.
pub(super) struct TableRow {
    /// The step.
    pub(super) step: u64,
    /// When its sample was published \[ns since 1970\].
    pub(super) published_ns: u64,
    /// The values in the order of [`TableColumns::values`].
    pub(super) values: Vec<f64>,
}

/// The columns of a table.
pub(super) struct TableColumns {
    step_s: Option<f64>,
    actuators: Vec<String>,
    gages: Vec<String>,
    /// The components of residuals and divergences.
    channels: Vec<Component>,
}

impl TableColumns {
    /// Columns named according to the configuration; without it, numbered from 1 in the order of the samples.
    pub(super) fn new(
        record: &ModuleRecord,
        sample: Option<usize>,
        setup: Option<&ModuleSetup>,
    ) -> Self {
        let first = sample.and_then(|index| record.samples.get(index));
        let (demands, elongations) =
            first.map_or((0, 0), |first| (first.demands_n.len(), first.elongations_m.len()));
        let components = setup.map(ModuleSetup::components).unwrap_or_default();
        let (actuators, gages): (Vec<&Component>, Vec<&Component>) =
            components.iter().partition(|c| matches!(c, Component::Actuator(_)));
        let named = |components: Vec<&Component>, count: usize, kind: &str| -> Vec<String> {
            if components.len() == count {
                components.into_iter().map(column).collect()
            } else {
                (1..=count).map(|number| format!("{kind}_{number}")).collect()
            }
        };
        let mut channels: Vec<Component> = Vec::new();
        for channel in record.divergences.iter().flat_map(|message| &message.channels) {
            if !channels.contains(&channel.component) {
                channels.push(channel.component.clone());
            }
        }
        Self {
            step_s: setup.map(|setup| setup.step_s),
            actuators: named(actuators, demands, "actuator"),
            gages: named(gages, elongations, "sensor"),
            channels,
        }
    }

    /// The names of the values in a row.
    pub(super) fn values(&self) -> Vec<String> {
        let mut heading = vec!["time_s".to_owned()];
        heading.extend(self.actuators.iter().map(|name| format!("{name}_demand_n")));
        for name in &self.actuators {
            heading.extend(["a", "b"].map(|chamber| format!("{name}_pressure_{chamber}_pa")));
        }
        heading.extend(self.gages.iter().map(|name| format!("{name}_elongation_m")));
        for channel in self.channels.iter().map(column) {
            heading.extend([format!("{channel}_residual"), format!("{channel}_divergence")]);
        }
        heading
    }

    pub(super) fn row(
        &self,
        record: &ModuleRecord,
        index: usize,
        divergences: Option<&vocabulary::Divergences>,
    ) -> Option<TableRow> {
        let sample = record.samples.get(index)?;
        let published_ns = record.samples.head(index).map_or(0, |head| head.time_unix_ns);
        let step = sample.step.0;
        let mut row = vec![self.step_s.map_or(f64::NAN, |step_s| step as f64 * step_s)];
        let mut add = |values: &mut dyn Iterator<Item = f64>, count: usize| {
            // A sample with a different length must not shift the following columns.
            row.extend((0..count).map(|_| values.next().unwrap_or(f64::NAN)));
        };
        let actuators = self.actuators.len();
        add(&mut sample.demands_n.iter().copied(), actuators);
        add(&mut sample.pressures_pa.iter().flatten().copied(), 2 * actuators);
        add(&mut sample.elongations_m.iter().copied(), self.gages.len());
        for component in &self.channels {
            let channels = divergences.map_or(&[][..], |message| &message.channels);
            let channel = channels.iter().find(|channel| channel.component == *component);
            let residual = channel.map_or(f64::NAN, |channel| channel.residual);
            let divergence = channel.and_then(|channel| channel.divergence).unwrap_or(f64::NAN);
            row.extend([residual, divergence]);
        }
        Some(TableRow { step, published_ns, values: row })
    }
}

/// The component's name in the form of an identifier.
fn column(component: &Component) -> String {
    component.to_string().replace(['/', '-', '.'], "_")
}

/// Writes a table: step, time and time of publication \[s\], then the other values by name.
pub(super) fn write_csv(
    file: &Path,
    names: &[String],
    rows: impl Iterator<Item = TableRow>,
) -> io::Result<()> {
    let mut out = csv::Writer::from_writer(BufWriter::new(File::create(file)?));
    let (time, values) = names.split_at(1);
    let first = ["step".to_owned(), time.concat(), "published_s".to_owned()];
    out.write_record(first.iter().chain(values))?;
    for TableRow { step, published_ns, values } in rows {
        let (time, values) = values.split_at(1);
        out.write_field(step.to_string())?;
        out.write_field(time.iter().copied().map(number).collect::<String>())?;
        let (whole, rest) = (published_ns / 1_000_000_000, published_ns % 1_000_000_000);
        out.write_field(format!("{whole}.{rest:09}"))?;
        for value in values {
            out.write_field(number(*value))?;
        }
        out.write_record(None::<&[u8]>)?;
    }
    out.flush()
}

/// The shortest text that parses to the same bits; empty if the value is not finite.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}
