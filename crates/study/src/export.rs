//! Recordings of runs: the residuals of every channel at every step, with the true faults.
//!
//! A recording is a table (CSV) with a header row. Columns: `step`; `fault`, the path of the component that is faulty
//! at this step, or empty; then one column per component, `module1/actuator/a1/residual`, with its residual (\[N\] for
//! an actuator, \[m\] for a gage). On request, what was measured too, in the columns of other tables ([`Signal`]).
//! Numbers are written with full precision.

use std::io::{self, Write};

use diagnosis::Diagnoser;
use vocabulary::{Component, ComponentPath, Signal, Step};

use crate::campaign::Campaign;
use crate::case::CaseRun;
use crate::engine::{Plants, prepare};
use crate::error::StudyError;
use crate::group::RigEvent;
use crate::rig::{Rig, TimedFault};

/// A change that a diagnoser reported during a recorded run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedChange {
    /// The channel.
    pub component: ComponentPath,
    /// The step at which its divergence rose to its threshold.
    pub step: Step,
}

/// Runs a case of any campaign whose plants are not commissioned, and writes its recording, with the readings if so
/// wanted. Returns its result, and every change that the diagnosers reported, in order.
///
/// # Errors
/// A plant or diagnosers cannot be created, or writing to `out` failed.
pub fn export<C: Campaign>(
    campaign: &C,
    number: u64,
    readings: bool,
    out: &mut impl Write,
) -> Result<(C::Row, Vec<RecordedChange>), StudyError> {
    let (case, rig) = prepare(campaign, number, &Plants::new())?;
    let mut table = csv::Writer::from_writer(out);
    table.write_record(heading(&rig, readings)).map_err(io::Error::from)?;
    let mut watch = |rig: &Rig, _: &[RigEvent]| match rig.samples().first() {
        Some(sample) => {
            let record = record(rig, sample.step, readings, &case.faults);
            Ok(table.write_record(record).map_err(io::Error::from)?)
        }
        None => Ok(()),
    };
    let mut run = CaseRun::new(&case, rig, &mut watch);
    let row = campaign.judge(&case, &mut run)?;
    let changes = run.occurrences.iter().filter_map(RigEvent::change);
    let changes =
        changes.map(|(component, change)| RecordedChange { component, step: change.step });
    let changes = changes.collect();
    table.flush()?;
    Ok((row, changes))
}

fn heading(rig: &Rig, readings: bool) -> impl Iterator<Item = String> {
    let columns = move |diagnoser: &Diagnoser| {
        let path = |component: &Component| ComponentPath {
            module: diagnoser.module().clone(),
            component: component.clone(),
        };
        let signals = |component: &Component| match component {
            _ if !readings => vec![Signal::Residual],
            Component::Actuator(_) => {
                vec![Signal::Residual, Signal::Demand, Signal::PressureA, Signal::PressureB]
            }
            Component::Sensor(_) => vec![Signal::Residual, Signal::Elongation],
        };
        let of_component = |component: &Component| {
            let path = path(component);
            signals(component).into_iter().map(move |signal| signal.column(&path))
        };
        diagnoser.components().iter().flat_map(of_component).collect::<Vec<_>>()
    };
    let names = ["step", "fault"].map(str::to_owned);
    names.into_iter().chain(rig.diagnosers().iter().flat_map(columns))
}

/// The row of the rig's latest step.
fn record(rig: &Rig, step: Step, readings: bool, faults: &[TimedFault]) -> Vec<String> {
    let is_present = |of: &&TimedFault| of.at <= step && of.until.is_none_or(|until| step < until);
    let faulty = faults.iter().find(is_present).map(|of| of.component.to_string());
    let mut row = vec![step.to_string(), faulty.unwrap_or_default()];
    for (diagnoser, sample) in rig.diagnosers().iter().zip(rig.samples()) {
        let measured = (sample.demands_n.iter().zip(&sample.pressures_pa))
            .map(|(demand, [a, b])| vec![*demand, *a, *b])
            .chain(sample.elongations_m.iter().map(|elongation| vec![*elongation]));
        for (evidence, measured) in diagnoser.evidence().iter().zip(measured) {
            row.push(format!("{:e}", evidence.residual));
            row.extend(measured.iter().filter(|_| readings).map(|value| format!("{value:e}")));
        }
    }
    row
}
