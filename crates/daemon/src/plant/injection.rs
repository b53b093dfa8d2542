//! Orders from the network: give a component a fault, or repair it.

use std::sync::mpsc as std_mpsc;
use std::sync::mpsc::TrySendError;

use names::{ComponentPath, Mention, Step, StructureName};
use plant::Plant;
use tokio::sync::mpsc;
use wire::{Injected, Injection, Key, PlantTopic, Refused};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};

use super::agenda::{Agenda, Item};

/// Orders, and replies, that may wait.
const QUEUE: usize = 256;

/// An order and where its reply goes.
#[derive(Debug)]
pub(crate) struct Order {
    pub(crate) injection: Injection,
    pub(crate) query: Query,
}

/// A reply on its way.
#[derive(Debug)]
pub(crate) struct OrderReply {
    pub(crate) outcome: Result<Injected, String>,
    pub(crate) query: Query,
}

/// Both ends of a queue.
#[derive(Debug)]
pub(crate) struct Ends<S, R> {
    pub(crate) sender: S,
    pub(crate) receiver: R,
}

type Orders = Ends<std_mpsc::SyncSender<Order>, std_mpsc::Receiver<Order>>;
type Replies = Ends<mpsc::Sender<OrderReply>, mpsc::Receiver<OrderReply>>;

/// The queues to and from the plant's thread.
pub(crate) fn channel() -> (Orders, Replies) {
    let (order_in, order_out) = std_mpsc::sync_channel(QUEUE);
    let (reply_in, reply_out) = mpsc::channel(QUEUE);
    (Ends { sender: order_in, receiver: order_out }, Ends { sender: reply_in, receiver: reply_out })
}

/// Takes orders on `plant/command/inject`. What is no order is refused on the spot.
pub(crate) async fn declare(
    session: &Session,
    structure: &StructureName,
    orders: std_mpsc::SyncSender<Order>,
    replies: mpsc::Sender<OrderReply>,
) -> zenoh::Result<Queryable<()>> {
    session
        .declare_queryable(Key::of_plant(structure, PlantTopic::Inject).to_string())
        .complete(true)
        .callback(move |query| take(query, &orders, &replies))
        .await
}

fn take(query: Query, orders: &std_mpsc::SyncSender<Order>, replies: &mpsc::Sender<OrderReply>) {
    let payload = query.payload().map(|payload| payload.to_bytes().into_owned());
    let (query, reason) = match wire::decode::<Injection>(&payload.unwrap_or_default()) {
        Ok(injection) => match orders.try_send(Order { injection, query }) {
            Ok(()) => return,
            Err(TrySendError::Full(order)) => (order.query, "too many orders are waiting".into()),
            Err(TrySendError::Disconnected(order)) => (order.query, "the plant is ending".into()),
        },
        Err(error) => (query, error.to_string()),
    };
    // A full queue leaves the query without a reply, which is no consent either.
    let _ = replies.try_send(OrderReply { outcome: Err(reason), query });
}

/// Carries out an order, or puts it on the agenda.
pub(crate) fn obey(
    injection: Injection,
    plant: &mut Plant,
    agenda: &mut Agenda,
) -> Result<Injected, String> {
    let Injection { component, fault, at_step } = injection;
    let component = meant(&component, plant)?;
    let next_step = plant.next_step();
    let step = at_step.unwrap_or(next_step);
    if step < next_step {
        return Err(format!("step {step} is over; the next one is {next_step}"));
    }
    let item = Item { step, component: component.clone(), fault };
    // An order for later is tried on a copy, so that it can be refused now.
    if step == next_step {
        apply(&item, plant)?;
    } else {
        apply(&item, &mut plant.clone())?;
        agenda.add(item);
    }
    Ok(Injected { component, effective_step: step })
}

/// The component that is mentioned: where no module is given, the only one of that name.
fn meant(mention: &Mention, plant: &Plant) -> Result<ComponentPath, String> {
    if let Mention { module: Some(module), component } = mention {
        return Ok(ComponentPath { module: module.clone(), component: component.clone() });
    }
    let all: Vec<_> = plant.components().filter(|path| mention.may_be(path)).collect();
    match all.as_slice() {
        [only] => Ok((*only).clone()),
        [] => Err(format!("no module has a component `{mention}`")),
        several => {
            let paths: Vec<String> = several.iter().map(|path| format!("`{path}`")).collect();
            Err(format!("`{mention}` may be {}; write which", paths.join(" or ")))
        }
    }
}

/// Applies an item to its component.
pub(crate) fn apply(item: &Item, plant: &mut Plant) -> Result<(), String> {
    let done = match item.fault {
        Some(fault) => plant.inject(&item.component, fault),
        None => plant.clear(&item.component),
    };
    done.map_err(|error| error.to_string())
}

/// Does all that is due before `step` is computed. Was there anything?
pub(crate) fn catch_up(agenda: &mut Agenda, plant: &mut Plant, step: Step) -> bool {
    let mut any = false;
    while let Some(item) = agenda.next_due(step) {
        any = true;
        let done = if item.fault.is_some() { "fault injected" } else { "repaired" };
        match apply(&item, plant) {
            Ok(()) => {
                tracing::info!(component = %item.component, %step, fault = ?item.fault, "{done}")
            }
            Err(error) => {
                tracing::error!(component = %item.component, %step, "not {done}: {error}")
            }
        }
    }
    any
}

/// Sends replies, one after the other.
pub(crate) async fn reply(mut replies: mpsc::Receiver<OrderReply>) {
    while let Some(OrderReply { outcome, query }) = replies.recv().await {
        let sent = match outcome {
            Ok(injected) => match wire::encode(&injected) {
                Ok(bytes) => {
                    let key = query.key_expr().clone();
                    query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).await
                }
                Err(error) => Err(error.into()),
            },
            Err(reason) => match wire::encode(&Refused { reason }) {
                Ok(bytes) => query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).await,
                Err(error) => Err(error.into()),
            },
        };
        if let Err(error) = sent {
            tracing::debug!("reply to an injection not sent: {error}");
        }
    }
}
