//! What a campaign is: cases that are drawn, run, judged and summarised.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::case::{CampaignCase, CaseRun};
use crate::error::StudyError;
use crate::report::{ReportFigure, Table};
use crate::system::{CommissionedPlant, System};

/// What came of cases, by their number.
pub type Rows<R> = BTreeMap<u64, R>;

/// Rows of the same kind together, in their order.
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
    /// What a case is an example of.
    type Kind: fmt::Display;
    /// What came of a case: a line of the journal.
    type Row: Serialize + DeserializeOwned + Send;
    /// What came of all.
    type Summary: Serialize;

    /// The systems that its cases are of; at least one.
    fn systems(&self) -> &[System];

    /// How many cases it has.
    fn cases(&self) -> u64;

    /// Which system a case is of, by its place, and which of that system's plants if it is commissioned beforehand.
    /// Otherwise the case has a plant of its own.
    fn plant_of(&self, case: u64) -> (usize, Option<u64>);

    /// Draws a case. The plant is that of [`Self::plant_of`].
    ///
    /// # Errors
    /// Nothing in the structure can have the fault.
    fn draw(
        &self,
        number: u64,
        plant: Option<&CommissionedPlant>,
    ) -> Result<CampaignCase<Self::Kind>, StudyError>;

    /// Runs a case, to its end or as far as need be, and judges what comes of it.
    ///
    /// # Errors
    /// What the run fails with.
    fn judge(
        &self,
        case: &CampaignCase<Self::Kind>,
        run: &mut CaseRun,
    ) -> Result<Self::Row, StudyError>;

    /// Sums up rows, which may be those of a part of the cases.
    fn summarize(&self, rows: &Rows<Self::Row>) -> Self::Summary;

    /// The summary as tables, and as sentences that stand below them.
    fn tables(&self, rows: &Rows<Self::Row>, summary: &Self::Summary) -> (Vec<Table>, Vec<String>);

    /// The figures of a summary.
    ///
    /// # Errors
    /// A structure that has not what a figure shows.
    fn figures(&self, _: &Self::Summary) -> Result<Vec<ReportFigure>, StudyError> {
        Ok(Vec::new())
    }

    /// The healthy components that were named in a case although no campaign may ever name one: a defect of the
    /// diagnosis.
    fn defects(&self, _: &Self::Row) -> Vec<String> {
        Vec::new()
    }
}
