//! Passes operators' orders to the diagnoser's queue.
//!
//! An order on a key that ends with an operator's name belongs to that operator, whatever the message says, because
//! access control admits only that operator to the key. On the key without a name, which access control denies to all,
//! the message names the issuer.

use std::sync::Arc;

use tokio::sync::mpsc;
use vocabulary::{OperatorName, Order, OrderKind, Topic};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::SharedInquiryCounters;
use crate::diagnoser::publish::{ModuleOutbox, RoutineMessage};
use diagnosis::messages::Speaker;

/// An order and where the reply goes.
#[derive(Debug)]
pub(crate) struct OrderInquiry {
    pub(crate) kind: OrderKind,
    pub(crate) order: Order,
    pub(crate) query: Query,
}

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    queue: &mpsc::Sender<OrderInquiry>,
    outbox: &ModuleOutbox,
    counters: &SharedInquiryCounters,
) -> zenoh::Result<Vec<Queryable<()>>> {
    let mut queryables = Vec::new();
    for kind in OrderKind::ALL {
        let open = speaker.key(Topic::Command(kind));
        for (key, read) in [(format!("{open}/*"), read_named as Read), (open, read as Read)] {
            let (queue, outbox) = (queue.clone(), outbox.clone());
            let counters = Arc::clone(counters);
            let queryable = session
                .declare_queryable(key)
                .complete(true)
                .callback(move |query| take((kind, read), query, &queue, &outbox, &counters));
            queryables.push(queryable.await?);
        }
    }
    Ok(queryables)
}

/// How an order is read from a query.
type Read = fn(OrderKind, &Query) -> Result<Order, String>;

fn take(
    (kind, read): (OrderKind, Read),
    query: Query,
    queue: &mpsc::Sender<OrderInquiry>,
    outbox: &ModuleOutbox,
    counters: &SharedInquiryCounters,
) {
    counters.count(|counters| counters.received += 1);
    match read(kind, &query) {
        Ok(order) => {
            if let Err(error) = queue.try_send(OrderInquiry { kind, order, query }) {
                counters.count(|counters| counters.turned_away += 1);
                let OrderInquiry { query, .. } = error.into_inner();
                let reason = "command queue full; retry".to_owned();
                outbox.routine(RoutineMessage::Refusal { query, reason });
            }
        }
        Err(reason) => {
            counters.count(|counters| counters.malformed += 1);
            outbox.routine(RoutineMessage::Refusal { query, reason });
        }
    }
}

fn read_named(kind: OrderKind, query: &Query) -> Result<Order, String> {
    let key = query.key_expr().as_str();
    let name = key.rsplit('/').next().unwrap_or_default();
    let operator: OperatorName = name.parse().map_err(|error| format!("{error}, in `{key}`"))?;
    let mut order = read(kind, query)?;
    order.by = operator.into();
    Ok(order)
}

fn read(kind: OrderKind, query: &Query) -> Result<Order, String> {
    let payload = query.payload().ok_or("command without a payload; see `trusswatch schema`")?;
    let order: Order =
        vocabulary::decode(&payload.to_bytes()).map_err(|error| error.to_string())?;
    order.check(kind)?;
    Ok(order)
}
