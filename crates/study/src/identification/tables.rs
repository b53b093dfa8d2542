//! The tally as tables.

use std::collections::BTreeMap;

use vocabulary::IdentifiedKind;

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
    let row = |when: &str, (kind, sizing): (&IdentifiedKind, &Sizing)| {
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
    let row = |kind: IdentifiedKind, range: &UndecidedBySize| {
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

/// A row for each true kind: how often it was right, and what else it was taken for.
fn confusion(title: &str, rows: &BTreeMap<IdentifiedKind, KindRow>) -> Table {
    let row = |(kind, row): (&IdentifiedKind, &KindRow)| {
        let right = row.decided.get(kind).copied().unwrap_or(0);
        let counts =
            [row.cases, row.not_named, row.undecided, right].map(|count| count.to_string());
        let others = row.decided.iter().filter(|(taken, _)| *taken != kind);
        let others: Vec<String> =
            others.map(|(taken, count)| format!("{count} {}", taken.words())).collect();
        let cells = [kind.words().to_owned()].into_iter().chain(counts);
        cells.chain([others.join(", ")]).collect()
    };
    Table::new(
        title,
        &["", "faults", "not named", "undecided", "right", "another kind"],
        rows.iter().map(row).collect(),
    )
}
