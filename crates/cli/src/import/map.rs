//! The map of an import: which column of which table is which signal, in which unit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use diagnosis::ModuleSetup;
use serde::Deserialize;
use settings::{ConfigErrors, SettingsFile};
use vocabulary::{Component, ModuleName, RunId, Signal, StructureName};

/// The content of the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct MapFile {
    structure: StructureName,
    module: ModuleName,
    /// A diagnoser's configuration, relative to this file; without one all columns are readings.
    #[serde(default)]
    config: Option<PathBuf>,
    /// Step of the recording \[s\]; by default the shortest of the tables'.
    #[serde(default)]
    step_s: Option<f64>,
    #[serde(default = "first_run")]
    run: RunId,
    /// When the recording began \[ns since 1970\]; by default as the first table's times tell.
    #[serde(default)]
    start_unix_ns: Option<u64>,
    /// Of each table, in the order of the command line; may be left out if nothing is to be said of any.
    #[serde(default)]
    tables: Vec<TableMap>,
    columns: Vec<ColumnMap>,
}

fn first_run() -> RunId {
    RunId(1)
}

/// What is to be said of a table.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct TableMap {
    /// Column of times or steps.
    pub(super) time: Option<String>,
    /// Rows per second, if no column tells.
    pub(super) rate_hz: Option<f64>,
    /// How much later than in the first table its first row was taken \[s\]; by default as the dates of both tell.
    pub(super) offset_s: Option<f64>,
    /// A column that all loggers measure; the clock offset is estimated from it.
    pub(super) common: Option<String>,
}

/// Where a signal is.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ColumnMap {
    /// The table, from 1.
    #[serde(default = "first_table")]
    pub(super) table: usize,
    pub(super) column: String,
    component: Component,
    /// What of the component; by default what a sensor measures.
    #[serde(default)]
    signal: Option<String>,
    /// Of what stands in the table; a reading keeps it.
    #[serde(default)]
    unit: Option<String>,
    #[serde(default = "one")]
    sign: f64,
    /// Taken off what stands in the table, before all else.
    #[serde(default)]
    offset: f64,
    #[serde(default = "one")]
    scale: f64,
}

fn first_table() -> usize {
    1
}

fn one() -> f64 {
    1.0
}

/// A checked map.
#[derive(Debug)]
pub(super) struct ImportMap {
    pub(super) structure: StructureName,
    pub(super) setup: ModuleSetup,
    pub(super) thresholds: String,
    pub(super) step_s: Option<f64>,
    pub(super) run: RunId,
    pub(super) start_unix_ns: Option<u64>,
    pub(super) tables: Vec<TableMap>,
    /// Of each value of a sample: demands, pressures, then elongations or readings.
    pub(super) sources: Vec<Source>,
    pub(super) actuators: usize,
}

/// Where a value comes from.
#[derive(Debug, Clone)]
pub(super) struct Source {
    /// The table, from 0.
    pub(super) table: usize,
    pub(super) column: String,
    offset: f64,
    factor: f64,
}

impl Source {
    pub(super) fn value(&self, cell: f64) -> f64 {
        self.factor * (cell - self.offset)
    }
}

impl ImportMap {
    /// Reads and checks a map for so many tables.
    pub(super) fn read(file: &Path, tables: usize) -> Result<Self, ConfigErrors> {
        let document = SettingsFile::read(file)?;
        let map: MapFile = document.parse()?;
        let wrong = |problem: String| ConfigErrors::one(file, None, problem);
        let (mut setup, thresholds) = match &map.config {
            Some(config) => {
                let config = daemon::config::load_diagnoser(&document.beside(config))?;
                (config.module_setup(), config.thresholds)
            }
            None => {
                let (structure, module) = (map.structure.clone(), map.module.clone());
                // The step is known when the tables are.
                (ModuleSetup::of_readings(structure, module, 1.0), String::new())
            }
        };
        if setup.module != map.module {
            let (module, own) = (&map.module, &setup.module);
            return Err(wrong(format!("`module` is `{module}`, that of `config` is `{own}`")));
        }
        if map.config.is_none() {
            let names = map.columns.iter().filter_map(|column| match &column.component {
                Component::Sensor(name) => Some(name.clone()),
                Component::Actuator(_) => None,
            });
            setup.readings = names.collect();
        }
        let mut known = map.tables;
        if known.len() > tables {
            let listed = known.len();
            return Err(wrong(format!("`tables` are {listed}, and {tables} were given")));
        }
        known.resize(tables, TableMap::default());
        let actuators = setup.components().iter().filter(|c| is_actuator(c)).count();
        let mut sources = Vec::new();
        for (component, signal) in wanted(&setup) {
            let mut found = map.columns.iter().filter(|column| {
                column.component == component && column.signal(&setup) == signal.suffix()
            });
            let what = format!("`{component}`, signal `{}`", signal.suffix());
            let column = found.next().ok_or_else(|| wrong(format!("no column is {what}")))?;
            if found.next().is_some() {
                return Err(wrong(format!("several columns are {what}; keep one")));
            }
            sources.push(column.source(&setup, signal, tables).map_err(wrong)?);
        }
        if sources.len() != map.columns.len() {
            let is_unknown = |column: &&ColumnMap| {
                let own = wanted(&setup);
                !own.iter()
                    .any(|(c, s)| *c == column.component && s.suffix() == column.signal(&setup))
            };
            let unknown = map.columns.iter().find(is_unknown).map_or("", |c| c.column.as_str());
            return Err(wrong(format!(
                "column `{unknown}`: module `{}` has no such component with such a signal; use {}",
                map.module,
                wanted(&setup)
                    .iter()
                    .map(|(c, s)| format!("{c} {}", s.suffix()))
                    .collect::<Vec<_>>()
                    .join(", ")
            )));
        }
        let positive = |step_s: f64| step_s.is_finite() && step_s > 0.0;
        if let Some(step_s) = map.step_s.filter(|step_s| !positive(*step_s)) {
            return Err(wrong(format!("`step_s` is {step_s}; use seconds above 0")));
        }
        let (structure, step_s, run) = (map.structure, map.step_s, map.run);
        let start_unix_ns = map.start_unix_ns;
        let tables = known;
        Ok(Self {
            structure,
            setup,
            thresholds,
            step_s,
            run,
            start_unix_ns,
            tables,
            sources,
            actuators,
        })
    }
}

fn is_actuator(component: &Component) -> bool {
    matches!(component, Component::Actuator(_))
}

/// The values of a sample of this module, in their order.
fn wanted(setup: &ModuleSetup) -> Vec<(Component, Signal)> {
    let (actuators, gages): (Vec<Component>, Vec<Component>) =
        setup.components().into_iter().partition(is_actuator);
    let demands = actuators.iter().map(|a| (a.clone(), Signal::Demand));
    let pressures = actuators
        .iter()
        .flat_map(|a| [Signal::PressureA, Signal::PressureB].map(|signal| (a.clone(), signal)));
    let measured = of_sensors(setup);
    demands.chain(pressures).chain(gages.iter().map(|g| (g.clone(), measured))).collect()
}

fn of_sensors(setup: &ModuleSetup) -> Signal {
    if setup.measures_readings() { Signal::Reading } else { Signal::Elongation }
}

impl ColumnMap {
    fn signal<'a>(&'a self, setup: &ModuleSetup) -> &'a str {
        self.signal.as_deref().unwrap_or_else(|| of_sensors(setup).suffix())
    }

    fn source(&self, setup: &ModuleSetup, signal: Signal, tables: usize) -> Result<Source, String> {
        let Self { table, column, sign, offset, scale, .. } = self;
        if !(1..=tables).contains(table) {
            return Err(format!("column `{column}`: `table` is {table}; use 1 to {tables}"));
        }
        if sign.abs() != 1.0 || !(scale.is_finite() && *scale != 0.0 && offset.is_finite()) {
            return Err(format!(
                "column `{column}`: use a `sign` of 1 or -1, finite figures and no `scale` of 0"
            ));
        }
        let unit = match (&self.unit, signal) {
            (None, _) | (Some(_), Signal::Reading) => 1.0,
            (Some(unit), _) => self.in_si(unit, setup, signal).ok_or_else(|| {
                let right = match signal {
                    Signal::Demand => "N, kN or MN",
                    Signal::Elongation => "m, mm, µm, or m/m and µm/m of strain",
                    _ => "Pa, kPa, MPa or bar",
                };
                format!("column `{column}`: `unit` is {unit}; use {right}")
            })?,
        };
        let (table, column) = (table - 1, column.clone());
        Ok(Source { table, column, offset: *offset, factor: sign * scale * unit })
    }

    /// So many of the signal's own unit are one of these.
    fn in_si(&self, unit: &str, setup: &ModuleSetup, signal: Signal) -> Option<f64> {
        let unit = unit.replace(['μ', 'u'], "µ");
        Some(match (signal, unit.as_str()) {
            (Signal::Demand, "N") | (Signal::Elongation, "m") => 1.0,
            (Signal::PressureA | Signal::PressureB, "Pa") => 1.0,
            (Signal::Demand, "kN") | (Signal::PressureA | Signal::PressureB, "kPa") => 1e3,
            (Signal::Demand, "MN") | (Signal::PressureA | Signal::PressureB, "MPa") => 1e6,
            (Signal::PressureA | Signal::PressureB, "bar") => 1e5,
            (Signal::Elongation, "mm") => 1e-3,
            (Signal::Elongation, "µm") => 1e-6,
            (Signal::Elongation, "m/m") => self.length_m(setup)?,
            (Signal::Elongation, "µm/m" | "µε") => 1e-6 * self.length_m(setup)?,
            _ => return None,
        })
    }

    /// Of the member that its gage is on.
    fn length_m(&self, setup: &ModuleSetup) -> Option<f64> {
        let module = setup.structure.module(&setup.module)?;
        let gage = module.gages.iter().find(|gage| gage.name.as_str() == self.component.name())?;
        Some(setup.structure.gage_length_m(gage))
    }
}

/// A map to start from: each column is a reading.
pub(super) fn proposal(tables: &[(String, Vec<String>)]) -> String {
    let mut text = String::from(
        "# Which column is which signal; made by `trusswatch import --propose`. A value is\n\
         # sign · scale · (cell - offset). With `config`, a diagnoser's configuration, `component` is one of its module\n\
         # and `signal` is demand_n, pressure_a_pa, pressure_b_pa or elongation_m; `unit` is then converted.\n\
         structure = \"structure\"\nmodule = \"module\"\n# config = \"module1.toml\"\n\
         # step_s = 0.01          # default: the shortest of the tables'\n",
    );
    for (name, _) in tables {
        let _ = write!(
            text,
            "\n[[tables]]                # {}\n# rate_hz = 100          # if no column of times tells it\n",
            name.replace(char::is_control, " ")
        );
        if tables.len() > 1 {
            text += "# offset_s = 0.0         # its first row was taken so much later than the first table's; default: by dates\n\
                     # common = \"NAME\"        # or: a column that all loggers measure, to estimate it from\n";
        }
    }
    let mut taken: Vec<String> = Vec::new();
    for (table, (_, columns)) in tables.iter().enumerate() {
        for column in columns {
            let (name, unit) = named(column, &taken);
            let quoted = toml::Value::from(column.as_str());
            let _ = write!(
                text,
                "\n[[columns]]\ntable = {}\ncolumn = {quoted}\ncomponent = \"sensor/{name}\"\n",
                table + 1
            );
            if let Some(unit) = unit {
                let _ = writeln!(text, "unit = {}", toml::Value::from(unit));
            }
            taken.push(name);
        }
    }
    text
}

/// A component's name made of a column's, and the unit in its brackets.
fn named(column: &str, taken: &[String]) -> (String, Option<String>) {
    let (bare, unit) = match column.rsplit_once(['[', '(']) {
        Some((bare, unit)) if !bare.trim().is_empty() => {
            (bare, unit.trim_end_matches([']', ')', ' ']))
        }
        _ => (column, ""),
    };
    let allowed = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let name: String = bare.trim().chars().map(allowed).take(50).collect();
    let name = if name.is_empty() || name.starts_with('-') { format!("c{name}") } else { name };
    let free = |name: &String| !taken.contains(name);
    let name = if free(&name) {
        name
    } else {
        (2..).map(|k| format!("{name}_{k}")).find(free).unwrap_or_default()
    };
    (name, Some(unit.to_owned()).filter(|unit| !unit.is_empty()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_s_name_becomes_a_component_s() {
        let name = |column: &str| named(column, &["F_1".to_owned()]);
        assert_eq!(name("Kraft Süd [kN]"), ("Kraft_S_d".to_owned(), Some("kN".to_owned())));
        assert_eq!(name("F 1 (N)"), ("F_1_2".to_owned(), Some("N".to_owned())));
        assert_eq!(name("-1"), ("c-1".to_owned(), None));
        assert_eq!(name("[V]"), ("_V_".to_owned(), None));
    }
}
