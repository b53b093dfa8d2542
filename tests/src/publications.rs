//! When each sample was published, by its publisher's clock, which is this machine's.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use truss::ids::{ModuleName, Step};
use wire::FaultTransition;
use zenoh::pubsub::Subscriber;

use crate::observer::Observer;

type Times = BTreeMap<(ModuleName, Step), u64>;

/// Notes the samples of every module, or of some.
pub struct Publications {
    times: Arc<Mutex<Times>>,
    _subscribers: Vec<Subscriber<()>>,
}

impl Publications {
    /// Notes those of every module from now on.
    pub async fn of(observer: &Observer) -> Self {
        Self::of_modules(observer, &["*".to_owned()]).await
    }

    /// Notes those of these modules from now on.
    pub async fn of_modules(observer: &Observer, modules: &[String]) -> Self {
        let times = Arc::new(Mutex::new(Times::new()));
        let mut subscribers = Vec::new();
        for module in modules {
            let noted = Arc::clone(&times);
            let callback = move |received: zenoh::sample::Sample| {
                if let Ok(sample) = wire::decode::<wire::Sample>(&received.payload().to_bytes()) {
                    let mut times = noted.lock().unwrap_or_else(PoisonError::into_inner);
                    times.insert((sample.module, sample.step), sample.time_unix_ns);
                }
            };
            let key = format!("trusswatch/*/{module}/sample");
            let subscriber = observer.session.declare_subscriber(key).callback(callback);
            subscribers.push(subscriber.await.unwrap());
        }
        Self { times, _subscribers: subscribers }
    }

    /// When a sample was published \[ns since 1970\].
    ///
    /// # Panics
    /// If it was not.
    #[must_use]
    pub fn time_of(&self, module: &ModuleName, step: Step) -> u64 {
        let times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        let time = times.get(&(module.clone(), step)).copied();
        time.unwrap_or_else(|| panic!("sample {step} of {module} was not published"))
    }

    /// From the publication of the sample that decided to the arrival of the message \[ms\].
    ///
    /// # Panics
    /// If the message tells no step, or its sample was not published.
    #[must_use]
    pub fn delay_ms(&self, (arrival, message): &(u64, FaultTransition)) -> f64 {
        let decided = message.decided_step.unwrap();
        arrival.saturating_sub(self.time_of(&message.module, decided)) as f64 / 1e6
    }
}

/// p50 and p99.
#[must_use]
pub fn percentiles(mut values: Vec<f64>) -> (f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    (at(0.5), at(0.99))
}
