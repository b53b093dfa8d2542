//! The process that runs on a module's computer.
//!
//! | file | job |
//! |---|---|
//! | `intake` | samples from the network, in order and without a gap where that can be had |
//! | `inquiry` | what others ask: peers, operators, whoever wants to know |
//! | `diagnosis_loop` | owns the diagnoser; takes from the queues |
//! | `performer` | carries out the diagnoser's actions |
//! | `peer_query`, `peer_book`, `presence`, `patience` | asks peers; what became of it; who is there; when to ask again |
//! | `desk` | questions and orders whose replies are still to come |
//! | `vigil` | whether samples come at all |
//! | `state` | what outlives the process |
//! | `outbox`, `event_lane`, `routine_lane`, `publishers` | everything that goes out, on two threads |
//! | `fault_book` | the present state of each component, for whoever asks |
//! | `status` | how it all is |

mod args;
mod asking;
mod desk;
mod diagnosis_loop;
mod event_lane;
mod fault_book;
mod inquiry;
mod intake;
mod outbox;
mod patience;
mod peer_book;
mod peer_query;
mod performer;
mod presence;
mod publishers;
mod routine_lane;
mod state;
mod status;
mod vigil;

use std::sync::Arc;
use std::time::Duration;

use diagnosis::Diagnoser;
use tokio::sync::mpsc;
use zenoh::Session;

pub use args::{command_line, main};
pub use state::StateDirectory;

use crate::config::DiagnoserConfig;
use crate::convert::Speaker;
use crate::exit::Failure;
use crate::health::{Listening, ModuleBoard, ModuleHealth};
use crate::session;
use crate::shutdown::Shutdown;
use crate::supervision::{Supervisor, words};
use asking::Asking;
use desk::Desk;
use diagnosis_loop::{Boards, DiagnosisLoop, Intake, Queues};
use event_lane::EventLane;
use inquiry::Queryables;
use intake::{Receiver, Sequencer, Size, Store};
use outbox::Outbox;
use peer_book::PeerBook;
use peer_query::PeerQueries;
use performer::Performer;
use routine_lane::RoutineLane;
use state::{Keeper, Recollection};

/// Answers of peers that may wait to be looked at.
const ANSWER_QUEUE: usize = 256;
/// How long the last messages may take to get out.
const DRAINING: Duration = Duration::from_secs(2);

/// Runs a diagnoser until it is asked to end.
///
/// # Errors
/// No session, the state directory is in use, or the network refuses something that a diagnoser cannot
/// do without.
pub async fn run(config: DiagnoserConfig, mut shutdown: Shutdown) -> Result<(), Failure> {
    let diagnoser = Diagnoser::new(config.module_setup()).map_err(|problems| {
        let listed: Vec<String> = problems.iter().map(ToString::to_string).collect();
        Failure::running("no diagnoser can be made", listed.join("; "))
    })?;
    let memory = Remembered::open(&config)?;
    let health = Listening::on(config.health)?;
    let supervisor = Supervisor::from_environment();
    let board = Arc::new(ModuleBoard::default());
    let speaker =
        Speaker { structure: config.structure_name.clone(), module: config.module().clone() };
    let serving = health.serve(ModuleHealth {
        speaker,
        pulse: supervisor.pulse(),
        board: Arc::clone(&board),
    })?;
    supervisor.status(words::OPENING);
    let Some(session) = session::open_unless(&config.network, &mut shutdown).await? else {
        return Ok(());
    };
    let result = serve(&session, config, diagnoser, memory, (supervisor, board), shutdown).await;
    session::close(&session).await;
    drop(serving);
    result
}

/// What was there before the process.
struct Remembered {
    keeper: Keeper,
    recollection: Recollection,
    watch_file: Option<(state::WatchFile, Option<state::Watch>)>,
}

impl Remembered {
    fn open(config: &DiagnoserConfig) -> Result<Self, Failure> {
        let directory = config.state.directory.as_deref();
        if directory.is_none() {
            tracing::warn!(
                "no state directory: faults are forgotten when this process ends; \
                 set `directory` in the table `state`, or use `--state-dir`"
            );
        }
        let (keeper, recollection) =
            Keeper::open(directory, config.state.rotate_bytes(), config.module())
                .map_err(|error| Failure::Running(error.to_string()))?;
        let watch_file = keeper.open_watch_file();
        Ok(Self { keeper, recollection, watch_file })
    }
}

async fn serve(
    session: &Session,
    config: DiagnoserConfig,
    mut diagnoser: Diagnoser,
    memory: Remembered,
    (supervisor, health): (Supervisor, Arc<ModuleBoard>),
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let speaker =
        Speaker { structure: config.structure_name.clone(), module: config.module().clone() };
    let Remembered { keeper, recollection, watch_file } = memory;
    diagnoser.recall(recollection.memory(watch_file.as_ref().and_then(|(_, watch)| *watch)));
    let boards = Boards {
        journal: keeper.board(),
        watch_file,
        peers: PeerBook::new(config.peers()),
        health,
    };

    let components = diagnoser.components().to_vec();
    let mut events = EventLane::declare(session, &speaker, &components, &config.publish, keeper)
        .await
        .map_err(refused)?;
    events.repeat(recollection.latest);
    let routine = RoutineLane::declare(session, &speaker).await.map_err(refused)?;
    let (outbox, drained) = Outbox::open(events, routine)
        .map_err(|error| Failure::running("no thread can be started", error))?;

    let (answers, answers_out) = mpsc::channel(ANSWER_QUEUE);
    let (samples, samples_out) = mpsc::channel(config.publish.sample_queue);
    let (fetched, fetched_out) = mpsc::channel(1);
    let presence =
        presence::watch(session, &speaker, config.peers(), &boards.peers, &answers).await;
    let presence = presence.map_err(refused)?;
    let peers = PeerQueries::declare(session, &speaker, &config, boards.peers.clone(), answers)
        .await
        .map_err(refused)?;
    let inquiries = Arc::new(inquiry::Counters::default());
    let (queryables, inquiries_out) =
        Queryables::declare(session, &speaker, &outbox, config.state.directory.clone(), &inquiries)
            .await
            .map_err(refused)?;
    let (actuators, gages) = config.size();
    let size = Size { actuators, gages };
    let receiver = Receiver::new(
        speaker.module.clone(),
        size,
        samples,
        config.input.incumbent(),
        config.publish.sample_queue,
    );
    let counters = receiver.counters();
    let subscriber = receiver.subscribe(session, &speaker).await.map_err(refused)?;
    // Last of all: whoever sees the token can rely on everything above.
    let token = session.liveliness().declare_token(speaker.key(wire::Topic::Alive));
    let token = token.await.map_err(refused)?;
    tracing::info!(
        structure = %speaker.structure,
        module = %speaker.module,
        actuators,
        gages,
        thresholds = config.thresholds,
        "ready"
    );

    let queues = Queues {
        samples: samples_out,
        fetched: fetched_out,
        inquiries: inquiries_out,
        answers: answers_out,
    };
    let intake = Intake {
        sequencer: Sequencer::new(config.input.recover_steps, config.publish.sample_queue),
        store: Store::new(session, &speaker, size, Arc::clone(&counters), fetched),
        counters,
        receiver,
        resync_after: config.input.resync_after(),
    };
    let performer = Performer::new(
        speaker,
        outbox,
        peers,
        Desk::new(config.queries.hold()),
        Asking::new(config.queries.pause()),
        inquiries,
    );
    DiagnosisLoop::new(diagnoser, &config, performer, intake, boards, supervisor)
        .run(queues, shutdown)
        .await;

    for undeclared in [token.undeclare().await, subscriber.undeclare().await] {
        undeclared.map_err(refused)?;
    }
    for subscriber in presence {
        subscriber.undeclare().await.map_err(refused)?;
    }
    queryables.undeclare().await.map_err(refused)?;
    // The threads end when the last of those who hold the outbox is gone; that was just now.
    for drained in drained {
        if tokio::time::timeout(DRAINING, drained).await.is_err() {
            tracing::warn!("the last messages did not get out within {DRAINING:?}");
        }
    }
    tracing::info!("stopped");
    Ok(())
}
