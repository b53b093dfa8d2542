//! Messages that arrive on fault keys, and replies to queries.

use std::time::Duration;

use tokio::sync::watch::Sender;
use vocabulary::keys::Watched;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::sample::Sample;

use crate::LIMIT;

/// From one query to the next.
const GLANCE: Duration = Duration::from_millis(20);
/// Timeout for replies; a query without anybody who may answer ends at once.
const ANSWERS: Duration = Duration::from_secs(30);
/// The same where nothing is to come: a query that is refused on its way ends only then.
const NO_ANSWERS: Duration = Duration::from_secs(3);

/// Messages: key and text.
type Texts = Vec<(String, String)>;

/// Everything that arrives on fault keys, and what was there before.
pub struct Letters {
    session: Session,
    texts: Sender<Texts>,
    _subscriber: Subscriber<()>,
}

impl Letters {
    /// Subscribes, then queries the present, as README and commands do.
    pub async fn to(session: &Session) -> Self {
        let texts = Sender::new(Texts::new());
        let arrived = texts.clone();
        let callback = move |sample: Sample| arrived.send_modify(|texts| texts.push(text(&sample)));
        let faults = Watched::default().faults();
        let subscriber = session.declare_subscriber(&faults).callback(callback).await.unwrap();
        let letters = Self { session: session.clone(), texts, _subscriber: subscriber };
        letters.query(&faults).await;
        letters
    }

    async fn query(&self, expression: &str) {
        // What has not come by then is asked for again.
        let present = answers_within(&self.session, expression, NO_ANSWERS).await;
        self.texts.send_modify(|texts| texts.extend(present));
    }

    /// Has a text with these words arrived on this key?
    #[must_use]
    pub fn have(&self, key: &str, words: &str) -> bool {
        hold(&self.texts.borrow(), key, words)
    }

    /// Has a text with these words arrived anywhere?
    #[must_use]
    pub fn have_anywhere(&self, words: &str) -> bool {
        self.texts.borrow().iter().any(|(_, text)| text.contains(words))
    }

    /// Waits until a text with these words arrives on this key, or is the answer to a query there: who was not connected when
    /// it was published is asked later.
    ///
    /// # Panics
    /// If none comes.
    pub async fn wait(&self, key: &str, words: &str) {
        assert!(self.hear(key, words).await, "no `{words}` came on {key}");
    }

    /// The same; whether one has come.
    pub async fn hear(&self, key: &str, words: &str) -> bool {
        let arrived = async {
            while !self.have(key, words) {
                tokio::time::sleep(GLANCE).await;
                self.query(key).await;
            }
        };
        tokio::time::timeout(LIMIT, arrived).await.is_ok()
    }
}

/// Is there a text with these words on this key?
#[must_use]
pub fn hold(texts: &[(String, String)], key: &str, words: &str) -> bool {
    texts.iter().any(|(on, text)| on == key && text.contains(words))
}

/// Answers every query that concerns `asked` with a text on a key. What is forbidden fails here already or at the router.
pub async fn answer(session: &Session, asked: &str, key: &'static str, text: &'static str) {
    let queryable = session.declare_queryable(asked.to_owned()).callback(move |query| {
        let _ = zenoh::Wait::wait(query.reply(key, text));
    });
    queryable.background().await.unwrap();
}

/// All replies to a query.
pub async fn answers(session: &Session, question: &str) -> Texts {
    answers_within(session, question, ANSWERS).await
}

/// All replies to a query that should get none.
pub async fn answers_to_the_refused(session: &Session, question: &str) -> Texts {
    answers_within(session, question, NO_ANSWERS).await
}

async fn answers_within(session: &Session, question: &str, timeout: Duration) -> Texts {
    let query = session.get(question).target(QueryTarget::All);
    let replies = query.consolidation(ConsolidationMode::None).timeout(timeout).await.unwrap();
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
