//! Smallest fault against time: repeats runs with faults of increasing size, for each detector.

mod curve;
mod outcome;
mod question;

use vocabulary::Step;

pub(crate) use curve::curves;
pub use curve::{LimitCurve, LimitPoint, LimitSummary, Reached, Within, smallest_within};
pub use outcome::LimitRow;
pub use question::{LimitDetector, LimitQuestion, SizedKind};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::figure::{limits_figure, power_figure};
use crate::report::{ReportFigure, Table};
use crate::system::{CommissionedPlant, System};
use outcome::{DetectionOutcome, Since};

/// Runs for each size of each kind of fault, detector and system.
#[derive(Debug, Clone)]
pub struct LimitCampaign {
    /// The systems.
    pub systems: Vec<System>,
    /// The number of commissioned plants per system.
    pub plants: u64,
    /// Runs of each size.
    pub runs: u64,
    /// The questions, each studied with so many runs; those of a curve are consecutive.
    pub questions: Vec<LimitQuestion>,
}

impl LimitCampaign {
    /// The minimum isolable fault for kinds measured in noise; otherwise limits of both detectors.
    #[must_use]
    pub fn new(systems: Vec<System>, plants: u64, runs: u64, isolation: bool) -> Self {
        let detectors: &[LimitDetector] = match isolation {
            true => &[LimitDetector::Isolation],
            false => &[LimitDetector::Change, LimitDetector::Reference],
        };
        let kinds = if isolation { SizedKind::IN_NOISE } else { SizedKind::ABSOLUTE };
        let mut questions = Vec::new();
        for system in 0..systems.len() {
            for (kind, detector) in
                kinds.iter().flat_map(|kind| detectors.iter().map(move |of| (*kind, *of)))
            {
                let question = |size| LimitQuestion { system, detector, kind, size };
                questions.extend(kind.sizes().into_iter().map(question));
            }
        }
        Self { systems, plants, runs, questions }
    }

    /// The question of a case, and the number of its run.
    fn question(&self, case: u64) -> (LimitQuestion, u64) {
        (self.questions[(case / self.runs) as usize], case % self.runs)
    }
}

impl Campaign for LimitCampaign {
    type Kind = LimitQuestion;
    type Row = LimitRow;
    type Summary = LimitSummary;

    fn systems(&self) -> &[System] {
        &self.systems
    }

    fn cases(&self) -> u64 {
        self.questions.len() as u64 * self.runs
    }

    fn plant_of(&self, case: u64) -> (usize, Option<u64>) {
        let (question, run) = self.question(case);
        let system = question.system;
        (system, question.plant(&self.systems[system], run, self.plants))
    }

    fn draw(
        &self,
        number: u64,
        _: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<LimitQuestion>, StudyError> {
        let (question, run) = self.question(number);
        let case = question.draw(&self.systems[question.system], number, run);
        case.ok_or(StudyError::NothingToBreak)
    }

    /// A change or a comparison is followed until the component is declared faulty, which is final.
    fn judge(
        &self,
        case: &CampaignCase<LimitQuestion>,
        run: &mut CaseRun,
    ) -> Result<LimitRow, StudyError> {
        let Some(fault) = case.faults.first() else { return Ok(LimitRow::default()) };
        if case.kind.detector == LimitDetector::Isolation {
            run.finish()?;
            return Ok(LimitRow::of_isolation(&run.diagnosed(), fault));
        }
        let (mut found, mut right) = (Since::default(), Since::default());
        for step in (0..).map(Step) {
            if !run.step()? {
                break;
            }
            let (outcome, is_final) =
                outcome::outcome(&run.rig, &fault.component, case.kind.detector);
            found.note(step, outcome >= DetectionOutcome::Found);
            right.note(step, outcome == DetectionOutcome::Right);
            if is_final {
                break;
            }
        }
        Ok(LimitRow { found: found.steps_from(fault.at), right: right.steps_from(fault.at) })
    }

    fn summarize(&self, rows: &Rows<LimitRow>) -> LimitSummary {
        let point = |(question, first): (&LimitQuestion, u64)| {
            let of_size = rows.range(first..first + self.runs).map(|(_, row)| *row);
            let step_s = self.systems[question.system].parameters.step_s;
            LimitPoint::of(question.size, &of_size.collect::<Vec<_>>(), step_s)
        };
        let mut firsts = (0..).step_by(self.runs as usize);
        let is_one = |a: &LimitQuestion, b: &LimitQuestion| {
            (a.system, a.detector, a.kind) == (b.system, b.detector, b.kind)
        };
        let curve = |questions: &[LimitQuestion]| {
            let points = questions.iter().zip(firsts.by_ref()).map(point).collect();
            LimitCurve::of(&self.systems[questions[0].system].name, &questions[0], points)
        };
        LimitSummary { curves: self.questions.chunk_by(is_one).map(curve).collect() }
    }

    fn tables(&self, _: &Rows<LimitRow>, summary: &LimitSummary) -> (Vec<Table>, Vec<String>) {
        (summary.tables(), Vec::new())
    }

    fn figures(&self, summary: &LimitSummary) -> Result<Vec<ReportFigure>, StudyError> {
        let is_isolation = self.questions.iter().any(|of| of.detector == LimitDetector::Isolation);
        let (name, caption, svg) = match is_isolation {
            true => ("power", "Minimum isolable fault", power_figure(&summary.curves)),
            false => ("limits", "Smallest fault against time", limits_figure(&summary.curves)),
        };
        Ok(vec![ReportFigure { name, caption: caption.to_owned(), svg }])
    }
}
