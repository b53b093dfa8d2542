//! Alarms that are shelved or suppressed: which components an order about the module concerns, and which shelvings end.

use diagnosis::{Diagnoser, GivenOrder, GivenOrderKind, Transition};
use vocabulary::Component;

/// Who gives orders without a person.
pub(super) const ITSELF: &str = "trusswatch";

/// The components that an order about the whole module concerns.
///
/// # Errors
/// None of them is suppressed, so that there is nothing to end.
pub(crate) fn concerned(
    kind: vocabulary::OrderKind,
    diagnoser: &Diagnoser,
) -> Result<Vec<Component>, String> {
    if kind != vocabulary::OrderKind::Unsuppress {
        return Ok(diagnoser.components().to_vec());
    }
    let suppressed = diagnoser.last_transitions().filter(|latest| latest.suppressed.is_some());
    let components: Vec<Component> = suppressed.map(|latest| latest.component.clone()).collect();
    if components.is_empty() {
        return Err(format!("no component of `{}` is suppressed", diagnoser.module()));
    }
    Ok(components)
}

/// The orders that end what has had its time \[ns since 1970\].
pub(crate) fn lapses(diagnoser: &Diagnoser, now_unix_ns: u64) -> Vec<(Component, GivenOrder)> {
    let is_over = |latest: &&Transition| {
        let mut both = latest.shelved.iter().chain(&latest.suppressed);
        both.any(|shelving| shelving.span().is_over(now_unix_ns))
    };
    let order = |latest: &Transition| {
        let (kind, by) = (GivenOrderKind::Lapse { now_unix_ns }, ITSELF.to_owned());
        (latest.component.clone(), GivenOrder { kind, by, on_behalf_of: None, note: None })
    };
    diagnoser.last_transitions().filter(is_over).map(order).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use diagnosis::{Action, Event, OrderToken, Span};
    use std::path::Path;

    const SECOND: u64 = 1_000_000_000;
    const NOW: u64 = 1_800_000_000 * SECOND;

    fn diagnoser() -> Diagnoser {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/small/lower.toml");
        let config = crate::config::load_diagnoser(&file).unwrap();
        Diagnoser::new(config.module_setup()).unwrap()
    }

    fn give(diagnoser: &mut Diagnoser, (component, order): (Component, GivenOrder)) -> Action {
        let mut actions = Vec::new();
        diagnoser.handle(Event::Ordered { token: OrderToken(0), component, order }, &mut actions);
        actions.pop().unwrap()
    }

    fn order(component: &Component, kind: GivenOrderKind) -> (Component, GivenOrder) {
        let (by, note) = ("ada".to_owned(), Some("painting".to_owned()));
        (component.clone(), GivenOrder { kind, by, on_behalf_of: None, note })
    }

    fn span(seconds: u64) -> Span {
        Span { since_unix_ns: NOW, until_unix_ns: NOW + seconds * SECOND }
    }

    /// The components for which the time is over.
    fn lapsing(diagnoser: &Diagnoser, now_unix_ns: u64) -> Vec<String> {
        let orders = lapses(diagnoser, now_unix_ns);
        orders.iter().map(|(component, _)| component.to_string()).collect()
    }

    #[test]
    fn what_has_had_its_time_lapses_once_before_the_first_sample_too() {
        let mut diagnoser = diagnoser();
        let components = diagnoser.components().to_vec();
        give(&mut diagnoser, order(&components[0], GivenOrderKind::Shelve(span(10))));
        give(&mut diagnoser, order(&components[1], GivenOrderKind::Suppress(span(20))));
        assert_eq!(lapsing(&diagnoser, NOW + 9 * SECOND), [""; 0]);
        let due = lapses(&diagnoser, NOW + 10 * SECOND);
        assert_eq!(lapsing(&diagnoser, NOW + 10 * SECOND), [components[0].to_string()]);
        for order in due {
            assert!(matches!(give(&mut diagnoser, order), Action::Obeyed { sequence: 3, .. }));
        }
        assert_eq!(lapsing(&diagnoser, NOW + 10 * SECOND), [""; 0]);
        assert_eq!(lapsing(&diagnoser, NOW + 60 * SECOND), [components[1].to_string()]);
    }

    #[test]
    fn a_clock_that_was_set_back_ends_what_has_not_begun_yet() {
        let mut diagnoser = diagnoser();
        let component = diagnoser.components()[0].clone();
        give(&mut diagnoser, order(&component, GivenOrderKind::Shelve(span(7200))));
        assert_eq!(lapsing(&diagnoser, NOW - 59 * SECOND), [""; 0], "clocks are adjusted");
        assert_eq!(lapsing(&diagnoser, NOW - 61 * SECOND), [component.to_string()]);
    }

    #[test]
    fn an_order_about_the_module_concerns_all_its_components_and_its_end_those_that_are_suppressed()
    {
        let mut diagnoser = diagnoser();
        let components = concerned(vocabulary::OrderKind::Suppress, &diagnoser).unwrap();
        assert_eq!(components, diagnoser.components());
        let refusal = concerned(vocabulary::OrderKind::Unsuppress, &diagnoser).unwrap_err();
        assert_eq!(refusal, "no component of `lower` is suppressed");
        for (place, component) in components.iter().enumerate() {
            let span = span(100 - place as u64);
            give(&mut diagnoser, order(component, GivenOrderKind::Suppress(span)));
        }
        give(&mut diagnoser, order(&components[0], GivenOrderKind::Unsuppress));
        let left = concerned(vocabulary::OrderKind::Unsuppress, &diagnoser).unwrap();
        assert_eq!(left, components[1..]);
    }
}
