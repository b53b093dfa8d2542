//! A module's status messages: that they keep coming, and what they say.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use truss::ids::{ModuleName, Step};
use wire::ModuleStatus;
use zenoh::pubsub::Subscriber;

use super::stalls::Stalls;
use crate::observer::Observer;

/// What the status messages of one module were like.
#[derive(Debug, Clone)]
pub struct Heartbeat {
    /// The latest.
    pub latest: ModuleStatus,
    /// How many there were.
    pub count: u64,
    /// The longest time between two of them, less what the machine was busy otherwise.
    pub longest_gap: Duration,
    /// The largest lag told \[ms\].
    pub largest_lag_ms: f64,
    /// Most samples that waited at a time.
    pub most_queued: u64,
    /// Messages that told of no more steps than the one before.
    pub standstills: u64,
    arrived: Instant,
    stalled: Duration,
}

impl Heartbeat {
    fn first(latest: ModuleStatus, stalled: Duration) -> Self {
        let arrived = Instant::now();
        let (count, standstills, most_queued) = (1, 0, 0);
        let (longest_gap, largest_lag_ms) = (Duration::ZERO, 0.0);
        Self {
            latest,
            count,
            longest_gap,
            largest_lag_ms,
            most_queued,
            standstills,
            arrived,
            stalled,
        }
    }

    fn beat(&mut self, status: ModuleStatus, stalled: Duration) {
        let now = Instant::now();
        let gap = (now - self.arrived).saturating_sub(stalled.saturating_sub(self.stalled));
        self.longest_gap = self.longest_gap.max(gap);
        self.largest_lag_ms = self.largest_lag_ms.max(status.lag_ms.unwrap_or(0.0));
        self.most_queued = self.most_queued.max(status.queued_samples);
        self.standstills += u64::from(status.step <= self.latest.step);
        (self.latest, self.arrived, self.stalled) = (status, now, stalled);
        self.count += 1;
    }

    /// How long ago the latest message came, less what the machine was busy otherwise.
    #[must_use]
    pub fn age(&self, stalls: &Stalls) -> Duration {
        self.arrived.elapsed().saturating_sub(stalls.total().saturating_sub(self.stalled))
    }

    /// The latest step told.
    #[must_use]
    pub fn step(&self) -> Step {
        self.latest.step.unwrap_or_default()
    }
}

type ByModule = BTreeMap<ModuleName, Heartbeat>;

/// The heartbeats of all modules.
pub struct Heartbeats {
    modules: Arc<Mutex<ByModule>>,
    _subscriber: Subscriber<()>,
}

impl Heartbeats {
    /// Listens from now on.
    pub async fn of(observer: &Observer, stalls: &Stalls) -> Self {
        let modules = Arc::new(Mutex::new(ByModule::new()));
        let (heard, stalls) = (Arc::clone(&modules), stalls.clone());
        let callback = move |sample: zenoh::sample::Sample| {
            let Ok(status) = wire::decode::<ModuleStatus>(&sample.payload().to_bytes()) else {
                return;
            };
            note(&mut heard.lock().unwrap(), status, stalls.total());
        };
        let subscriber = observer.session.declare_subscriber("trusswatch/tower/*/status");
        Self { modules, _subscriber: subscriber.callback(callback).await.unwrap() }
    }

    /// What has been heard.
    pub fn modules(&self) -> MutexGuard<'_, ByModule> {
        self.modules.lock().unwrap()
    }
}

/// Messages from before the first step do not count: nothing moves yet.
fn note(modules: &mut ByModule, status: ModuleStatus, stalled: Duration) {
    if status.step.is_none() {
        return;
    }
    match modules.get_mut(&status.module) {
        Some(heartbeat) => heartbeat.beat(status, stalled),
        None => {
            modules.insert(status.module.clone(), Heartbeat::first(status, stalled));
        }
    }
}
