//! When each sample was published, by its publisher's clock, which is this machine's.

use std::collections::BTreeMap;

use vocabulary::{FaultTransition, ModuleName, Sample, Step};

use crate::in_time;
use crate::noted::Noted;
use crate::observer::Observer;

type Times = BTreeMap<(ModuleName, Step), u64>;

/// Notes the samples of every module, or of some.
pub struct Publications(Noted<Times>);

impl Publications {
    /// Notes those of every module from now on.
    pub async fn of(observer: &Observer) -> Self {
        Self::of_modules(observer, &["*".to_owned()]).await
    }

    /// Notes those of these modules from now on.
    pub async fn of_modules(observer: &Observer, modules: &[String]) -> Self {
        let keys = modules.iter().map(|module| format!("trusswatch/*/{module}/sample"));
        let keys: Vec<String> = keys.collect();
        let note = |times: &mut Times, sample: Sample| {
            times.insert((sample.module, sample.step), sample.time_unix_ns);
        };
        Self(Noted::of(&observer.session, &keys, Times::new(), note).await)
    }

    /// When a sample was published \[ns since 1970\]; of one that did not get here, when the last
    /// one before it was, which makes no delay shorter. Waits until it or a later one is here: what
    /// it led to may have come over another link.
    ///
    /// # Panics
    /// If none comes.
    pub async fn time_of(&self, module: &ModuleName, step: Step) -> u64 {
        let of_module = |last| (module.clone(), Step(0))..=(module.clone(), last);
        let find = |times: &Times| {
            times.range(of_module(Step(u64::MAX))).next_back().filter(|(key, _)| key.1 >= step)?;
            times.range(of_module(step)).next_back().map(|(_, time)| *time)
        };
        in_time(&format!("sample {step} of {module}"), self.0.first(find)).await
    }

    /// From the publication of the sample that decided each message to its arrival \[ms\].
    ///
    /// # Panics
    /// If a message has no step, or its sample was not published.
    pub async fn delays_ms<'a>(
        &self,
        messages: impl IntoIterator<Item = &'a (u64, FaultTransition)>,
    ) -> Vec<f64> {
        let mut delays = Vec::new();
        for (arrival, message) in messages {
            let decided = self.time_of(&message.module, message.decided_step.unwrap()).await;
            delays.push(arrival.saturating_sub(decided) as f64 / 1e6);
        }
        delays
    }
}
