//! Liveness signals of one module, in the order of their arrival.

use ::observer::News;
use tokio::sync::mpsc::unbounded_channel;
use vocabulary::{ModuleStatus, PhaseChange, Progress};
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::arrivals::Arrivals;
use crate::noted::listen;
use crate::observer::{Hearing, Observer, unix_ns};

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
pub type Signs = Arrivals<Sign, ([Subscriber<()>; 3], Hearing)>;

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
        let module = module.to_owned();
        let phase = move |news| match news {
            News::Phase(change) if change.module.as_str() == module => take(Sign::Phase(change)),
            _ => {}
        };
        // A starting diagnoser may publish its first phase before it is discovered: that one is queried.
        let phases = observer.hear(phase).await;
        Self::by(arrivals, ([tokens, statuses, progresses], phases))
    }
}
