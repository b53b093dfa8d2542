//! A third-party monitoring client.

use std::collections::BTreeMap;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use ::observer::News;
use session::Network;
use session::client::Live;
use tokio::sync::mpsc::unbounded_channel;
use tokio::task::JoinSet;
use vocabulary::{
    FaultTransition, Injection, ModuleName, ModulePhase, ModuleStatus, Step, StructureName,
    fault::Fault, keys::Watched,
};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};

use crate::arrivals::Arrivals;
use crate::deployment::{Deployment, LONGEST_LEASE_MS};
use crate::in_time;
use crate::noted::{Noted, read};

/// A session that is connected to every process of a deployment.
pub struct Observer {
    /// The session.
    pub session: Session,
    /// The structure.
    pub structure: StructureName,
}

/// Fault transitions as they arrive.
pub type Faults = Arrivals<FaultTransition, Hearing>;

/// Hears as long as it lives.
pub type Hearing = JoinSet<()>;

/// The latest status of each module.
pub type Statuses = BTreeMap<ModuleName, ModuleStatus>;

/// Nanoseconds since 1970.
#[must_use]
pub fn unix_ns() -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    u64::try_from(now.as_nanos()).unwrap()
}

/// Timeout for the states of the modules; those received by then are used.
const STATES_WITHIN: Duration = Duration::from_millis(300);
/// In service for so long that no effect may be older than its cause \[steps\].
const WATCHED: u64 = 500;

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
        states.extend(read::<FaultTransition>(sample));
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
        // Without a laboratory no link breaks, and nobody is to give the observer up because it is kept waiting.
        let lease_ms = (!deployment.is_in_lab()).then_some(LONGEST_LEASE_MS);
        let network = Network { lease_ms, ..network };
        Self::through(&network, "tower".parse().unwrap()).await
    }

    /// Connects through this network, to watch this structure.
    pub async fn through(network: &Network, structure: StructureName) -> Self {
        let session = in_time("the observer's session", session::open(network)).await.unwrap();
        Self { session, structure }
    }

    /// Waits until the diagnosers, and the plant if asked for, are there.
    pub async fn wait_for(&self, modules: &[&str], plant: bool) {
        let modules: Vec<ModuleName> = modules.iter().map(|name| name.parse().unwrap()).collect();
        let there = session::client::wait_for(
            &self.session,
            &self.structure,
            &modules,
            plant,
            crate::LIMIT,
        );
        there.await.unwrap();
    }

    /// Waits until these modules have been in service for so long that they can judge any change.
    pub async fn wait_until_watching(&self, modules: &[&str]) {
        let is_watching = |status: &ModuleStatus| {
            let since =
                status.in_service_since_step.filter(|_| status.phase == ModulePhase::InService);
            since.zip(status.step).is_some_and(|(since, now)| now.since(since) > WATCHED)
        };
        for module in modules {
            self.status_of(module, is_watching).await;
        }
    }

    /// Has the plant give a component a fault, or none, at its next step, and returns that step.
    pub async fn inject(&self, component: &str, fault: Option<Fault>) -> Step {
        let order = Injection { component: component.parse().unwrap(), fault, at_step: None };
        let done =
            session::client::inject(&self.session, &self.structure, &order, crate::LIMIT).await;
        done.unwrap().effective_step
    }

    /// Waits until a process has gone, by its liveliness token.
    pub async fn wait_until_gone(&self, name: &str) {
        let key = format!("trusswatch/{}/{name}/alive", self.structure);
        let gone = async {
            while self.session.liveliness().get(&key).await.unwrap().recv_async().await.is_ok() {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time("the end of a liveliness token", gone).await;
    }

    /// Hands all news to `take`, the latest of every component before now included.
    pub(crate) async fn hear(&self, take: impl Fn(News) + Send + 'static) -> Hearing {
        let mut live = Live::events(&self.session, None).await.unwrap();
        let mut hearing = JoinSet::new();
        hearing.spawn(async move {
            while let Some(event) = live.next_event().await {
                take(event.news.clone());
            }
        });
        hearing
    }

    /// Listens to every fault transition, the latest of every component before now included.
    pub async fn faults(&self) -> Faults {
        let (sender, arrivals) = unbounded_channel();
        let take = move |news| {
            if let News::Fault(transition) | News::Present(transition) = news {
                // There is no receiver any more when a test is over.
                let _ = sender.send((unix_ns(), *transition));
            }
        };
        Arrivals::by(arrivals, self.hear(take).await)
    }

    /// Collects the latest status of every module from now on.
    pub async fn statuses(&self) -> Noted<Statuses> {
        let note = |latest: &mut Statuses, status: ModuleStatus| {
            latest.insert(status.module.clone(), status);
        };
        let keys = [Watched::default().statuses()];
        Noted::of(&self.session, &keys, Statuses::new(), note).await
    }

    /// Waits for a status that is as wanted.
    pub async fn status(&self, wanted: impl Fn(&ModuleStatus) -> bool) -> ModuleStatus {
        let statuses = self.statuses().await;
        let found = statuses.first(|latest| latest.values().find(|one| wanted(one)).cloned());
        match tokio::time::timeout(crate::LIMIT, found).await {
            Ok(status) => status,
            Err(_) => panic!("no status as wanted, but {:#?}", *statuses.so_far()),
        }
    }

    /// Waits for a status of one module that is as wanted.
    pub async fn status_of(
        &self,
        module: &str,
        wanted: impl Fn(&ModuleStatus) -> bool,
    ) -> ModuleStatus {
        self.status(|status| status.module.as_str() == module && wanted(status)).await
    }
}
