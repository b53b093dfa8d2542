//! A third party that listens.

use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use daemon::config::Network;
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};
use truss::ids::{ModuleName, StructureName};
use wire::{FaultTransition, ModuleStatus};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use crate::deployment::Deployment;
use crate::in_time;

/// A session that is connected to every process of a deployment.
pub struct Observer {
    /// The session.
    pub session: Session,
    /// The structure.
    pub structure: StructureName,
}

/// Fault transitions as they arrive, with the time of arrival \[ns since 1970\].
pub struct Faults {
    arrivals: UnboundedReceiver<(u64, FaultTransition)>,
    _subscriber: AdvancedSubscriber<()>,
}

/// Nanoseconds since 1970.
#[must_use]
pub fn unix_ns() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    u64::try_from(now.as_nanos()).unwrap()
}

/// Whoever has not told its states by then does not; the others' are used.
const STATES_WITHIN: Duration = Duration::from_millis(300);

/// The present states of all components of the modules that answer.
pub async fn states(session: &Session) -> Vec<FaultTransition> {
    let replies = session
        .get("trusswatch/tower/*/fault/**")
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(STATES_WITHIN)
        .await
        .unwrap();
    let mut states = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        let Ok(sample) = reply.result() else { continue };
        states.extend(wire::decode::<FaultTransition>(&sample.payload().to_bytes()));
    }
    states
}

impl Observer {
    /// Connects, or lets the others connect.
    pub async fn of(deployment: &Deployment) -> Self {
        let network = match &deployment.onlooker {
            Some(own) => Network { listen: vec![own.clone()], ..Network::default() },
            None => Network::peer_of(&deployment.endpoints),
        };
        let session =
            in_time("the observer's session", daemon::session::open(&network)).await.unwrap();
        Self { session, structure: "tower".parse().unwrap() }
    }

    /// Waits until the diagnosers, and the plant if asked for, are there.
    pub async fn wait_for(&self, modules: &[&str], plant: bool) {
        let modules: Vec<ModuleName> = modules.iter().map(|name| name.parse().unwrap()).collect();
        let there = daemon::observer::wait_for(
            &self.session,
            &self.structure,
            &modules,
            plant,
            crate::LIMIT,
        );
        there.await.unwrap();
    }

    /// Waits until a process has gone, as its liveliness token tells.
    pub async fn wait_until_gone(&self, name: &str) {
        let key = format!("trusswatch/{}/{name}/alive", self.structure);
        let gone = async {
            while self.session.liveliness().get(&key).await.unwrap().recv_async().await.is_ok() {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time("the end of a liveliness token", gone).await;
    }

    /// Listens to every fault transition, those before now included.
    pub async fn faults(&self) -> Faults {
        let (sender, arrivals) = unbounded_channel();
        let callback = move |sample: zenoh::sample::Sample| {
            let message = wire::decode(&sample.payload().to_bytes()).unwrap();
            let _ = sender.send((unix_ns(), message));
        };
        let subscriber = self.session.declare_subscriber("trusswatch/*/*/fault/**");
        let history = HistoryConfig::default().detect_late_publishers().max_samples(64);
        let recovery = RecoveryConfig::default().heartbeat();
        let subscriber = subscriber.callback(callback).advanced().history(history);
        let _subscriber = subscriber.recovery(recovery).await.unwrap();
        Faults { arrivals, _subscriber }
    }

    /// Collects the latest status of every module from now on.
    pub async fn statuses(&self) -> (Subscriber<()>, Arc<Mutex<Vec<ModuleStatus>>>) {
        let statuses = Arc::new(Mutex::new(Vec::<ModuleStatus>::new()));
        let latest = statuses.clone();
        let callback = move |sample: zenoh::sample::Sample| {
            let Ok(status) = wire::decode::<ModuleStatus>(&sample.payload().to_bytes()) else {
                return;
            };
            let mut latest = latest.lock().unwrap();
            latest.retain(|other| other.module != status.module);
            latest.push(status);
        };
        let subscriber = self.session.declare_subscriber("trusswatch/*/*/status");
        (subscriber.callback(callback).await.unwrap(), statuses)
    }

    /// Waits for a status that is as wanted.
    pub async fn status(&self, wanted: impl Fn(&ModuleStatus) -> bool) -> ModuleStatus {
        let (_subscriber, statuses) = self.statuses().await;
        let found = async {
            loop {
                let found = statuses.lock().unwrap().iter().find(|status| wanted(status)).cloned();
                if let Some(status) = found {
                    return status;
                }
                tokio::time::sleep(Duration::from_millis(10)).await;
            }
        };
        match tokio::time::timeout(crate::LIMIT, found).await {
            Ok(status) => status,
            Err(_) => panic!("no status as wanted, but {:#?}", statuses.lock().unwrap()),
        }
    }
}

impl Faults {
    /// The next transition and when it arrived.
    pub async fn next(&mut self) -> (u64, FaultTransition) {
        in_time("a fault transition", self.arrivals.recv()).await.unwrap()
    }

    /// The next transition, however long it takes; `None` when there will be none.
    pub async fn recv(&mut self) -> Option<(u64, FaultTransition)> {
        self.arrivals.recv().await
    }

    /// Everything that has arrived so far.
    pub fn arrived(&mut self) -> Vec<(u64, FaultTransition)> {
        std::iter::from_fn(|| self.arrivals.try_recv().ok()).collect()
    }
}
