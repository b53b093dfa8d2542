//! The parent on the network: a third party that listens to everyone.

use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use truss::ids::StructureName;
use wire::keys::Watched;
use zenoh::Session;
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{AdvancedSubscriberBuilderExt, HistoryConfig, RecoveryConfig};

use super::news::{self, News};
use crate::failure::Failure;

/// Most fault transitions and changes of one source that are asked for again.
const HISTORY: usize = 1000;

/// The parent's place on the network.
pub(super) struct Network {
    session: Session,
    inbox: UnboundedReceiver<News>,
}

fn broken(what: &str) -> impl Fn(zenoh::Error) -> Failure + '_ {
    move |error| Failure::network(format!("cannot {what}: {error}"))
}

impl Network {
    /// Listens at `own` for those who watch, and connects to the endpoints as they come up.
    pub(super) async fn open(
        structure: &StructureName,
        own: &str,
        endpoints: &[String],
    ) -> Result<Network, Failure> {
        let session = zenoh::open(config(own, endpoints)?).await.map_err(broken("open a session"))?;
        // Memory is bounded all the same: a demo ends after some tens of seconds.
        let (outbox, inbox) = unbounded_channel();
        let watched = Watched { structure: Some(structure), module: None };
        for expression in [watched.faults(), watched.changes()] {
            subscribe_to_history(&session, &expression, outbox.clone()).await?;
        }
        for expression in [watched.statuses(), watched.progress()] {
            subscribe(&session, &expression, outbox.clone()).await?;
        }
        subscribe_to_tokens(&session, &watched.tokens(), outbox).await?;
        Ok(Network { session, inbox })
    }

    /// The next piece of news.
    pub(super) async fn next(&mut self) -> Result<News, Failure> {
        self.inbox.recv().await.ok_or_else(|| Failure::network("the session was closed"))
    }

    /// Leaves the network.
    pub(super) async fn close(self) {
        // An error means that it is closed already.
        let _ = self.session.close().await;
    }
}

fn config(own: &str, endpoints: &[String]) -> Result<zenoh::Config, Failure> {
    let mut config = zenoh::Config::default();
    let settings = [
        ("mode", "\"peer\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("scouting/gossip/enabled", "false".to_owned()),
        ("listen/endpoints", serde_json::json!([own]).to_string()),
        ("connect/endpoints", serde_json::json!(endpoints).to_string()),
        ("connect/timeout_ms", "-1".to_owned()),
        ("connect/exit_on_failure", "false".to_owned()),
        (
            "connect/retry",
            "{ period_init_ms: 50, period_max_ms: 200, period_increase_factor: 1.5 }".to_owned(),
        ),
        ("transport/link/tx/lease", "1000".to_owned()),
    ];
    for (key, value) in settings {
        config.insert_json5(key, &value).map_err(broken("configure the session"))?;
    }
    Ok(config)
}

/// Hands a sample on. A callback must not wait, and this one does not.
fn hand_on(outbox: &UnboundedSender<News>, sample: &Sample) {
    if let Some(news) = news::read(sample.key_expr().as_str(), &sample.payload().to_bytes()) {
        // Nobody listens any more when the demo is ending.
        let _ = outbox.send(news);
    }
}

async fn subscribe(
    session: &Session,
    expression: &str,
    outbox: UnboundedSender<News>,
) -> Result<(), Failure> {
    session
        .declare_subscriber(expression)
        .callback(move |sample| hand_on(&outbox, &sample))
        .background()
        .await
        .map_err(broken("subscribe"))
}

async fn subscribe_to_history(
    session: &Session,
    expression: &str,
    outbox: UnboundedSender<News>,
) -> Result<(), Failure> {
    session
        .declare_subscriber(expression)
        .callback(move |sample| hand_on(&outbox, &sample))
        .advanced()
        .history(HistoryConfig::default().detect_late_publishers().max_samples(HISTORY))
        .recovery(RecoveryConfig::default().heartbeat())
        .background()
        .await
        .map_err(broken("subscribe"))
}

async fn subscribe_to_tokens(
    session: &Session,
    expression: &str,
    outbox: UnboundedSender<News>,
) -> Result<(), Failure> {
    let hand_on = move |sample: Sample| {
        let there = sample.kind() == SampleKind::Put;
        if let Some(news) = news::read_token(sample.key_expr().as_str(), there) {
            // Nobody listens any more when the demo is ending.
            let _ = outbox.send(news);
        }
    };
    session
        .liveliness()
        .declare_subscriber(expression)
        .history(true)
        .callback(hand_on)
        .background()
        .await
        .map_err(broken("watch who is there"))
}
