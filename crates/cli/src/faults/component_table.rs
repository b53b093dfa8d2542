//! The components that are other than normal, as a table.

use wire::{FaultTransition, Symptom};

use crate::paint::Colour;
use crate::paint::state_colour;
use crate::table::{TextTable, table};
use wording::{NOTHING, identified, or_nothing, ratio, reason, residual, state_and_aside, utc};

const HEADING: [&str; 9] = [
    "component",
    "state",
    "kind of fault",
    "onset",
    "decided",
    "published",
    "residual",
    "divergence",
    "why",
];

/// The table, and the colour of each row.
pub(super) fn components(components: &[&FaultTransition]) -> (TextTable, Vec<Option<Colour>>) {
    let mut table = table(&HEADING);
    for transition in components {
        table.add_row(row(transition));
    }
    table.align_right([3, 4, 6, 7]);
    table.break_times(5);
    table.stack(&[&[0], &[1, 5], &[3, 4], &[6, 7], &[2, 8]]);
    (table, components.iter().map(|component| Some(state_colour(component.state()))).collect())
}

fn row(transition: &FaultTransition) -> [String; 9] {
    let step = |step| or_nothing::<String>(Option::map(step, |step| format!("step {step}")));
    // What was last computed says nothing of a component without a signal.
    let evidence = transition.evidence.as_ref().filter(|_| transition.symptom == Symptom::Change);
    let why = reason(transition);
    [
        transition.component.to_string(),
        state_and_aside(transition),
        or_nothing(transition.identification.as_deref().map(identified)),
        step(transition.onset_step),
        step(transition.decided_step),
        published(transition),
        or_nothing(
            evidence
                .map(|evidence| residual(transition.component.component.kind(), evidence.residual)),
        ),
        or_nothing(evidence.map(|evidence| ratio(evidence.ratio()))),
        if why.is_empty() { NOTHING.to_owned() } else { why },
    ]
}

/// When the transition was published; a component without one has the time of the answer.
fn published(transition: &FaultTransition) -> String {
    or_nothing((transition.sequence > 0).then(|| utc(transition.time_unix_ns)))
}
