//! Campaigns: cases that are drawn, run, judged and summarised.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::report::{ReportFigure, Table};
use crate::system::{CommissionedPlant, System};

/// The results of cases, by number.
pub type Rows<R> = BTreeMap<u64, R>;

/// Groups rows of the same kind, keeping their order.
pub(crate) fn grouped<'a, R, K: Ord>(
    rows: impl IntoIterator<Item = &'a R>,
    kind: impl Fn(&R) -> K,
) -> BTreeMap<K, Vec<&'a R>> {
    let mut groups = BTreeMap::<_, Vec<_>>::new();
    for row in rows {
        groups.entry(kind(row)).or_default().push(row);
    }
    groups
}

/// A campaign. The [engine](crate::Engine) runs its cases.
pub trait Campaign: Sync {
    /// The kind of a case.
    type Kind: fmt::Display;
    /// The result of a case: a line of the journal.
    type Row: Serialize + DeserializeOwned + Send;
    /// The result of the campaign.
    type Summary: Serialize;

    /// The systems of its cases; at least one.
    fn systems(&self) -> &[System];

    /// The number of cases.
    fn cases(&self) -> u64;

    /// The system of a case, by its position, and the number of the commissioned plant. Without a number the case has
    /// its own plant.
    fn plant_of(&self, case: u64) -> (usize, Option<u64>);

    /// What has become of a plant since it was commissioned.
    fn alter(&self, _: &mut CommissionedPlant) {}

    /// Draws a case. The plant is that of [`Self::plant_of`].
    ///
    /// # Errors
    /// No component of the structure can have the fault.
    fn draw(
        &self,
        number: u64,
        plant: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<Self::Kind>, StudyError>;

    /// Runs a case, to its end or as long as necessary, and judges the result.
    ///
    /// # Errors
    /// The run failed.
    fn judge(
        &self,
        case: &CampaignCase<Self::Kind>,
        run: &mut CaseRun,
    ) -> Result<Self::Row, StudyError>;

    /// Summarises rows, which may be those of some of the cases.
    fn summarize(&self, rows: &Rows<Self::Row>) -> Self::Summary;

    /// The summary as tables, and sentences to be placed below them.
    fn tables(&self, rows: &Rows<Self::Row>, summary: &Self::Summary) -> (Vec<Table>, Vec<String>);

    /// The figures of a summary.
    ///
    /// # Errors
    /// The structure lacks a component that a figure shows.
    fn figures(&self, _: &Self::Summary) -> Result<Vec<ReportFigure>, StudyError> {
        Ok(Vec::new())
    }

    /// Healthy components that were named in a case although no campaign should ever name one: a defect of the
    /// diagnosis.
    fn defects(&self, _: &Self::Row) -> Vec<String> {
        Vec::new()
    }
}
