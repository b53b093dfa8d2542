//! Messages that arrive on fault keys, and replies to queries.

use std::time::Duration;

use tokio::sync::watch::Sender;
use wire::keys::Watched;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::Sample;
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use crate::in_time;
use crate::noted::Noted;

/// Timeout for replies.
const ANSWERS: Duration = Duration::from_secs(3);

/// Messages: key and text.
type Texts = Vec<(String, String)>;

/// Everything that arrives on fault keys, those before now included.
pub struct Letters(Noted<Texts, AdvancedSubscriber<()>>);

impl Letters {
    /// Listens as README and commands do.
    pub async fn to(session: &Session) -> Self {
        let texts = Sender::new(Texts::new());
        let arrived = texts.clone();
        let callback = move |sample: Sample| arrived.send_modify(|texts| texts.push(text(&sample)));
        let faults = Watched::default().faults();
        let subscriber = session.declare_subscriber(faults).callback(callback);
        let history = HistoryConfig::default().detect_late_publishers().max_samples(64);
        Self(Noted::by(texts, subscriber.advanced().history(history).await.unwrap()))
    }

    /// Has a text with these words arrived on this key?
    #[must_use]
    pub fn have(&self, key: &str, words: &str) -> bool {
        hold(&self.0.so_far(), key, words)
    }

    /// Has a text with these words arrived anywhere?
    #[must_use]
    pub fn have_anywhere(&self, words: &str) -> bool {
        self.0.so_far().iter().any(|(_, text)| text.contains(words))
    }

    /// Waits until a text with these words arrives on this key.
    pub async fn wait(&self, key: &str, words: &str) {
        let arrived = |texts: &Texts| hold(texts, key, words).then_some(());
        in_time(&format!("`{words}` on {key}"), self.0.first(arrived)).await;
    }
}

/// Is there a text with these words on this key?
#[must_use]
pub fn hold(texts: &[(String, String)], key: &str, words: &str) -> bool {
    texts.iter().any(|(on, text)| on == key && text.contains(words))
}

/// All replies to a query.
pub async fn answers(session: &Session, question: &str) -> Texts {
    let query = session.get(question).target(QueryTarget::All);
    let replies = query.consolidation(ConsolidationMode::None).timeout(ANSWERS).await.unwrap();
    let mut answers = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        answers.extend(reply.result().map(text));
    }
    answers
}

fn text(sample: &Sample) -> (String, String) {
    let bytes = sample.payload().to_bytes();
    (sample.key_expr().to_string(), String::from_utf8_lossy(&bytes).into_owned())
}
