//! The process that runs on a module's computer.
//!
//! | file | job |
//! |---|---|
//! | `intake` | samples from the network, in order and without a gap where that can be had |
//! | `inquiry` | queries and commands: of peers, operators, monitoring clients |
//! | `diagnosis_loop` | owns the diagnoser; takes from the queues |
//! | `inputs` | what the diagnoser takes beside samples, for recordings |
//! | `performer` | carries out the diagnoser's actions |
//! | `identification` | what kind of fault it is, on a thread of its own |
//! | `freeze_frames` | what was seen around the latching of a fault, kept and given to whoever asks |
//! | `peers` | whether they are there, what they answer, how long that is waited for, when they are queried again |
//! | `pending_replies` | queries and commands that have not been replied to yet |
//! | `namesakes` | whether another process runs as the same module |
//! | `staleness` | whether samples arrive |
//! | `service` | whether components are monitored, for the thread that answers queries |
//! | `state` | what outlives the process |
//! | `outgoing` | everything that goes out, on threads of its own |
//! | `status`, `health` | the status of it all; the same over HTTP |

mod args;
mod conditions;
mod diagnosis_loop;
mod freeze_frames;
mod health;
mod identification;
mod inputs;
mod inquiry;
mod intake;
mod namesakes;
mod outgoing;
mod peers;
mod pending_replies;
mod performer;
mod service;
mod set_aside;
mod staleness;
mod state;
mod status;

use std::sync::Arc;
use std::time::Duration;

use diagnosis::Diagnoser;
use tokio::sync::mpsc;
use vocabulary::ModuleConfiguration;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;

pub use args::{command_line, main};
pub use state::StateDirectory;

use conditions::Conditions;
use diagnosis_loop::{Boards, DiagnosisLoop, Intake, Queues};
use freeze_frames::FreezeFrames;
use health::{ModuleBoard, ModuleHealth};
use identification::{IdentificationTally, Identifier};
use inputs::{Register, Shelf};
use inquiry::{Provenance, Queryables};
use intake::{Arrival, Fetched, Receiver, Sequencer, Size, Store};
use namesakes::Namesakes;
use outgoing::{
    Books, Drained, EventLane, IdentifiedFaults, Lanes, Outbox, Outgoing, ReplyLane, RoutineLane,
    SharedBooks, States,
};
use peers::{LOOK_EVERY, PeerBook, PeerQueries, Presence, QueryPause};
use pending_replies::PendingReplies;
use performer::Performer;
use service::Service;
use shell::clock;
use shell::exit::Failure;
use shell::health::Listening;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{Crew, OPENING, Supervisor};
use state::{Keeper, Recollection, Watch, WatchFile, Writer};

use crate::config::DiagnoserConfig;
use diagnosis::messages::Speaker;

/// Answers of peers that may wait to be looked at.
const ANSWER_QUEUE: usize = 256;
/// How long it may take to withdraw what is on the network. Both times, the closing of the session and the end of the
/// runtime are together within the five seconds of the shipped units.
const WITHDRAWING: Duration = Duration::from_millis(500);
/// How long the last messages may take to get out, and onto the disk.
const DRAINING: Duration = Duration::from_millis(1500);

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
    let Some(memory) = Remembered::open_unless(&config, &mut shutdown).await? else {
        return Ok(());
    };
    let listening = Listening::on(config.health)?;
    let supervisor = Supervisor::from_environment();
    let board = Arc::new(ModuleBoard::default());
    let speaker = Speaker {
        structure: config.structure_name.clone(),
        module: config.module().clone(),
        incarnation: memory.keeper.status().incarnation,
    };
    let subject = ModuleHealth {
        speaker: speaker.clone(),
        pulse: supervisor.pulse(),
        board: Arc::clone(&board),
    };
    let serving = listening
        .serve(subject)
        .map_err(|error| Failure::running("health cannot be served", error))?;
    supervisor.status(OPENING);
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(());
    };
    let result =
        serve(&session, (config, speaker), diagnoser, memory, (supervisor, board), shutdown).await;
    session::close(&session).await;
    drop(serving);
    result
}

/// What was there before the process.
struct Remembered {
    keeper: Keeper,
    recollection: Recollection,
    watch_file: Option<WatchFile>,
    watch: Option<Watch>,
}

impl Remembered {
    /// Unless the end is asked for before the disk has answered.
    async fn open_unless(
        config: &DiagnoserConfig,
        shutdown: &mut Shutdown,
    ) -> Result<Option<Self>, Failure> {
        if let Some(directory) = &config.state.directory {
            tracing::info!(directory = %directory.display(), "opening the state directory");
        }
        let config = config.clone();
        let opening = tokio::task::spawn_blocking(move || Self::open(&config));
        tokio::select! {
            opened = opening => opened.unwrap_or_else(|error| {
                Err(Failure::running("the state directory cannot be opened", error))
            }).map(Some),
            () = shutdown.requested() => Ok(None),
        }
    }

    fn open(config: &DiagnoserConfig) -> Result<Self, Failure> {
        let directory = config.state.directory.as_deref();
        if directory.is_none() {
            tracing::warn!(
                "no state directory: faults are forgotten when this process ends; \
                 set `directory` in the table `state`, or use `--state-dir`"
            );
        }
        let (mut keeper, recollection) =
            Keeper::open(directory, config.state.rotate_bytes(), config.module())
                .map_err(|error| Failure::Running(error.to_string()))?;
        let (watch_file, watch) = keeper.open_watch_file().unzip();
        Ok(Self { keeper, recollection, watch_file, watch: watch.flatten() })
    }
}

async fn serve(
    session: &Session,
    (config, speaker): (DiagnoserConfig, Speaker),
    mut diagnoser: Diagnoser,
    memory: Remembered,
    (supervisor, health): (Supervisor, Arc<ModuleBoard>),
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let Remembered { keeper, recollection, watch_file, watch } = memory;
    let memory = recollection.memory(watch);
    let configuration = configuration(&config, &speaker)?;
    let mut register = Register::new(speaker.clone());
    let started = register.start(&memory, configuration.fingerprint.clone());
    let shelf = Shelf::new(register.process());
    diagnoser.recall(memory);
    let components = diagnoser.components().to_vec();
    let crew = Crew::new(shutdown.clone(), supervisor.pulse());
    let (writer, submission, journal) = Writer::new(keeper, watch_file);
    let service = Service::new(supervisor.pulse(), staleness::NO_SAMPLE_YET.to_owned());
    let conditions = Conditions::new(diagnoser.conditions());
    let states = States::new(&speaker, &components, service.clone(), conditions.clone());
    let identifications = Arc::new(IdentificationTally::default());
    let Recollection { latest, faults, .. } = recollection;
    let faults = IdentifiedFaults::new(&speaker, &components, faults, Arc::clone(&identifications));
    let books = SharedBooks::new(Books { states, faults, phase: None });
    let boards = Boards {
        journal: journal.clone(),
        watch,
        peers: PeerBook::new(config.peers()),
        namesakes: Namesakes::new(Duration::from_millis(config.publish.status_every_ms)),
        health,
        service,
        conditions,
        identifications: Arc::clone(&identifications),
    };

    let no_thread = |error| Failure::running("no thread can be started", error);
    let written = crew.thread("journal", move |_| writer.run()).map_err(no_thread)?;
    let inquiries = Arc::new(inquiry::InquiryTally::default());
    let kept = (books.clone(), shelf.clone());
    let declaring =
        EventLane::declare(session, &speaker, journal.clone(), kept, Arc::clone(&inquiries));
    let events = declaring.await.map_err(refused)?;
    events.repeat(latest);
    let declaring = RoutineLane::declare(session, &speaker, Arc::clone(&inquiries));
    let routine = declaring.await.map_err(refused)?;
    let replies = ReplyLane::new(books.clone(), journal, Arc::clone(&inquiries));
    let lanes = Lanes { events, replies, routine };
    let (outbox, mut drained) =
        Outbox::open((submission, books), lanes, &crew).map_err(no_thread)?;
    drained.push(written);
    outbox.event(Outgoing::Input(Box::new(started)));

    let (answers, answers_out) = mpsc::channel(ANSWER_QUEUE);
    let presence = peers::watch(session, &speaker, config.peers(), &boards.peers, &answers).await;
    let presence = presence.map_err(refused)?;
    let namesakes = boards.namesakes.watch(session, &speaker).await.map_err(refused)?;
    let looking = Presence::new(session, &speaker, boards.peers.clone()).keep_looking(
        config.peers().to_vec(),
        answers.clone(),
        LOOK_EVERY,
    );
    let looking = crew.task("presence", looking);
    let peers = PeerQueries::declare(session, &speaker, &config, boards.peers.clone(), answers)
        .await
        .map_err(refused)?;
    let directory = config.state.directory.clone();
    let (freeze_frames, ended) =
        FreezeFrames::start(&speaker, directory.clone(), &inquiries, &crew).map_err(no_thread)?;
    drained.push(ended);
    let freeze_frame = freeze_frames.declare(session, &speaker, &inquiries).await;
    let freeze_frame = freeze_frame.map_err(refused)?;
    let given = (directory, Provenance { shelf, configuration }, &crew);
    let declaring = Queryables::declare(session, &speaker, &outbox, given, &inquiries);
    let (queryables, inquiries_out) = declaring.await.map_err(refused)?;
    let (intake, samples, fetched) =
        open_intake(session, &speaker, &config).await.map_err(refused)?;
    let subscriber = intake.receiver.subscribe(session, &speaker).await.map_err(refused)?;
    // This task runs the loop from now on, and whoever sees the token may ask.
    supervisor.progress();
    // Last of all: the token shows that everything above is in place.
    let token = session.liveliness().declare_token(speaker.key(vocabulary::Topic::Alive));
    let token = token.await.map_err(refused)?;
    let declared = Declared { token, subscriber, presence, namesakes, queryables, freeze_frame };
    let (actuators, gages) = config.size();
    tracing::info!(
        structure = %speaker.structure,
        module = %speaker.module,
        actuators,
        gages,
        thresholds = config.thresholds,
        "ready"
    );

    let queues = Queues { samples, fetched, inquiries: inquiries_out, answers: answers_out };
    let refusals = intake.receiver.refusals();
    let identifier = Identifier::start(speaker.clone(), outbox.clone(), identifications, &crew)
        .map_err(no_thread)?;
    let performer = Performer::new(
        speaker,
        (outbox, identifier, register, freeze_frames),
        peers,
        PendingReplies::new(config.queries.hold()),
        QueryPause::new(config.queries.pause()),
        inquiries,
        refusals,
    );
    DiagnosisLoop::new(diagnoser, &config, performer, intake, boards, supervisor)
        .run(queues, shutdown)
        .await;

    looking.abort();
    match tokio::time::timeout(WITHDRAWING, declared.withdraw()).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!("not everything was withdrawn: {error}"),
        Err(_) => tracing::warn!("not everything was withdrawn within {WITHDRAWING:?}"),
    }
    drain(drained).await;
    tracing::info!("stopped");
    Ok(())
}

/// The setup that verdicts depend on, as it is given to who asks.
fn configuration(
    config: &DiagnoserConfig,
    speaker: &Speaker,
) -> Result<ModuleConfiguration, Failure> {
    let (setup, software) = (config.module_setup(), env!("CARGO_PKG_VERSION"));
    speaker
        .configuration(&setup, software, &config.thresholds, clock::unix_ns())
        .map_err(|error| Failure::running("the configuration cannot be written as JSON", error))
}

/// The way of the samples, and the queues at its end: those that come, those that were fetched.
async fn open_intake(
    session: &Session,
    speaker: &Speaker,
    config: &DiagnoserConfig,
) -> zenoh::Result<(Intake, mpsc::Receiver<Arrival>, mpsc::Receiver<Fetched>)> {
    let room = config.publish.sample_queue;
    let (samples_in, samples) = mpsc::channel(room);
    let (fetched_in, fetched) = mpsc::channel(1);
    let (actuators, gages) = config.size();
    let size = Size { actuators, gages };
    let module = speaker.module.clone();
    let receiver = Receiver::new(module, size, samples_in, config.input.incumbent(), room);
    let counters = receiver.counters();
    let store = Store::declare(session, speaker, size, Arc::clone(&counters), fetched_in).await?;
    let intake = Intake {
        sequencer: Sequencer::new(config.input.recover_steps, room),
        store,
        counters,
        receiver,
        resync_after: config.input.resync_after(),
    };
    Ok((intake, samples, fetched))
}

/// What is on the network, in the order in which it is withdrawn.
struct Declared {
    token: LivelinessToken,
    subscriber: Subscriber<()>,
    presence: Vec<Subscriber<()>>,
    namesakes: Subscriber<()>,
    queryables: Queryables,
    freeze_frame: Queryable<()>,
}

impl Declared {
    async fn withdraw(self) -> zenoh::Result<()> {
        self.token.undeclare().await?;
        self.subscriber.undeclare().await?;
        for subscriber in self.presence {
            subscriber.undeclare().await?;
        }
        self.namesakes.undeclare().await?;
        self.freeze_frame.undeclare().await?;
        self.queryables.undeclare().await
    }
}

/// The threads end when the last of those who hold the outbox is gone, and everything in it is out.
async fn drain(drained: Drained) {
    let all = async {
        for drained in drained {
            // An error means that the thread has failed, for which the process ends.
            let _ = drained.await;
        }
    };
    if tokio::time::timeout(DRAINING, all).await.is_err() {
        tracing::warn!("the last messages did not get out, or onto the disk, within {DRAINING:?}");
    }
}
