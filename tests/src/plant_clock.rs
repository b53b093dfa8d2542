//! How far the plant has come, told by the samples that it publishes; no diagnoser has a part in it.

use truss::ids::{RunId, Step};
use zenoh::pubsub::Subscriber;

use crate::in_time;
use crate::observer::Observer;

/// The latest run and step of the plant.
pub struct PlantClock {
    latest: tokio::sync::watch::Receiver<Option<(RunId, Step)>>,
    _subscriber: Subscriber<()>,
}

impl PlantClock {
    /// Listens from now on.
    pub async fn of(observer: &Observer) -> Self {
        Self::of_module(observer, "module2").await
    }

    /// Listens to the samples of this module from now on.
    pub async fn of_module(observer: &Observer, module: &str) -> Self {
        let (sender, latest) = tokio::sync::watch::channel(None);
        let callback = move |received: zenoh::sample::Sample| {
            if let Ok(sample) = wire::decode::<wire::Sample>(&received.payload().to_bytes()) {
                sender.send_replace(Some((sample.run, sample.step)));
            }
        };
        let key = format!("trusswatch/{}/{module}/sample", observer.structure);
        let subscriber = observer.session.declare_subscriber(key);
        Self { latest, _subscriber: subscriber.callback(callback).await.unwrap() }
    }

    /// Waits until the plant is at a step of a run, or beyond.
    pub async fn reach(&self, run: RunId, step: u64) {
        let mut latest = self.latest.clone();
        let reached = |latest: &Option<(RunId, Step)>| {
            latest.is_some_and(|(present, at)| present == run && at >= Step(step))
        };
        let what = format!("step {step} of run {run}");
        in_time(&what, latest.wait_for(reached)).await.unwrap();
    }

    /// The latest step of a run; `None` before its first.
    pub fn step(&self, run: RunId) -> Option<Step> {
        self.latest.borrow().and_then(|(present, step)| (present == run).then_some(step))
    }
}
