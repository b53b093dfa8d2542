//! Liveness signals of one module, in the order of their arrival.

use tokio::sync::mpsc::unbounded_channel;
use wire::{ModuleStatus, PhaseChange, Progress};
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use crate::arrivals::Arrivals;
use crate::noted::{listen, read};
use crate::observer::{Observer, unix_ns};

/// A liveness signal of a module.
#[derive(Debug, Clone)]
pub enum Sign {
    /// Its liveliness token has appeared or disappeared.
    Present(bool),
    /// Its status.
    Status(Box<ModuleStatus>),
    /// It has entered another phase.
    Phase(PhaseChange),
    /// Its progress.
    Progress(Progress),
}

/// The signals of a module.
pub type Signs = Arrivals<Sign, ([Subscriber<()>; 3], AdvancedSubscriber<()>)>;

impl Signs {
    /// Listens from now on.
    pub async fn of(observer: &Observer, module: &str) -> Self {
        let (sender, arrivals) = unbounded_channel();
        let take = move |sign: Sign| {
            // There is no receiver any more when a test is over.
            let _ = sender.send((unix_ns(), sign));
        };
        let key = |topic: &str| format!("trusswatch/{}/{module}/{topic}", observer.structure);
        let session = &observer.session;
        let present = take.clone();
        let present = move |token: Sample| present(Sign::Present(token.kind() == SampleKind::Put));
        let tokens = session.liveliness().declare_subscriber(key("alive")).history(true);
        let tokens = tokens.callback(present).await.unwrap();
        let status = take.clone();
        let status =
            move |_: &Sample, message: ModuleStatus| status(Sign::Status(Box::new(message)));
        let statuses = listen(session, &key("status"), status).await;
        let progress = take.clone();
        let progress = move |_: &Sample, message: Progress| progress(Sign::Progress(message));
        let progresses = listen(session, &key("progress"), progress).await;
        let phase = move |sample: Sample| {
            if let Some(change) = read(&sample) {
                take(Sign::Phase(change));
            }
        };
        // A starting diagnoser may publish its first phase before it is discovered.
        let history = HistoryConfig::default().detect_late_publishers().max_samples(16);
        let phases = session.declare_subscriber(key("phase")).callback(phase).advanced();
        let phases = phases.history(history).await.unwrap();
        Self::by(arrivals, ([tokens, statuses, progresses], phases))
    }
}
