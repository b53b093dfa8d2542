//! Recorded samples on the network, in the plant's place: at their pace, at another one, or as fast as the diagnosers.

mod playing;
mod programme;

use std::sync::Arc;

use session::Network;
use shell::exit::Failure;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::sync::oneshot;
use vocabulary::{ModuleName, PlantTopic, RunId};
use zenoh::Session;

pub use programme::Programme;

use crate::config::{LockStep, Speed};
use crate::plant::attendance::Attendance;
use crate::plant::awaited::Awaited;
use crate::plant::pacing::{Pace, Pacing};
use crate::plant::progress::ProgressEar;
use crate::plant::recording::Recording;
use crate::plant::sample_publisher::SamplePublisher;
use crate::plant::status::{self, Board};
use playing::Playing;

/// By the clock, so many steps are published together, as by the plant.
const BURST_STEPS: u64 = 4;

/// How recorded samples are published.
#[derive(Debug, Clone)]
pub struct Manner {
    /// How fast.
    pub speed: Speed,
    /// As which run. A run that the diagnosers have seen already is none that they would begin anew with.
    pub run: RunId,
    /// Diagnosers that must be there before the first sample.
    pub wait_for: Vec<ModuleName>,
}

/// Publishes recorded samples until the last of them is out, or the end is asked for: how many were published. Questions
/// for past samples are answered meanwhile.
///
/// # Errors
/// No session can be opened, or the network refuses a declaration.
pub async fn run(
    network: &Network,
    programme: Programme,
    manner: Manner,
    mut shutdown: Shutdown,
) -> Result<u64, Failure> {
    let Some(session) = open_unless(network, &mut shutdown).await? else { return Ok(0) };
    let result = serve(&session, programme, manner, shutdown).await;
    session::close(&session).await;
    result
}

async fn serve(
    session: &Session,
    programme: Programme,
    manner: Manner,
    shutdown: Shutdown,
) -> Result<u64, Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let Manner { speed, run, wait_for } = manner;
    let structure = programme.structure.clone();
    let supervisor = Arc::new(Supervisor::from_environment());
    let board = Arc::new(Board::new(structure.clone(), run, speed));
    let attendance = Arc::new(Attendance::new(run, &programme.modules()));
    let present = attendance.watch_tokens(session, &structure).await.map_err(refused)?;
    let step_s = programme.step_s;
    let pace = Pace { speed, step_s, burst_steps: BURST_STEPS, lock_step: LockStep::default() };
    let pacing = Pacing::new(pace, Arc::clone(&attendance));
    let (mut publishers, mut recordings) = (Vec::new(), Vec::new());
    for module in programme.modules() {
        let recording = Recording::new(run);
        recordings.push(recording.declare(session, &structure, &module).await.map_err(refused)?);
        let publisher =
            SamplePublisher::declare(session, &structure, &module, run, &pacing, recording);
        publishers.push(publisher.await.map_err(refused)?);
    }
    let reporting = tokio::spawn(status::report(
        status::declare(session, &structure).await.map_err(refused)?,
        Arc::clone(&board),
        Arc::clone(&supervisor),
    ));
    let token_key = vocabulary::Key::of_plant(&structure, PlantTopic::Alive).to_string();
    let token = session.liveliness().declare_token(token_key).await.map_err(refused)?;
    let progress = ProgressEar::new(session, &structure, &attendance);
    let playing = Playing {
        programme,
        publishers,
        attendance,
        progress,
        pacing,
        awaited: Awaited::new(wait_for),
        board,
        supervisor,
        shutdown,
    };
    let published = on_a_thread(playing).await;
    reporting.abort();
    token.undeclare().await.map_err(refused)?;
    present.undeclare().await.map_err(refused)?;
    for recording in recordings {
        recording.undeclare().await.map_err(refused)?;
    }
    published
}

async fn on_a_thread(playing: Playing) -> Result<u64, Failure> {
    let (ending, ended) = oneshot::channel();
    std::thread::Builder::new()
        .name("player".to_owned())
        .spawn(move || {
            // Fails only if the receiver is gone.
            let _ = ending.send(playing.run());
        })
        .map_err(|error| Failure::running("the player's thread cannot be started", error))?;
    ended.await.map_err(|_| Failure::Running("the player's thread has failed".to_owned()))
}
