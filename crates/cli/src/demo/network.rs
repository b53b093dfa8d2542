//! The parent on the network: a subscriber to all processes.

use names::StructureName;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use wire::keys::Watched;
use zenoh::Session;
use zenoh::sample::{Sample, SampleKind};

use super::news::{self, News};
use crate::failure::Failure;

/// The parent's place on the network.
pub(super) struct Network {
    session: Session,
    inbox: UnboundedReceiver<News>,
}

fn broken(what: &str) -> impl Fn(zenoh::Error) -> Failure + '_ {
    move |error| Failure::network(format!("cannot {what}: {error}"))
}

impl Network {
    /// Listens at `own` for monitoring clients, and connects to the endpoints as they come up.
    pub(super) async fn open(
        structure: &StructureName,
        own: &str,
        endpoints: &[String],
    ) -> Result<Network, Failure> {
        let places = session::Network {
            listen: vec![own.to_owned()],
            ..session::Network::peer_of(endpoints)
        };
        let session =
            session::open(&places).await.map_err(|error| Failure::network(error.to_string()))?;
        // Memory is bounded all the same: a demo ends after some tens of seconds.
        let (outbox, inbox) = unbounded_channel();
        let watched = Watched { structure: Some(structure), module: None };
        // Before any process runs: nothing is published earlier.
        let events = [watched.faults(), watched.changes(), watched.identifications()];
        for expression in events.into_iter().chain([watched.statuses(), watched.progress()]) {
            subscribe(&session, &expression, outbox.clone()).await?;
        }
        subscribe_to_tokens(&session, &watched.tokens(), outbox).await?;
        Ok(Network { session, inbox })
    }

    /// The next message.
    pub(super) async fn next(&mut self) -> Result<News, Failure> {
        self.inbox.recv().await.ok_or_else(|| Failure::network("the session was closed"))
    }

    /// Leaves the network.
    pub(super) async fn close(self) {
        session::close(&self.session).await;
    }
}

/// Forwards a sample. A callback must not wait, and this one does not.
fn forward(outbox: &UnboundedSender<News>, sample: &Sample) {
    if let Some(news) = news::read(sample.key_expr().as_str(), &sample.payload().to_bytes()) {
        // The receiver is gone when the demo is ending.
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
        .callback(move |sample| forward(&outbox, &sample))
        .background()
        .await
        .map_err(broken("subscribe"))
}

async fn subscribe_to_tokens(
    session: &Session,
    expression: &str,
    outbox: UnboundedSender<News>,
) -> Result<(), Failure> {
    let forward = move |sample: Sample| {
        let there = sample.kind() == SampleKind::Put;
        if let Some(news) = news::read_token(sample.key_expr().as_str(), there) {
            // The receiver is gone when the demo is ending.
            let _ = outbox.send(news);
        }
    };
    session
        .liveliness()
        .declare_subscriber(expression)
        .history(true)
        .callback(forward)
        .background()
        .await
        .map_err(broken("watch liveliness tokens"))
}
