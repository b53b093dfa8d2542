//! Which peers are there: their liveliness tokens.

use std::collections::BTreeSet;
use std::time::Duration;

use diagnosis::Event;
use tokio::sync::mpsc;
use vocabulary::{ModuleName, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use super::PeerTable;
use diagnosis::messages::Speaker;

/// How long a token is looked for.
const LOOK_UP: Duration = Duration::from_millis(200);
/// How often tokens are looked for that the network may be wrong about.
pub(crate) const LOOK_EVERY: Duration = Duration::from_secs(5);

/// Watches every peer; the diagnoser is informed of those that return.
pub(crate) async fn watch(
    session: &Session,
    speaker: &Speaker,
    peers: &[ModuleName],
    table: &PeerTable,
    events: &mpsc::Sender<Event>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::with_capacity(peers.len());
    for peer in peers {
        let key = vocabulary::Key::of_module(&speaker.structure, peer, Topic::Alive).to_string();
        let (peer, table, events) = (peer.clone(), table.clone(), events.clone());
        let subscriber = session
            .liveliness()
            .declare_subscriber(key)
            .history(true)
            .callback(move |token| {
                let present = token.kind() == SampleKind::Put;
                tracing::info!(%peer, "peer {}", if present { "reachable" } else { "disappeared" });
                table.note_presence(&peer, present);
                if present {
                    // If the queue is full, the peer is queried again later anyway.
                    let _ = events.try_send(Event::Returned { peer: peer.clone() });
                }
            })
            .await?;
        subscribers.push(subscriber);
    }
    Ok(subscribers)
}

/// Which peers are present, to be looked up.
#[derive(Debug, Clone)]
pub(crate) struct Presence {
    session: Session,
    speaker: Speaker,
    table: PeerTable,
}

impl Presence {
    pub(crate) fn new(session: &Session, speaker: &Speaker, table: PeerTable) -> Self {
        Self { session: session.clone(), speaker: speaker.clone(), table }
    }

    /// Is the peer there, as far as is known or can be found out?
    pub(crate) async fn is_there(&self, peer: &ModuleName) -> bool {
        self.table.is_present(peer) || self.look_again(peer).await
    }

    /// Looks now and then for the peers that seem to be absent, and whether those that were found so are still
    /// there; for as long as it is polled.
    pub(crate) async fn keep_looking(
        self,
        peers: Vec<ModuleName>,
        events: mpsc::Sender<Event>,
        every: Duration,
    ) {
        let mut found = BTreeSet::new();
        loop {
            tokio::time::sleep(every).await;
            for peer in &peers {
                let seemed_there = self.table.is_present(peer);
                if seemed_there && !found.contains(peer) {
                    continue;
                }
                match (seemed_there, self.look_again(peer).await) {
                    (false, true) => {
                        found.insert(peer);
                        // If the queue is full, the peer is queried again later anyway.
                        let _ = events.try_send(Event::Returned { peer: peer.clone() });
                    }
                    (true, false) => {
                        found.remove(peer);
                        tracing::info!(%peer, "peer disappeared");
                        self.table.note_presence(peer, false);
                    }
                    (true, true) | (false, false) => {}
                }
            }
        }
    }

    /// Asks the network for a peer's token. When one of two links between processes ends, the network may
    /// report that a token has gone though the other link still has it, and never take that back.
    async fn look_again(&self, peer: &ModuleName) -> bool {
        let key =
            vocabulary::Key::of_module(&self.speaker.structure, peer, Topic::Alive).to_string();
        let liveliness = self.session.liveliness();
        let Ok(replies) = liveliness.get(key).timeout(LOOK_UP).await else { return false };
        while let Ok(reply) = replies.recv_async().await {
            if reply.result().is_ok() {
                tracing::info!(%peer, "peer reachable again");
                self.table.note_presence(peer, true);
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODULE: &str = "m2";

    /// What the table says, as soon as it says so.
    async fn wait_for(table: &PeerTable, present: bool) {
        let peer = MODULE.parse().unwrap();
        let said = async {
            while table.is_present(&peer) != present {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(Duration::from_secs(10), said).await.unwrap();
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_peer_that_is_there_after_all_is_found_and_missed_again() {
        let session = session::open(&session::Network::default()).await.unwrap();
        let speaker = Speaker::of("t".parse().unwrap(), "m1".parse().unwrap());
        let peer: ModuleName = MODULE.parse().unwrap();
        let key = vocabulary::Key::of_module(&speaker.structure, &peer, Topic::Alive).to_string();
        let token = session.liveliness().declare_token(key).await.unwrap();
        let table = PeerTable::new(std::slice::from_ref(&peer));
        let (events, mut returned) = mpsc::channel(1);
        let presence = Presence::new(&session, &speaker, table.clone());
        let looking = presence.keep_looking(vec![peer.clone()], events, Duration::from_millis(10));
        let looking = tokio::spawn(looking);
        wait_for(&table, true).await;
        assert_eq!(returned.recv().await, Some(Event::Returned { peer }));
        token.undeclare().await.unwrap();
        wait_for(&table, false).await;
        looking.abort();
        session::close(&session).await;
    }
}
