//! What was identified, for people and for machines.

use std::collections::BTreeMap;
use std::io::{self, Write};

use names::fault::FaultKind;
use serde::Serialize;
use study::identification::{
    IdentificationRecord, IdentificationSituation, IdentificationTally, KindRow, SituationRow,
    Sizing, UndecidedBySize,
};

use super::Arguments;
use crate::failure::Failure;
use crate::study::tables::{self, Titled, interval, percent};
use crate::table::{table, terminal_width};
use crate::versioned;

/// What was asked for and what came of it.
#[derive(Serialize)]
pub(super) struct Report<'a> {
    weather: &'static str,
    seed: u64,
    mismatch: f64,
    plants: u64,
    cases_per_plant: u64,
    complete: bool,
    #[serde(flatten)]
    tally: &'a IdentificationTally,
    faults: &'a [IdentificationRecord],
}

impl<'a> Report<'a> {
    pub(super) fn of(
        arguments: &Arguments,
        tally: &'a IdentificationTally,
        faults: &'a [IdentificationRecord],
        complete: bool,
    ) -> Self {
        Self {
            weather: arguments.weather.as_str(),
            seed: arguments.drawn.seed,
            mismatch: arguments.drawn.mismatch,
            plants: arguments.drawn.plants.get(),
            cases_per_plant: arguments.cases.get(),
            complete,
            tally,
            faults,
        }
    }

    /// Prints it on standard output.
    pub(super) fn print(&self, json: bool) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        if json {
            write!(out, "{}", versioned::text(self)?)?;
            return Ok(out.flush()?);
        }
        let IdentificationTally { decided, right, right_95, .. } = self.tally;
        writeln!(
            out,
            "Of {decided} faults decided within a second, from twice the limit of their kind on, {right} are right: {}",
            interval(*right_95),
        )?;
        for (title, rows) in [
            (
                "What faults were taken for, a second after they were named",
                &self.tally.within_a_second,
            ),
            ("The same at the end", &self.tally.in_the_end),
        ] {
            writeln!(out, "\n{title}\n{}", confusion(rows))?;
        }
        let tables = [self.situations(), self.sizes(), self.undecided()];
        tables::write(&tables, terminal_width(), &mut out)?;
        Ok(out.flush()?)
    }

    fn situations(&self) -> Titled {
        let row = |(situation, row): (&IdentificationSituation, &SituationRow)| {
            let SituationRow { named, decided, right, decided_in_the_end, right_in_the_end } = row;
            let mut cells = vec![situation.as_str().replace('_', " ")];
            let counts = [named, decided, right, decided_in_the_end, right_in_the_end];
            cells.extend(counts.map(u64::to_string));
            cells
        };
        Titled {
            title: "By what else happens",
            note:
                "Faults from twice the limit of their kind on whose component was declared faulty."
                    .to_owned(),
            heading: vec!["", "named", "decided in 1 s", "right", "decided at the end", "right"],
            rows: self.tally.situations.iter().map(row).collect(),
        }
    }

    fn sizes(&self) -> Titled {
        let row = |when: &str, (kind, sizing): (&FaultKind, &Sizing)| {
            vec![
                kind.words().to_owned(),
                when.to_owned(),
                sizing.stated.to_string(),
                sizing.covered.to_string(),
                interval(sizing.covered_95),
                sizing.below.to_string(),
                sizing.above.to_string(),
                percent(sizing.median_error),
            ]
        };
        let tally = self.tally;
        let rows = tally.sizes_within_a_second.iter().map(|sizing| row("1 s", sizing));
        let rows = rows.chain(tally.sizes_in_the_end.iter().map(|sizing| row("end", sizing)));
        Titled {
            title: "Stated sizes of faults whose kind is right",
            note: "covered: the 95 % interval holds the true size; below, above: it lies below or above that. The\nmedian error is relative.".to_owned(),
            heading: vec!["", "after", "stated", "covered", "", "below", "above", "median error"],
            rows: rows.collect(),
        }
    }

    fn undecided(&self) -> Titled {
        let row = |kind: FaultKind, range: &UndecidedBySize| {
            let mut cells = vec![
                kind.words().to_owned(),
                format!("{} to {}", range.from, range.to),
                range.named.to_string(),
            ];
            cells.extend(range.undecided.map(|count| count.to_string()));
            cells
        };
        let each = self.tally.undecided.iter();
        Titled {
            title: "Undecided faults, by size in limits of their kind",
            note: String::new(),
            heading: vec!["", "size", "named", "open after 0.2 s", "1 s", "10 s"],
            rows: each
                .flat_map(|(kind, rows)| rows.iter().map(|range| row(*kind, range)))
                .collect(),
        }
    }
}

/// One row for each true kind, one column for each that was taken for it.
fn confusion(rows: &BTreeMap<FaultKind, KindRow>) -> String {
    let taken: Vec<FaultKind> = FaultKind::ALL
        .into_iter()
        .filter(|kind| rows.values().any(|row| row.decided.contains_key(kind)))
        .collect();
    let mut heading = vec!["", "faults", "not named", "undecided"];
    heading.extend(taken.iter().map(|kind| kind.words()));
    let mut text = table(&heading);
    for (kind, row) in rows {
        let mut cells = vec![
            kind.words().to_owned(),
            row.cases.to_string(),
            row.not_named.to_string(),
            row.undecided.to_string(),
        ];
        let count = |kind| row.decided.get(kind).map_or_else(String::new, u64::to_string);
        cells.extend(taken.iter().map(count));
        text.add_row(cells);
    }
    text.align_right(1..heading.len());
    text.text(terminal_width()).to_string()
}
