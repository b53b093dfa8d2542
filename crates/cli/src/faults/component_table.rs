//! The components that are other than normal, as a table.

use comfy_table::{CellAlignment, Table};
use wire::FaultTransition;

use crate::paint::Colour;
use crate::table::table;
use crate::telling::{NOTHING, or_nothing, ratio, reason, residual, state_colour, utc};

const HEADING: [&str; 8] =
    ["component", "state", "onset", "decided", "told", "residual", "divergence", "why"];

/// The table, and the colour of each row.
pub(super) fn components(components: &[&FaultTransition]) -> (Table, Vec<Option<Colour>>) {
    let mut table = table(&HEADING);
    for transition in components {
        table.add_row(row(transition));
    }
    for column in [2, 3, 5, 6] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    (table, components.iter().map(|component| Some(state_colour(component.state))).collect())
}

fn row(transition: &FaultTransition) -> [String; 8] {
    let step = |step| or_nothing::<String>(Option::map(step, |step| format!("step {step}")));
    let evidence = transition.evidence.as_ref();
    let why = reason(transition);
    [
        transition.component.to_string(),
        transition.state.to_string(),
        step(transition.onset_step),
        step(transition.decided_step),
        told(transition),
        or_nothing(evidence.map(|evidence| residual(transition.kind, evidence.residual))),
        or_nothing(evidence.map(|evidence| ratio(evidence.ratio))),
        if why.is_empty() { NOTHING.to_owned() } else { why },
    ]
}

/// When the transition was published; a component without one bears the time of the answer.
fn told(transition: &FaultTransition) -> String {
    or_nothing((transition.sequence > 0).then(|| utc(transition.time_unix_ns)))
}
