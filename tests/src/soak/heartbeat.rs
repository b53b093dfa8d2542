//! A module's status messages: their regularity and contents.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use tokio::sync::watch::Ref;
use vocabulary::{ModuleName, ModuleStatus, Step};

use super::stalls::Stalls;
use crate::noted::Noted;
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
    /// The largest lag reported \[ms\].
    pub largest_lag_ms: f64,
    /// Most samples that waited at a time.
    pub most_queued: u64,
    /// Messages that reported no more steps than the one before.
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

    /// The latest step reported.
    #[must_use]
    pub fn step(&self) -> Step {
        self.latest.step.unwrap_or_default()
    }
}

type ByModule = BTreeMap<ModuleName, Heartbeat>;

/// The heartbeats of all modules.
pub struct Heartbeats(Noted<ByModule>);

impl Heartbeats {
    /// Listens from now on.
    pub async fn of(observer: &Observer, stalls: &Stalls) -> Self {
        let stalls = stalls.clone();
        let take = move |modules: &mut ByModule, status: ModuleStatus| {
            note(modules, status, stalls.total());
        };
        let keys = ["trusswatch/tower/*/status".to_owned()];
        Self(Noted::of(&observer.session, &keys, ByModule::new(), take).await)
    }

    /// The heartbeats so far.
    pub fn modules(&self) -> Ref<'_, ByModule> {
        self.0.so_far()
    }

    /// A module's heartbeats up to the one that reports this step. Nothing else that listens to the same
    /// messages says that this one has got as far.
    pub async fn up_to(&self, module: &ModuleName, step: Step) -> Heartbeat {
        let there = |heartbeat: &&Heartbeat| heartbeat.latest.step == Some(step);
        self.0.first(|modules| modules.get(module).filter(there).cloned()).await
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
