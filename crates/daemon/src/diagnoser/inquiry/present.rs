//! Queries for what is known at present: the states of components, the identifications of their faults, and the phase.

use std::sync::Arc;

use tokio::sync::Semaphore;
use vocabulary::keys::Watched;
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::InquiryTally;
use crate::diagnoser::outgoing::{Asked, Outbox, Routine, Wanted};
use crate::messages::TOO_MANY_QUESTIONS;
use diagnosis::messages::Speaker;

/// Questions of each kind that may wait.
const MAX_WAITING: usize = 64;

fn expression(wanted: Wanted, speaker: &Speaker) -> String {
    let watched = Watched { structure: Some(&speaker.structure), module: Some(&speaker.module) };
    match wanted {
        Wanted::States => watched.faults(),
        Wanted::Identifications => watched.identifications(),
        Wanted::Phase => watched.phases(),
    }
}

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    wanted: Wanted,
    outbox: Outbox,
    counters: &Arc<InquiryTally>,
) -> zenoh::Result<Queryable<()>> {
    let counters = Arc::clone(counters);
    let places = Arc::new(Semaphore::new(MAX_WAITING));
    session
        .declare_queryable(expression(wanted, speaker))
        .callback(move |query: Query| {
            counters.received();
            let Ok(place) = Arc::clone(&places).try_acquire_owned() else {
                counters.turned_away();
                let reason = TOO_MANY_QUESTIONS.to_owned();
                outbox.routine(Routine::Refusal { query, reason });
                return;
            };
            if !outbox.question(Asked { wanted, query, place }) {
                counters.turned_away();
            }
        })
        .await
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use shell::shutdown;
    use shell::supervision::{Crew, Supervisor};

    use super::*;
    use crate::diagnoser::outgoing::ReplyLane;
    use crate::diagnoser::outgoing::testing::{books, outbox, speaker};
    use crate::diagnoser::state::{Keeper, Writer};

    const PATIENCE: Duration = Duration::from_secs(20);

    /// A session without a network.
    async fn session() -> Session {
        let mut config = zenoh::Config::default();
        config.insert_json5("scouting/multicast/enabled", "false").unwrap();
        config.insert_json5("listen/endpoints", "[]").unwrap();
        zenoh::open(config).await.unwrap()
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 2)]
    async fn a_question_is_answered_when_the_reply_is_sent() {
        let (keeper, _) = Keeper::open(None, 0, &"module1".parse().unwrap()).unwrap();
        let (_writer, submission, journal) = Writer::new(keeper, None);
        let (outbox, _events, questions) = outbox(submission, 4);
        let session = session().await;
        let tally = Arc::new(InquiryTally::default());
        let speaker = speaker();
        let declaring = declare(&session, &speaker, Wanted::States, outbox, &tally);
        let _queryable = declaring.await.unwrap();
        let replies = session.get("trusswatch/tower/module1/fault/**").await.unwrap();
        let asked = questions.recv_timeout(PATIENCE).unwrap();
        assert_eq!((tally.read().received, tally.read().answered), (1, 0));
        let (queue, waiting) = std::sync::mpsc::channel();
        queue.send(asked).unwrap();
        drop(queue);
        let lane = ReplyLane::new(books(), journal, Arc::clone(&tally));
        let (trigger, shutdown) = shutdown::pair();
        trigger.pull();
        let crew = Crew::new(shutdown, Supervisor::from_environment().pulse());
        let ended = crew.thread("replies", move |own| lane.run(&waiting, own)).unwrap();
        ended.await.unwrap();
        assert!(replies.recv_async().await.unwrap().result().is_ok());
        assert_eq!(tally.read().answered, 1);
    }
}
