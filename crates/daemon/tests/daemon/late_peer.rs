//! A peer whose answers are right but late, as over a link that loses packets, is waited for.

use std::time::Duration;

use crate::support::{Rig, in_time, status};
use daemon::config::{PlantFlags, ScheduledFault, Speed};
use tokio::runtime::Handle;
use vocabulary::{
    FaultState, FaultTransition, ModuleStatus, StateAnswer, StateQuestion, Step, fault::Fault,
};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];
const KEY: &str = "trusswatch/small/upper/state";
/// Longer than the first timeout, shorter than the second.
const LATE: Duration = Duration::from_millis(450);

/// The true answer of a module that has seen no change.
fn nothing_changed(question: StateQuestion) -> StateAnswer {
    StateAnswer {
        module: "upper".parse().unwrap(),
        question,
        watching_since: Some(Step(0)),
        changes: Vec::new(),
        actuator_faults: Vec::new(),
        alarms: Vec::new(),
        pending: Vec::new(),
        window: None,
    }
}

/// Answers in the name of the module `upper`, late.
async fn declare_a_late_peer(session: &Session) -> Queryable<()> {
    let runtime = Handle::current();
    let answer = move |query: Query| {
        let question = StateQuestion::from_parameters(query.parameters().as_str()).unwrap();
        let words = vocabulary::encode(&nothing_changed(question)).unwrap();
        runtime.spawn(async move {
            tokio::time::sleep(LATE).await;
            // Fails if the answer is no longer waited for.
            let _ = query.reply(KEY, words).wait();
        });
    };
    session.declare_queryable(KEY).complete(true).callback(answer).await.unwrap()
}

/// A jump would need no peer.
const SMALL_BIAS: Fault = Fault::Bias { offset_m: 1.2e-5 };

fn rig() -> Rig {
    let flags = PlantFlags { speed: Some(Speed::REAL), ..PlantFlags::default() };
    let mut rig = Rig::new("small/plant.toml", &SMALL, &flags);
    rig.plant.wait_for = vec!["lower".parse().unwrap()];
    rig.plant.schedule.faults = vec![ScheduledFault {
        // Long enough in service to know that nothing happened before.
        at_step: Step(3000),
        until_step: None,
        component: "lower/sensor/g1".parse().unwrap(),
        fault: SMALL_BIAS,
    }];
    rig
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_a_peer_answers_late_settles_the_verdict() {
    let rig = rig();
    let lower = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let token = observer.liveliness().declare_token("trusswatch/small/upper/alive").await.unwrap();
    let peer = declare_a_late_peer(&observer).await;
    let faults = "trusswatch/small/lower/fault/sensor/g1";
    let faults = observer.declare_subscriber(faults).await.unwrap();
    status(&observer, |status| peer_of(status).present).await;
    let plant = rig.start_plant();
    let mut states = Vec::new();
    in_time("the verdict", async {
        while states.last() != Some(&FaultState::Latched) {
            let received = faults.recv_async().await.unwrap();
            let published: FaultTransition =
                vocabulary::decode(&received.payload().to_bytes()).unwrap();
            states.push(published.state());
        }
    })
    .await;
    // The first timeout is the configured one.
    let expected = [FaultState::Tentative, FaultState::Unconfirmed, FaultState::Latched];
    assert_eq!(states, expected);
    let status = status(&observer, |status| peer_of(status).answered > 0).await;
    assert!(peer_of(&status).timed_out > 0, "{:?}", status.peers);
    peer.undeclare().await.unwrap();
    token.undeclare().await.unwrap();
    for process in [lower, plant] {
        process.stop().await;
    }
    session::close(&observer).await;
}

fn peer_of(status: &ModuleStatus) -> &vocabulary::PeerStatus {
    &status.peers[0]
}
