//! A session that plays the diagnoser of `module1` of the tower.

use std::sync::Arc;

use parking_lot::Mutex;
use session::Network;
use tokio::time::timeout;
use vocabulary::{
    Component, FaultState, Key, Obeyed, OperatorName, Order, OrderKind, Refused, Topic,
};
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};

use super::WITHIN;

/// The orders that came, each with its kind.
type Orders = Arc<Mutex<Vec<(OrderKind, Order)>>>;

/// A diagnoser that obeys everything but resets.
pub(crate) struct StandIn {
    pub(crate) endpoint: String,
    pub(crate) orders: Orders,
    _token: LivelinessToken,
    _queryables: Vec<Queryable<()>>,
    _session: Session,
}

impl StandIn {
    /// `operator`: the only one whose orders it takes.
    pub(crate) async fn open(operator: Option<OperatorName>) -> Self {
        timeout(WITHIN, Self::opened(operator)).await.unwrap()
    }

    async fn opened(operator: Option<OperatorName>) -> Self {
        let [endpoint] = session::loopback::endpoints().unwrap();
        let network = Network { listen: vec![endpoint.clone()], ..Network::default() };
        let session = session::open(&network).await.unwrap();
        let (structure, module) = ("tower".parse().unwrap(), "module1".parse().unwrap());
        let key = |topic| Key::of_module(&structure, &module, topic).to_string();
        let (orders, mut queryables) = (Orders::default(), Vec::new());
        for kind in OrderKind::ALL {
            let topic = operator
                .clone()
                .map_or(Topic::Command(kind), |operator| Topic::CommandOf(kind, operator));
            let (key, orders) = (key(topic), orders.clone());
            let answer = {
                let key = key.clone();
                move |query: Query| obey(&query, &key, kind, &orders)
            };
            queryables.push(session.declare_queryable(key).callback(answer).await.unwrap());
        }
        let token = session.liveliness().declare_token(key(Topic::Alive)).await.unwrap();
        Self { endpoint, orders, _token: token, _queryables: queryables, _session: session }
    }
}

fn obey(query: &Query, key: &str, kind: OrderKind, orders: &Orders) {
    let order: Order = vocabulary::decode(&query.payload().unwrap().to_bytes()).unwrap();
    let component: Option<Component> = order.component.clone().map(|mention| mention.component);
    orders.lock().push((kind, order));
    if kind == OrderKind::Reset {
        let reason = "the <b>evidence</b> is still there".to_owned();
        let refused = vocabulary::encode(&Refused { reason }).unwrap();
        zenoh::Wait::wait(query.reply_err(refused)).unwrap();
        return;
    }
    let state = FaultState::Acknowledged;
    let obeyed = Obeyed { component, state, sequence: 7, durable: true };
    zenoh::Wait::wait(query.reply(key, vocabulary::encode(&obeyed).unwrap())).unwrap();
}
