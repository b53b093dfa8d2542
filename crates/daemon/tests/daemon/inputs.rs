//! What a diagnoser takes beside samples is published, numbered without a gap, and given again; so is its setup, with which

//! another diagnoser computes the very same divergences.

use std::time::Duration;

use crate::support::{LIMIT, Rig, configs, in_time};
use daemon::config::{DiagnoserConfig, PlantFlags, load_diagnoser};
use diagnosis::messages::{Speaker, setup_fingerprint, to_setup};
use diagnosis::{Diagnoser, Event, Measurements, ModuleSetup};
use vocabulary::{Input, ModuleConfiguration, RunId, Step, Taken};
use zenoh::Session;
use zenoh::handlers::FifoChannelHandler;
use zenoh::pubsub::Subscriber;
use zenoh::query::ConsolidationMode;

const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];
const INPUTS: &str = "trusswatch/small/lower/input";
const CONFIGURATION: &str = "trusswatch/small/*/configuration";
const SAMPLES: &str = "trusswatch/small/lower/sample";
const COMMAND: &str = "trusswatch/small/lower/command/acknowledge";
const GLANCE: Duration = Duration::from_millis(100);

type Inputs = Subscriber<FifoChannelHandler<zenoh::sample::Sample>>;

fn sample(config: &DiagnoserConfig, step: u64) -> vocabulary::Sample {
    let (actuators, gages) = config.size();
    vocabulary::Sample {
        module: config.module().clone(),
        run: RunId(3),
        step: Step(step),
        time_unix_ns: step,
        demands_n: vec![-20.0; actuators],
        pressures_pa: vec![[70e5, 98.6e5]; actuators],
        elongations_m: vec![0.0; gages],
        readings: Vec::new(),
        block: Vec::new(),
    }
}

/// All of them: otherwise the latest of a key would stand for the others.
async fn replies<M: vocabulary::Message>(session: &Session, question: &str) -> Vec<(String, M)> {
    let replies = session.get(question).consolidation(ConsolidationMode::None).await.unwrap();
    let mut all = Vec::new();
    while let Ok(reply) = in_time("a reply", replies.recv_async()).await {
        let sample = reply.into_result().unwrap();
        let message = vocabulary::decode(&sample.payload().to_bytes()).unwrap();
        all.push((sample.key_expr().to_string(), message));
    }
    all
}

async fn inputs(session: &Session, parameters: &str) -> Vec<Input> {
    let given = replies(session, &format!("trusswatch/*/*/input?{parameters}")).await;
    assert!(given.iter().all(|(key, _)| key == INPUTS));
    given.into_iter().map(|(_, input)| input).collect()
}

async fn order(session: &Session) {
    let order = r#"{"v":1,"component":"sensor/g1","by":"ada","note":null,"force":false}"#;
    let replies = session.get(COMMAND).payload(order).await.unwrap();
    assert!(in_time("a refusal", replies.recv_async()).await.unwrap().result().is_err());
}

async fn next(inputs: &Inputs) -> Input {
    let received = in_time("an input", inputs.recv_async()).await.unwrap();
    vocabulary::decode(&received.payload().to_bytes()).unwrap()
}

/// Orders until the first input arrives: the diagnoser may not know of its subscriber yet.
async fn first(session: &Session, inputs: &Inputs) -> Input {
    in_time("the first input", async {
        loop {
            order(session).await;
            if let Ok(received) = tokio::time::timeout(GLANCE, inputs.recv_async()).await {
                return vocabulary::decode(&received.unwrap().payload().to_bytes()).unwrap();
            }
        }
    })
    .await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn inputs_are_published_and_given_again() {
    let rig = Rig::new("small/plant.toml", &SMALL, &PlantFlags::default());
    let lower = rig.start_diagnoser(0);
    let observer = rig.observer().await;
    let module = [rig.modules()[0].clone()];
    let structure = "small".parse().unwrap();
    session::client::wait_for(&observer, &structure, &module, false, LIMIT).await.unwrap();
    let subscriber = observer.declare_subscriber(INPUTS).await.unwrap();
    let mut seen = vec![first(&observer, &subscriber).await];
    for step in [5, 6, 7, 11, 12] {
        let message = vocabulary::encode(&sample(&rig.diagnosers[0], step)).unwrap();
        observer.put(SAMPLES, message).await.unwrap();
    }
    while !matches!(seen.last().unwrap().taken, Taken::Gap { .. }) {
        seen.push(next(&subscriber).await);
    }
    order(&observer).await;
    seen.push(next(&subscriber).await);

    let given = inputs(&observer, "").await;
    let number = |input: &Input| input.number;
    assert_eq!(
        given.iter().map(number).collect::<Vec<_>>(),
        (1..=given.len() as u64).collect::<Vec<_>>()
    );
    assert_eq!(given[given.len() - seen.len()..], seen);
    let Taken::Started { configuration, .. } = &given[0].taken else { panic!("{:?}", given[0]) };
    let [.., began, gap, ordered] = &given[..] else { panic!("{given:?}") };
    assert_eq!(began.taken, Taken::RunBegan { run: RunId(3), step: Step(5) });
    assert_eq!((began.samples, began.run, began.step), (0, None, None));
    assert_eq!(gap.taken, Taken::Gap { from: Step(8), missing: 3 });
    assert_eq!((gap.samples, gap.run, gap.step), (3, Some(RunId(3)), Some(Step(7))));
    assert!(matches!(ordered.taken, Taken::Ordered { .. }) && ordered.samples >= 4, "{ordered:?}");

    let (process, latest) = (given[0].process, ordered.number);
    let some =
        inputs(&observer, &format!("process={process};from={};to={latest}", latest - 1)).await;
    assert_eq!(some, given[given.len() - 2..]);
    assert_eq!(inputs(&observer, "process=1").await, []);

    let answer = replies::<ModuleConfiguration>(&observer, CONFIGURATION).await;
    let [(key, answer)] = &answer[..] else { panic!("{answer:?}") };
    assert_eq!(key, "trusswatch/small/lower/configuration");
    let own = rig.diagnosers[0].module_setup();
    assert_eq!(answer.fingerprint, setup_fingerprint(&own).unwrap());
    assert_eq!(&answer.fingerprint, configuration);
    assert_eq!(setup_fingerprint(&to_setup(answer).unwrap()).unwrap(), answer.fingerprint);
    lower.stop().await;
    session::close(&observer).await;
}

/// Every number of every step, in bits.
fn course(setup: ModuleSetup, samples: &[Measurements]) -> Vec<u64> {
    let mut diagnoser = Diagnoser::new(setup).unwrap();
    let mut bits = Vec::new();
    for sample in samples {
        diagnoser.handle(Event::Sample(sample.clone()), &mut Vec::new());
        for evidence in diagnoser.evidence() {
            let numbers = [evidence.residual, evidence.level, evidence.threshold];
            bits.extend(numbers.into_iter().chain(evidence.divergence).map(f64::to_bits));
        }
    }
    bits
}

#[test]
fn with_the_setup_that_is_given_the_divergences_are_the_same_bit_for_bit() {
    let plant = Rig::new("plant.toml", &["module1.toml", "module2.toml"], &PlantFlags::default());
    let mut plant = plant.plant.make_plant().unwrap();
    let signals: Vec<_> = (0..2700).map(|_| plant.advance().clone()).collect();
    for (index, file) in ["module1.toml", "module2.toml"].into_iter().enumerate() {
        let config = load_diagnoser(&configs().join(file)).unwrap();
        let mut setup = config.module_setup();
        assert!(setup.reference.is_some(), "{file}");
        setup.isolation.root_ratio = f64::INFINITY;
        let samples: Vec<Measurements> = (signals.iter().zip(0..))
            .map(|(signals, step)| {
                let own = &signals.modules[index];
                assert_eq!(own.module, setup.module);
                Measurements {
                    run: RunId(1),
                    step: Step(step),
                    demands_n: own.demands_n.clone(),
                    pressures_pa: own.pressures_pa.clone(),
                    elongations_m: own.elongations_m.clone(),
                }
            })
            .collect();
        let speaker = Speaker::of("tower".parse().unwrap(), setup.module.clone());
        let message = speaker.configuration(&setup, "1.0.0", &config.thresholds, 1).unwrap();
        assert_eq!(message.reference, setup.reference.as_ref().map(|known| known.fingerprint()));
        let bytes = vocabulary::encode(&message).unwrap();
        assert!(bytes.len() < 100_000, "{} bytes", bytes.len());
        let back = to_setup(&vocabulary::decode(&bytes).unwrap()).unwrap();
        assert!(back.isolation.root_ratio.is_infinite());
        assert_eq!(back.reference, setup.reference);
        assert_eq!(setup_fingerprint(&back).unwrap(), message.fingerprint);
        let expected = course(setup, &samples);
        assert!(expected == course(back, &samples), "{file}");
    }
}
