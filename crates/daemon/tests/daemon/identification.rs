//! What kind of fault it is, and how large, goes over the network, into the journal, and through a restart.
//!

//! Authority: the fault that the plant was given.

use std::time::Duration;

use crate::support::{LIMIT, Rig, in_time};
use daemon::config::{PlantFlags, ScheduledFault, Speed};
use observer::News;
use session::client::Live;
use vocabulary::{
    ComponentPath, FaultState, FaultTransition, Identification, Message, Order, OrderKind, RunId,
    Step, fault::Fault, keys::Watched,
};
use zenoh::Session;
use zenoh::query::ConsolidationMode;

const TOWER: [&str; 2] = ["module1.toml", "module2.toml"];
const RUN: RunId = RunId(42);
const OFFSET_M: f64 = 6e-5;
/// The 95 % interval may miss the true offset now and then, but not by as much as this.
const ROOM_M: f64 = 2e-6;

/// A gage of the tower that is off from step 3000 on, and diagnosers that keep a journal.
fn rig(state: &std::path::Path) -> (Rig, ComponentPath) {
    let flags = PlantFlags {
        speed: Some(Speed::Factor(4.0)),
        steps: Some(6500),
        run_id: Some(RUN),
        ..PlantFlags::default()
    };
    let mut rig = Rig::new("plant.toml", &TOWER, &flags).patient();
    let component: ComponentPath = "module2/sensor/g3".parse().unwrap();
    rig.plant.schedule.faults = vec![ScheduledFault {
        at_step: Step(3000),
        until_step: None,
        component: component.clone(),
        fault: Fault::Bias { offset_m: OFFSET_M },
    }];
    for diagnoser in &mut rig.diagnosers {
        let directory = state.join(diagnoser.module().as_str());
        diagnoser.state.directory = Some(directory);
    }
    (rig, component)
}

async fn subscribe(observer: &Session) -> Live {
    Live::events(observer, None).await.unwrap()
}

/// The next identification in which the kind is decided. Any other one must be of the same fault.
async fn next_decided(received: &mut Live, component: &ComponentPath) -> Identification {
    in_time("a decided identification", async {
        loop {
            let event = received.next_event().await.unwrap();
            let News::Identification(found) = &event.news else { continue };
            assert_eq!(found.component, *component);
            assert_eq!(found.signature, None, "only in answer to a question");
            if found.decided {
                return (**found).clone();
            }
        }
    })
    .await
}

/// What a query gets.
async fn replies<M: Message>(observer: &Session, expression: String) -> Vec<M> {
    let query = observer.get(expression).consolidation(ConsolidationMode::None).timeout(LIMIT);
    let received = query.await.unwrap();
    let mut replies = Vec::new();
    while let Ok(reply) = in_time("a reply", received.recv_async()).await {
        replies.push(vocabulary::decode(&reply.result().unwrap().payload().to_bytes()).unwrap());
    }
    replies
}

/// The fault's state, as soon as it is there: the module may just have started.
async fn present_state(observer: &Session, component: &ComponentPath) -> FaultTransition {
    in_time("the fault's state", async {
        loop {
            let states: Vec<FaultTransition> = replies(observer, Watched::default().faults()).await;
            if let Some(state) = states.into_iter().find(|state| state.component == *component) {
                return state;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    })
    .await
}

/// It is a bias of the size that the plant was given.
#[track_caller]
fn is_the_bias(found: &Identification) {
    let kind = found.kind().unwrap();
    let size = kind.size.as_ref().unwrap();
    assert_eq!(kind.kind.as_str(), "bias");
    let within = (size.low - ROOM_M..size.high + ROOM_M).contains(&OFFSET_M);
    assert!(within && size.low < size.value && size.value < size.high, "{size:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bias_is_identified_and_stays_so_through_an_acknowledgement_and_a_restart() {
    let directory = tempfile::tempdir().unwrap();
    let (rig, component) = rig(directory.path());
    let (structure, module) = (rig.plant.structure.name.clone(), component.module.clone());
    let diagnosers = [rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let all = rig.modules();
    session::client::wait_for(&observer, &structure, &all, false, LIMIT).await.unwrap();
    let mut received = subscribe(&observer).await;
    let plant = rig.start_plant();

    is_the_bias(&next_decided(&mut received, &component).await);
    plant.end().await;
    let latest = present_state(&observer, &component).await;
    assert_eq!(latest.state(), FaultState::Latched);
    let known = latest.identification.unwrap();
    assert_eq!((known.sequence, &known.signature), (latest.sequence, &None));
    is_the_bias(&known);
    let answers: Vec<Identification> =
        replies(&observer, Watched::default().identifications()).await;
    let [answer] = &answers[..] else { unreachable!("one faulty component: {answers:?}") };
    is_the_bias(answer);
    assert!(answer.as_of_step >= known.as_of_step);

    let order = Order {
        component: Some(component.component.clone().into()),
        by: "ada".to_owned(),
        ..Order::default()
    };
    let request = observer::OrderRequest {
        structure: structure.clone(),
        module: module.clone(),
        kind: OrderKind::Acknowledge,
        operator: None,
        order,
    };
    session::client::order(&observer, &request, LIMIT).await.unwrap();
    let history = session::client::history(&observer, &structure, &module, 1, LIMIT).await;
    let carried = history.transitions.last().unwrap();
    assert_eq!(carried.state(), FaultState::Acknowledged);
    is_the_bias(carried.identification.as_deref().unwrap());
    let published = history.identifications.last().unwrap().clone();
    is_the_bias(&published);

    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
    drop(received);
    let again = rig.start_diagnoser(1);
    session::client::wait_for(&observer, &structure, &[module], false, LIMIT).await.unwrap();
    let recalled = present_state(&observer, &component).await.identification.unwrap();
    // What the transition carried is later than what was published last, if they differ.
    is_the_bias(&recalled);
    assert!(recalled.as_of_step >= published.as_of_step);
    let mut received = subscribe(&observer).await;
    assert_eq!(next_decided(&mut received, &component).await, *recalled);
    again.stop().await;
    session::close(&observer).await;
}
