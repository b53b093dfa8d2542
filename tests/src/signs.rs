//! Signs of life of one module, in the order of their arrival.

use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use wire::{ModuleStatus, PhaseChange, Progress};
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use crate::in_time;
use crate::observer::{Observer, unix_ns};

/// Something heard of a module.
#[derive(Debug, Clone)]
pub enum Sign {
    /// Its liveliness token is there, or has gone.
    Present(bool),
    /// Its status.
    Status(Box<ModuleStatus>),
    /// It has entered another phase.
    Phase(PhaseChange),
    /// How far it has come.
    Progress(Progress),
}

/// What is heard of a module, with the time of arrival \[ns since 1970\].
pub struct Signs {
    arrivals: UnboundedReceiver<(u64, Sign)>,
    _subscribers: [Subscriber<()>; 3],
    _phases: AdvancedSubscriber<()>,
}

impl Signs {
    /// Listens from now on.
    pub async fn of(observer: &Observer, module: &str) -> Self {
        let (sender, arrivals) = unbounded_channel();
        let key = |topic: &str| format!("trusswatch/{}/{module}/{topic}", observer.structure);
        let session = &observer.session;
        let present = |sample: &Sample| Some(Sign::Present(sample.kind() == SampleKind::Put));
        let status = |sample: &Sample| {
            let status = wire::decode(&sample.payload().to_bytes()).ok()?;
            Some(Sign::Status(Box::new(status)))
        };
        let progress =
            |sample: &Sample| wire::decode(&sample.payload().to_bytes()).ok().map(Sign::Progress);
        let phase =
            |sample: &Sample| wire::decode(&sample.payload().to_bytes()).ok().map(Sign::Phase);
        let tokens = session.liveliness().declare_subscriber(key("alive")).history(true);
        let statuses = session.declare_subscriber(key("status"));
        let progresses = session.declare_subscriber(key("progress"));
        // Whoever has just started may tell its first phase before it is heard.
        let history = HistoryConfig::default().detect_late_publishers().max_samples(16);
        let phases = session.declare_subscriber(key("phase"));
        Self {
            _subscribers: [
                tokens.callback(hand_to(sender.clone(), present)).await.unwrap(),
                statuses.callback(hand_to(sender.clone(), status)).await.unwrap(),
                progresses.callback(hand_to(sender.clone(), progress)).await.unwrap(),
            ],
            _phases: phases
                .callback(hand_to(sender, phase))
                .advanced()
                .history(history)
                .await
                .unwrap(),
            arrivals,
        }
    }

    /// The next sign.
    pub async fn next(&mut self) -> (u64, Sign) {
        in_time("a sign of life", self.arrivals.recv()).await.unwrap()
    }

    /// The next one that is as wanted, as far as it is.
    pub async fn find<T>(&mut self, wanted: impl Fn(u64, &Sign) -> Option<T>) -> T {
        let found = async {
            loop {
                let (at, sign) = self.next().await;
                if let Some(found) = wanted(at, &sign) {
                    return found;
                }
            }
        };
        in_time("a sign of life as wanted", found).await
    }

    /// Everything that has arrived so far.
    pub fn arrived(&mut self) -> Vec<(u64, Sign)> {
        std::iter::from_fn(|| self.arrivals.try_recv().ok()).collect()
    }
}

fn hand_to(
    sender: UnboundedSender<(u64, Sign)>,
    read: impl Fn(&Sample) -> Option<Sign> + Send + Sync + 'static,
) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        if let Some(sign) = read(&sample) {
            // Nobody listens any more when a test is over.
            let _ = sender.send((unix_ns(), sign));
        }
    }
}
