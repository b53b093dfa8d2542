//! Operators' orders into the diagnoser's queue.

use std::sync::Arc;

use tokio::sync::mpsc;
use wire::{Order, OrderKind, Topic};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::convert::Speaker;
use crate::diagnoser::outgoing::{Outbox, Routine};

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
    outbox: &Outbox,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Vec<Queryable<()>>> {
    let mut queryables = Vec::new();
    for kind in [OrderKind::Acknowledge, OrderKind::Reset] {
        let (queue, outbox) = (queue.clone(), outbox.clone());
        let counters = Arc::clone(counters);
        let queryable = session
            .declare_queryable(speaker.key(Topic::Command(kind)))
            .complete(true)
            .callback(move |query| take(kind, query, &queue, &outbox, &counters));
        queryables.push(queryable.await?);
    }
    Ok(queryables)
}

fn take(
    kind: OrderKind,
    query: Query,
    queue: &mpsc::Sender<OrderInquiry>,
    outbox: &Outbox,
    counters: &InquiryTally,
) {
    counters.received();
    match read(&query) {
        Ok(order) => {
            if let Err(error) = queue.try_send(OrderInquiry { kind, order, query }) {
                counters.turned_away();
                let OrderInquiry { query, .. } = error.into_inner();
                let reason = "too many orders are waiting; order it again".to_owned();
                outbox.routine(Routine::Refusal { query, reason });
            }
        }
        Err(reason) => {
            counters.malformed();
            outbox.routine(Routine::Refusal { query, reason });
        }
    }
}

fn read(query: &Query) -> Result<Order, String> {
    let payload = query.payload().ok_or("an order has a payload; see the manual")?;
    let order: Order = wire::decode(&payload.to_bytes()).map_err(|error| error.to_string())?;
    order.check()?;
    Ok(order)
}
