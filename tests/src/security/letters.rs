//! Texts that arrive on fault keys, and texts that come as answers.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::Sample;
use zenoh_ext::{AdvancedSubscriber, AdvancedSubscriberBuilderExt, HistoryConfig};

use crate::in_time;

/// Whoever has not answered by then does not.
const ANSWERS: Duration = Duration::from_secs(3);

type Texts = Arc<Mutex<Vec<(String, String)>>>;

/// Everything that arrives on fault keys, those before now included: key and text.
pub struct Letters {
    texts: Texts,
    _subscriber: AdvancedSubscriber<()>,
}

impl Letters {
    /// Listens as README and commands do.
    pub async fn to(session: &Session) -> Self {
        let texts = Texts::default();
        let arrived = Arc::clone(&texts);
        let callback = move |sample: Sample| {
            let mut texts = arrived.lock().unwrap_or_else(PoisonError::into_inner);
            texts.push(text(&sample));
        };
        let subscriber = session.declare_subscriber("trusswatch/*/*/fault/**").callback(callback);
        let history = HistoryConfig::default().detect_late_publishers().max_samples(64);
        let _subscriber = subscriber.advanced().history(history).await.unwrap();
        Self { texts, _subscriber }
    }

    /// Has a text with these words arrived on this key?
    #[must_use]
    pub fn have(&self, key: &str, words: &str) -> bool {
        let texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        texts.iter().any(|(on, text)| on == key && text.contains(words))
    }

    /// Has a text with these words arrived anywhere?
    #[must_use]
    pub fn have_anywhere(&self, words: &str) -> bool {
        let texts = self.texts.lock().unwrap_or_else(PoisonError::into_inner);
        texts.iter().any(|(_, text)| text.contains(words))
    }

    /// Waits until a text with these words arrives on this key.
    pub async fn wait(&self, key: &str, words: &str) {
        let arrival = async {
            while !self.have(key, words) {
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time(&format!("`{words}` on {key}"), arrival).await;
    }
}

/// All answers to a question: key and text.
pub async fn answers(session: &Session, question: &str) -> Vec<(String, String)> {
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
