//! Runs with conditions other than a single permanent fault: hidden faults on commissioned plants, i.e. faults from the
//! start, after a gap, with slow growth, or behind another fault; and random histories of faults that appear, disappear
//! and overlap, with lost samples and restarts. In no case may a healthy component be named.

mod hidden;
mod histories;
mod row;
mod situation;
mod tally;

pub use hidden::HiddenFaults;
pub(crate) use row::standing;
pub use row::{ConditionRow, Faulty, Standing};
pub use situation::Situation;
pub use tally::{ConditionSummary, ConditionTally};

use crate::campaign::{Campaign, Rows};
use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::report::Table;
use crate::system::{CommissionedPlant, System};

/// Most missed faults listed one by one.
const SHOWN: usize = 10;

/// Cases in alternating situations.
#[derive(Debug, Clone)]
pub struct ConditionCampaign {
    /// The system.
    pub system: System,
    /// The situations. Histories have their own plants, other situations use commissioned ones.
    pub situations: Vec<Situation>,
    /// Restrictions on hidden faults.
    pub hidden: HiddenFaults,
    /// The number of commissioned plants.
    pub plants: u64,
    /// Cases per commissioned plant; for histories, all cases.
    pub cases: u64,
    /// Whether modules work without their peers, which are needed to recognise the effects of other modules' faults.
    pub alone: bool,
}

impl ConditionCampaign {
    /// The situation of a case, and how often it had its turn before.
    fn turn(&self, number: u64) -> (Situation, u64) {
        let count = self.situations.len() as u64;
        (self.situations[(number % count) as usize], number / count)
    }

    fn has_histories(&self) -> bool {
        self.situations.iter().any(|situation| situation.is_history())
    }
}

impl Campaign for ConditionCampaign {
    type Kind = Situation;
    type Row = ConditionRow;
    type Summary = ConditionSummary;

    fn systems(&self) -> &[System] {
        std::slice::from_ref(&self.system)
    }

    fn cases(&self) -> u64 {
        if self.has_histories() { self.cases } else { self.plants * self.cases }
    }

    fn plant_of(&self, case: u64) -> (usize, Option<u64>) {
        (0, (!self.has_histories()).then(|| case / self.cases.max(1)))
    }

    fn draw(
        &self,
        number: u64,
        plant: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<Situation>, StudyError> {
        let (situation, turn) = self.turn(number);
        let smallest = |gage: &_| plant.map_or(0.0, |plant| plant.smallest_bias_strain(gage));
        let case = match situation.is_history() {
            true => histories::draw(&self.system, number, situation),
            false => self.hidden.draw(&self.system, &smallest, (number, situation), turn),
        };
        case.ok_or(StudyError::NothingToBreak)
    }

    fn judge(
        &self,
        case: &CampaignCase<Situation>,
        run: &mut CaseRun,
    ) -> Result<ConditionRow, StudyError> {
        run.finish()?;
        Ok(ConditionRow::of(case, run))
    }

    fn summarize(&self, rows: &Rows<ConditionRow>) -> ConditionSummary {
        ConditionSummary::of(rows, self.system.parameters.step_s)
    }

    fn tables(
        &self,
        rows: &Rows<ConditionRow>,
        summary: &ConditionSummary,
    ) -> (Vec<Table>, Vec<String>) {
        let note = match self.alone {
            true => "Without peers a module takes what another's fault does to it for its own.",
            false => "",
        };
        // A component repaired in a history is normal.
        let passed = if self.has_histories() { Vec::new() } else { passed_for_normal(rows) };
        (vec![summary.table().with_note(note)], passed)
    }

    fn defects(&self, row: &ConditionRow) -> Vec<String> {
        if self.alone {
            return Vec::new();
        }
        row.healthy_named.iter().map(|named| named.component.to_string()).collect()
    }
}

fn passed_for_normal(rows: &Rows<ConditionRow>) -> Vec<String> {
    let faulty = rows.iter().flat_map(|(case, row)| row.faulty.iter().map(move |of| (case, of)));
    let passed = faulty.filter(|(_, faulty)| faulty.standing == Standing::Normal);
    let mut lines: Vec<String> = passed
        .map(|(case, of)| format!("Passed for normal: case {case}: {}, {}", of.component, of.fault))
        .collect();
    if let Some(more @ 1..) = lines.len().checked_sub(SHOWN) {
        lines.truncate(SHOWN);
        lines.push(format!("and {more} more"));
    }
    lines
}
