//! The process that runs on a module's computer.
//!
//! | file | job |
//! |---|---|
//! | `input` | samples from the network, in order and without a gap where the publisher still has them |
//! | `diagnose` | the loop that owns the module's process: takes from the queues, carries out effects |
//! | `store` | the present state of each component, and the journal on disk |
//! | `publish` | everything that goes out, on threads of its own |
//! | `answer` | queries and commands: of peers, operators, monitoring clients |
//! | `identify` | what kind of fault it is, on a thread of its own |
//! | `freeze_frames` | what was seen around the latching of a fault |
//! | `peers` | whether they are there, and what they answer |
//! | `duplicates` | whether another process runs as the same module |
//! | `health` | readiness and metrics over HTTP |
//!
//! What is decided, without the network, the disk or a clock, is in the crate `process`.

mod answer;
mod args;
mod diagnose;
mod duplicates;
mod freeze_frames;
mod health;
mod identify;
mod input;
mod peers;
mod publish;
mod store;

use std::sync::Arc;
use std::time::Duration;

use diagnosis::Diagnoser;
use diagnosis::messages::Speaker;
use parking_lot::Mutex;
use process::{ModuleProcess, ReceivedSample, SampleSize, ShutOffInterlock, WatchedSteps};
use session::CertificateWatch;
use shell::clock;
use shell::exit::Failure;
use shell::health::Listening;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{Crew, Ended, OPENING, Supervisor};
use tokio::sync::mpsc;
use vocabulary::ModuleConfiguration;
use zenoh::Session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;

pub use args::{command_line, main};
pub use store::StateDirectory;

use answer::{ProvenanceAnswers, Queryables, SharedInquiryCounters};
use diagnose::{DiagnosisLoop, Queues, SharedState};
use duplicates::DuplicateWatch;
use freeze_frames::FreezeFrames;
use health::{LatestReport, ModuleHealth};
use identify::Identifier;
use input::{RecoveredSamples, RecoveryQuerier, SampleReceiver};
use peers::{LOOK_EVERY, PeerForces, PeerQueries, PeerTable, Presence, watch_cylinders};
use publish::{EventPublisher, InputCache, ModuleOutbox, OutgoingEvent, RoutinePublisher};
use store::{JournalWriter, ModuleStore};

use crate::config::DiagnoserConfig;

/// How long the state directory may take to be read. The largest journals take two seconds of a processor; after this the
/// disk counts as hung, and diagnosis begins without it.
const OPENING_STATE: Duration = Duration::from_secs(5);
/// Answers of peers that may wait to be looked at.
const ANSWER_QUEUE: usize = 256;
/// What a peer says of its cylinders, once with each status, counts for so many of these.
const SAID_AGAIN: u32 = 5;
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
        Failure::running("cannot create the diagnoser", listed.join("; "))
    })?;
    let Some(opened) = OpenedStore::open_unless(&config, &mut shutdown).await? else {
        return Ok(());
    };
    let listening = Listening::on(config.health)?;
    let supervisor = Supervisor::from_environment();
    let report = Arc::new(LatestReport::default());
    let speaker = Speaker {
        structure: config.structure_name.clone(),
        module: config.module().clone(),
        incarnation: opened.store.lock().components.incarnation(),
    };
    let subject = ModuleHealth {
        speaker: speaker.clone(),
        pulse: supervisor.pulse(),
        report: Arc::clone(&report),
    };
    let serving = listening
        .serve(subject)
        .map_err(|error| Failure::running("health cannot be served", error))?;
    supervisor.status(OPENING);
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(());
    };
    let result =
        serve(&session, (config, speaker), diagnoser, opened, (supervisor, report), shutdown).await;
    session::close(&session).await;
    drop(serving);
    result
}

/// The store with what was there before the process, and what writes it.
struct OpenedStore {
    writer: JournalWriter,
    store: ModuleStore,
    watch: Option<WatchedSteps>,
}

impl OpenedStore {
    /// Unless the end is asked for before the disk has answered. A disk that hangs is left to the journal's thread.
    async fn open_unless(
        config: &DiagnoserConfig,
        shutdown: &mut Shutdown,
    ) -> Result<Option<Self>, Failure> {
        if let Some(directory) = &config.state.directory {
            tracing::info!(directory = %directory.display(), "opening the state directory");
        }
        let owned = config.clone();
        let opening = tokio::task::spawn_blocking(move || Self::open(&owned));
        tokio::select! {
            opened = tokio::time::timeout(OPENING_STATE, opening) => match opened {
                Ok(opened) => opened.unwrap_or_else(|error| {
                    Err(Failure::running("the state directory cannot be opened", error))
                }),
                Err(_) => {
                    let (writer, store) = JournalWriter::unanswered(
                        config.state.directory.as_deref(),
                        config.state.rotate_bytes(),
                        config.module(),
                    );
                    Ok(Self { writer, store, watch: None })
                }
            }.map(Some),
            () = shutdown.requested() => Ok(None),
        }
    }

    fn open(config: &DiagnoserConfig) -> Result<Self, Failure> {
        let directory = config.state.directory.as_deref();
        if directory.is_none() {
            tracing::warn!(
                "no state directory: faults will not survive a restart; \
                 set `directory` in the table `state`, or use `--state-dir`"
            );
        }
        let (writer, store, watch) =
            JournalWriter::open(directory, config.state.rotate_bytes(), config.module())
                .map_err(|error| Failure::Running(error.to_string()))?;
        Ok(Self { writer, store, watch })
    }
}

/// Everything that a diagnoser consists of, in the order in which it is started: store, publish, peers, answer, input,
/// diagnosis.
async fn serve(
    session: &Session,
    (config, speaker): (DiagnoserConfig, Speaker),
    diagnoser: Diagnoser,
    opened: OpenedStore,
    (supervisor, health): (Supervisor, Arc<LatestReport>),
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused = |error: zenoh::Error| Failure::running("Zenoh declaration failed", error);
    let no_thread = |error| Failure::running("no thread can be started", error);
    let configuration = configuration(&config, &speaker)?;
    let crew = Crew::new(shutdown.clone(), supervisor.pulse());
    let inquiries = SharedInquiryCounters::default();
    let identifications = Arc::default();

    // Restart: what the journal holds, for the diagnoser and for the recording of its inputs.
    let OpenedStore { writer, store, watch } = opened;
    let components = diagnoser.components().to_vec();
    let fingerprint = configuration.fingerprint.clone();
    let (module, started, inputs) = {
        let (mut state, settings) = (store.lock(), config.process_settings());
        let subject = (diagnoser, speaker.clone());
        let known = (&mut *state, watch);
        let (module, started) =
            ModuleProcess::start(subject, settings, fingerprint, known, diagnose::now());
        let inputs = state.components.inputs(&speaker.module);
        let inputs = InputCache::new(module.process(), inputs);
        (module, started, inputs)
    };

    // Store: the journal is written by a thread of its own.
    writer.note_start(&store);
    let writes = store.clone();
    let written = crew.thread("journal", move |_| writer.run(&writes)).map_err(no_thread)?;

    // Publish.
    let publisher = EventPublisher::declare(
        session,
        (&speaker, &components),
        (store.clone(), inputs.clone()),
        &inquiries,
        &identifications,
    );
    let events = publisher.await.map_err(refused)?;
    events.repeat();
    let routine = RoutinePublisher::declare(session, &speaker, Arc::clone(&inquiries));
    let routine = routine.await.map_err(refused)?;
    let (outbox, mut threads) =
        ModuleOutbox::open(store.clone(), events, routine, &crew).map_err(no_thread)?;
    threads.push(written);
    outbox.event(OutgoingEvent::Input(Box::new(started)));

    // Peers, and other processes of this module.
    let (answers, answers_out) = mpsc::channel(ANSWER_QUEUE);
    let peers = PeerTable::new(config.peers());
    let presence = peers::watch(session, &speaker, config.peers(), &peers, &answers).await;
    let presence = presence.map_err(refused)?;
    let every = Duration::from_millis(config.publish.status_every_ms);
    let most = config.tolerance.most_shut_off;
    let interlock = ShutOffInterlock::new(most, SAID_AGAIN * every, config.peers());
    let interlock = Arc::new(Mutex::new(interlock));
    let cylinders = watch_cylinders(session, &speaker, config.peers(), &interlock).await;
    let cylinders = cylinders.map_err(refused)?;
    let duplicates = DuplicateWatch::new(every);
    let duplicates_seen = duplicates.watch(session, &speaker).await.map_err(refused)?;
    let looking = Presence::new(session, &speaker, peers.clone()).keep_looking(
        config.peers().to_vec(),
        answers.clone(),
        LOOK_EVERY,
    );
    let looking = crew.task("presence", looking);
    let (forces, listening) = PeerForces::new(session, &speaker, config.peers());
    let listening = crew.task("forces", listening);
    let queries = PeerQueries::declare(session, &speaker, &config, peers.clone(), answers)
        .await
        .map_err(refused)?;

    // Answer.
    let directory = config.state.directory.clone();
    let (freeze_frames, ended) =
        FreezeFrames::start(&speaker, directory.clone(), &inquiries, &crew).map_err(no_thread)?;
    threads.push(ended);
    let freeze_frame = freeze_frames.declare(session, &speaker, &inquiries).await;
    let freeze_frame = freeze_frame.map_err(refused)?;
    let answered = (&outbox, store.clone(), supervisor.pulse());
    let kept = (directory, ProvenanceAnswers { inputs, configuration }, &crew);
    let declaring = Queryables::declare(session, &speaker, answered, kept, &inquiries);
    let (queryables, inquiries_out, ended) = declaring.await.map_err(refused)?;
    threads.push(ended);

    // Input.
    let (receiver, recovery, samples, recovered) =
        open_input(session, &speaker, &config).await.map_err(refused)?;
    let subscriber = receiver.subscribe(session, &speaker).await.map_err(refused)?;
    // This task runs the loop from now on, and clients that see the token may ask.
    supervisor.progress();
    // Last of all: the token shows that everything above is in place.
    let token = session.liveliness().declare_token(speaker.key(vocabulary::Topic::Alive));
    let token = token.await.map_err(refused)?;
    let declared = Declared {
        token,
        subscriber,
        presence,
        cylinders,
        duplicates: duplicates_seen,
        queryables,
        freeze_frame,
    };
    let (actuators, gages) = config.size();
    tracing::info!(
        structure = %speaker.structure,
        module = %speaker.module,
        actuators,
        gages,
        thresholds = config.thresholds,
        "ready"
    );

    // Diagnosis.
    let queues = Queues { samples, recovered, inquiries: inquiries_out, answers: answers_out };
    let counted = Arc::clone(&identifications);
    let identifier =
        Identifier::start(speaker.clone(), outbox.clone(), counted, &crew).map_err(no_thread)?;
    let shared = SharedState {
        store,
        outbox,
        receiver,
        recovery,
        queries,
        peers,
        forces,
        interlock,
        identifier,
        freeze_frames,
        inquiries,
        duplicates,
        certificate: CertificateWatch::start(config.network.certificates()),
        health,
        identifications,
    };
    DiagnosisLoop::new(module, shared, supervisor).run(queues, shutdown).await;

    looking.abort();
    listening.abort();
    match tokio::time::timeout(WITHDRAWING, declared.withdraw()).await {
        Ok(Ok(())) => {}
        Ok(Err(error)) => tracing::warn!("failed to undeclare Zenoh resources: {error}"),
        Err(_) => tracing::warn!("Zenoh resources not undeclared within {WITHDRAWING:?}"),
    }
    drain(threads).await;
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

/// Where samples come from, and the queues at the end: those that come, those that are recovered.
async fn open_input(
    session: &Session,
    speaker: &Speaker,
    config: &DiagnoserConfig,
) -> zenoh::Result<(
    SampleReceiver,
    RecoveryQuerier,
    mpsc::Receiver<ReceivedSample>,
    mpsc::Receiver<RecoveredSamples>,
)> {
    let room = config.publish.sample_queue;
    let (samples_in, samples) = mpsc::channel(room);
    let (recovered_in, recovered) = mpsc::channel(1);
    let (actuators, gages) = config.size();
    let size = SampleSize { actuators, gages };
    let arbitration = (config.input.incumbent(), room);
    let receiver = SampleReceiver::new(speaker.module.clone(), size, samples_in, arbitration);
    let recovery =
        RecoveryQuerier::declare(session, speaker, receiver.clone(), recovered_in).await?;
    Ok((receiver, recovery, samples, recovered))
}

/// What is on the network, in the order in which it is withdrawn.
struct Declared {
    token: LivelinessToken,
    subscriber: Subscriber<()>,
    presence: Vec<Subscriber<()>>,
    cylinders: Vec<Subscriber<()>>,
    duplicates: Subscriber<()>,
    queryables: Queryables,
    freeze_frame: Queryable<()>,
}

impl Declared {
    async fn withdraw(self) -> zenoh::Result<()> {
        self.token.undeclare().await?;
        self.subscriber.undeclare().await?;
        for subscriber in self.presence.into_iter().chain(self.cylinders) {
            subscriber.undeclare().await?;
        }
        self.duplicates.undeclare().await?;
        self.freeze_frame.undeclare().await?;
        self.queryables.undeclare().await
    }
}

/// The threads end when the last of those who hold the outbox is gone, and everything in it is out.
async fn drain(threads: Vec<Ended>) {
    let all = async {
        for ended in threads {
            // An error means that the thread has failed, for which the process ends.
            let _ = ended.await;
        }
    };
    if tokio::time::timeout(DRAINING, all).await.is_err() {
        tracing::warn!(
            "shutdown timed out after {DRAINING:?}, before all messages were published and journaled"
        );
    }
}
