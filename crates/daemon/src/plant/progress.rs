//! Receives the diagnosers' progress once it is needed: they publish it only while there is a
//! subscriber.

use std::sync::Arc;

use vocabulary::{Key, Progress, StructureName, Topic, keys::Watched};
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use super::attendance::Attendance;

/// Passes progress on to the attendance.
#[derive(Debug)]
pub(crate) struct ProgressEar {
    session: Session,
    structure: StructureName,
    attendance: Arc<Attendance>,
    subscriber: Option<Subscriber<()>>,
}

impl ProgressEar {
    /// One that does not subscribe yet.
    pub(crate) fn new(
        session: &Session,
        structure: &StructureName,
        attendance: &Arc<Attendance>,
    ) -> Self {
        let (session, structure) = (session.clone(), structure.clone());
        Self { session, structure, attendance: Arc::clone(attendance), subscriber: None }
    }

    /// Subscribes. If the network refuses, diagnosers are waited for until the timeout.
    pub(crate) fn listen(&mut self) {
        if self.subscriber.is_none() {
            match self.subscribe() {
                Ok(subscriber) => self.subscriber = Some(subscriber),
                Err(error) => tracing::warn!("the diagnosers' progress is not received: {error}"),
            }
        }
    }

    fn subscribe(&self) -> zenoh::Result<Subscriber<()>> {
        let watched = Watched { structure: Some(&self.structure), module: None };
        let attendance = Arc::clone(&self.attendance);
        let hear = move |received: zenoh::sample::Sample| {
            let key = received.key_expr().as_str().parse();
            let message = vocabulary::decode::<Progress>(&received.payload().to_bytes());
            match (key, message) {
                (Ok(Key::Module { module, topic: Topic::Progress, .. }), Ok(progress)) => {
                    attendance.note_progress(&module, progress);
                }
                (_, Err(error)) => tracing::debug!("progress not used: {error}"),
                (Ok(_) | Err(_), Ok(_)) => {}
            }
        };
        self.session.declare_subscriber(watched.progress()).callback(hear).wait()
    }
}
