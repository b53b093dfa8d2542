//! Recordings of runs: the residuals of every channel at every step, with the truth beside them.
//!
//! A recording is a table (CSV) with a header row. Columns: `step`; `fault`, the path of the component
//! that is faulty at this step, or nothing; then one column for each component, named by its path, with
//! its residual (\[N\] for an actuator, \[m\] for a gage). Numbers are written so that they are read back
//! bit by bit.

use std::io::{self, Write};

use diagnosis::Diagnoser;
use vocabulary::{ComponentPath, Step};

use crate::campaign::Campaign;
use crate::case::CaseRun;
use crate::engine::{Plants, prepare};
use crate::error::StudyError;
use crate::rig::{Rig, RigEvent, TimedFault};

/// A change that a diagnoser reported during a recorded run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedChange {
    /// The channel.
    pub component: ComponentPath,
    /// The step at which its divergence rose to its threshold.
    pub step: Step,
}

/// Runs a case, of scenarios or of any other campaign whose plants are not commissioned, and writes its recording.
/// Returns what came of it, and every change that the diagnosers reported, in order.
///
/// # Errors
/// A plant or diagnosers that cannot be made, or what `out` fails with.
pub fn export<C: Campaign>(
    campaign: &C,
    number: u64,
    out: &mut impl Write,
) -> Result<(C::Row, Vec<RecordedChange>), StudyError> {
    let (case, rig) = prepare(campaign, number, &Plants::new())?;
    let mut recorder = Recorder::new(out);
    let mut watch = |rig: &Rig, occurrences: &[RigEvent]| {
        let is_present = |of: &&TimedFault, step: Step| {
            of.at <= step && of.until.is_none_or(|until| step < until)
        };
        let faulty =
            |step| case.faults.iter().find(|of| is_present(of, step)).map(|of| &of.component);
        recorder.take(rig, occurrences, faulty)
    };
    let row = campaign.judge(&case, &mut CaseRun::new(&case, rig, &mut watch))?;
    Ok((row, recorder.finish()?))
}

/// Writes a run step by step.
struct Recorder<'a, W: Write> {
    out: csv::Writer<&'a mut W>,
    begun: bool,
    changes: Vec<RecordedChange>,
}

impl<'a, W: Write> Recorder<'a, W> {
    fn new(out: &'a mut W) -> Self {
        Self { out: csv::Writer::from_writer(out), begun: false, changes: Vec::new() }
    }

    /// Writes the row of the rig's latest step.
    fn take<'f>(
        &mut self,
        rig: &Rig,
        occurrences: &[RigEvent],
        faulty: impl Fn(Step) -> Option<&'f ComponentPath>,
    ) -> Result<(), StudyError> {
        self.changes.extend(occurrences.iter().filter_map(change));
        if !self.begun {
            self.header(rig).map_err(io::Error::from)?;
            self.begun = true;
        }
        let Some(step) = rig.samples().first().map(|sample| sample.step) else { return Ok(()) };
        Ok(self.row(rig, step, faulty(step)).map_err(io::Error::from)?)
    }

    fn header(&mut self, rig: &Rig) -> csv::Result<()> {
        let paths = |diagnoser: &Diagnoser| {
            let path = |component| format!("{}/{component}", diagnoser.module());
            diagnoser.components().iter().map(path).collect::<Vec<_>>()
        };
        let names = ["step", "fault"].map(str::to_owned);
        self.out.write_record(names.into_iter().chain(rig.diagnosers().iter().flat_map(paths)))
    }

    fn row(&mut self, rig: &Rig, step: Step, faulty: Option<&ComponentPath>) -> csv::Result<()> {
        let begin = [step.to_string(), faulty.map(ToString::to_string).unwrap_or_default()];
        let evidence = rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.evidence());
        let residuals = evidence.map(|evidence| format!("{:e}", evidence.residual));
        self.out.write_record(begin.into_iter().chain(residuals))
    }

    fn finish(mut self) -> Result<Vec<RecordedChange>, StudyError> {
        self.out.flush()?;
        Ok(self.changes)
    }
}

fn change(occurrence: &RigEvent) -> Option<RecordedChange> {
    let RigEvent::Change { module, change } = occurrence else { return None };
    let component = ComponentPath { module: module.clone(), component: change.component.clone() };
    Some(RecordedChange { component, step: change.step })
}
