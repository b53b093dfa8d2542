//! The recorder is killed two hundred times at random moments while two modules publish a sample a millisecond: every
//! file opens, with the reader of PyPI as well, nothing in it is wrong, and at most a second is missing at its end.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use recording::Recording;
use session::Network;
use system_tests::binaries::program;
use system_tests::deployment::free_endpoint;
use system_tests::{folder, turn};

/// Kills, unless the environment variable `TRUSSWATCH_KILLS` says otherwise, by so many recorders at once.
const KILLS: usize = 200;
const AT_ONCE: usize = 4;
const SEED: u64 = 17;
const MODULES: [&str; 2] = ["module1", "module2"];
/// When a recorder is killed, counted from its start \[ms\].
const AFTER_MS: std::ops::Range<u64> = 200..2500;
/// Most samples of a module that may be missing at the end, a second's.
const MOST_MISSING: u64 = 1000;

fn sample(module: &str, step: u64) -> String {
    let values: Vec<f64> = (0..20).map(|i| ((step * 31 + i * 17) as f64).sin() * 1e-4).collect();
    format!(
        r#"{{"v":1,"module":"{module}","run":1,"step":{step},"time_unix_ns":{step},"demands_n":[],"pressures_pa":[],"elongations_m":{values:?}}}"#
    )
}

/// Publishes a sample of each module a millisecond.
async fn publish(session: zenoh::Session, step: Arc<AtomicU64>, is_over: Arc<AtomicBool>) {
    let mut clock = tokio::time::interval(Duration::from_millis(1));
    while !is_over.load(Ordering::Relaxed) {
        clock.tick().await;
        let now = step.load(Ordering::Relaxed);
        for module in MODULES {
            let key = format!("trusswatch/tower/{module}/sample");
            session.put(key, sample(module, now)).await.unwrap();
        }
        step.store(now + 1, Ordering::Relaxed);
    }
}

/// A recorder that was killed.
struct Killed {
    files: Vec<PathBuf>,
    /// The next step at that moment.
    step: u64,
    /// How long it had been recording, if it had been.
    recorded: Option<Duration>,
}

fn start(endpoint: &str, place: &Path) -> Child {
    std::fs::create_dir(place).unwrap();
    let mut command: Command = program("trusswatch");
    command.args(["record", "--structure", "tower", "--connect", endpoint, "--into"]).arg(place);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().unwrap()
}

fn files(place: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(place).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

async fn kill(endpoint: &str, place: &Path, after: Duration, step: &AtomicU64) -> Killed {
    let mut recorder = start(endpoint, place);
    let end = Instant::now() + after;
    let mut began = None;
    while Instant::now() < end {
        if began.is_none() && !files(place).is_empty() {
            began = Some(Instant::now());
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let step = step.load(Ordering::Relaxed);
    recorder.kill().unwrap();
    recorder.wait().unwrap();
    Killed { files: files(place), step, recorded: began.map(|began| began.elapsed()) }
}

/// How many messages a file has, and how many bytes they are. Every sample in it is one that was published.
fn audit(file: &Path, latest: &mut BTreeMap<String, u64>) -> (u64, u64) {
    let (mut messages, mut bytes) = (0, 0);
    let mut steps: BTreeMap<String, u64> = BTreeMap::new();
    for message in Recording::open(file).unwrap().messages().unwrap() {
        let message = message.unwrap();
        (messages, bytes) = (messages + 1, bytes + message.payload.len() as u64);
        let Some(module) = MODULES.iter().find(|module| message.topic.contains(*module)) else {
            continue;
        };
        let step = u64::from(message.sequence);
        assert_eq!(message.payload, sample(module, step).as_bytes(), "{}", file.display());
        let before = steps.insert(message.topic.clone(), step);
        assert!(before.is_none_or(|before| before + 1 == step), "{}: {step}", file.display());
        latest.insert(message.topic, step);
    }
    (messages, bytes)
}

/// The same by the reader of PyPI, if it is here.
fn audit_elsewhere(files: &BTreeMap<PathBuf, (u64, u64)>) {
    let cache = std::env::var("XDG_CACHE_HOME")
        .unwrap_or_else(|_| format!("{}/.cache", std::env::var("HOME").unwrap_or_default()));
    let ours = PathBuf::from(cache).join("trusswatch/python/bin/python");
    let python = std::env::var_os("TRUSSWATCH_PYTHON").map(PathBuf::from);
    let python = python.unwrap_or(if ours.exists() { ours } else { "python3".into() });
    let has_it = Command::new(&python).args(["-c", "import mcap"]).stderr(Stdio::null()).status();
    if !has_it.is_ok_and(|status| status.success()) {
        assert!(std::env::var_os("CI").is_none(), "{} has no `mcap`", python.display());
        println!("SKIPPED: {} has no `mcap`; `.ci/tools python` installs it", python.display());
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/system/recorder_kills.py");
    let output = Command::new(python).arg(script).args(files.keys()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: BTreeMap<PathBuf, (u64, u64)> = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(found, *files);
    println!("the reader of PyPI agrees on {} files", files.len());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes two minutes and a machine of its own: run it with `--ignored`"]
async fn a_recorder_killed_two_hundred_times_loses_a_second_at_most() {
    let _turn = turn::alone().await;
    let kills = std::env::var("TRUSSWATCH_KILLS").map_or(KILLS, |kills| kills.parse().unwrap());
    let endpoint = free_endpoint();
    let network = Network { listen: vec![endpoint.clone()], ..Network::default() };
    let session = session::open(&network).await.unwrap();
    let (step, is_over) = (Arc::<AtomicU64>::default(), Arc::<AtomicBool>::default());
    let publishing = publish(session.clone(), Arc::clone(&step), Arc::clone(&is_over));
    let publishing = tokio::spawn(publishing);
    let directory = folder::temporary();
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let (mut all, mut most_missing, mut had) = (BTreeMap::new(), 0, 0);
    for round in 0..kills.div_ceil(AT_ONCE) {
        let places = [0, 1, 2, 3].map(|n| directory.path().join(format!("{round}-{n}")));
        let after = [(); AT_ONCE].map(|()| Duration::from_millis(random.random_range(AFTER_MS)));
        let kill = |n: usize| kill(&endpoint, &places[n], after[n], &step);
        let killed = tokio::join!(kill(0), kill(1), kill(2), kill(3));
        for killed in [killed.0, killed.1, killed.2, killed.3] {
            let mut latest = BTreeMap::new();
            for file in &killed.files {
                all.insert(file.clone(), audit(file, &mut latest));
            }
            if killed.recorded.is_some_and(|recorded| recorded > Duration::from_secs(1)) {
                had += 1;
                assert_eq!(latest.len(), MODULES.len(), "{:?}", killed.files);
            }
            for last in latest.values() {
                most_missing = most_missing.max(killed.step.saturating_sub(last + 1));
            }
        }
    }
    is_over.store(true, Ordering::Relaxed);
    publishing.await.unwrap();
    println!("{kills} kills, {} files, {had} of more than a second", all.len());
    println!("at most {most_missing} samples of a module missing at the end");
    assert!(most_missing <= MOST_MISSING && had > kills / 4, "{had} of {kills}");
    audit_elsewhere(&all);
    session::close(&session).await;
}
