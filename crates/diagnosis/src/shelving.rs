//! Alarms that are set aside for a time: shelved by an operator, or suppressed while their module is maintained
//! (ISA-18.2). A property beside the verdict, which does not depend on it.

use serde::{Deserialize, Serialize};

use crate::order::{GivenOrder, OrderKind, OrderRefusal};
use crate::verdict::Transition;

/// By this a clock may stand before the beginning of a span and count as right \[ns\].
const SET_BACK_NS: u64 = 60_000_000_000;

/// From when to when an alarm is set aside, by the shell's clock: the diagnoser has none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// When it began \[ns since 1970\].
    pub since_unix_ns: u64,
    /// When it is over \[ns since 1970\].
    pub until_unix_ns: u64,
}

impl Span {
    /// Whether it is over. It is as well if the clock stands long before its beginning: a clock that was set back must
    /// not keep an alarm away.
    #[must_use]
    pub fn is_over(&self, now_unix_ns: u64) -> bool {
        now_unix_ns >= self.until_unix_ns
            || now_unix_ns.saturating_add(SET_BACK_NS) < self.since_unix_ns
    }
}

/// By whom, why and until when an alarm is set aside.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shelving {
    /// From when to when.
    pub span: Span,
    /// By whom.
    pub by: String,
    /// In whose name, if that is a program that a person uses.
    pub on_behalf_of: Option<String>,
    /// Why.
    pub reason: String,
}

impl Shelving {
    /// By this order.
    pub(crate) fn of(given: &GivenOrder, span: Span) -> Self {
        let GivenOrder { by, on_behalf_of, note, .. } = given.clone();
        Self { span, by, on_behalf_of, reason: note.unwrap_or_default() }
    }
}

/// That an alarm is set aside one way, if it is.
type Aside = Option<Box<Shelving>>;

/// Whether a component is shelved, and whether it is suppressed, after an order about that.
pub(crate) fn aside_after(
    before: &Transition,
    order: &GivenOrder,
) -> Result<(Aside, Aside), OrderRefusal> {
    let Transition { component, shelved, suppressed, .. } = before.clone();
    match order.kind {
        OrderKind::Shelve(span) => Ok((Some(Box::new(Shelving::of(order, span))), suppressed)),
        OrderKind::Suppress(span) => Ok((shelved, Some(Box::new(Shelving::of(order, span))))),
        OrderKind::Unshelve if shelved.is_some() => Ok((None, suppressed)),
        OrderKind::Unshelve => Err(OrderRefusal::NotShelved(component)),
        OrderKind::Unsuppress if suppressed.is_some() => Ok((shelved, None)),
        OrderKind::Unsuppress => Err(OrderRefusal::NotSuppressed(component)),
        OrderKind::Lapse { now_unix_ns } => {
            let left_of =
                |aside: &Aside| aside.clone().filter(|aside| !aside.span.is_over(now_unix_ns));
            let left = (left_of(&shelved), left_of(&suppressed));
            let has_lapsed = left != (shelved, suppressed);
            has_lapsed.then_some(left).ok_or(OrderRefusal::NothingIsOver(component))
        }
        // These are about the verdict.
        OrderKind::Acknowledge | OrderKind::ReTare | OrderKind::Reset { .. } => {
            Ok((shelved, suppressed))
        }
    }
}
