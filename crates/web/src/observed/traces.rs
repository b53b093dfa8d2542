//! A module's divergences of the last minute. The diagnoser publishes them only while there is a subscriber; one
//! subscription serves all pages.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use session::client::DivergenceFeed;
use tokio::sync::watch::{Receiver, Sender};
use tokio::time::{Instant, sleep};
use vocabulary::{Divergences, ModuleName, StructureName};
use zenoh::Session;

use super::Observed;

/// The span that is kept.
const MINUTE_NS: u64 = 60_000_000_000;
/// Most messages kept, whatever their rate.
const MOST: usize = 1200;
/// Interval of updates.
const SHOW_EVERY: Duration = Duration::from_millis(500);
/// Pause before subscribing again.
const AGAIN_AFTER: Duration = Duration::from_secs(1);

/// The messages of the last minute, oldest first.
pub(crate) type Traces = VecDeque<Arc<Divergences>>;

impl Observed {
    /// Subscribes to the divergences of a module.
    pub(crate) fn traces(
        self: &Arc<Self>,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Receiver<Arc<Traces>> {
        let key = (structure.clone(), module.clone());
        let (observed, whose) = (Arc::clone(self), key.clone());
        self.traces.subscribe(key, Arc::default(), move |sender| watch(observed, whose, sender))
    }
}

async fn watch(
    observed: Arc<Observed>,
    whose: (StructureName, ModuleName),
    shown: Sender<Arc<Traces>>,
) {
    loop {
        if let Some(session) = observed.session() {
            follow(&session, &whose, &shown).await;
        }
        sleep(AGAIN_AFTER).await;
    }
}

/// Collects messages until the session ends.
async fn follow(
    session: &Session,
    (structure, module): &(StructureName, ModuleName),
    shown: &Sender<Arc<Traces>>,
) {
    let feed = DivergenceFeed::open(session, structure, module).await;
    let mut feed = match feed {
        Ok(feed) => feed,
        Err(error) => {
            return tracing::debug!("cannot subscribe to divergences of {module}: {error}");
        }
    };
    let mut traces = Traces::new();
    let mut show_at = Instant::now();
    while let Some(message) = feed.next().await {
        keep(&mut traces, message);
        if Instant::now() >= show_at {
            shown.send_replace(Arc::new(traces.clone()));
            show_at = Instant::now() + SHOW_EVERY;
        }
    }
}

fn keep(traces: &mut Traces, message: Divergences) {
    let begin = message.time_unix_ns.saturating_sub(MINUTE_NS);
    traces.push_back(Arc::new(message));
    while traces.len() > MOST || traces.front().is_some_and(|first| first.time_unix_ns < begin) {
        traces.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    #[test]
    fn a_minute_is_kept_and_no_more_than_there_is_room_for() {
        let at = |time_unix_ns| Divergences {
            structure: "t".parse().unwrap(),
            module: "m1".parse().unwrap(),
            run: RunId(1),
            step: Step(1),
            time_unix_ns,
            channels: Vec::new(),
        };
        let mut traces = Traces::new();
        for second in 0..100_u64 {
            keep(&mut traces, at(second * 1_000_000_000));
        }
        assert_eq!((traces.len(), traces[0].time_unix_ns), (61, 39_000_000_000));
        for _ in 0..2 * MOST {
            keep(&mut traces, at(100_000_000_000));
        }
        assert_eq!(traces.len(), MOST);
    }
}
