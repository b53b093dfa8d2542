//! Recordings of runs: the residuals of every channel at every step, with the truth beside them.
//!
//! A recording is a table (CSV) with a header row. Columns: `step`; `fault`, the path of the component
//! that is faulty at this step, or nothing; then one column for each component, named by its path, with
//! its residual (\[N\] for an actuator, \[m\] for a gage). Numbers are written so that they are read back
//! bit by bit.

use std::io::Write;

use truss::ids::{ComponentPath, Step};

use crate::campaign::Campaign;
use crate::error::StudyError;
use crate::record::{NominalRecord, ScenarioRecord};
use crate::rig::{Occurrence, Rig};

/// A change that a diagnoser told during a recorded run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordedChange {
    /// The channel.
    pub component: ComponentPath,
    /// The step at which its divergence rose to its threshold.
    pub step: Step,
}

/// A run that was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported<R> {
    /// What came of it.
    pub record: R,
    /// Every change that the diagnosers told, in order.
    pub changes: Vec<RecordedChange>,
}

/// Runs a scenario and writes its recording.
///
/// # Errors
/// A plant or diagnosers that cannot be made, or what `out` fails with.
pub fn export_scenario(
    campaign: &Campaign,
    number: u64,
    out: &mut impl Write,
) -> Result<Exported<ScenarioRecord>, StudyError> {
    let injection = campaign.scenario(number)?.injection;
    let mut recorder = Recorder::new(out);
    let record = campaign.follow_scenario(number, |rig, news| {
        let faulty = |step| (step >= injection.at).then_some(&injection.component);
        recorder.take(rig, news, faulty)
    })?;
    Ok(Exported { record, changes: recorder.finish()? })
}

/// Runs a nominal run and writes its recording.
///
/// # Errors
/// A plant or diagnosers that cannot be made, or what `out` fails with.
pub fn export_nominal(
    campaign: &Campaign,
    number: u64,
    out: &mut impl Write,
) -> Result<Exported<NominalRecord>, StudyError> {
    let mut recorder = Recorder::new(out);
    let record = campaign.follow_nominal(number, |rig, news| recorder.take(rig, news, |_| None))?;
    Ok(Exported { record, changes: recorder.finish()? })
}

/// Writes a run step by step.
struct Recorder<'a, W> {
    out: &'a mut W,
    begun: bool,
    changes: Vec<RecordedChange>,
}

impl<'a, W: Write> Recorder<'a, W> {
    fn new(out: &'a mut W) -> Self {
        Self { out, begun: false, changes: Vec::new() }
    }

    /// Writes the row of the rig's latest step.
    fn take<'f>(
        &mut self,
        rig: &Rig,
        news: &[Occurrence],
        faulty: impl Fn(Step) -> Option<&'f ComponentPath>,
    ) -> Result<(), StudyError> {
        self.changes.extend(news.iter().filter_map(change));
        if !self.begun {
            self.header(rig)?;
            self.begun = true;
        }
        let Some(step) = rig.samples().first().map(|sample| sample.step) else { return Ok(()) };
        write!(self.out, "{step},")?;
        if let Some(component) = faulty(step) {
            write!(self.out, "{component}")?;
        }
        for evidence in rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.evidence()) {
            write!(self.out, ",{:e}", evidence.residual)?;
        }
        Ok(writeln!(self.out)?)
    }

    fn header(&mut self, rig: &Rig) -> Result<(), StudyError> {
        write!(self.out, "step,fault")?;
        for diagnoser in rig.diagnosers() {
            for component in diagnoser.components() {
                write!(self.out, ",{}/{component}", diagnoser.module())?;
            }
        }
        Ok(writeln!(self.out)?)
    }

    fn finish(self) -> Result<Vec<RecordedChange>, StudyError> {
        self.out.flush()?;
        Ok(self.changes)
    }
}

fn change(occurrence: &Occurrence) -> Option<RecordedChange> {
    let Occurrence::Change { module, change } = occurrence else { return None };
    let component = ComponentPath { module: module.clone(), component: change.component.clone() };
    Some(RecordedChange { component, step: change.step })
}
