//! Alarms shelved by an operator, or suppressed while their module is maintained (ISA-18.2), and cylinders that are shut
//! off. The verdict does not depend on these properties.

use vocabulary::{Component, GivenOrder, GivenOrderKind, Shelving, Span};

use crate::order::OrderRefusal;
use crate::verdict::Transition;

/// By this order.
fn shelving(given: &GivenOrder, span: Span) -> Shelving {
    let GivenOrder { by, on_behalf_of, note, .. } = given.clone();
    let Span { since_unix_ns, until_unix_ns } = span;
    Shelving { since_unix_ns, until_unix_ns, by, on_behalf_of, reason: note.unwrap_or_default() }
}

/// A component's latest transition after an order that its verdict does not depend on.
pub(crate) fn set_aside(
    mut before: Transition,
    order: &GivenOrder,
) -> Result<Transition, OrderRefusal> {
    let Transition { shelved, suppressed, shut_off, .. } = &mut before;
    let refusal = match order.kind {
        GivenOrderKind::Shelve(span) => {
            *shelved = Some(Box::new(shelving(order, span)));
            None
        }
        GivenOrderKind::Suppress(span) => {
            *suppressed = Some(Box::new(shelving(order, span)));
            None
        }
        GivenOrderKind::ShutOff { .. } => {
            *shut_off = Some(Box::new(order.clone()));
            None
        }
        GivenOrderKind::Unshelve => none_taken(shelved, OrderRefusal::NotShelved),
        GivenOrderKind::Unsuppress => none_taken(suppressed, OrderRefusal::NotSuppressed),
        GivenOrderKind::PutBack => none_taken(shut_off, OrderRefusal::NotShutOff),
        GivenOrderKind::Lapse { now_unix_ns } => {
            let lapse = |aside: &mut Option<Box<Shelving>>| {
                aside.take_if(|aside| aside.span().is_over(now_unix_ns)).is_some()
            };
            let lapsed = [lapse(shelved), lapse(suppressed)].contains(&true);
            (!lapsed).then_some(OrderRefusal::NothingIsOver as fn(Component) -> OrderRefusal)
        }
        // These are about the verdict.
        GivenOrderKind::Acknowledge
        | GivenOrderKind::ReTare
        | GivenOrderKind::Reset { .. }
        | GivenOrderKind::Declare => None,
    };
    match refusal {
        Some(refusal) => Err(refusal(before.component)),
        None => Ok(before),
    }
}

/// Ends it; the refusal if there is nothing to end.
fn none_taken<T>(
    present: &mut Option<T>,
    refusal: fn(Component) -> OrderRefusal,
) -> Option<fn(Component) -> OrderRefusal> {
    present.take().is_none().then_some(refusal)
}
