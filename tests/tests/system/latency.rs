//! From the publication of the sample that decides a verdict to the arrival of the fault message at a
//! third party, in real time by single samples at 1 kHz, beside a plain Zenoh round trip of the same payload.

use std::time::{Duration, Instant};

use daemon::config::{Schedule, ScheduledFault};
use session::Network;
use system_tests::deployment::{Deployment, free_endpoint};
use system_tests::in_time;
use system_tests::observer::{Faults, Observer};
use system_tests::publications::Publications;
use system_tests::quantiles::quantiles;
use system_tests::turn;
use vocabulary::{FaultState, RunId, Step, fault::Fault};

const STEPS: u64 = 40_000;
/// A fault in one of these gages and its repair are changes of their own, each decided by a sample.
const GAGES: [&str; 12] = [
    "module1/sensor/g1",
    "module2/sensor/g1",
    "module1/sensor/g2",
    "module2/sensor/g2",
    "module1/sensor/g3",
    "module2/sensor/g3",
    "module1/sensor/g4",
    "module2/sensor/g4",
    "module1/sensor/g5",
    "module2/sensor/g5",
    "module1/sensor/g6",
    "module2/sensor/g6",
];

fn schedule() -> Schedule {
    let faults = GAGES.iter().enumerate().map(|(place, component)| ScheduledFault {
        at_step: Step(3200 + 3000 * place as u64),
        until_step: None,
        component: component.parse().unwrap(),
        fault: Fault::Bias { offset_m: 4e-4 },
    });
    Schedule { faults: faults.collect() }
}

/// Round trips of a payload of this size between two sessions over loopback \[ms\].
async fn round_trips(size: usize, count: usize) -> Vec<f64> {
    let endpoint = free_endpoint();
    let near = Network { listen: vec![endpoint.clone()], ..Network::default() };
    let near = session::open(&near).await.unwrap();
    let far = session::open(&Network::peer_of(&[endpoint])).await.unwrap();
    let echo = far.clone();
    let _echo = far
        .declare_subscriber("ping")
        .callback(move |sample| {
            let (echo, payload) = (echo.clone(), sample.payload().clone());
            tokio::spawn(async move { echo.put("pong", payload).await.unwrap() });
        })
        .await
        .unwrap();
    let (sender, mut pongs) = tokio::sync::mpsc::unbounded_channel();
    let _pong = near
        .declare_subscriber("pong")
        .callback(move |_| {
            let _ = sender.send(Instant::now());
        })
        .await
        .unwrap();
    let payload = vec![b'x'; size];
    let mut trips = Vec::new();
    while trips.len() < count {
        let start = Instant::now();
        near.put("ping", payload.clone()).await.unwrap();
        // The first pings may go before the links are declared.
        if let Ok(Some(end)) = tokio::time::timeout(Duration::from_millis(200), pongs.recv()).await
        {
            trips.push((end - start).as_secs_f64() * 1e3);
        }
    }
    trips
}

/// Milliseconds of every verdict from the deciding sample to the decision, which waits for peers' answers, and to the
/// message's arrival; and a message's size.
async fn delays(faults: &mut Faults, publications: &Publications) -> ([Vec<f64>; 2], usize) {
    let mut arrivals = Vec::new();
    while arrivals.len() < GAGES.len() {
        let (arrival, message) = faults.next().await;
        if message.state() == FaultState::Latched {
            arrivals.push((arrival, message));
        }
    }
    let size = arrivals.last().map_or(0, |(_, message)| vocabulary::encode(message).unwrap().len());
    let decisions: Vec<_> =
        arrivals.iter().map(|(_, message)| (message.time_unix_ns, message.clone())).collect();
    let [decided, arrived] =
        [publications.delays_ms(&decisions).await, publications.delays_ms(&arrivals).await];
    ([decided, arrived], size)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "measures time: wants both cores for itself"]
async fn in_real_time_no_sample_is_dropped_and_the_message_follows_the_deciding_sample() {
    let _turn = turn::alone().await;
    let deployment = Deployment::of_tower(&schedule());
    deployment.reconfigure_plant(|plant| {
        plant.insert("burst_steps".into(), 1.into());
    });
    let diagnosers = deployment.start_diagnosers();
    let observer = Observer::of(&deployment).await;
    observer.wait_for(&["module1", "module2"], false).await;
    let publications = Publications::of(&observer).await;
    let mut faults = observer.faults().await;
    let mut plant = deployment.start_plant("real", STEPS, 7, RunId(7));
    let ([decided, arrived], size) = delays(&mut faults, &publications).await;
    let pings = round_trips(size, 500).await;
    assert_eq!(plant.exit_code().await, Some(0), "{}", plant.log());
    for module in ["module1", "module2"] {
        let status = observer
            .status(|s| s.module.as_str() == module && s.step == Some(Step(STEPS - 1)))
            .await;
        assert_eq!(status.intake.dropped, 0, "{module}");
        assert_eq!(status.diagnosis.samples_missing, 0, "{module}");
        assert_eq!(status.diagnosis.samples, STEPS, "{module}");
    }
    let [decided_p50, decided_p99] = quantiles(decided, [0.5, 0.99]);
    let [p50, p99] = quantiles(arrived, [0.5, 0.99]);
    let [ping_p50, ping_p99] = quantiles(pings, [0.5, 0.99]);
    println!("from the deciding sample to the fault message, {} verdicts:", GAGES.len());
    println!("  p50 {p50:.2} ms, p99 {p99:.2} ms");
    println!(
        "  of it to the decision, with the peer's answer: {decided_p50:.2} and {decided_p99:.2} ms"
    );
    println!("a plain round trip of the same {size} bytes, 500 times:");
    println!("  p50 {ping_p50:.2} ms, p99 {ping_p99:.2} ms");
    assert!(p50 < 25.0, "two hops and a question take less than {p50} ms");
    for process in diagnosers {
        in_time("the end", process.stop()).await;
    }
}
