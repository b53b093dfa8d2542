//! A history as it would be without any order that sets an alarm aside, up to the numbers of transitions and orders.

use diagnosis::{Action, OrderToken, Transition};

use super::life::is_of_alarm;

/// The history without the outcomes of such orders, without what they say of components, and without numbers.
pub fn unshelved(history: &[Action]) -> Vec<Action> {
    let mut kept = Vec::new();
    let mut outcomes = history.iter().peekable();
    while let Some(action) = outcomes.next() {
        match action {
            Action::Publish(transition)
                if transition.order.as_ref().is_some_and(|order| is_of_alarm(order.kind)) =>
            {
                let outcome = outcomes.next();
                assert!(matches!(outcome, Some(Action::Obeyed { .. })), "{outcome:?}");
            }
            Action::OrderRefused { refusal, .. } if is_of_shelving(refusal) => {}
            action => kept.push(without_numbers(action)),
        }
    }
    kept
}

/// A component that is not the module's is refused whatever is ordered.
fn is_of_shelving(refusal: &diagnosis::OrderRefusal) -> bool {
    use diagnosis::OrderRefusal::{NotShelved, NotSuppressed, NothingIsOver, Unknown};
    matches!(refusal, NotShelved(_) | NotSuppressed(_) | NothingIsOver(_) | Unknown(_))
}

fn without_numbers(action: &Action) -> Action {
    let token = OrderToken(0);
    match action.clone() {
        Action::Publish(transition) => Action::Publish(Transition {
            sequence: 0,
            shelved: None,
            suppressed: None,
            ..transition
        }),
        Action::Identify(mut excerpt) => {
            excerpt.sequence = 0;
            Action::Identify(excerpt)
        }
        Action::Freeze { component, mut signals } => {
            signals.sequence = 0;
            Action::Freeze { component, signals }
        }
        Action::Obeyed { .. } => Action::Obeyed { token, sequence: 0 },
        Action::OrderRefused { refusal, .. } => Action::OrderRefused { token, refusal },
        other => other,
    }
}
