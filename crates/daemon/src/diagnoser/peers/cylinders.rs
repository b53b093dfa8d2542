//! What peers' cylinders can do, for the interlock of shutting off.

use std::sync::Arc;
use std::time::Instant;

use diagnosis::messages::Speaker;
use parking_lot::Mutex;
use process::ShutOffInterlock;
use vocabulary::{Capability, Key, ModuleName, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::messages;

/// Shared with the diagnosis.
pub(crate) type SharedInterlock = Arc<Mutex<ShutOffInterlock>>;

/// Listens to peers, if any cylinder may be shut off.
pub(crate) async fn watch_cylinders(
    session: &Session,
    speaker: &Speaker,
    peers: &[ModuleName],
    interlock: &SharedInterlock,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::new();
    if !interlock.lock().permits_any() {
        return Ok(subscribers);
    }
    for peer in peers {
        let key = Key::of_module(&speaker.structure, peer, Topic::Capability).to_string();
        let (peer, interlock) = (peer.clone(), Arc::clone(interlock));
        let subscriber = session.declare_subscriber(key).callback(move |sample| {
            match messages::read(&sample, Capability::key) {
                Ok(said) => interlock.lock().hear(&peer, &said.cylinders, Instant::now()),
                // Without it nothing is shut off.
                Err(why) => tracing::warn!(%peer, "what its cylinders can do is not said: {why}"),
            }
        });
        subscribers.push(subscriber.await?);
    }
    Ok(subscribers)
}
