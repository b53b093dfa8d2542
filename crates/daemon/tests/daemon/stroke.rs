//! The plant lets a cylinder make a stroke by order from the network, one at a time.

use std::f64::consts::TAU;

use crate::support::{LIMIT, Process, Rig, first, in_time};
use daemon::config::{PlantFlags, Speed};
use observer::QueryError;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use vocabulary::{Refused, Sample, Step, Stroke, StrokeBegun, StructureName};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

const SMALL: [&str; 2] = ["small/lower.toml", "small/upper.toml"];
const SAMPLES: &str = "trusswatch/small/lower/sample";
const FORCE_N: f64 = 2e3;

/// The plant alone, and who orders.
struct Scene {
    plant: Process,
    observer: Session,
    structure: StructureName,
}

impl Scene {
    async fn open() -> Scene {
        let flags = PlantFlags { speed: Some(Speed::Factor(2.0)), ..PlantFlags::default() };
        let mut rig = Rig::new("small/plant.toml", &SMALL, &flags);
        rig.plant.wait_for.clear();
        let plant = rig.start_plant();
        let observer = rig.observer().await;
        let structure = rig.plant.structure.name.clone();
        session::client::wait_for(&observer, &structure, &[], true, LIMIT).await.unwrap();
        Scene { plant, observer, structure }
    }

    async fn order(&self, stroke: &Stroke) -> Result<StrokeBegun, QueryError> {
        session::client::stroke(&self.observer, &self.structure, stroke, LIMIT).await
    }

    async fn is_refused(&self, stroke: &Stroke, reason: &str) {
        match self.order(stroke).await {
            Err(QueryError::Refused(found)) => assert!(found.contains(reason), "{found}"),
            other => panic!("{stroke:?}: {other:?}"),
        }
    }

    async fn close(self) {
        self.plant.stop().await;
        session::close(&self.observer).await;
    }
}

/// The samples of the lower module as they come, however long nobody looks: a subscriber whose queue is full holds up the
/// replies that come over the same link.
struct Samples {
    arriving: UnboundedReceiver<Sample>,
    _subscriber: Subscriber<()>,
}

impl Samples {
    async fn of(observer: &Session) -> Self {
        let (sender, arriving) = unbounded_channel();
        let take = move |received: zenoh::sample::Sample| {
            // There is no receiver any more when a test is over.
            let _ = sender.send(read(&received).unwrap());
        };
        let subscriber = observer.declare_subscriber(SAMPLES).callback(take).await.unwrap();
        Self { arriving, _subscriber: subscriber }
    }

    /// The first one from this step on: on a busy machine one may be lost.
    async fn from(&mut self, step: Step) -> Sample {
        in_time("a sample", async {
            loop {
                let sample = self.arriving.recv().await.unwrap();
                if sample.step >= step {
                    return sample;
                }
            }
        })
        .await
    }
}

fn stroke(component: &str) -> Stroke {
    Stroke {
        component: component.parse().unwrap(),
        force_n: FORCE_N,
        duration_s: 4.0,
        largest_strain: 1e-3,
    }
}

/// What a stroke of four seconds adds to the demand after this many of its steps: F sin²(2πt/T), first one way and then
/// the other.
fn pushed_n(steps: u64) -> f64 {
    let place = steps as f64 / 4000.0;
    FORCE_N.copysign(0.5 - place) * (TAU * place).sin().powi(2)
}

fn read(received: &zenoh::sample::Sample) -> Option<Sample> {
    vocabulary::decode(&received.payload().to_bytes()).ok()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stroke_moves_the_demand_of_its_cylinder_alone_and_another_one_has_to_wait() {
    let scene = Scene::open().await;
    let mut samples = Samples::of(&scene.observer).await;
    let first = samples.from(Step(0)).await.step;
    samples.from(first.plus(100)).await;

    // Only one module has such a cylinder.
    let begun = scene.order(&stroke("actuator/a2")).await.unwrap();
    assert_eq!(begun.component.to_string(), "lower/actuator/a2");
    assert_eq!(begun.last_step, begun.first_step.plus(3999));
    let busy = "`lower/actuator/a2` is making its stroke; wait until it has ended";
    scene.is_refused(&stroke("upper/actuator/a1"), busy).await;

    let held = samples.from(begun.first_step).await.demands_n;
    for after in [1000, 2000, 3000] {
        let sample = samples.from(begun.first_step.plus(after)).await;
        let (demands, force_n) = (sample.demands_n, pushed_n(sample.step.since(begun.first_step)));
        assert!((demands[1] - held[1] - force_n).abs() < 1e-6, "{held:?} {demands:?}");
        assert!((demands[0] - held[0]).abs() < 1e-6, "{held:?} {demands:?}");
    }
    samples.from(begun.last_step.plus(1)).await;
    let next = scene.order(&stroke("upper/actuator/a1")).await.unwrap();
    assert!(next.first_step > begun.last_step);
    scene.close().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_order_that_makes_no_sense_is_refused_with_the_reason_and_moves_nothing() {
    let scene = Scene::open().await;
    let sensible = || stroke("lower/actuator/a1");
    for (stroke, reason) in [
        (stroke("lower/actuator/a9"), "unknown actuator `lower/actuator/a9`: expected one of"),
        (stroke("lower/sensor/g1"), "unknown actuator `lower/sensor/g1`"),
        (stroke("actuator/a9"), "no module has a component `actuator/a9`"),
        (stroke("actuator/a1"), "`actuator/a1` may be `lower/actuator/a1` or"),
        (Stroke { force_n: 1e6, ..sensible() }, "`force_n` of a stroke is 1000000; use 1 to"),
        (Stroke { duration_s: 0.1, ..sensible() }, "`duration_s` of a stroke is 0.1; use 2 to 600"),
        (Stroke { largest_strain: 0.1, ..sensible() }, "`largest_strain` of a stroke is 0.1"),
    ] {
        scene.is_refused(&stroke, reason).await;
    }
    for (payload, reason) in [
        ("", "malformed JSON"),
        ("{\"v\":1}", "missing field `component`"),
        ("{\"v\":1,\"component\":\"actuator/a2\",\"force_n\":\"5 kN\"}", "invalid stroke"),
    ] {
        let query = scene.observer.get("trusswatch/small/plant/command/stroke").payload(payload);
        let replies = query.timeout(LIMIT).await.unwrap();
        let reply = in_time("a reply", replies.recv_async()).await.unwrap();
        let error = reply.result().unwrap_err().payload().to_bytes().into_owned();
        let refused: Refused = vocabulary::decode(&error).unwrap();
        assert!(refused.reason.contains(reason), "{payload}: {}", refused.reason);
    }
    // Nothing is under way.
    let begun = scene.order(&sensible()).await.unwrap();
    first(&scene.observer, SAMPLES, "the stroke's sample", |received| {
        read(received).filter(|sample| sample.step > begun.first_step)
    })
    .await;
    scene.close().await;
}
