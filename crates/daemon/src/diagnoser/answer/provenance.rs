//! Answers requests of recorders for the provenance of verdicts, i.e. the diagnoser's inputs, its state and its
//! configuration, on a separate thread, because thousands of inputs may be requested at once and a state is megabytes.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::time::Duration;

use shell::clock;
use shell::supervision::Crew;
use tokio::sync::mpsc;
use vocabulary::{
    Input, InputQuestion, ModuleConfiguration, QuestionError, StatePart, Taken, Topic,
};
use zenoh::bytes::Encoding;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::{SharedInquiryCounters, hand_over};
use crate::diagnoser::publish::InputCache;
use crate::messages::{put, refuse};
use diagnosis::Diagnoser;
use diagnosis::messages::{Speaker, from_diagnoser};

/// Questions that may wait.
const MAX_WAITING: usize = 16;

/// The loop gives a state between two events.
const SNAPSHOT_WITHIN: Duration = Duration::from_millis(500);

/// The whole state of the diagnoser, and where in the stream of its inputs that is.
#[derive(Debug)]
pub(crate) struct Snapshot {
    pub(crate) head: Input,
    pub(crate) state: StatePart,
    pub(crate) diagnoser: Diagnoser,
}

/// What is given.
#[derive(Debug)]
pub(crate) struct ProvenanceAnswers {
    /// The inputs.
    pub(crate) inputs: InputCache,
    /// The configuration.
    pub(crate) configuration: ModuleConfiguration,
}

/// What is asked for.
#[derive(Debug, Clone, Copy)]
enum ProvenanceQuestion {
    Inputs(InputQuestion),
    State,
    Configuration,
}

pub(super) async fn declare(
    session: &Session,
    speaker: &Speaker,
    (provenance, snapshots, crew): (ProvenanceAnswers, mpsc::Sender<SyncSender<Snapshot>>, &Crew),
    counters: &SharedInquiryCounters,
) -> zenoh::Result<[Queryable<()>; 2]> {
    let inputs = |text: &str| match text {
        InputQuestion::STATE => Ok(ProvenanceQuestion::State),
        _ => InputQuestion::from_parameters(text).map(ProvenanceQuestion::Inputs),
    };
    let configuration = |_: &str| Ok(ProvenanceQuestion::Configuration);
    let queue = provenance.giver(speaker, snapshots, Arc::clone(counters), crew)?;
    Ok([
        queryable(session, speaker.key(Topic::Input), inputs, &queue, counters).await?,
        queryable(session, speaker.key(Topic::Configuration), configuration, &queue, counters)
            .await?,
    ])
}

async fn queryable(
    session: &Session,
    key: String,
    read: fn(&str) -> Result<ProvenanceQuestion, QuestionError>,
    queue: &SyncSender<(ProvenanceQuestion, Query)>,
    counters: &SharedInquiryCounters,
) -> zenoh::Result<Queryable<()>> {
    let (queue, counters) = (queue.clone(), Arc::clone(counters));
    session
        .declare_queryable(key)
        .complete(true)
        .callback(move |query| {
            let question = read(query.parameters().as_str());
            hand_over(question, query, &queue, &counters);
        })
        .await
}

impl ProvenanceAnswers {
    /// Starts the thread; it ends when every sender is gone.
    fn giver(
        self,
        speaker: &Speaker,
        snapshots: mpsc::Sender<SyncSender<Snapshot>>,
        counters: SharedInquiryCounters,
        crew: &Crew,
    ) -> std::io::Result<SyncSender<(ProvenanceQuestion, Query)>> {
        let (queue, out) = sync_channel(MAX_WAITING);
        // Their own keys, for queries to every module at once.
        let keys = [Topic::Input, Topic::Configuration].map(|topic| speaker.key(topic));
        crew.thread("provenance", move |lane| {
            while let Ok((wanted, query)) = out.recv() {
                lane.begin();
                counters.count(|counters| counters.answered += 1);
                match wanted {
                    ProvenanceQuestion::Inputs(question) => {
                        self.give_inputs(question, &query, &keys[0])
                    }
                    ProvenanceQuestion::State => give_state(&snapshots, &query, &keys[0]),
                    ProvenanceQuestion::Configuration => self.give_configuration(&query, &keys[1]),
                }
                lane.rest();
            }
        })?;
        Ok(queue)
    }

    fn give_inputs(&self, question: InputQuestion, query: &Query, key: &str) {
        for input in self.inputs.asked(question) {
            let reply = query.reply(key, input).encoding(Encoding::APPLICATION_JSON);
            if let Err(error) = reply.wait() {
                tracing::debug!("cannot answer with a past input: {error}");
                return;
            }
        }
    }

    fn give_configuration(&self, query: &Query, key: &str) {
        let time_unix_ns = clock::unix_ns();
        let message = ModuleConfiguration { time_unix_ns, ..self.configuration.clone() };
        put(&message, |bytes| query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait());
    }
}

/// Of the state only the copy is made in the loop.
fn give_state(snapshots: &mpsc::Sender<SyncSender<Snapshot>>, query: &Query, key: &str) {
    let (reply, given) = sync_channel(1);
    let asked = snapshots.try_send(reply).is_ok();
    let Some(snapshot) = asked.then(|| given.recv_timeout(SNAPSHOT_WITHIN).ok()).flatten() else {
        return refuse(query, format!("no state within {} ms", SNAPSHOT_WITHIN.as_millis()));
    };
    for part in from_diagnoser(&snapshot.diagnoser, &snapshot.state) {
        let part = Input { taken: Taken::State(Box::new(part)), ..snapshot.head.clone() };
        put(&part, |bytes| query.reply(key, bytes).encoding(Encoding::APPLICATION_JSON).wait());
    }
}
