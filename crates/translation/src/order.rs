//! Orders as the diagnosis takes them, as they are sent, and as they are reported.

use diagnosis::{GivenOrder, Order, OrderKind, Span};
use names::Component;
use wire::GivenOrderKind;

/// An order about a component as the diagnosis takes it, at the time when it is given \[ns since 1970\].
#[must_use]
pub fn from_wire_order(
    kind: wire::OrderKind,
    component: Component,
    order: wire::Order,
    now_unix_ns: u64,
) -> Order {
    let wire::Order { component: _, by, on_behalf_of, note, for_s, force, re_tare } = order;
    let span = Span {
        since_unix_ns: now_unix_ns,
        until_unix_ns: now_unix_ns.saturating_add(for_s.unwrap_or(0).saturating_mul(1_000_000_000)),
    };
    let kind = match kind {
        wire::OrderKind::Acknowledge => OrderKind::Acknowledge,
        wire::OrderKind::Reset if re_tare => OrderKind::ReTare,
        wire::OrderKind::Reset => OrderKind::Reset { force },
        wire::OrderKind::Shelve => OrderKind::Shelve(span),
        wire::OrderKind::Unshelve => OrderKind::Unshelve,
        wire::OrderKind::Suppress => OrderKind::Suppress(span),
        wire::OrderKind::Unsuppress => OrderKind::Unsuppress,
    };
    Order { component, given: GivenOrder { kind, by, on_behalf_of, note } }
}

pub(crate) fn to_wire_order(given: GivenOrder) -> wire::GivenOrder {
    let GivenOrder { kind, by, on_behalf_of, note } = given;
    let (order, span) = match kind {
        OrderKind::Acknowledge => (GivenOrderKind::Acknowledge, None),
        OrderKind::Reset { .. } | OrderKind::ReTare => (GivenOrderKind::Reset, None),
        OrderKind::Shelve(span) => (GivenOrderKind::Shelve, Some(span)),
        OrderKind::Unshelve => (GivenOrderKind::Unshelve, None),
        OrderKind::Suppress(span) => (GivenOrderKind::Suppress, Some(span)),
        OrderKind::Unsuppress => (GivenOrderKind::Unsuppress, None),
        OrderKind::Lapse { .. } => (GivenOrderKind::Lapse, None),
    };
    let noticed = match kind {
        OrderKind::Lapse { now_unix_ns } => Some(now_unix_ns),
        _ => None,
    };
    wire::GivenOrder {
        order,
        by,
        on_behalf_of,
        note,
        force: kind == OrderKind::Reset { force: true },
        re_tare: kind == OrderKind::ReTare,
        since_unix_ns: span.map(|span| span.since_unix_ns),
        until_unix_ns: span.map(|span| span.until_unix_ns).or(noticed),
    }
}

pub(crate) fn from_given_order(given: wire::GivenOrder) -> GivenOrder {
    let until_unix_ns = given.until_unix_ns.unwrap_or(0);
    let span = Span { since_unix_ns: given.since_unix_ns.unwrap_or(0), until_unix_ns };
    let kind = match given.order {
        GivenOrderKind::Acknowledge => OrderKind::Acknowledge,
        GivenOrderKind::Reset if given.re_tare => OrderKind::ReTare,
        GivenOrderKind::Reset => OrderKind::Reset { force: given.force },
        GivenOrderKind::Shelve => OrderKind::Shelve(span),
        GivenOrderKind::Unshelve => OrderKind::Unshelve,
        GivenOrderKind::Suppress => OrderKind::Suppress(span),
        GivenOrderKind::Unsuppress => OrderKind::Unsuppress,
        GivenOrderKind::Lapse => OrderKind::Lapse { now_unix_ns: until_unix_ns },
    };
    let wire::GivenOrder { by, on_behalf_of, note, .. } = given;
    GivenOrder { kind, by, on_behalf_of, note }
}
