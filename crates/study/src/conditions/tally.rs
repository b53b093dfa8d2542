//! Results of many cases, by situation.

use std::collections::BTreeMap;

use serde::Serialize;

use super::row::{ConditionRow, Standing};
use super::situation::Situation;
use crate::campaign::{Rows, grouped};
use crate::report::{Table, interval};
use crate::scenarios::FoundCount;
use crate::statistics::{Interval95, share_interval};

/// The results of a campaign.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConditionSummary {
    /// All cases.
    pub all: ConditionTally,
    /// By situation.
    pub situations: BTreeMap<Situation, ConditionTally>,
}

/// The results of some cases.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ConditionTally {
    /// The number of cases.
    pub cases: u64,
    /// Faulty components.
    pub faults: u64,
    /// Faulty components declared faulty at the end.
    pub named: u64,
    /// Interval of their share (Clopper and Pearson).
    pub named_95: Interval95,
    /// Faulty components that are the likeliest of several suspects at the end.
    pub likeliest: u64,
    /// Faulty components that are another one of several suspects at the end.
    pub in_a_group: u64,
    /// Faulty components whose state is unknown at the end.
    pub cannot_tell: u64,
    /// Faulty components considered healthy at the end.
    pub normal: u64,
    /// First faults of cases, and the number ever named.
    pub first_faults: FoundCount,
    /// Later faults of other components, likewise.
    pub later_faults: FoundCount,
    /// Cases with changes that could not be judged in the end.
    pub not_judged: u64,
    /// Cases in which a healthy component was named.
    pub healthy_named: u64,
    /// Interval of their share (Clopper and Pearson).
    pub healthy_named_95: Interval95,
    /// Hours of simulated time.
    pub hours: f64,
    /// Queries to peers per hour.
    pub questions_per_hour: f64,
}

impl ConditionSummary {
    pub(super) fn of(rows: &Rows<ConditionRow>, step_s: f64) -> Self {
        let situations = grouped(rows.values(), |row| row.situation);
        let tally = |(situation, rows): (&Situation, &Vec<&ConditionRow>)| {
            (*situation, ConditionTally::of(rows.iter().copied(), step_s))
        };
        Self {
            all: ConditionTally::of(rows.values(), step_s),
            situations: situations.iter().map(tally).collect(),
        }
    }

    pub(super) fn table(&self) -> Table {
        let situations = self.situations.iter();
        let situations = situations.map(|(situation, tally)| (situation.as_str(), tally));
        let rows = situations.chain([("all", &self.all)]).map(|(name, tally)| tally.row(name));
        Table::new(
            "Faults by what else happens, and how they stand at the end",
            &[
                "situation",
                "cases",
                "faults",
                "named",
                "95 %",
                "likeliest of a group",
                "in a group",
                "cannot tell",
                "normal",
                "first ever named",
                "later ever named",
                "not judged",
                "healthy named",
                "95 %",
                "hours",
                "questions per hour",
            ],
            rows.collect(),
        )
    }
}

impl ConditionTally {
    fn of<'a>(rows: impl Iterator<Item = &'a ConditionRow>, step_s: f64) -> Self {
        let (mut all, mut questions) = (Self::default(), 0);
        for row in rows {
            all.cases += 1;
            all.not_judged += u64::from(row.unconfirmed > 0);
            all.healthy_named += u64::from(!row.healthy_named.is_empty());
            all.hours += row.steps as f64 * step_s / 3600.0;
            questions += row.questions;
            for (place, faulty) in row.faulty.iter().enumerate() {
                all.faults += 1;
                *match faulty.standing {
                    Standing::Named => &mut all.named,
                    Standing::Likeliest => &mut all.likeliest,
                    Standing::InAGroup => &mut all.in_a_group,
                    Standing::CannotTell => &mut all.cannot_tell,
                    Standing::Normal => &mut all.normal,
                } += 1;
                let found = if place == 0 { &mut all.first_faults } else { &mut all.later_faults };
                found.count(faulty.named.is_some());
            }
        }
        all.named_95 = share_interval(all.named, all.faults);
        all.healthy_named_95 = share_interval(all.healthy_named, all.cases);
        all.questions_per_hour = if all.hours > 0.0 { questions as f64 / all.hours } else { 0.0 };
        all
    }

    fn row(&self, name: &str) -> Vec<String> {
        let found = |of: &FoundCount| match of.all {
            0 => "–".to_owned(),
            all => format!("{} of {all}", of.found),
        };
        vec![
            name.replace('_', " "),
            self.cases.to_string(),
            self.faults.to_string(),
            self.named.to_string(),
            if self.faults > 0 { interval(self.named_95) } else { "–".to_owned() },
            self.likeliest.to_string(),
            self.in_a_group.to_string(),
            self.cannot_tell.to_string(),
            self.normal.to_string(),
            found(&self.first_faults),
            found(&self.later_faults),
            self.not_judged.to_string(),
            self.healthy_named.to_string(),
            interval(self.healthy_named_95),
            format!("{:.2}", self.hours),
            format!("{:.0}", self.questions_per_hour),
        ]
    }
}
