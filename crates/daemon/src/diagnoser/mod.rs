//! The process that runs on a module's computer.
//!
//! | file | job |
//! |---|---|
//! | `sample_intake` | samples from the network into a queue; what is none is counted by reason |
//! | `state_queryable` | peers' questions into a queue |
//! | `diagnosis_loop` | owns the diagnoser; takes from the queues, carries out its actions |
//! | `peer_query` | asks peers; their answers go into a queue |
//! | `outbox` | a thread that hands everything to the network, in order, and may be held up by it |
//! | `fault_book` | the present state of each component, for whoever asks |
//! | `status` | how it all is |

mod args;
mod diagnosis_loop;
mod fault_book;
mod outbox;
mod peer_query;
mod sample_intake;
mod state_queryable;
mod status;

use std::time::Duration;

use diagnosis::Diagnoser;
use tokio::sync::mpsc;
use zenoh::Session;

pub use args::main;

use crate::config::DiagnoserConfig;
use crate::convert::Speaker;
use crate::exit::Failure;
use crate::session;
use crate::shutdown::Shutdown;
use diagnosis_loop::{DiagnosisLoop, Queues};
use outbox::Outbox;
use peer_query::PeerQueries;
use sample_intake::SampleIntake;

/// Questions of others that may wait to be looked at.
const INQUIRY_QUEUE: usize = 1024;
/// Answers of peers that may wait to be looked at.
const ANSWER_QUEUE: usize = 256;
/// How long the last messages may take to get out.
const DRAINING: Duration = Duration::from_secs(2);

/// Runs a diagnoser until it is asked to end.
///
/// # Errors
/// No session, or the network refuses something that a diagnoser cannot do without.
pub async fn run(config: DiagnoserConfig, mut shutdown: Shutdown) -> Result<(), Failure> {
    let diagnoser = Diagnoser::new(config.module_setup()).map_err(|problems| {
        let listed: Vec<String> = problems.iter().map(ToString::to_string).collect();
        Failure::running("no diagnoser can be made", listed.join("; "))
    })?;
    let session = tokio::select! {
        opened = session::open(&config.network) => opened?,
        () = shutdown.requested() => return Ok(()),
    };
    let result = serve(&session, config, diagnoser, shutdown).await;
    session::close(&session).await;
    result
}

async fn serve(
    session: &Session,
    config: DiagnoserConfig,
    diagnoser: Diagnoser,
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let speaker =
        Speaker { structure: config.structure_name.clone(), module: config.module().clone() };
    let components = diagnoser.components().to_vec();
    let (outbox, drained) =
        Outbox::open(session, &speaker, &components, &config.publish).await.map_err(refused)?;
    let (inquiries, inquiries_out) = mpsc::channel(INQUIRY_QUEUE);
    let (answers, answers_out) = mpsc::channel(ANSWER_QUEUE);
    let (samples, samples_out) = mpsc::channel(config.publish.sample_queue);

    let peers = PeerQueries::declare(session, &speaker, &config, answers).await.map_err(refused)?;
    let state = state_queryable::declare(session, &speaker, inquiries, outbox.clone())
        .await
        .map_err(refused)?;
    let faults = fault_book::declare(session, &speaker, outbox.clone()).await.map_err(refused)?;
    let intake = SampleIntake::new(speaker.module.clone(), samples);
    let counters = intake.counters();
    let subscriber = intake.subscribe(session, &speaker).await.map_err(refused)?;
    // Last of all: whoever sees the token can rely on everything above.
    let token = session.liveliness().declare_token(speaker.key(wire::Topic::Alive));
    let token = token.await.map_err(refused)?;
    let (actuators, gages) = config.size();
    tracing::info!(
        structure = %speaker.structure,
        module = %speaker.module,
        actuators,
        gages,
        thresholds = config.thresholds,
        "ready"
    );

    let queues = Queues { samples: samples_out, inquiries: inquiries_out, answers: answers_out };
    DiagnosisLoop::new(diagnoser, speaker, &config, outbox, peers, counters)
        .run(queues, shutdown)
        .await;

    for undeclared in [token.undeclare().await, subscriber.undeclare().await] {
        undeclared.map_err(refused)?;
    }
    for undeclared in [state.undeclare().await, faults.undeclare().await] {
        undeclared.map_err(refused)?;
    }
    // The outbox ends when the last of those who hold it is gone; that was just now.
    if tokio::time::timeout(DRAINING, drained).await.is_err() {
        tracing::warn!("the last messages did not get out within {DRAINING:?}");
    }
    tracing::info!("stopped");
    Ok(())
}
