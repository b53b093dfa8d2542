//! The worst values of each module's statuses over a period, less what the machine was busy otherwise.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::{ModuleStatus, keys::Watched};

use crate::noted::Noted;
use crate::observer::Observer;
use crate::soak::Stalls;

/// The worst values of one module.
#[derive(Debug, Clone, Copy, Default)]
pub struct Worst {
    /// Number of statuses.
    pub statuses: u64,
    /// The oldest latest sample, less how long the machine had stood still since the status before \[ms\].
    pub sample_age_ms: f64,
    /// The longest way of a sample from its publication to its diagnosis \[ms\].
    pub lag_ms: f64,
    /// Most samples that waited.
    pub queued_samples: u64,
    /// The longest time without a status.
    pub silence: Duration,
    latest: Option<Instant>,
    stalled: Duration,
}

type ByModule = BTreeMap<String, Worst>;

/// Listens to every module's status.
pub struct WorstStatus(Noted<ByModule>);

impl WorstStatus {
    /// Listens from now on.
    pub async fn of(observer: &Observer) -> Self {
        let stalls = Stalls::watched();
        let note = move |by_module: &mut ByModule, status: ModuleStatus| {
            let worst = by_module.entry(status.module.to_string()).or_default();
            worst.note(&status, stalls.total());
        };
        let keys = [Watched::default().statuses()];
        Self(Noted::of(&observer.session, &keys, ByModule::new(), note).await)
    }

    /// The worst of a module so far; its present silence counts.
    #[must_use]
    pub fn of_module(&self, module: &str) -> Worst {
        let mut worst = self.0.so_far().get(module).copied().unwrap_or_default();
        worst.silence = worst.silence.max(worst.latest.map_or(Duration::MAX, |at| at.elapsed()));
        worst
    }
}

impl Worst {
    fn note(&mut self, status: &ModuleStatus, stalled: Duration) {
        let now = Instant::now();
        self.statuses += 1;
        let excuse_ms = 1e3 * (stalled - self.stalled).as_secs_f64();
        let age_ms = status.sample_age_ms.unwrap_or(0.0) - excuse_ms;
        self.sample_age_ms = self.sample_age_ms.max(age_ms);
        self.stalled = stalled;
        self.lag_ms = self.lag_ms.max(status.lag_ms.unwrap_or(0.0));
        self.queued_samples = self.queued_samples.max(status.queued_samples);
        let silence = self.latest.map_or(Duration::ZERO, |latest| now - latest);
        self.silence = self.silence.max(silence);
        self.latest = Some(now);
    }
}
