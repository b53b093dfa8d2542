//! Recordings of runs: the residuals of every channel at every step, with the true faults.
//!
//! A recording is a table (CSV) with a header row. Columns: `step`; `fault`, the path of the component that is faulty
//! at this step, or empty; then one column per component, `module1/actuator/a1/residual`, with its residual (\[N\] for
//! an actuator, \[m\] for a gage). Numbers are written with full precision.

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

/// Runs a case of any campaign whose plants are not commissioned, and writes its recording. Returns its result, and
/// every change that the diagnosers reported, in order.
///
/// # Errors
/// A plant or diagnosers cannot be created, or writing to `out` failed.
pub fn export<C: Campaign>(
    campaign: &C,
    number: u64,
    out: &mut impl Write,
) -> Result<(C::Row, Vec<RecordedChange>), StudyError> {
    let (case, rig) = prepare(campaign, number, &Plants::new())?;
    let mut table = csv::Writer::from_writer(out);
    table.write_record(heading(&rig)).map_err(io::Error::from)?;
    let mut watch = |rig: &Rig, _: &[RigEvent]| match rig.samples().first() {
        Some(sample) => {
            let record = record(rig, sample.step, &case.faults);
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

fn heading(rig: &Rig) -> impl Iterator<Item = String> {
    let paths = |diagnoser: &Diagnoser| {
        let column = |component: &Component| {
            let (module, component) = (diagnoser.module().clone(), component.clone());
            Signal::Residual.column(&ComponentPath { module, component })
        };
        diagnoser.components().iter().map(column).collect::<Vec<_>>()
    };
    let names = ["step", "fault"].map(str::to_owned);
    names.into_iter().chain(rig.diagnosers().iter().flat_map(paths))
}

/// The row of the rig's latest step.
fn record(rig: &Rig, step: Step, faults: &[TimedFault]) -> impl Iterator<Item = String> {
    let is_present = |of: &&TimedFault| of.at <= step && of.until.is_none_or(|until| step < until);
    let faulty = faults.iter().find(is_present).map(|of| of.component.to_string());
    let begin = [step.to_string(), faulty.unwrap_or_default()];
    let evidence = rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.evidence());
    begin.into_iter().chain(evidence.map(|evidence| format!("{:e}", evidence.residual)))
}
