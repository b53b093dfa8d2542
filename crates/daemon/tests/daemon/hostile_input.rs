//! What is not as it should be is refused or counted, by name, and nothing stops working.

use std::time::Duration;

use crate::support::{LIMIT, Process, Rig, first, in_time, status};
use daemon::config::{PlantFlags, Speed};
use observer::QueryError;
use vocabulary::{
    ComponentPath, Injection, PlantPhase, PlantStatus, Refused, RunId, Sample, SampleQuestion,
    StateAnswer, StateQuestion, Step, StepValues, fault::Fault,
};
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::query::{ConsolidationMode, Query, Queryable};
use zenoh::sample::SourceInfo;
use zenoh::{Session, Wait};

const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];

/// A diagnoser of the lower module; the test plays the rest of the world.
async fn diagnoser_alone() -> (Process, Session) {
    // these tests send single samples and take their time
    diagnoser_that_is_stale_after(3_600_000).await
}

async fn diagnoser_that_is_stale_after(ms: u64) -> (Process, Session) {
    let (_, diagnoser, observer) = rig_with_a_diagnoser_that_is_stale_after(ms).await;
    (diagnoser, observer)
}

async fn rig_with_a_diagnoser_that_is_stale_after(ms: u64) -> (Rig, Process, Session) {
    let mut rig = Rig::new("small/plant.toml", &SMALL, &PlantFlags::default());
    rig.diagnosers[0].publish.status_every_ms = 100;
    rig.diagnosers[0].queries.hold_ms = 3000;
    rig.diagnosers[0].input.stale_after_ms = ms;
    let diagnoser = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let (structure, lower) = (&rig.plant.structure.name, ["lower".parse().unwrap()]);
    session::client::wait_for(&observer, structure, &lower, false, LIMIT).await.unwrap();
    (rig, diagnoser, observer)
}

fn sample(step: u64) -> Sample {
    Sample {
        module: "lower".parse().unwrap(),
        run: RunId(1),
        step: Step(step),
        time_unix_ns: 1,
        demands_n: vec![0.0; 2],
        pressures_pa: vec![[7e6, 9.86e6]; 2],
        elongations_m: vec![0.0; 3],
        readings: Vec::new(),
        block: Vec::new(),
    }
}

async fn put(observer: &Session, bytes: Vec<u8>) {
    observer.put("trusswatch/small/lower/sample", bytes).await.unwrap();
}

async fn put_sample(observer: &Session, sample: &Sample) {
    put(observer, vocabulary::encode(sample).unwrap()).await;
}

/// The reply to a question about a run in the lower module: an answer, a refusal, or silence.
async fn ask(
    observer: &Session,
    run: u64,
    parameters: &str,
) -> Option<Result<StateAnswer, String>> {
    let replies = observer
        .get(format!("trusswatch/small/lower/state?run={run}&{parameters}"))
        .consolidation(ConsolidationMode::None)
        .timeout(Duration::from_secs(10))
        .await
        .unwrap();
    let reply = in_time("a reply", replies.recv_async()).await.ok()?;
    Some(match reply.result() {
        Ok(sample) => Ok(vocabulary::decode(&sample.payload().to_bytes()).unwrap()),
        Err(error) => {
            Err(vocabulary::decode::<Refused>(&error.payload().to_bytes()).unwrap().reason)
        }
    })
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_kind_of_bad_sample_is_counted_by_its_name_and_good_ones_are_still_used() {
    let (diagnoser, observer) = diagnoser_alone().await;
    put_sample(&observer, &sample(0)).await;
    put_sample(&observer, &sample(1)).await;
    // malformed JSON, a word, no text at all
    for bytes in [b"{\"v\":1,".to_vec(), br#"{"v":1,"step":nope}"#.to_vec(), vec![0xff, 0x00]] {
        put(&observer, bytes).await;
    }
    // an unknown version
    put(&observer, br#"{"v":7,"whatever":true}"#.to_vec()).await;
    // JSON, but no sample
    put(&observer, br#"{"v":1,"hello":"world"}"#.to_vec()).await;
    // another module's
    put_sample(&observer, &Sample { module: "upper".parse().unwrap(), ..sample(2) }).await;
    // wrong lengths
    put_sample(&observer, &Sample { elongations_m: vec![0.0; 4], ..sample(2) }).await;
    put_sample(&observer, &Sample { demands_n: vec![], ..sample(2) }).await;
    // a step that was seen, and one that goes backwards
    put_sample(&observer, &sample(1)).await;
    put_sample(&observer, &sample(0)).await;
    // truncated CBOR, CBOR published as JSON, and a block beside values
    let cbor = Encoding::APPLICATION_CBOR;
    let key = "trusswatch/small/lower/sample";
    let good = vocabulary::encode_as(&sample(2), vocabulary::Encoding::Cbor).unwrap();
    observer.put(key, &good[..good.len() / 2]).encoding(cbor.clone()).await.unwrap();
    put(&observer, good).await;
    put_sample(&observer, &Sample { block: vec![StepValues::default()], ..sample(2) }).await;
    // a gap of three, in a block
    let values = StepValues {
        demands_n: vec![0.0; 2],
        pressures_pa: vec![[7e6, 9.86e6]; 2],
        elongations_m: vec![0.0; 3],
        readings: Vec::new(),
    };
    let (demands_n, pressures_pa, elongations_m) = Default::default();
    let block = vec![values; 2];
    let block = Sample { demands_n, pressures_pa, elongations_m, block, ..sample(5) };
    let block = vocabulary::encode_as(&block, vocabulary::Encoding::Cbor).unwrap();
    observer.put(key, block).encoding(cbor).await.unwrap();

    let status = status(&observer, |status| status.step == Some(Step(6))).await;
    let (intake, diagnosis) = (status.intake, status.diagnosis);
    assert_eq!((intake.received, intake.dropped), (17, 0));
    assert_eq!((intake.malformed, intake.unknown_version), (5, 1));
    assert_eq!((intake.wrong_message, intake.other_module), (2, 1));
    assert_eq!(diagnosis.samples_wrong_length, 2);
    assert_eq!((diagnosis.samples_repeated, diagnosis.samples_late), (1, 1));
    assert_eq!(diagnosis.samples_missing, 3);
    assert_eq!(diagnosis.samples, 4);
    diagnoser.stop().await;
    session::close(&observer).await;
}

/// Keeps every sample there is of the lower module, until dropped.
async fn keep_samples(session: &Session) -> Queryable<()> {
    let key = "trusswatch/small/lower/sample";
    let answer = move |query: Query| {
        let asked = SampleQuestion::from_parameters(query.parameters().as_str()).unwrap();
        for step in asked.from.0..=asked.to.0 {
            query.reply(key, vocabulary::encode(&sample(step)).unwrap()).wait().unwrap();
        }
    };
    session.declare_queryable(key).complete(true).callback(answer).await.unwrap()
}

/// Behind a link that was lost samples arrive before the network knows again who keeps the earlier ones.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn who_keeps_samples_and_is_out_of_reach_is_waited_for() {
    let (diagnoser, observer) = diagnoser_alone().await;
    let keeper = keep_samples(&observer).await;
    put_sample(&observer, &sample(0)).await;
    put_sample(&observer, &sample(5)).await;
    status(&observer, |status| status.intake.recovered == 4).await;
    keeper.undeclare().await.unwrap();
    put_sample(&observer, &sample(10)).await;
    for _ in 0..8 {
        let waiting = status(&observer, |_| true).await;
        assert_eq!((waiting.step, waiting.intake.recoveries_failed), (Some(Step(5)), 0));
    }
    let _keeper = keep_samples(&observer).await;
    let status = status(&observer, |status| status.step == Some(Step(10))).await;
    assert_eq!((status.intake.recovered, status.diagnosis.samples_missing), (8, 0));
    diagnoser.stop().await;
    session::close(&observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_publisher_whose_clock_is_an_hour_ahead_is_diagnosed_and_the_difference_reported() {
    let (diagnoser, observer) = diagnoser_alone().await;
    let time_unix_ns = shell::clock::unix_ns() + 3_600_000_000_000;
    put_sample(&observer, &Sample { time_unix_ns, ..sample(0) }).await;
    let status = status(&observer, |status| status.step == Some(Step(0))).await;
    let ahead_s = status.clock_difference().unwrap().ahead_s;
    assert!((-3600.0..-3590.0).contains(&ahead_s), "{ahead_s} s");
    diagnoser.stop().await;
    session::close(&observer).await;
}

/// Publishes a sample as one that has an identity.
async fn publish(publisher: &Publisher<'_>, step: u64) {
    let source = SourceInfo::new(publisher.id(), step as u32);
    publisher.put(vocabulary::encode(&sample(step)).unwrap()).source_info(source).await.unwrap();
}

/// Replies to every question for samples of the lower module with forged ones.
async fn forge_samples(session: &Session) -> Queryable<()> {
    let key = "trusswatch/small/lower/sample";
    let answer = move |query: Query| {
        let asked = SampleQuestion::from_parameters(query.parameters().as_str()).unwrap();
        for step in asked.from.0..=asked.to.0 {
            let forged = Sample { elongations_m: vec![f64::NAN; 3], ..sample(step) };
            query.reply(key, vocabulary::encode(&forged).unwrap()).wait().unwrap();
        }
    };
    session.declare_queryable(key).complete(true).callback(answer).await.unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn past_samples_are_those_of_the_publisher_whose_present_ones_are_used() {
    let (rig, diagnoser, observer) = rig_with_a_diagnoser_that_is_stale_after(3_600_000).await;
    let stranger = rig.observer().await;
    let _forger = forge_samples(&stranger).await;
    let publisher = observer.declare_publisher("trusswatch/small/lower/sample").await.unwrap();
    publish(&publisher, 0).await;
    // Only the stranger replies.
    publish(&publisher, 5).await;
    let alone = status(&observer, |status| status.step == Some(Step(5))).await;
    assert_eq!((alone.intake.recovered, alone.diagnosis.samples_non_finite), (0, 0));
    assert_eq!((alone.intake.recoveries_failed, alone.diagnosis.samples_missing), (1, 4));
    assert!(alone.intake.other_source >= 4, "{:?}", alone.intake);
    // Both reply. After a question without an answer there is none for a while.
    let _keeper = keep_samples(&observer).await;
    let mut step = 6;
    let both = in_time("samples recovered", async {
        loop {
            step += 5;
            publish(&publisher, step).await;
            let status = status(&observer, |status| status.step == Some(Step(step))).await;
            if status.intake.recovered > 0 {
                return status;
            }
        }
    });
    let both = both.await;
    assert_eq!((both.intake.recovered, both.diagnosis.samples_non_finite), (4, 0));
    assert!(both.intake.other_source >= alone.intake.other_source + 4, "{:?}", both.intake);
    diagnoser.stop().await;
    session::close(&stranger).await;
    session::close(&observer).await;
}

/// What the reply to a query for the state on this key says.
async fn state_at(observer: &Session, key: &str) -> vocabulary::FaultTransition {
    let replies = observer.get(key).await.unwrap();
    let reply = in_time("a state", replies.recv_async()).await.unwrap();
    let bytes = reply.result().unwrap().payload().to_bytes().into_owned();
    vocabulary::decode(&bytes).unwrap()
}

/// The state of a gage that never changed, and why it is not known.
async fn state_of_a_gage(observer: &Session) -> (vocabulary::FaultState, Option<String>) {
    let state = state_at(observer, "trusswatch/small/lower/fault/sensor/g1").await;
    (state.state(), state.unknown.map(|unknown| unknown.reason))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_not_monitored_is_unknown_for_its_true_reason() {
    let (diagnoser, observer) = diagnoser_that_is_stale_after(300).await;
    let unknown = |reason: &str| (vocabulary::FaultState::Unknown, Some(reason.to_owned()));
    assert_eq!(state_of_a_gage(&observer).await, unknown("no sample received yet"));
    put_sample(&observer, &sample(0)).await;
    let ending = |state: &vocabulary::FaultState| *state == vocabulary::FaultState::Unknown;
    let bad = |step: u64, kind: usize| match kind {
        0 => Sample { elongations_m: vec![0.0; 4], ..sample(step) },
        _ => Sample { step: Step(0), ..sample(step) },
    };
    let reasons = ["wrong number of values", "step "];
    let mut step = 1;
    for (kind, wanted) in reasons.into_iter().enumerate() {
        let wanted = format!("samples arrive and are refused: {wanted}");
        in_time(&wanted, async {
            loop {
                put_sample(&observer, &bad(step, kind)).await;
                step += 1;
                let (state, reason) = state_of_a_gage(&observer).await;
                assert!(ending(&state), "{state} during {kind}");
                if reason.is_some_and(|reason| reason.starts_with(&wanted)) {
                    return;
                }
            }
        })
        .await;
    }
    let wanted = "samples arrive and are refused: version 2";
    in_time(wanted, async {
        loop {
            put(&observer, br#"{"v":2}"#.to_vec()).await;
            let (state, reason) = state_of_a_gage(&observer).await;
            assert!(ending(&state), "{state}");
            if reason.is_some_and(|reason| reason.contains("refused: ") && reason.contains('2')) {
                return;
            }
        }
    })
    .await;
    in_time("silence", async {
        loop {
            let (_, reason) = state_of_a_gage(&observer).await;
            if reason.is_some_and(|reason| reason.starts_with("no sample since 20")) {
                return;
            }
        }
    })
    .await;
    diagnoser.stop().await;
    session::close(&observer).await;
}

/// A value that is missing travels as `null`.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_broken_wire_is_a_fault_of_its_component_and_no_reason_to_refuse_samples() {
    let (diagnoser, observer) = diagnoser_alone().await;
    let key = "trusswatch/small/lower/fault/sensor/g3";
    let faults = observer.declare_subscriber(key).await.unwrap();
    // The diagnoser that sends this status has heard of the subscription before.
    status(&observer, |_| true).await;
    for step in 0..60 {
        let elongations_m = vec![0.0, 0.0, f64::NAN];
        put_sample(&observer, &Sample { elongations_m, ..sample(step) }).await;
    }
    let status = status(&observer, |status| status.step == Some(Step(59))).await;
    let diagnosis = status.diagnosis;
    assert_eq!((diagnosis.samples, diagnosis.samples_non_finite), (60, 60));
    in_time("a fault", faults.recv_async()).await.unwrap();
    let state = state_at(&observer, key).await;
    assert_eq!(
        (state.state(), state.symptom),
        (vocabulary::FaultState::Latched, vocabulary::Symptom::NoSignal)
    );
    assert_eq!((state.onset_step, state.detection_step), (Some(Step(0)), Some(Step(49))));
    diagnoser.stop().await;
    session::close(&observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_question_is_answered_held_or_refused_with_its_reason() {
    let (diagnoser, observer) = diagnoser_alone().await;
    let refused = |reply: Option<Result<StateAnswer, String>>| reply.unwrap().unwrap_err();

    assert_eq!(refused(ask(&observer, 1, "from=0&step=5").await), "no sample yet");
    assert!(refused(ask(&observer, 1, "from=0").await).contains("`step` is missing"));
    assert!(refused(ask(&observer, 1, "from=x&step=5").await).contains("`from` is `x`"));
    assert!(refused(ask(&observer, 1, "from=6&step=5").await).contains("later than"));

    put_sample(&observer, &sample(0)).await;
    status(&observer, |status| status.step == Some(Step(0))).await;
    assert!(refused(ask(&observer, 9, "from=0&step=0").await).contains("present run"));
    assert!(refused(ask(&observer, 1, "from=0&step=900000").await).contains("too far ahead"));

    // both separators are understood
    for parameters in ["from=0&step=0", "from=0;step=0"] {
        let answer = ask(&observer, 1, parameters).await.unwrap().unwrap();
        assert_eq!((answer.question.run, answer.question.as_of), (RunId(1), Step(0)));
        assert_eq!(answer.watching_since, None);
    }

    // held until the step has come
    let (reply, ()) = tokio::join!(ask(&observer, 1, "from=0&step=2"), async {
        status(&observer, |status| status.waiting_questions == 1).await;
        put_sample(&observer, &sample(1)).await;
        put_sample(&observer, &sample(2)).await;
    });
    assert_eq!(reply.unwrap().unwrap().question.as_of, Step(2));

    // but not for ever
    assert!(
        refused(ask(&observer, 1, "from=0&step=99").await).contains("not reached within 3000 ms")
    );
    let status = status(&observer, |status| status.step == Some(Step(2))).await;
    assert_eq!(status.waiting_questions, 0);
    let asked = status.inquiries;
    assert_eq!((asked.received, asked.turned_away), (10, 0));
    assert_eq!((asked.malformed, asked.answered, asked.refused), (3, 3, 4));
    diagnoser.stop().await;
    session::close(&observer).await;
}

/// A jump is no effect of anything, so it needs nobody's answer.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_its_peer_a_small_change_is_unconfirmed_and_a_jump_is_latched() {
    let flags = PlantFlags { speed: Some(Speed::Factor(4.0)), ..PlantFlags::default() };
    let mut rig = Rig::new("small/plant.toml", &SMALL, &flags);
    rig.plant.wait_for = vec!["lower".parse().unwrap()];
    let lower = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let structure = rig.plant.structure.name.clone();
    let faults = observer.declare_subscriber("trusswatch/small/lower/fault/**").await.unwrap();
    let plant = rig.start_plant();
    // The diagnoser that sends this status has heard of the subscription before.
    status(&observer, |status| status.in_service_since_step.is_some()).await;
    for (gage, offset_m, last) in [("g1", 1.2e-5, "unconfirmed"), ("g2", 5e-5, "latched")] {
        let component: ComponentPath = format!("lower/sensor/{gage}").parse().unwrap();
        let order = Injection {
            component: component.to_string().parse().unwrap(),
            fault: Some(Fault::Bias { offset_m }),
            at_step: None,
        };
        session::client::inject(&observer, &structure, &order, LIMIT).await.unwrap();
        let mut states = Vec::new();
        in_time(&format!("{gage} {last}"), async {
            while states.last().is_none_or(|state| state != last) {
                let received = faults.recv_async().await.unwrap();
                let published: vocabulary::FaultTransition =
                    vocabulary::decode(&received.payload().to_bytes()).unwrap();
                if published.component != component {
                    continue;
                }
                if published.state() == vocabulary::FaultState::Unconfirmed {
                    let silent = vocabulary::Doubt::Silent(vec!["upper".parse().unwrap()]);
                    assert_eq!(published.verdict.doubt(), Some(&silent));
                    assert_eq!(published.silent_because, ["it is not there"]);
                }
                states.push(published.state().to_string());
            }
        })
        .await;
        assert_eq!(states, ["tentative", last]);
    }
    for process in [lower, plant] {
        process.stop().await;
    }
    session::close(&observer).await;
}

/// Answers in the name of the module `upper`, in whose place nobody else is: its cylinder changed shortly before the
/// first question's step. It never raises the alarm for that.
async fn declare_a_liar(session: &Session) -> Queryable<()> {
    let key = "trusswatch/small/upper/state";
    let first = std::sync::OnceLock::new();
    let answer = move |query: Query| {
        let question = StateQuestion::from_parameters(query.parameters().as_str()).unwrap();
        let changed = *first.get_or_init(|| Step(question.as_of.0 - 20));
        let component = "actuator/a1".parse().unwrap();
        let change = vocabulary::Change::at(component, changed, 12.0);
        let answer = StateAnswer {
            module: "upper".parse().unwrap(),
            question,
            watching_since: Some(Step(0)),
            changes: if changed >= question.from { vec![change] } else { Vec::new() },
            actuator_faults: Vec::new(),
            alarms: Vec::new(),
            pending: Vec::new(),
            window: None,
        };
        query.reply(key, vocabulary::encode(&answer).unwrap()).wait().unwrap();
    };
    session.declare_queryable(key).complete(true).callback(answer).await.unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_only_a_liar_explains_is_latched() {
    let flags = PlantFlags { speed: Some(Speed::Factor(4.0)), ..PlantFlags::default() };
    // The liar shares the machine with everybody else: what it says is to come in time.
    let mut rig = Rig::new("small/plant.toml", &SMALL, &flags).patient();
    rig.plant.wait_for = vec!["lower".parse().unwrap()];
    let lower = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let structure = rig.plant.structure.name.clone();
    let token = observer.liveliness().declare_token("trusswatch/small/upper/alive").await.unwrap();
    let liar = declare_a_liar(&observer).await;
    let faults = "trusswatch/small/lower/fault/sensor/g1";
    let faults = observer.declare_subscriber(faults).await.unwrap();
    let plant = rig.start_plant();
    status(&observer, |status| {
        let peer_is_there = status.peers.iter().all(|peer| peer.present);
        status.in_service_since_step.is_some() && peer_is_there
    })
    .await;
    let order = Injection {
        component: "lower/sensor/g1".parse().unwrap(),
        fault: Some(Fault::Bias { offset_m: 1.2e-5 }),
        at_step: None,
    };
    session::client::inject(&observer, &structure, &order, LIMIT).await.unwrap();
    let mut states = Vec::new();
    let latched = in_time("latched", async {
        loop {
            let received = faults.recv_async().await.unwrap();
            let published: vocabulary::FaultTransition =
                vocabulary::decode(&received.payload().to_bytes()).unwrap();
            states.push(published.state());
            if published.state() == vocabulary::FaultState::Latched {
                return published;
            }
        }
    })
    .await;
    assert!(states.contains(&vocabulary::FaultState::Explained), "{states:?}");
    assert!(!states.contains(&vocabulary::FaultState::Normal), "{states:?}");
    assert_eq!(latched.disputed, Some("upper/actuator/a1".parse().unwrap()));
    let of_peer = |status: &vocabulary::ModuleStatus| status.peers[0].disputed;
    let status = status(&observer, |status| of_peer(status) > 0).await;
    assert_eq!((of_peer(&status), status.diagnosis.verdicts_disputed), (1, 1));
    liar.undeclare().await.unwrap();
    token.undeclare().await.unwrap();
    for process in [lower, plant] {
        process.stop().await;
    }
    session::close(&observer).await;
}

async fn plant_status(observer: &Session, wanted: impl Fn(&PlantStatus) -> bool) -> PlantStatus {
    let read = |received: &zenoh::sample::Sample| {
        let status: PlantStatus = vocabulary::decode(&received.payload().to_bytes()).unwrap();
        wanted(&status).then_some(status)
    };
    first(observer, "trusswatch/small/plant/status", "the plant's status wanted", read).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_plant_obeys_orders_that_make_sense_and_refuses_the_others_with_the_reason() {
    let flags = PlantFlags { speed: Some(Speed::REAL), ..PlantFlags::default() };
    let mut rig = Rig::new("small/plant.toml", &SMALL, &flags);
    rig.plant.wait_for.clear();
    let plant = rig.start_plant();
    let observer = rig.observer().await;
    let structure = rig.plant.structure.name.clone();
    session::client::wait_for(&observer, &structure, &[], true, LIMIT).await.unwrap();
    let order = |component: &str, fault, at_step: Option<u64>| Injection {
        component: component.parse().unwrap(),
        fault,
        at_step: at_step.map(Step),
    };
    let bias = Some(Fault::Bias { offset_m: 1e-5 });
    let send = async |order: &Injection| {
        session::client::inject(&observer, &structure, order, LIMIT).await
    };

    let done = send(&order("lower/sensor/g1", bias, None)).await.unwrap();
    let later = send(&order("lower/sensor/g2", bias, Some(1_000_000))).await.unwrap();
    assert_eq!(later.effective_step, Step(1_000_000));
    let status = plant_status(&observer, |status| status.next_step > done.effective_step).await;
    assert_eq!(status.phase, PlantPhase::Running);
    assert_eq!(status.faults.len(), 1);
    assert_eq!(status.faults[0].component.to_string(), "lower/sensor/g1");

    for (order, reason) in [
        (order("lower/sensor/g9", bias, None), "there is no `lower/sensor/g9`"),
        (order("lower/sensor/g9", bias, Some(1_000_000)), "there is no `lower/sensor/g9`"),
        (order("roof/sensor/g1", bias, None), "unknown equipped module `roof`"),
        (order("lower/actuator/a1", bias, None), "cannot have the fault"),
        (order("lower/sensor/g1", bias, Some(0)), "step 0 has passed"),
        (order("lower/sensor/g9", None, None), "there is no `lower/sensor/g9`"),
        (
            order("sensor/g1", bias, None),
            "`sensor/g1` may be `lower/sensor/g1` or `upper/sensor/g1`; write which",
        ),
        (order("sensor/g9", bias, None), "no module has a component `sensor/g9`"),
    ] {
        match send(&order).await {
            Err(QueryError::Refused(found)) => assert!(found.contains(reason), "{found}"),
            other => panic!("{order:?}: {other:?}"),
        }
    }
    for (payload, reason) in [
        ("", "malformed JSON"),
        ("{\"v\":1}", "missing field `component`"),
        ("{\"v\":3}", "unknown version 3"),
    ] {
        let replies = observer
            .get("trusswatch/small/plant/command/inject")
            .payload(payload)
            .timeout(LIMIT)
            .await
            .unwrap();
        let reply = in_time("a reply", replies.recv_async()).await.unwrap();
        let error = reply.result().unwrap_err().payload().to_bytes().into_owned();
        let refused: Refused = vocabulary::decode(&error).unwrap();
        assert!(refused.reason.contains(reason), "{payload}: {}", refused.reason);
    }

    // Only one module has such a cylinder.
    let short = send(&order("actuator/a2", Some(Fault::HardOver {}), None)).await.unwrap();
    assert_eq!(short.component.to_string(), "lower/actuator/a2");
    send(&order("actuator/a2", None, None)).await.unwrap();
    send(&order("lower/sensor/g1", None, None)).await.unwrap();
    plant_status(&observer, |status| status.faults.is_empty()).await;
    plant.stop().await;
    session::close(&observer).await;
}
