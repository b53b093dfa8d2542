//! The worst that each module's statuses have told for a while.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use wire::ModuleStatus;
use zenoh::pubsub::Subscriber;

use crate::observer::Observer;

/// What one module told.
#[derive(Debug, Clone, Copy, Default)]
pub struct Worst {
    /// How many statuses.
    pub statuses: u64,
    /// The oldest latest sample \[ms\].
    pub sample_age_ms: f64,
    /// The longest way of a sample from its publication to its diagnosis \[ms\].
    pub lag_ms: f64,
    /// Most samples that waited.
    pub queued_samples: u64,
    /// The longest time without a status.
    pub silence: Duration,
    latest: Option<Instant>,
}

/// Listens to every module's status.
pub struct WorstStatus {
    told: Arc<Mutex<BTreeMap<String, Worst>>>,
    _subscriber: Subscriber<()>,
}

impl WorstStatus {
    /// Listens from now on.
    pub async fn of(observer: &Observer) -> Self {
        let told = Arc::<Mutex<BTreeMap<String, Worst>>>::default();
        let noted = Arc::clone(&told);
        let callback = move |sample: zenoh::sample::Sample| {
            // The plant has a status too.
            let decoded = wire::decode::<ModuleStatus>(&sample.payload().to_bytes());
            let Ok(status) = decoded else { return };
            noted.lock().unwrap().entry(status.module.to_string()).or_default().note(&status);
        };
        let subscriber = observer.session.declare_subscriber("trusswatch/*/*/status");
        Self { told, _subscriber: subscriber.callback(callback).await.unwrap() }
    }

    /// The worst of a module so far; its present silence counts.
    #[must_use]
    pub fn of_module(&self, module: &str) -> Worst {
        let mut worst = self.told.lock().unwrap().get(module).copied().unwrap_or_default();
        worst.silence = worst.silence.max(worst.latest.map_or(Duration::MAX, |at| at.elapsed()));
        worst
    }
}

impl Worst {
    fn note(&mut self, status: &ModuleStatus) {
        let now = Instant::now();
        self.statuses += 1;
        self.sample_age_ms = self.sample_age_ms.max(status.sample_age_ms.unwrap_or(0.0));
        self.lag_ms = self.lag_ms.max(status.lag_ms.unwrap_or(0.0));
        self.queued_samples = self.queued_samples.max(status.queued_samples);
        let silence = self.latest.map_or(Duration::ZERO, |latest| now - latest);
        self.silence = self.silence.max(silence);
        self.latest = Some(now);
    }
}
