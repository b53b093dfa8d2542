//! Alarms are set aside by order, for a component or for a module, and count again by themselves; a restart in between

//! changes nothing of that.

use crate::support::{LIMIT, Process, Rig, in_time, status};
use daemon::config::PlantFlags;
use observer::{OrderRequest, QueryError};
use vocabulary::{FaultTransition, GivenOrderKind, Obeyed, OperatorName, Order, OrderKind};
use zenoh::Session;

const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];
const GAGE: &str = "sensor/g1";
const STATE: &str = "trusswatch/small/lower/fault/sensor/g1";

/// A diagnoser that has no sample, and a state directory.
async fn start(rig: &Rig) -> (Process, Session) {
    let lower = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let (structure, module) = ("small".parse().unwrap(), [rig.modules()[0].clone()]);
    session::client::wait_for(&observer, &structure, &module, false, LIMIT).await.unwrap();
    (lower, observer)
}

fn rig(state: &std::path::Path) -> Rig {
    let mut rig = Rig::new("small/plant.toml", &SMALL, &PlantFlags::default());
    rig.diagnosers[0].state.directory = Some(state.to_owned());
    rig
}

/// An order of the operator `web`, which `ada` uses.
async fn order(
    observer: &Session,
    kind: OrderKind,
    for_s: Option<u64>,
) -> Result<Obeyed, QueryError> {
    let component = (!kind.is_of_module()).then(|| GAGE.parse().unwrap());
    let order = Order {
        component,
        by: "somebody".to_owned(),
        on_behalf_of: Some("ada".to_owned()),
        note: Some("painting".to_owned()),
        for_s,
        ..Order::default()
    };
    let operator: OperatorName = "web".parse().unwrap();
    let (structure, module) = ("small".parse().unwrap(), "lower".parse().unwrap());
    let request = OrderRequest { structure, module, kind, operator: Some(operator), order };
    session::client::order(observer, &request, LIMIT).await
}

async fn state(observer: &Session) -> FaultTransition {
    let replies = observer.get(STATE).await.unwrap();
    let reply = in_time("the state", replies.recv_async()).await.unwrap().into_result().unwrap();
    vocabulary::decode(&reply.payload().to_bytes()).unwrap()
}

/// The state as soon as its transition has this number.
async fn state_of(observer: &Session, sequence: u64) -> FaultTransition {
    let published = observer.declare_subscriber(STATE).await.unwrap();
    let mut latest = state(observer).await;
    while latest.sequence < sequence {
        let received = in_time("a transition", published.recv_async()).await.unwrap();
        latest = vocabulary::decode(&received.payload().to_bytes()).unwrap();
    }
    latest
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_module_is_suppressed_with_all_its_components_and_one_reply() {
    let folder = tempfile::tempdir().unwrap();
    let rig = rig(folder.path());
    let (lower, observer) = start(&rig).await;
    let refused = order(&observer, OrderKind::Unsuppress, None).await.unwrap_err();
    assert!(refused.to_string().contains("no component of `lower` is suppressed"), "{refused}");
    let components = {
        let (actuators, gages) = rig.diagnosers[0].size();
        (actuators + gages) as u64
    };
    let obeyed = order(&observer, OrderKind::Suppress, Some(3600)).await.unwrap();
    assert_eq!((obeyed.component, obeyed.sequence, obeyed.durable), (None, components, true));
    let present = status(&observer, |status| status.suppressed.is_some()).await;
    assert_eq!(present.shelved, components);
    assert_eq!(present.inquiries.orders_obeyed, 1, "one order");
    let suppressed = present.suppressed.unwrap();
    assert_eq!((suppressed.by.as_str(), suppressed.reason.as_str()), ("web", "painting"));
    assert_eq!(suppressed.on_behalf_of.as_deref(), Some("ada"), "through web");
    assert_eq!(suppressed.until_unix_ns - suppressed.since_unix_ns, 3_600_000_000_000);
    assert_eq!(state(&observer).await.suppressed, Some(suppressed));

    let obeyed = order(&observer, OrderKind::Unsuppress, None).await.unwrap();
    assert_eq!((obeyed.component, obeyed.sequence), (None, 2 * components));
    status(&observer, |status| status.shelved == 0 && status.suppressed.is_none()).await;
    lower.stop().await;
    session::close(&observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_shelved_survives_a_restart_and_ends_by_itself_with_a_numbered_event_before_any_sample()
 {
    let folder = tempfile::tempdir().unwrap();
    let rig = rig(folder.path());
    let (lower, observer) = start(&rig).await;
    let for_long = order(&observer, OrderKind::Shelve, Some(3600)).await.unwrap();
    assert_eq!((for_long.component, for_long.sequence), (Some(GAGE.parse().unwrap()), 1));
    let briefly = order(&observer, OrderKind::Shelve, Some(3)).await.unwrap();
    assert_eq!(briefly.sequence, 2, "the later order replaces the earlier one");
    lower.stop().await;
    session::close(&observer).await;

    let (lower, observer) = start(&rig).await;
    status(&observer, |status| status.shelved == 0).await;
    let after = state_of(&observer, 3).await;
    let given = after.order.unwrap();
    assert!(matches!(given.kind, GivenOrderKind::Lapse { .. }) && given.by == "trusswatch");
    assert_eq!((after.sequence, after.shelved, after.durable), (3, None, true));
    lower.stop().await;
    session::close(&observer).await;

    let (lower, observer) = start(&rig).await;
    let present = status(&observer, |status| status.next_sequence >= 4).await;
    assert_eq!((present.next_sequence, present.shelved), (4, 0), "it ends once");
    let refused = order(&observer, OrderKind::Unshelve, None).await.unwrap_err();
    assert!(refused.to_string().contains("`sensor/g1` is not shelved"), "{refused}");
    lower.stop().await;
    session::close(&observer).await;
}
