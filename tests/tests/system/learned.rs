//! A module without a structural model, from tables to a latched fault: learnt by one program, diagnosed by another from
//! what a client publishes, recorded, and replayed bit for bit.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use session::Network;
use system_tests::binaries::program;
use system_tests::in_time;
use system_tests::observer::unix_ns;
use system_tests::operate::ended;
use system_tests::process::Process;
use system_tests::recorder::Recorder;
use system_tests::turn;
use vocabulary::fault::FaultKind;
use vocabulary::{FaultState, FaultTransition, Identification, RunId, Sample, Step, Symptom};
use zenoh::qos::CongestionControl;

/// Readings a second, and how many.
const RATE_HZ: f64 = 5.0;
const SAMPLES: usize = 1500;
const ONSET: usize = 1000;
const SENSORS: usize = 4;
const GLANCE: Duration = Duration::from_millis(50);

/// Deterministic noise between -0.5 and 0.5.
fn noise(seed: u64, sample: usize, channel: usize) -> f64 {
    let mut bits = seed ^ (sample as u64) << 20 ^ (channel as u64) << 50;
    for _ in 0..3 {
        bits = (bits ^ bits >> 31).wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(seed);
    }
    (bits >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

/// What sensors and, last, the load read at a sample.
fn readings(seed: u64, sample: usize) -> Vec<f64> {
    let phase = seed as f64 + sample as f64 / (40.0 * RATE_HZ);
    let load = 50.0 + 40.0 * (TAU * phase).sin();
    let sensor = |k: usize| (1.0 + 0.3 * k as f64) * load + noise(seed, sample, k);
    (0..SENSORS).map(sensor).chain([load + 0.2 * noise(seed, sample, SENSORS)]).collect()
}

fn table(seed: u64) -> String {
    let mut table = "time,s1,s2,s3,s4,load\n".to_owned();
    for sample in 0..4 * SAMPLES {
        write!(table, "{:.1}", sample as f64 / RATE_HZ).unwrap();
        readings(seed, sample).iter().for_each(|value| write!(table, ",{value:.5}").unwrap());
        table.push('\n');
    }
    table
}

async fn learn(folder: &Path) {
    let mut command = program("trusswatch");
    command.arg("learn");
    for seed in 1..=4 {
        let file = folder.join(format!("healthy{seed}.csv"));
        std::fs::write(&file, table(seed)).unwrap();
        command.arg(file);
    }
    command.args(["--inputs", "load", "--sensors", "s1,s2,s3,s4", "--out"]);
    command.arg(folder.join("bridge.learned.toml"));
    let learnt = ended(command).await;
    assert_eq!(learnt.code, Some(0), "{learnt:?}");
}

fn start_diagnoser(folder: &Path, endpoint: &str) -> Process {
    let file = folder.join("bridge.toml");
    let text = format!(
        "module = \"span\"\nstructure_name = \"bridge\"\nlearned = \"bridge.learned.toml\"\n\
         step_s = {}\n[state]\ndirectory = \"state\"\n[network]\nlisten = [\"{endpoint}\"]\n",
        1.0 / RATE_HZ
    );
    std::fs::write(&file, text).unwrap();
    let mut command = program("trusswatch-diagnoser");
    command.arg("run").arg(file);
    Process::start(command, folder, "diagnoser")
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_learned_module_latches_what_it_is_sent_and_replays_as_it_was() {
    let _turn = turn::side_by_side().await;
    let folder = system_tests::folder::temporary();
    learn(folder.path()).await;
    let [endpoint, own] = session::loopback::endpoints().unwrap();
    let diagnoser = start_diagnoser(folder.path(), &endpoint);
    let network = Network {
        listen: vec![own.clone()],
        connect: vec![endpoint.clone()],
        ..Network::default()
    };
    let client = in_time("a session", session::open(&network)).await.unwrap();
    // Samples come from the client, all else from the diagnoser.
    let mut recorder = Recorder::start_of("bridge", &[endpoint.clone(), own], folder.path());
    recorder.hears(&["span"]).await;
    // The recorder subscribes to other modules' samples too; the diagnoser's token follows its subscription.
    let of_recorder = client.declare_publisher("trusswatch/bridge/other/sample").await.unwrap();
    let linked = async {
        while !of_recorder.matching_status().await.unwrap().matching() {
            tokio::time::sleep(GLANCE).await;
        }
        let token = "trusswatch/bridge/span/alive";
        while client.liveliness().get(token).await.unwrap().recv_async().await.is_err() {
            tokio::time::sleep(GLANCE).await;
        }
    };
    in_time("the links to diagnoser and recorder", linked).await;
    let faults = client.declare_subscriber("trusswatch/bridge/span/fault/**").await.unwrap();
    let identifications = "trusswatch/bridge/span/identification/**";
    let identifications = client.declare_subscriber(identifications).await.unwrap();
    let publisher = client.declare_publisher("trusswatch/bridge/span/sample");
    let publisher = publisher.congestion_control(CongestionControl::Block).await.unwrap();
    for sample in 0..SAMPLES {
        let mut readings = readings(9, sample);
        readings[2] += if sample < ONSET { 0.0 } else { 15.0 };
        let message = Sample {
            module: "span".parse().unwrap(),
            run: RunId(1),
            step: Step(sample as u64),
            time_unix_ns: unix_ns(),
            demands_n: vec![],
            pressures_pa: vec![],
            elongations_m: vec![],
            readings,
            block: Vec::new(),
        };
        publisher.put(vocabulary::encode(&message).unwrap()).await.unwrap();
    }
    let fault = in_time("a fault", faults.recv_async()).await.unwrap();
    let fault: FaultTransition = vocabulary::decode(&fault.payload().to_bytes()).unwrap();
    assert_eq!(fault.component.to_string(), "span/sensor/s3");
    assert_eq!((fault.state(), fault.symptom), (FaultState::Latched, Symptom::Reading));
    let step = fault.detection_step.unwrap().0 as usize;
    assert!((ONSET..ONSET + 20).contains(&step), "{fault:?}");
    let mut command = program("trusswatch");
    command.args(["faults", "--mode", "peer", "--timeout", "30", "--connect", &endpoint]);
    let told = ended(command).await;
    assert!(told.out.contains("s3") && told.out.contains("too large by"), "{told:?}");
    let identified = async {
        loop {
            let found = identifications.recv_async().await.unwrap();
            let found: Identification = vocabulary::decode(&found.payload().to_bytes()).unwrap();
            if found.decided {
                return found;
            }
        }
    };
    let found = in_time("an identification", identified).await;
    assert_eq!((found.component, found.sequence), (fault.component, fault.sequence));
    let decided = found.candidates[0];
    let size = decided.size.unwrap();
    assert!(decided.kind == FaultKind::Bias.into() && size.own_unit, "{decided:?}");
    assert!(size.low < 15.0 && 15.0 < size.high, "{decided:?}");
    let mut command = program("trusswatch");
    command.args(["fault", "show", "span/sensor/s3", "--mode", "peer", "--timeout", "30"]);
    command.args(["--connect", &endpoint]);
    let told = ended(command).await;
    assert!(told.out.contains("bias") && !told.out.contains("µm"), "{told:?}");
    diagnoser.stop().await;
    recorder.end().await;
    let replayed = recorder.replay(&["--verify", "--json"]).await;
    assert_eq!(replayed.code, Some(0), "{replayed:?}");
    let process = &replayed.json()["modules"][0]["processes"][0];
    assert_eq!(
        (process["samples"].as_u64(), process["verdicts_same"].as_u64()),
        (Some(1500), Some(1))
    );
    assert!(process["identifications_same"].as_u64() >= Some(1), "{process}");
}
