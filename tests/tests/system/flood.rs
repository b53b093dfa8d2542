//! A million malformed or hostile messages on every key that a diagnoser listens to, at full rate: no
//! crash, no growth, real samples diagnosed as before, every message counted.
//!
//! Samples are always a million. Queries are as many as fit into [`TIME`] for each key; with the
//! environment variable `TRUSSWATCH_FLOOD=million` they are a million too, however long that takes.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use daemon::config::Schedule;
use serde_json::Value;
use system_tests::deployment::{Deployment, MODULES};
use system_tests::footprint::allocated_kib;
use system_tests::hostile::{
    Fate, Impostor, Questions, Replies, ask_many, blocking_session, pour, pour_long, questions,
    true_sample,
};
use system_tests::observer::{Faults, Observer};
use system_tests::process::Process;
use system_tests::turn;
use system_tests::worst::WorstStatus;
use vocabulary::{
    FaultState, FaultTransition, Injection, InquiryCounters, IntakeCounters, ModulePhase,
    ModuleStatus, RunId, fault::Fault,
};
use zenoh::Session;

const MILLION: u64 = 1_000_000;
/// Samples with very many values: as many as the diagnoser keeps of a publisher that it does not use.
const LONG: u64 = 5000;
/// Replies to one query by an impostor.
const JUNK: u64 = 100_000;
/// For the queries of one key.
const TIME: Duration = Duration::from_secs(10);
/// Longer than any run takes.
const STEPS: u64 = 100_000_000;
/// Of a gage, below the root ratio.
const SMALL_BIAS_M: f64 = 1.2e-5;
const BASE: &str = "trusswatch/tower/module1";
const SAMPLES: &str = "trusswatch/tower/module1/sample";
/// No sample that is diagnosed is older \[ms\].
const OLDEST_MS: f64 = 500.0;
/// Longer than the effects of a fault take to show, in steps.
const WATCHED: u64 = 500;
/// By then what a flood took has been given back.
const GIVEN_BACK: Duration = Duration::from_secs(10);

fn question_time() -> Duration {
    match std::env::var("TRUSSWATCH_FLOOD").as_deref() {
        Ok("million") => Duration::MAX,
        _ => TIME,
    }
}

/// The tower in real time, a monitoring client, and an unknown client connected to the first module only.
struct Scene {
    _deployment: Deployment,
    plant: Option<Process>,
    diagnosers: Vec<Process>,
    observer: Observer,
    foreign: Session,
}

impl Scene {
    async fn in_service() -> Self {
        let deployment = Deployment::of_tower(&Schedule::default());
        // The plant shares two processors with the flood; how soon it may be replaced is not the question.
        deployment.set(1, "input", "incumbent_ms", 2000);
        // Without a reference the peer has nothing to ask while nothing changes: every question is the flood's.
        deployment.reconfigure(1, |config| {
            config.remove("reference").unwrap();
        });
        let diagnosers = deployment.start_diagnosers();
        let observer = Observer::of(&deployment).await;
        observer.wait_for(&MODULES, false).await;
        let plant = Some(deployment.start_plant("real", STEPS, 11, RunId(11)));
        for module in MODULES {
            observer.status_of(module, has_watched).await;
        }
        let foreign = blocking_session(&deployment.endpoints[1..2]).await;
        Self { _deployment: deployment, plant, diagnosers, observer, foreign }
    }

    async fn status(&self, wanted: impl Fn(&ModuleStatus) -> bool) -> ModuleStatus {
        self.observer.status_of("module1", wanted).await
    }

    fn allocated_kib(&self) -> u64 {
        allocated_kib(self.diagnosers[0].pid()).unwrap()
    }

    /// Waits until no more than a third of the memory that it had before has been kept, which is five bytes for
    /// each message: what the last messages took is given back as those that follow are freed.
    async fn has_memory_back(&self, before: u64) {
        let (start, at_once) = (Instant::now(), self.allocated_kib());
        let most = before + before / 3;
        while self.allocated_kib() > most && start.elapsed() < GIVEN_BACK {
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        let (after, elapsed) = (self.allocated_kib(), start.elapsed());
        println!(
            "resident memory {before} KiB before, {at_once} KiB after, {after} KiB {elapsed:.1?} later"
        );
        assert!(after <= most, "from {before} to {after} KiB");
    }

    async fn inject(&self, component: &str, offset_m: f64) {
        let fault = Some(Fault::Bias { offset_m });
        let order = Injection { component: component.parse().unwrap(), fault, at_step: None };
        let (session, structure) = (&self.observer.session, "tower".parse().unwrap());
        session::client::inject(session, &structure, &order, Duration::from_secs(5)).await.unwrap();
    }

    /// Pours samples and waits until all have been seen; each must have been counted for what it is.
    async fn flood_samples(&self, pouring: impl Future<Output = BTreeMap<Fate, u64>>) {
        let before = self.status(|_| true).await.intake;
        let start = Instant::now();
        let sent = pouring.await;
        let seconds = start.elapsed().as_secs_f64();
        let count = sent.values().sum();
        let expected = |fate| sent.get(&fate).copied().unwrap_or_default();
        let seen = |status: &ModuleStatus| fates(&before, &status.intake).values().sum::<u64>();
        let after = self.status(|status| seen(status) >= count).await.intake;
        for (fate, found) in fates(&before, &after) {
            assert_eq!(found, expected(fate), "{fate:?}");
        }
        self.report("sample", count, seconds);
    }

    /// Sends queries and waits until each has ended; each must have been counted.
    async fn flood_questions(&self, questions: &Questions, count: u64, time: Duration) {
        let before = self.status(|_| true).await.inquiries;
        let start = Instant::now();
        let replies = ask_many(&self.foreign, questions, count, time).await;
        let seconds = start.elapsed().as_secs_f64();
        let ended = |status: &ModuleStatus| ends(&status.inquiries) - ends(&before);
        let after = self.status(|status| ended(status) >= replies.asked).await;
        check_inquiries(questions.topic, &before, &after.inquiries, &replies);
        assert_eq!(after.publisher.replies_lost, 0, "{}", questions.topic);
        self.report(questions.topic, replies.asked, seconds);
        println!("    {replies:?}");
    }

    fn report(&self, topic: &str, messages: u64, seconds: f64) {
        let (rate, kib) = (messages as f64 / seconds, self.allocated_kib());
        println!("  {topic}: {messages} in {seconds:.1} s, {rate:.0} per second; {kib} KiB");
    }

    async fn stop_plant(mut self) -> Self {
        self.plant.take().unwrap().stop().await;
        self
    }

    async fn stop(self) {
        session::close(&self.foreign).await;
        for process in self.diagnosers {
            process.stop().await;
        }
    }
}

/// Has the module watched for long enough to know what was there before a fault that begins now?
fn has_watched(status: &ModuleStatus) -> bool {
    let since = status.in_service_since_step;
    since.zip(status.step).is_some_and(|(since, step)| step.since(since) >= WATCHED)
}

/// What was counted in between.
fn fates(before: &IntakeCounters, after: &IntakeCounters) -> BTreeMap<Fate, u64> {
    BTreeMap::from([
        (Fate::Malformed, after.malformed - before.malformed),
        (Fate::UnknownVersion, after.unknown_version - before.unknown_version),
        (Fate::WrongMessage, after.wrong_message - before.wrong_message),
        (Fate::OtherModule, after.other_module - before.other_module),
        (Fate::OtherSource, after.other_source - before.other_source),
    ])
}

fn ends(counters: &InquiryCounters) -> u64 {
    counters.malformed + counters.turned_away + counters.answered + counters.refused
}

fn check_inquiries(
    topic: &str,
    before: &InquiryCounters,
    after: &InquiryCounters,
    replies: &Replies,
) {
    assert_eq!(after.received - before.received, replies.asked, "{topic}");
    assert_eq!(ends(after) - ends(before), replies.asked, "{topic}");
    assert_eq!(after.malformed - before.malformed, replies.malformed, "{topic}");
    assert_eq!(after.orders_obeyed, 0, "{topic}");
}

/// Floods every key, once more with samples alone that have very many values.
async fn flood(scene: &Scene, sample: &Value, count: u64, time: Duration) {
    scene.flood_samples(pour_long(&scene.foreign, SAMPLES, sample, LONG)).await;
    scene.flood_samples(pour(&scene.foreign, SAMPLES, sample, count)).await;
    let status = scene.status(|_| true).await;
    for questions in questions(BASE, status.run.unwrap().0, status.step.unwrap().0) {
        scene.flood_questions(&questions, count, time).await;
    }
}

/// The next transition into this state.
async fn next_of(faults: &mut Faults, state: FaultState) -> FaultTransition {
    loop {
        let (_, message) = faults.next().await;
        if message.state() == state {
            return message;
        }
    }
}

/// Every step has been diagnosed, and everything else received was the flood.
fn check_samples(status: &ModuleStatus, hostile: u64) {
    let (intake, diagnosis) = (status.intake, status.diagnosis);
    assert_eq!(diagnosis.samples, status.step.unwrap().0 + 1);
    assert_eq!((diagnosis.samples_missing, intake.dropped, intake.resynchronised), (0, 0, 0));
    assert_eq!(intake.received + intake.recovered, hostile + diagnosis.samples);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes and a machine of its own: run it with `--ignored`"]
async fn a_million_hostile_messages_on_every_key_are_counted_and_change_nothing() {
    let _turn = turn::alone().await;
    let scene = Scene::in_service().await;
    let sample = true_sample(&scene.observer.session, SAMPLES).await;
    let worst = WorstStatus::of(&scene.observer).await;
    println!("to get warm:");
    flood(&scene, &sample, MILLION / 10, question_time() / 10).await;
    let before = scene.allocated_kib();
    println!("at full length:");
    flood(&scene, &sample, MILLION, question_time()).await;
    scene.has_memory_back(before).await;
    let worst = worst.of_module("module1");
    println!("{worst:?}");
    assert!(worst.sample_age_ms < OLDEST_MS && worst.silence < Duration::from_secs(2), "{worst:?}");
    let mut faults = scene.observer.faults().await;
    scene.inject("module1/sensor/g2", 4e-4).await;
    let fault = next_of(&mut faults, FaultState::Latched).await;
    assert_eq!(fault.component.to_string(), "module1/sensor/g2");
    let scene = scene.stop_plant().await;
    let status = scene.status(|status| status.phase == ModulePhase::Stale).await;
    check_samples(&status, LONG + MILLION / 10 + LONG + MILLION);
    scene.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "takes minutes and a machine of its own: run it with `--ignored`"]
async fn junk_in_place_of_replies_confirms_nothing_and_ends_with_its_sender() {
    let _turn = turn::alone().await;
    let scene = Scene::in_service().await;
    let mut faults = scene.observer.faults().await;
    let peer = Impostor::on(&scene.foreign, "trusswatch/tower/module2/state", JUNK).await;
    let store = Impostor::on(&scene.foreign, SAMPLES, JUNK).await;
    // A jump would need no reply.
    scene.inject("module1/sensor/g4", SMALL_BIAS_M).await;
    let fault = next_of(&mut faults, FaultState::Unconfirmed).await;
    assert_eq!(fault.component.to_string(), "module1/sensor/g4");
    // By then memory for the junk of several queries has been allocated.
    scene.status(|status| status.peers[0].malformed >= 3).await;
    let before = scene.allocated_kib();
    scene.status(|status| status.peers[0].malformed >= 10).await;
    let status = scene.status(|_| true).await;
    println!("{} junk replies; {:?}", peer.sent(), status.peers);
    scene.has_memory_back(before).await;
    assert!(status.sample_age_ms.unwrap() < OLDEST_MS, "{status:?}");
    peer.leave().await;
    store.leave().await;
    let fault = next_of(&mut faults, FaultState::Latched).await;
    assert_eq!(fault.component.to_string(), "module1/sensor/g4");
    scene.stop_plant().await.stop().await;
}
