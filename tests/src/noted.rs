//! What messages say: noted as they come, looked at and waited for.

use std::sync::Arc;

use tokio::sync::watch::{Ref, Sender};
use vocabulary::Message;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::Sample;

/// A message, if it is one of this kind.
pub(crate) fn read<M: Message>(sample: &Sample) -> Option<M> {
    vocabulary::decode(&sample.payload().to_bytes()).ok()
}

/// Hands `take` the messages of a kind on some keys, each with what it came in, from now on.
pub(crate) async fn listen<M: Message + 'static>(
    session: &Session,
    keys: &str,
    take: impl Fn(&Sample, M) + Send + Sync + 'static,
) -> Subscriber<()> {
    let callback = move |sample: Sample| {
        if let Some(message) = read::<M>(&sample) {
            take(&sample, message);
        }
    };
    session.declare_subscriber(keys).callback(callback).await.unwrap()
}

/// What has been noted so far; goes on as long as the subscribers live.
pub struct Noted<T, S = Vec<Subscriber<()>>> {
    notes: Sender<T>,
    _subscribers: S,
}

impl<T: Send + Sync + 'static> Noted<T> {
    /// Has `note` enter each message of its kind on these keys into the notes, from now on.
    pub(crate) async fn of<M: Message + 'static>(
        session: &Session,
        keys: &[String],
        notes: T,
        note: impl Fn(&mut T, M) + Send + Sync + 'static,
    ) -> Self {
        let (notes, note) = (Sender::new(notes), Arc::new(note));
        let mut subscribers = Vec::new();
        for key in keys {
            let (notes, note) = (notes.clone(), Arc::clone(&note));
            let take = move |_: &Sample, message: M| {
                notes.send_modify(|notes| note(notes, message));
            };
            subscribers.push(listen(session, key, take).await);
        }
        Self::by(notes, subscribers)
    }
}

impl<T, S> Noted<T, S> {
    /// What these subscribers enter into these notes.
    pub(crate) fn by(notes: Sender<T>, subscribers: S) -> Self {
        Self { notes, _subscribers: subscribers }
    }

    /// What there is; nothing is noted while it is held.
    pub fn so_far(&self) -> Ref<'_, T> {
        self.notes.borrow()
    }

    /// What `find` finds in the notes, as soon as it finds anything.
    pub async fn first<R>(&self, mut find: impl FnMut(&T) -> Option<R>) -> R {
        let (mut notes, mut found) = (self.notes.subscribe(), None);
        let is_there = |notes: &T| {
            found = find(notes);
            found.is_some()
        };
        notes.wait_for(is_there).await.unwrap();
        found.unwrap()
    }
}
