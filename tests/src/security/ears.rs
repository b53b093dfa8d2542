//! Everything that a session can come to hear.

use std::collections::BTreeSet;
use std::time::Duration;

use tokio::sync::watch::Sender;
use vocabulary::keys::Watched;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::LIMIT;
use crate::noted::Noted;
use crate::observer::unix_ns;

/// Messages and liveliness tokens.
#[derive(Debug, Default)]
struct Heard {
    /// The first with this key and this text.
    said: Vec<Said>,
    /// Whether a token has gone.
    loss: bool,
}

#[derive(Debug)]
struct Said {
    key: String,
    text: String,
    came_unix_ns: u64,
}

/// What is heard on every key that there is, from now on.
pub struct Ears(Noted<Heard>);

impl Ears {
    /// Subscribes as commands and README do, and to everything at once.
    pub async fn of(session: &Session) -> Self {
        let watched = Watched::default();
        let expressions = [
            watched.faults(),
            watched.identifications(),
            watched.phases(),
            watched.changes(),
            watched.divergences(),
            watched.statuses(),
            watched.progress(),
            watched.samples(),
            "trusswatch/**".to_owned(),
        ];
        let heard = Sender::new(Heard::default());
        let mut subscribers: Vec<Subscriber<()>> = Vec::new();
        for expression in expressions {
            let note = note(&heard);
            subscribers.push(session.declare_subscriber(expression).callback(note).await.unwrap());
        }
        let tokens = session.liveliness().declare_subscriber(watched.tokens()).history(true);
        subscribers.push(tokens.callback(note(&heard)).await.unwrap());
        Self(Noted::by(heard, subscribers))
    }

    /// Is there something with these words whose key begins so?
    #[must_use]
    pub fn have(&self, below: &str, words: &str) -> bool {
        hold(&self.0.so_far(), below, words)
    }

    /// Waits until there is.
    ///
    /// # Panics
    /// If there never is.
    pub async fn wait(&self, below: &str, words: &str) {
        assert!(self.hear(below, words).await, "no `{words}` came below {below}");
    }

    /// The same; whether there is.
    pub async fn hear(&self, below: &str, words: &str) -> bool {
        let arrived = |heard: &Heard| hold(heard, below, words).then_some(());
        tokio::time::timeout(LIMIT, self.0.first(arrived)).await.is_ok()
    }

    /// The keys on which anything was heard.
    #[must_use]
    pub fn keys(&self) -> BTreeSet<String> {
        self.0.so_far().said.iter().map(|said| said.key.clone()).collect()
    }

    /// How long after its time of publication the first message on this key came.
    #[must_use]
    pub fn lateness(&self, key: &str) -> Option<Duration> {
        let heard = self.0.so_far();
        let first = heard.said.iter().find(|said| said.key == key)?;
        let published: serde_json::Value = serde_json::from_str(&first.text).ok()?;
        let published = published["time_unix_ns"].as_u64()?;
        Some(Duration::from_nanos(first.came_unix_ns.saturating_sub(published)))
    }

    /// Waits until a token goes.
    pub async fn loss(&self) {
        self.0.first(|heard| heard.loss.then_some(())).await;
    }
}

fn note(heard: &Sender<Heard>) -> impl Fn(Sample) + Send + Sync + 'static {
    let heard = heard.clone();
    move |sample| {
        let text = String::from_utf8_lossy(&sample.payload().to_bytes()).into_owned();
        let key = sample.key_expr().to_string();
        let (gone, came_unix_ns) = (sample.kind() == SampleKind::Delete, unix_ns());
        heard.send_modify(|heard| heard.note(Said { key, text, came_unix_ns }, gone));
    }
}

/// Messages that are kept of one key: samples come a thousand times a second.
const MOST: usize = 50;

impl Heard {
    fn note(&mut self, said: Said, gone: bool) {
        self.loss |= gone;
        let of_key = self.said.iter().filter(|known| known.key == said.key).count();
        // The same comes by several subscriptions.
        let is_new = !self.said.iter().any(|one| one.key == said.key && one.text == said.text);
        if of_key < MOST && is_new {
            self.said.push(said);
        }
    }
}

fn hold(heard: &Heard, below: &str, words: &str) -> bool {
    heard.said.iter().any(|said| said.key.starts_with(below) && said.text.contains(words))
}
