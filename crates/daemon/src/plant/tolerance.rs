//! What modules say of their components, for the controller's tolerance of faults ([`plant::Tolerance`]).

use std::sync::mpsc::SyncSender;

use plant::{ModuleMessage, ToleranceSettings};
use vocabulary::{Capability, Corrected, Key, Message, StructureName, keys::Watched};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::messages;

/// Messages that wait for the next step; further ones are dropped.
pub(crate) const QUEUE: usize = 4096;

/// A message, or the reason why it cannot be read.
pub(crate) type Heard = Result<ModuleMessage, String>;

/// Listens to what the settings ask for.
pub(crate) async fn subscribe(
    session: &Session,
    structure: &StructureName,
    settings: &ToleranceSettings,
    news: SyncSender<Heard>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let watched = Watched { structure: Some(structure), module: None };
    let mut subscribers = Vec::new();
    if settings.corrected_readings {
        let (all, key, of) = (watched.corrected(), Corrected::key, ModuleMessage::Readings);
        subscribers.push(listen(session, all, news.clone(), key, of).await?);
    }
    if settings.reallocation || settings.most_shut_off > 0 {
        let (all, key, of) = (watched.capabilities(), Capability::key, ModuleMessage::Cylinders);
        subscribers.push(listen(session, all, news.clone(), key, of).await?);
    }
    Ok(subscribers)
}

/// Listens to messages.
async fn listen<M: Message + 'static>(
    session: &Session,
    expression: String,
    news: SyncSender<Heard>,
    key: fn(&M) -> Key,
    of: fn(M) -> ModuleMessage,
) -> zenoh::Result<Subscriber<()>> {
    let callback = move |sample: zenoh::sample::Sample| {
        // What comes too fast is superseded.
        let _ = news.try_send(messages::read(&sample, key).map(of));
    };
    session.declare_subscriber(expression).callback(callback).await
}
