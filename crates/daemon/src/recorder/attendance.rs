//! Whose configuration, inputs and present states are asked for: of each diagnoser that is there or comes.

use vocabulary::Key;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::SampleKind;

use super::fetching::{Desk, Wish};
use super::subject::Subject;

pub(super) struct Attendance;

impl Attendance {
    /// Brings a wish for each diagnoser's token that is seen.
    pub(super) async fn watch(
        session: &Session,
        subject: &Subject,
        desk: Desk,
    ) -> zenoh::Result<Subscriber<()>> {
        let tokens = subject.tokens();
        let subject = subject.clone();
        let seen = move |token: zenoh::sample::Sample| {
            if token.kind() == SampleKind::Put
                && subject.has(token.key_expr().as_str())
                && let Some(wish) = wish_about(token.key_expr().as_str())
                && !desk.bring(wish)
            {
                tracing::warn!(token = %token.key_expr(), "too many diagnosers at once; not asked");
            }
        };
        session.liveliness().declare_subscriber(tokens).history(true).callback(seen).await
    }
}

/// To ask the module that a key belongs to.
pub(super) fn wish_about(key: &str) -> Option<Wish> {
    match key.parse() {
        Ok(Key::Module { structure, module, .. }) => Some(Wish::Module(structure, module)),
        _ => None,
    }
}
