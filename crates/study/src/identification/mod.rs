//! Studies identification: whether the diagnosers state the right kind and size of a fault, and how soon.

mod draw;
mod row;
mod tables;
mod tally;

pub use draw::{IdentificationCases, IdentificationTask};
pub use row::{IdentificationRow, IdentificationStatement};
pub use tally::{
    IdentificationSummary, KindRow, Right, SIZES_IN_LIMITS, SituationRow, Sizing,
    UNDECIDED_AFTER_S, UndecidedBySize,
};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::figure::identification_figure;
use crate::report::{ReportFigure, Table};
use crate::system::{CommissionedPlant, System};
use vocabulary::fault::FaultKind;

/// Faults of commissioned plants that are to be identified.
#[derive(Debug, Clone)]
pub struct IdentificationCampaign {
    /// The system.
    pub system: System,
    /// Restrictions on the cases.
    pub of: IdentificationCases,
    /// The diagnosers do not know this kind.
    pub without: Option<FaultKind>,
    /// The number of commissioned plants.
    pub plants: u64,
    /// Faults per plant.
    pub cases: u64,
}

impl Campaign for IdentificationCampaign {
    type Kind = IdentificationTask;
    type Row = IdentificationRow;
    type Summary = IdentificationSummary;

    fn systems(&self) -> &[System] {
        std::slice::from_ref(&self.system)
    }

    fn cases(&self) -> u64 {
        self.plants * self.cases
    }

    fn plant_of(&self, case: u64) -> (usize, Option<u64>) {
        (0, Some(case / self.cases.max(1)))
    }

    fn draw(
        &self,
        number: u64,
        _: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<IdentificationTask>, StudyError> {
        self.of.draw(&self.system, number).ok_or(StudyError::NothingToBreak)
    }

    fn judge(
        &self,
        case: &CampaignCase<IdentificationTask>,
        run: &mut CaseRun,
    ) -> Result<IdentificationRow, StudyError> {
        IdentificationRow::of(case, run, self.system.parameters.step_s, self.without)
    }

    fn summarize(&self, rows: &Rows<IdentificationRow>) -> IdentificationSummary {
        IdentificationSummary::of(rows)
    }

    fn tables(
        &self,
        _: &Rows<IdentificationRow>,
        summary: &IdentificationSummary,
    ) -> (Vec<Table>, Vec<String>) {
        (tables::tables(summary), Vec::new())
    }

    fn figures(&self, summary: &IdentificationSummary) -> Result<Vec<ReportFigure>, StudyError> {
        let caption = "Faults whose kind is undecided".to_owned();
        Ok(vec![ReportFigure { name: "identified", caption, svg: identification_figure(summary) }])
    }
}
