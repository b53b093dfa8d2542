//! Alarms shelved by an operator, or suppressed while their module is maintained (ISA-18.2). The verdict does not
//! depend on this property.

use vocabulary::{GivenOrder, GivenOrderKind, Shelving, Span};

use crate::order::OrderRefusal;
use crate::verdict::Transition;

/// By this order.
fn shelving(given: &GivenOrder, span: Span) -> Shelving {
    let GivenOrder { by, on_behalf_of, note, .. } = given.clone();
    let Span { since_unix_ns, until_unix_ns } = span;
    Shelving { since_unix_ns, until_unix_ns, by, on_behalf_of, reason: note.unwrap_or_default() }
}

/// The shelving or suppression of an alarm, if any.
type Aside = Option<Box<Shelving>>;

/// Whether a component is shelved, and whether it is suppressed, after an order about that.
pub(crate) fn aside_after(
    before: &Transition,
    order: &GivenOrder,
) -> Result<(Aside, Aside), OrderRefusal> {
    let Transition { component, shelved, suppressed, .. } = before.clone();
    match order.kind {
        GivenOrderKind::Shelve(span) => Ok((Some(Box::new(shelving(order, span))), suppressed)),
        GivenOrderKind::Suppress(span) => Ok((shelved, Some(Box::new(shelving(order, span))))),
        GivenOrderKind::Unshelve if shelved.is_some() => Ok((None, suppressed)),
        GivenOrderKind::Unshelve => Err(OrderRefusal::NotShelved(component)),
        GivenOrderKind::Unsuppress if suppressed.is_some() => Ok((shelved, None)),
        GivenOrderKind::Unsuppress => Err(OrderRefusal::NotSuppressed(component)),
        GivenOrderKind::Lapse { now_unix_ns } => {
            let left_of =
                |aside: &Aside| aside.clone().filter(|aside| !aside.span().is_over(now_unix_ns));
            let left = (left_of(&shelved), left_of(&suppressed));
            let has_lapsed = left != (shelved, suppressed);
            has_lapsed.then_some(left).ok_or(OrderRefusal::NothingIsOver(component))
        }
        // These are about the verdict.
        GivenOrderKind::Acknowledge | GivenOrderKind::ReTare | GivenOrderKind::Reset { .. } => {
            Ok((shelved, suppressed))
        }
    }
}
