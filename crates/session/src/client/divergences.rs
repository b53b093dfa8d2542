//! The divergences of a module as its diagnoser publishes them, which it does only while there is a subscriber.

use tokio::sync::mpsc::{Receiver, channel};
use vocabulary::{Divergences, Key, ModuleName, StructureName, Topic, keys::Watched};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use super::presence::AttendanceError;

/// Capacity of the message queue; further messages are dropped.
const QUEUE: usize = 256;

/// A subscription to the divergences of one module, ended by dropping it.
#[derive(Debug)]
pub struct DivergenceFeed {
    inbox: Receiver<Divergences>,
    _subscriber: Subscriber<()>,
}

impl DivergenceFeed {
    /// Subscribes.
    ///
    /// # Errors
    /// Zenoh cannot declare the subscriber.
    pub async fn open(
        session: &Session,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Result<Self, AttendanceError> {
        let (outlet, inbox) = channel(QUEUE);
        let watched = Watched { structure: Some(structure), module: Some(module) };
        let subscriber = session
            .declare_subscriber(watched.divergences())
            .callback(move |sample| {
                let key = sample.key_expr().as_str().parse::<Key>();
                let Ok(Key::Module { structure, module, topic: Topic::Divergence }) = key else {
                    return;
                };
                let message = vocabulary::decode::<Divergences>(&sample.payload().to_bytes());
                let own = |read: &Divergences| read.structure == structure && read.module == module;
                if let Ok(message) = message
                    && own(&message)
                {
                    let _ = outlet.try_send(message);
                }
            })
            .await
            .map_err(|error| AttendanceError::Network(error.to_string()))?;
        Ok(Self { inbox, _subscriber: subscriber })
    }

    /// Waits for the next message; `None` once the session is closed.
    pub async fn next(&mut self) -> Option<Divergences> {
        self.inbox.recv().await
    }
}
