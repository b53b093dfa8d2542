//! The tally as tables.

use std::collections::BTreeMap;

use vocabulary::fault::FaultKind;

use super::tally::{IdentificationSummary, KindRow, Right, SituationRow, Sizing, UndecidedBySize};
use crate::report::{Table, interval, percent};

/// All of them.
pub(super) fn tables(tally: &IdentificationSummary) -> Vec<Table> {
    let Right { decided, right, right_95 } = tally.all;
    let note = format!(
        "Of {decided} faults decided within a second, from twice the limit of their kind on, {right} are right: {}",
        interval(right_95),
    );
    vec![
        confusion(
            "What faults were taken for, a second after they were named",
            &tally.within_a_second,
        )
        .with_note(note),
        confusion("The same at the end", &tally.in_the_end),
        situations(tally),
        sizes(tally),
        undecided(tally),
    ]
}

fn situations(tally: &IdentificationSummary) -> Table {
    let rows = tally.situations.iter().map(|(situation, row)| {
        let SituationRow { named, decided, right, decided_in_the_end, right_in_the_end } = row;
        let counts = [named, decided, right, decided_in_the_end, right_in_the_end];
        let situation = situation.as_str().replace('_', " ");
        [situation].into_iter().chain(counts.map(u64::to_string)).collect()
    });
    Table::new(
        "By what else happens",
        &["", "named", "decided in 1 s", "right", "decided at the end", "right"],
        rows.collect(),
    )
    .with_note("Faults from twice the limit of their kind on whose component was declared faulty.")
}

fn sizes(tally: &IdentificationSummary) -> Table {
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
    let rows = tally.sizes_within_a_second.iter().map(|sizing| row("1 s", sizing));
    let rows = rows.chain(tally.sizes_in_the_end.iter().map(|sizing| row("end", sizing)));
    Table::new(
        "Stated sizes of faults whose kind is right",
        &["", "after", "stated", "covered", "", "below", "above", "median error"],
        rows.collect(),
    )
    .with_note(
        "covered: the 95 % interval holds the true size; below, above: it lies below or above that. The\nmedian error is relative.",
    )
}

fn undecided(tally: &IdentificationSummary) -> Table {
    let row = |kind: FaultKind, range: &UndecidedBySize| {
        let sizes = format!("{} to {}", range.from, range.to);
        let counts = [range.named].into_iter().chain(range.undecided);
        let cells = [kind.words().to_owned(), sizes].into_iter();
        cells.chain(counts.map(|count| count.to_string())).collect()
    };
    let rows =
        tally.undecided.iter().flat_map(|(kind, ranges)| ranges.iter().map(|of| row(*kind, of)));
    Table::new(
        "Undecided faults, by size in limits of their kind",
        &["", "size", "named", "open after 0.2 s", "1 s", "10 s"],
        rows.collect(),
    )
}

/// A row for each true kind, a column for each stated kind.
fn confusion(title: &str, rows: &BTreeMap<FaultKind, KindRow>) -> Table {
    let taken: Vec<FaultKind> = FaultKind::ALL
        .into_iter()
        .filter(|kind| rows.values().any(|row| row.decided.contains_key(kind)))
        .collect();
    let mut heading = vec!["", "faults", "not named", "undecided"];
    heading.extend(taken.iter().map(|kind| kind.words()));
    let row = |(kind, row): (&FaultKind, &KindRow)| {
        let counts = [row.cases, row.not_named, row.undecided].map(|count| count.to_string());
        let taken =
            taken.iter().map(|kind| row.decided.get(kind).map_or_else(String::new, u64::to_string));
        [kind.words().to_owned()].into_iter().chain(counts).chain(taken).collect()
    };
    Table::new(title, &heading, rows.iter().map(row).collect())
}
