//! The recorder: what it missed or was before it is fetched, what cannot be had is counted, in the file too.

use std::path::Path;

use crate::support::{free_endpoint, in_time};
use daemon::recorder::{self, RecordedKeys, RecorderConfig, RecorderReport};
use recording::{FileLimits, Recorded, Recording};
use session::Network;
use shell::shutdown;
use vocabulary::{Encoding, InputQuestion, Sample, SampleQuestion, StepValues};
use zenoh::Session;

const SAMPLE: &str = "trusswatch/tower/m/sample";
const INPUT: &str = "trusswatch/tower/m/input";
const CONFIGURATION: &str = "trusswatch/tower/m/configuration";

fn sample(step: u64) -> String {
    format!(r#"{{"v":1,"module":"m","run":7,"step":{step},"time_unix_ns":{}}}"#, 1000 + step)
}

fn input(number: u64) -> String {
    format!(
        r#"{{"v":1,"module":"m","process":9,"number":{number},"time_unix_ns":{}}}"#,
        500 + number
    )
}

/// Answers as a plant and a diagnoser would; of the samples from 20 to 29 it keeps none.
async fn answer(session: &Session) {
    let samples = session.declare_queryable(SAMPLE).callback(|query| {
        let question = SampleQuestion::from_parameters(query.parameters().as_str()).unwrap();
        let steps = (question.from.0..=question.to.0).filter(|step| !(20..30).contains(step));
        steps.for_each(|step| {
            zenoh::Wait::wait(query.reply(SAMPLE, sample(step))).unwrap();
        });
    });
    samples.background().await.unwrap();
    let inputs = session.declare_queryable(INPUT).callback(|query| {
        let question = InputQuestion::from_parameters(query.parameters().as_str()).unwrap();
        let (from, to) = (question.from.unwrap_or(1), question.to.unwrap_or(3));
        (from..=to).for_each(|number| {
            zenoh::Wait::wait(query.reply(INPUT, input(number))).unwrap();
        });
    });
    inputs.background().await.unwrap();
    let configuration = session.declare_queryable(CONFIGURATION).callback(|query| {
        let given = r#"{"v":1,"structure":"tower","module":"m","software":"1.0","fingerprint":"f","thresholds":"t","reference":null,"setup":{},"time_unix_ns":5}"#;
        zenoh::Wait::wait(query.reply(CONFIGURATION, given)).unwrap();
    });
    configuration.background().await.unwrap();
}

fn messages(files: &[std::path::PathBuf]) -> Vec<Recorded> {
    let of = |file: &Path| -> Vec<Recorded> {
        Recording::open(file).unwrap().messages().unwrap().map(Result::unwrap).collect()
    };
    files.iter().flat_map(|file| of(file)).collect()
}

fn of_topic<'a>(messages: &'a [Recorded], topic: &str) -> Vec<&'a str> {
    let found = messages.iter().filter(|message| message.topic == topic);
    let mut payloads: Vec<_> = found.collect();
    payloads.sort_by_key(|message| message.time_unix_ns);
    payloads.iter().map(|message| std::str::from_utf8(&message.payload).unwrap()).collect()
}

/// A recorder beside the publishers, which meet at its endpoint.
struct Rig {
    session: Session,
    trigger: shutdown::Trigger,
    seen: tokio::sync::watch::Receiver<RecorderReport>,
    recorder: tokio::task::JoinHandle<Result<RecorderReport, shell::exit::Failure>>,
    _directory: tempfile::TempDir,
}

impl Rig {
    /// `prepare` declares who answers.
    async fn start(prepare: impl AsyncFn(&Session)) -> Self {
        let endpoint = free_endpoint();
        let network = Network { listen: vec![endpoint.clone()], ..Network::default() };
        let session = session::open(&network).await.unwrap();
        prepare(&session).await;
        let directory = tempfile::tempdir().unwrap();
        let config = RecorderConfig {
            network: Network { connect: vec![endpoint], ..Network::default() },
            keys: RecordedKeys {
                structure: Some("tower".parse().unwrap()),
                ..RecordedKeys::default()
            },
            directory: directory.path().to_path_buf(),
            limits: FileLimits { file_bytes: 1 << 30, file_ns: u64::MAX, quota_bytes: 1 << 32 },
        };
        let (trigger, shutdown) = shutdown::pair();
        let (reports, seen) = tokio::sync::watch::channel(RecorderReport::default());
        let recorder = tokio::spawn(recorder::run(config, shutdown, move |report| {
            reports.send_replace(report.clone());
        }));
        Self { session, trigger, seen, recorder, _directory: directory }
    }

    async fn until(&mut self, what: &str, holds: impl FnMut(&RecorderReport) -> bool) {
        in_time(what, self.seen.wait_for(holds)).await.unwrap();
    }

    /// Waits until the recorder subscribes to samples.
    async fn is_heard(&mut self) {
        let samples = self.session.declare_publisher(SAMPLE).await.unwrap();
        let listener = samples.matching_listener().await.unwrap();
        if !samples.matching_status().await.unwrap().matching() {
            in_time("the recorder's subscription", listener.recv_async()).await.unwrap();
        }
    }

    async fn end(self) -> RecorderReport {
        self.trigger.pull();
        let report = in_time("the end", self.recorder).await.unwrap().unwrap();
        self.session.close().await.unwrap();
        report
    }
}

fn has(topic: &'static str, count: u64) -> impl Fn(&RecorderReport) -> bool {
    move |report| report.messages.get(topic).copied().unwrap_or(0) >= count
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_was_missed_is_fetched_and_what_cannot_be_had_is_counted() {
    let mut rig = Rig::start(answer).await;
    let token = rig.session.liveliness().declare_token("trusswatch/tower/m/alive").await.unwrap();
    let given = |report: &RecorderReport| has(CONFIGURATION, 1)(report) && has(INPUT, 3)(report);
    rig.until("the configuration and inputs", given).await;

    let samples = rig.session.declare_publisher(SAMPLE).await.unwrap();
    for step in [10, 11, 15, 35] {
        samples.put(sample(step)).await.unwrap();
    }
    rig.session.put(INPUT, input(4)).await.unwrap();
    // Of 0 to 35 all but ten.
    let come = |report: &RecorderReport| {
        has(SAMPLE, 26)(report) && has(INPUT, 4)(report) && report.lost() >= 10
    };
    rig.until("the samples", come).await;
    rig.trigger.pull();
    let report = in_time("the end", rig.recorder).await.unwrap().unwrap();
    assert_eq!(report.losses, [(SAMPLE.to_owned(), 10)].into());
    assert_eq!(report.files.len(), 1);
    drop(token);

    let found = messages(&report.files);
    let steps: Vec<String> = (0..36).filter(|step| !(20..30).contains(step)).map(sample).collect();
    assert_eq!(of_topic(&found, SAMPLE), steps);
    assert_eq!(of_topic(&found, INPUT), (1..5).map(input).collect::<Vec<_>>());
    let losses = of_topic(&found, "trusswatch/tower/recorder/loss");
    assert!(losses.len() == 1 && losses[0].contains(r#""count":10"#), "{losses:?}");
    let metadata = Recording::open(&report.files[0]).unwrap().metadata().unwrap();
    let names: Vec<&str> = metadata.iter().map(|about| about.name.as_str()).collect();
    assert_eq!(names, ["recorder", "module/tower/m", "losses"]);
    assert_eq!(metadata[1].values["configuration"], "f");
}

/// No later sample shows that the last ones of a run did not arrive; what the diagnoser says does.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_last_samples_of_a_run_are_fetched_once_the_diagnoser_has_taken_them() {
    let mut rig = Rig::start(answer).await;
    rig.is_heard().await;
    for step in 0..10 {
        rig.session.put(SAMPLE, sample(step)).await.unwrap();
    }
    rig.until("the first samples", has(SAMPLE, 10)).await;
    rig.session.put("trusswatch/tower/m/progress", r#"{"v":1,"run":7,"step":34}"#).await.unwrap();
    // The publisher does not keep those from 20 to 29.
    rig.until("the last samples", |report| has(SAMPLE, 25)(report) && report.lost() >= 10).await;
    let report = rig.end().await;
    assert_eq!((report.messages[SAMPLE], report.lost()), (25, 10));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_still_missing_when_the_recorder_ends_is_counted_as_lost() {
    let (asked, mut question) = tokio::sync::mpsc::unbounded_channel();
    let never_answers = async |session: &Session| {
        let asked = asked.clone();
        let holds = session.declare_queryable(SAMPLE).callback(move |query| {
            asked.send(query).unwrap();
        });
        holds.background().await.unwrap();
    };
    let mut rig = Rig::start(never_answers).await;
    rig.is_heard().await;
    for step in [0, 5] {
        rig.session.put(SAMPLE, sample(step)).await.unwrap();
    }
    let held = in_time("the question", question.recv()).await;
    let report = rig.end().await;
    drop(held);
    assert_eq!(report.losses, [(SAMPLE.to_owned(), 4)].into());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn blocks_published_and_fetched_are_recorded_step_by_step_as_if_each_had_been_published() {
    let block = |from: u64, encoding| {
        let values = (from..from + 5).map(|step| StepValues {
            elongations_m: vec![step as f64, f64::NAN],
            ..StepValues::default()
        });
        let empty =
            format!(r#"{{"v":1,"module":"m","run":7,"step":{from},"time_unix_ns":{from}}}"#);
        let mut block: Sample = vocabulary::decode(empty.as_bytes()).unwrap();
        block.block = values.collect();
        vocabulary::encode_as(&block, encoding).unwrap()
    };
    let mut rig = Rig::start(async |session| {
        let kept = session.declare_queryable(SAMPLE).callback(move |query| {
            let question = SampleQuestion::from_parameters(query.parameters().as_str()).unwrap();
            // Whole blocks, with steps that were not asked for.
            for from in (0..20)
                .step_by(5)
                .filter(|from| *from <= question.to.0 && from + 4 >= question.from.0)
            {
                let reply = query.reply(SAMPLE, block(from, Encoding::Cbor));
                zenoh::Wait::wait(reply.encoding(zenoh::bytes::Encoding::APPLICATION_CBOR))
                    .unwrap();
            }
        });
        kept.background().await.unwrap();
    })
    .await;
    rig.is_heard().await;
    let samples = rig.session.declare_publisher(SAMPLE).await.unwrap();
    let cbor = zenoh::bytes::Encoding::APPLICATION_CBOR;
    samples.put(block(0, Encoding::Json)).await.unwrap();
    samples.put(block(15, Encoding::Cbor)).encoding(cbor.clone()).await.unwrap();
    rig.until("twenty samples", has(SAMPLE, 20)).await;
    // An invalid sample is recorded verbatim, so that an operator can find out what was sent.
    samples.put("\u{1}block").encoding(cbor).await.unwrap();
    rig.until("the invalid sample", has(SAMPLE, 21)).await;
    rig.trigger.pull();
    let report = in_time("the end", rig.recorder).await.unwrap().unwrap();
    assert_eq!(report.lost(), 0, "{report:?}");
    let mut recorded: Vec<Recorded> =
        messages(&report.files).into_iter().filter(|one| one.topic == SAMPLE).collect();
    recorded.retain(|one| !one.payload.ends_with(b"block"));
    recorded.sort_by_key(|one| one.sequence);
    assert_eq!(recorded.len(), 20);
    for (step, one) in (0..).zip(&recorded) {
        let sample: Sample = vocabulary::decode(&one.payload).unwrap();
        assert_eq!((sample.step.0, sample.block.len()), (step, 0));
        assert_eq!(sample.elongations_m[0], step as f64);
        assert!(sample.elongations_m[1].is_nan());
    }
}
