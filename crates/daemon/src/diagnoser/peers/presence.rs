//! Which peers are there: their liveliness tokens.

use std::time::Duration;

use diagnosis::Event;
use names::ModuleName;
use tokio::sync::mpsc;
use wire::Topic;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use super::standing::PeerBook;
use crate::convert::Speaker;

/// How long a token is looked for.
const LOOK_UP: Duration = Duration::from_millis(200);

/// Watches every peer; the diagnoser is informed of those that return.
pub(crate) async fn watch(
    session: &Session,
    speaker: &Speaker,
    peers: &[ModuleName],
    book: &PeerBook,
    events: &mpsc::Sender<Event>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::with_capacity(peers.len());
    for peer in peers {
        let key = wire::Key::of_module(&speaker.structure, peer, Topic::Alive).to_string();
        let (peer, book, events) = (peer.clone(), book.clone(), events.clone());
        let subscriber = session
            .liveliness()
            .declare_subscriber(key)
            .history(true)
            .callback(move |token| {
                let present = token.kind() == SampleKind::Put;
                tracing::info!(%peer, "peer {}", if present { "is there" } else { "has gone" });
                book.note_presence(&peer, present);
                if present {
                    // If there is no room, the peer is queried again later anyway.
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
    book: PeerBook,
}

impl Presence {
    pub(crate) fn new(session: &Session, speaker: &Speaker, book: PeerBook) -> Self {
        Self { session: session.clone(), speaker: speaker.clone(), book }
    }

    /// Is the peer there, as far as is known or can be found out?
    pub(crate) async fn is_there(&self, peer: &ModuleName) -> bool {
        self.book.is_present(peer) || self.look_again(peer).await
    }

    /// Asks the network for a peer's token. When one of two links between processes ends, the network may
    /// report that a token has gone though the other link still has it, and never take that back.
    async fn look_again(&self, peer: &ModuleName) -> bool {
        let key = wire::Key::of_module(&self.speaker.structure, peer, Topic::Alive).to_string();
        let liveliness = self.session.liveliness();
        let Ok(replies) = liveliness.get(key).timeout(LOOK_UP).await else { return false };
        while let Ok(reply) = replies.recv_async().await {
            if reply.result().is_ok() {
                tracing::info!(%peer, "peer is there after all");
                self.book.note_presence(peer, true);
                return true;
            }
        }
        false
    }
}
