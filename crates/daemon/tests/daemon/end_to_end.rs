//! Plant and diagnosers over the network come to the verdicts of one process.
//!

//! Authority: `diagnosis` and `plant` in one process, without any network.

use std::collections::BTreeMap;

use crate::support::{
    LIMIT, Process, Reference, Rig, Story, first, in_time, note, status, story_of_reference,
};
use daemon::config::{PlantFlags, ScheduledFault, Speed};
use daemon::player::{Playback, Programme};
use observer::News;
use session::client::Live;
use vocabulary::{Encoding, FaultTransition, RunId, Sample, Step, fault::Fault, keys::Watched};
use zenoh::Session;
use zenoh::query::ConsolidationMode;

const RUN: RunId = RunId(42);
const TOWER: [&str; 2] = ["module1.toml", "module2.toml"];
const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];

fn fault(at_step: u64, until_step: Option<u64>, component: &str, fault: Fault) -> ScheduledFault {
    let component = component.parse().unwrap();
    ScheduledFault { at_step: Step(at_step), until_step: until_step.map(Step), component, fault }
}

/// A sensor's and an actuator's fault, more than a horizon apart.
fn rig(plant: &str, modules: &[&str], components: [&str; 2], flags: PlantFlags) -> Rig {
    let flags = PlantFlags { run_id: Some(RUN), ..flags };
    // The transitions are those of one process only as long as every answer is waited for.
    let mut rig = Rig::new(plant, modules, &flags).patient();
    rig.plant.schedule.faults = vec![
        fault(3000, Some(3500), components[0], Fault::Bias { offset_m: 5e-5 }),
        fault(6800, None, components[1], Fault::InternalLeakage { area_m2: 5e-8 }),
    ];
    rig
}

fn expected(rig: &Rig, steps: u64) -> Story {
    expected_and_samples(rig, steps).0
}

fn expected_and_samples(rig: &Rig, steps: u64) -> (Story, Vec<vocabulary::Sample>) {
    let mut reference = Reference::new(rig);
    reference.run(RUN, steps);
    let story = story_of_reference(&reference);
    let mut latched: Vec<&str> = story
        .values()
        .filter(|transition| transition.state == "latched")
        .map(|transition| transition.component.as_str())
        .collect();
    latched.sort_unstable();
    let mut faulty: Vec<String> =
        rig.plant.schedule.faults.iter().map(|fault| fault.component.to_string()).collect();
    faulty.sort_unstable();
    assert_eq!(latched, faulty, "{story:#?}");
    (story, reference.samples)
}

/// Listens until every expected transition has arrived.
async fn until_as_expected(faults: &mut Live, expected: &Story) {
    let mut story = Story::new();
    let as_expected = async {
        while story != *expected {
            match &faults.next_event().await.unwrap().news {
                News::Fault(transition) | News::Present(transition) => {
                    note(&mut story, transition);
                }
                news @ (News::Missed { .. } | News::Lost { .. }) => unreachable!("{news:?}"),
                _ => {}
            }
        }
    };
    let in_time = tokio::time::timeout(LIMIT, as_expected).await;
    assert!(in_time.is_ok(), "expected {expected:#?}\nfound {story:#?}");
}

/// Reads the journals until they have every expected transition.
async fn until_journals_are_as_expected(observer: &Session, rig: &Rig, expected: &Story) {
    let structure = &rig.plant.structure.name;
    let mut story = Story::new();
    let as_expected = async {
        while story != *expected {
            for module in rig.modules() {
                let journal =
                    session::client::history(observer, structure, &module, 1, LIMIT).await;
                journal.transitions.iter().for_each(|transition| note(&mut story, transition));
            }
        }
    };
    let in_time = tokio::time::timeout(LIMIT, as_expected).await;
    assert!(in_time.is_ok(), "expected {expected:#?}\nfound {story:#?}");
}

async fn listen(observer: &Session, rig: &Rig) -> Live {
    let (structure, modules) = (&rig.plant.structure.name, rig.modules());
    let everybody = session::client::wait_for(observer, structure, &modules, false, LIMIT);
    everybody.await.unwrap();
    Live::events(observer, None).await.unwrap()
}

/// Queries every module for the present states.
async fn present_states(observer: &Session) -> BTreeMap<String, FaultTransition> {
    let replies = observer
        .get(Watched::default().faults())
        .consolidation(ConsolidationMode::None)
        .timeout(LIMIT)
        .await
        .unwrap();
    let mut states = BTreeMap::new();
    while let Ok(reply) = in_time("a reply", replies.recv_async()).await {
        let bytes = reply.result().unwrap().payload().to_bytes();
        let state: FaultTransition = vocabulary::decode(&bytes).unwrap();
        states.insert(state.component.to_string(), state);
    }
    states
}

async fn stop(diagnosers: Vec<Process>, observer: Session) {
    for diagnoser in diagnosers {
        diagnoser.stop().await;
    }
    session::close(&observer).await;
}

fn at_speed(speed: Speed, steps: u64) -> PlantFlags {
    PlantFlags { speed: Some(speed), steps: Some(steps), ..PlantFlags::default() }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn at_full_speed_with_the_plant_last_the_verdicts_are_those_of_one_process() {
    let components = ["module2/sensor/g3", "module1/actuator/a2"];
    let rig = rig("plant.toml", &TOWER, components, at_speed(Speed::Max, 9000));
    let expected = expected(&rig, 9000);
    let diagnosers = vec![rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let mut faults = listen(&observer, &rig).await;
    rig.start_plant().end().await;
    until_as_expected(&mut faults, &expected).await;
    for module in rig.modules() {
        let status = status(&observer, |status| status.module == module).await;
        assert_eq!(status.diagnosis.samples, 9000);
        assert_eq!(status.diagnosis.samples_missing, 0);
        assert_eq!(status.intake.dropped, 0);
        assert_eq!(status.publisher.events_lost, 0);
        assert!(status.in_service_since_step.is_some(), "{:?}", status.phase);
    }
    let states = present_states(&observer).await;
    assert_eq!(states.len(), 24, "each component has a state");
    for transition in expected.values() {
        let latest =
            expected.values().rfind(|other| other.component == transition.component).unwrap();
        assert_eq!(states[&transition.component].state().to_string(), latest.state);
    }
    stop(diagnosers, observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn at_full_speed_with_the_plant_first_the_verdicts_are_those_of_one_process() {
    let components = ["lower/sensor/g1", "upper/actuator/a1"];
    let mut rig = rig("small/plant.toml", &SMALL, components, at_speed(Speed::Max, 9000));
    // The first transitions may be there before anybody listens.
    let state = tempfile::tempdir().unwrap();
    for diagnoser in &mut rig.diagnosers {
        diagnoser.state.directory = Some(state.path().join(diagnoser.module().as_str()));
    }
    let expected = expected(&rig, 9000);
    let plant = rig.start_plant();
    let observer = rig.observer().await;
    let structure = &rig.plant.structure.name;
    let plant_is_there = session::client::wait_for(&observer, structure, &[], true, LIMIT);
    plant_is_there.await.unwrap();
    let diagnosers = vec![rig.start_diagnoser(1), rig.start_diagnoser(0)];
    plant.end().await;
    until_journals_are_as_expected(&observer, &rig, &expected).await;
    for module in rig.modules() {
        let status = status(&observer, |status| status.module == module).await;
        assert_eq!((status.diagnosis.samples, status.diagnosis.samples_missing), (9000, 0));
    }
    stop(diagnosers, observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn by_the_clock_the_verdicts_are_those_of_one_process() {
    let components = ["lower/sensor/g1", "upper/actuator/a1"];
    let rig = rig("small/plant.toml", &SMALL, components, at_speed(Speed::Factor(2.0), 8400));
    let expected = expected(&rig, 8400);
    let diagnosers = vec![rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let mut faults = listen(&observer, &rig).await;
    rig.start_plant().end().await;
    until_as_expected(&mut faults, &expected).await;
    stop(diagnosers, observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn in_blocks_of_cbor_some_of_them_fetched_the_verdicts_are_those_of_one_process() {
    let components = ["lower/sensor/g1", "upper/actuator/a1"];
    let flags = PlantFlags { no_wait: true, ..at_speed(Speed::Factor(1.0), 8400) };
    let mut rig = rig("small/plant.toml", &SMALL, components, flags);
    let expected = expected(&rig, 8400);
    (rig.plant.burst_steps, rig.plant.blocks, rig.plant.encoding) = (7, true, Encoding::Cbor);
    let plant = rig.start_plant();
    let observer = rig.observer().await;
    let running = |sample: &zenoh::sample::Sample| {
        let (bytes, named) = (sample.payload().to_bytes(), sample.encoding().to_string());
        let samples: Vec<Sample> = Sample::read(&bytes, Encoding::Cbor).unwrap().collect();
        (samples[0].step.0 > 100).then_some((samples.len(), bytes.len(), named))
    };
    let key = "trusswatch/small/upper/sample";
    let (steps, bytes, named) = first(&observer, key, "a block", running).await;
    assert_eq!((steps, named.as_str()), (7, "application/cbor"));
    assert!(bytes < 7 * 250, "{bytes} bytes");
    // They ask for the steps before.
    let diagnosers = vec![rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let mut faults = listen(&observer, &rig).await;
    plant.end().await;
    until_as_expected(&mut faults, &expected).await;
    for module in rig.modules() {
        let status = status(&observer, |status| status.module == module).await;
        assert_eq!((status.diagnosis.samples, status.diagnosis.samples_missing), (8400, 0));
        assert!(status.intake.recovered >= 100, "{:?}", status.intake);
    }
    stop(diagnosers, observer).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn recorded_samples_in_the_plants_place_lead_to_the_verdicts_that_they_led_to() {
    let components = ["lower/sensor/g1", "upper/actuator/a1"];
    let rig = rig("small/plant.toml", &SMALL, components, PlantFlags::default());
    let (expected, samples) = expected_and_samples(&rig, 8400);
    let diagnosers = vec![rig.start_diagnoser(0), rig.start_diagnoser(1)];
    let observer = rig.observer().await;
    let mut faults = listen(&observer, &rig).await;
    let programme = Programme::new(rig.plant.structure.name.clone(), 1e-3, samples);
    // As another run than the recorded one.
    let playback = Playback { speed: Speed::Max, run: RunId(43), wait_for: rig.modules() };
    let (_trigger, shutdown) = shell::shutdown::pair();
    let playing = daemon::player::run(&rig.plant.network, programme, playback, shutdown);
    let published = in_time("the end of the recording", playing).await.unwrap();
    assert_eq!(published, 2 * 8400);
    until_as_expected(&mut faults, &expected).await;
    stop(diagnosers, observer).await;
}
