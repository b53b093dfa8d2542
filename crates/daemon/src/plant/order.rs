//! Orders from the network: taken, passed to the plant's thread, answered.

use std::sync::mpsc as std_mpsc;
use std::sync::mpsc::TrySendError;

use plant::Plant;
use tokio::sync::mpsc;
use vocabulary::{
    DecodeError, EncodeError, Injected, Injection, Key, Mention, PlantTopic, Refused, Stroke,
    StrokeBegun, StructureName,
};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};

use super::agenda::Agenda;
use super::{injection, stroke};

/// Orders, and replies, that may wait.
const QUEUE: usize = 256;

/// What is ordered.
#[derive(Debug)]
pub(crate) enum Command {
    Inject(Injection),
    Stroke(Stroke),
}

/// What was done.
#[derive(Debug)]
pub(crate) enum Obeyed {
    Injected(Injected),
    StrokeBegun(StrokeBegun),
}

/// An order and where its reply goes.
#[derive(Debug)]
pub(crate) struct Order {
    pub(crate) command: Command,
    pub(crate) query: Query,
}

/// A reply on its way.
#[derive(Debug)]
pub(crate) struct OrderReply {
    pub(crate) outcome: Result<Obeyed, String>,
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

/// Reads the orders of one key.
type Read = fn(&[u8]) -> Result<Command, DecodeError>;

/// The keys that take orders, each with what it takes.
const KEYS: [(PlantTopic, Read); 2] = [
    (PlantTopic::Inject, |bytes| vocabulary::decode(bytes).map(Command::Inject)),
    (PlantTopic::Stroke, |bytes| vocabulary::decode(bytes).map(Command::Stroke)),
];

impl Command {
    /// The component that it is about.
    pub(crate) fn component(&self) -> &Mention {
        match self {
            Command::Inject(injection) => &injection.component,
            Command::Stroke(stroke) => &stroke.component,
        }
    }

    /// Carries it out, or puts it on the agenda.
    pub(crate) fn obey(self, plant: &mut Plant, agenda: &mut Agenda) -> Result<Obeyed, String> {
        match self {
            Command::Inject(order) => injection::obey(order, plant, agenda).map(Obeyed::Injected),
            Command::Stroke(order) => stroke::begin(&order, plant).map(Obeyed::StrokeBegun),
        }
    }
}

impl Obeyed {
    fn encode(&self) -> Result<Vec<u8>, EncodeError> {
        match self {
            Obeyed::Injected(injected) => vocabulary::encode(injected),
            Obeyed::StrokeBegun(begun) => vocabulary::encode(begun),
        }
    }
}

/// The queues to and from the plant's thread.
pub(crate) fn channel() -> (Orders, Replies) {
    let (order_in, order_out) = std_mpsc::sync_channel(QUEUE);
    let (reply_in, reply_out) = mpsc::channel(QUEUE);
    (Ends { sender: order_in, receiver: order_out }, Ends { sender: reply_in, receiver: reply_out })
}

/// Takes orders on every key that there is for them. What is no order is refused on the spot.
pub(crate) async fn declare(
    session: &Session,
    structure: &StructureName,
    orders: std_mpsc::SyncSender<Order>,
    replies: mpsc::Sender<OrderReply>,
) -> zenoh::Result<Vec<Queryable<()>>> {
    let mut queryables = Vec::with_capacity(KEYS.len());
    for (topic, read) in KEYS {
        let (orders, replies) = (orders.clone(), replies.clone());
        let queryable = session
            .declare_queryable(Key::of_plant(structure, topic).to_string())
            .complete(true)
            .callback(move |query| take(query, read, &orders, &replies));
        queryables.push(queryable.await?);
    }
    Ok(queryables)
}

fn take(
    query: Query,
    read: Read,
    orders: &std_mpsc::SyncSender<Order>,
    replies: &mpsc::Sender<OrderReply>,
) {
    let payload = query.payload().map(|payload| payload.to_bytes().into_owned());
    let (query, reason) = match read(&payload.unwrap_or_default()) {
        Ok(command) => match orders.try_send(Order { command, query }) {
            Ok(()) => return,
            Err(TrySendError::Full(order)) => (order.query, "too many orders are waiting".into()),
            Err(TrySendError::Disconnected(order)) => (order.query, "the plant is ending".into()),
        },
        Err(error) => (query, error.to_string()),
    };
    // A full queue leaves the query without a reply, which is no consent either.
    let _ = replies.try_send(OrderReply { outcome: Err(reason), query });
}

/// Sends replies, one after the other.
pub(crate) async fn reply(mut replies: mpsc::Receiver<OrderReply>) {
    while let Some(OrderReply { outcome, query }) = replies.recv().await {
        let sent = match outcome {
            Ok(obeyed) => match obeyed.encode() {
                Ok(bytes) => {
                    let key = query.key_expr().clone();
                    query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).await
                }
                Err(error) => Err(error.into()),
            },
            Err(reason) => match vocabulary::encode(&Refused { reason }) {
                Ok(bytes) => query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).await,
                Err(error) => Err(error.into()),
            },
        };
        if let Err(error) = sent {
            tracing::debug!("reply to an order not sent: {error}");
        }
    }
}
