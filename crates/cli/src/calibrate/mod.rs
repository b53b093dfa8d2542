//! `trusswatch calibrate`: thresholds from data without a fault, simulated or recorded.

mod arguments;
mod columns;
mod data;
mod digits;
mod gamma;
mod recorded;
mod simulated;
mod table;

use std::io::{self, Write};
use std::path::Path;

use daemon::config::{Uncalibrated, load_uncalibrated};
use daemon::thresholds::Thresholds;

use crate::failure::Failure;
use crate::table::terminal_width;

pub(crate) use arguments::Arguments;

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let wanted = arguments.check()?;
    let modules: Vec<Uncalibrated> =
        arguments.modules.iter().map(|file| load(file)).collect::<Result<_, _>>()?;
    let data = match &arguments.simulation.plant {
        Some(plant) => simulated::simulate(plant, &arguments.simulation, &modules)?,
        None => recorded::read(&arguments.recorded, arguments.skip_bad, &modules)?,
    };
    let gammas = gamma::gammas(&data, wanted)?;
    let mut out = io::stdout().lock();
    for ((module, peaks), gammas) in modules.iter().zip(&data.calibration.modules).zip(&gammas) {
        let components = peaks.channels.iter().map(|channel| channel.component.clone());
        let thresholds = Thresholds {
            module: module.setup.module.clone(),
            provenance: data.provenance(wanted, peaks.watched_steps),
            detection: module.detection,
            thresholds: components.zip(gammas.iter().map(|gamma| gamma.threshold)).collect(),
        };
        write_file(&module.thresholds, &thresholds)?;
        writeln!(out, "{}\n", table::of_module(peaks, gammas).text(terminal_width()))?;
        writeln!(out, "{}: {} thresholds\n", module.thresholds.display(), gammas.len())?;
    }
    Ok(())
}

fn load(file: &Path) -> Result<Uncalibrated, Failure> {
    load_uncalibrated(file)
        .map_err(|errors| Failure::inputs(errors.to_string().lines().map(str::to_owned).collect()))
}

fn write_file(file: &Path, thresholds: &Thresholds) -> Result<(), Failure> {
    let text = toml::to_string(thresholds).map_err(|error| Failure::runtime(error.to_string()))?;
    std::fs::write(file, text)
        .map_err(|error| Failure::runtime(format!("cannot write {}: {error}", file.display())))
}
