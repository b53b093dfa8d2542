//! The process that stands in for the tower.
//!
//! | file | job |
//! |---|---|
//! | `simulation` | a thread: orders and agenda, one step, its samples out, and again |
//! | `pacing` | when the next step may come: by the clock, or as fast as the diagnosers |
//! | `attendance` | which diagnosers are there and how far they have come |
//! | `awaited` | which of them must be there before the first step |
//! | `progress` | receives the latter, when it matters |
//! | `order` | orders from the network: taken, passed on, answered |
//! | `meaning` | which component an order means |
//! | `injection`, `stroke` | faults and repairs; stroke tests |
//! | `agenda` | what is to happen to which component at which step |
//! | `sample_publisher` | one module's samples |
//! | `recording` | the latest of them, for diagnosers that missed some |
//! | `status`, `health` | the status of it all; the same over HTTP |

mod agenda;
mod args;
pub(crate) mod attendance;
pub(crate) mod awaited;
mod health;
mod injection;
mod meaning;
mod order;
pub(crate) mod pacing;
pub(crate) mod progress;
pub(crate) mod recording;
pub(crate) mod sample_publisher;
pub(crate) mod simulation;
pub(crate) mod status;
mod stroke;

use std::sync::Arc;

use tokio::sync::oneshot;
use vocabulary::{PlantTopic, RunId};
use zenoh::Session;

pub use args::{command_line, main};

use agenda::Agenda;
use attendance::Attendance;
use awaited::Awaited;
use health::PlantHealth;
use pacing::{Pace, Pacing};
use progress::ProgressEar;
use recording::Recording;
use sample_publisher::SamplePublisher;
use shell::clock;
use shell::exit::Failure;
use shell::health::Listening;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{OPENING, Supervisor};
use simulation::Simulation;
use status::Board;

use crate::config::PlantConfig;
use crate::status_line;

/// Runs a plant until its last step is done or it is asked to end.
///
/// # Errors
/// No plant can be made, no session can be opened, or the network refuses a declaration.
pub async fn run(config: PlantConfig, mut shutdown: Shutdown) -> Result<(), Failure> {
    let plant =
        config.make_plant().map_err(|error| Failure::running("no plant can be made", error))?;
    let listening = Listening::on(config.health)?;
    let supervisor = Arc::new(Supervisor::from_environment());
    supervisor.status(OPENING);
    let run = config.run.unwrap_or(RunId(clock::unix_ns() / 1000));
    let board = Arc::new(Board::new(config.structure.name.clone(), run, config.speed));
    let subject = PlantHealth { pulse: supervisor.pulse(), board: Arc::clone(&board) };
    let serving = listening
        .serve(subject)
        .map_err(|error| Failure::running("health cannot be served", error))?;
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(());
    };
    let result = serve(&session, &config, plant, (supervisor, board), shutdown).await;
    session::close(&session).await;
    drop(serving);
    result
}

async fn serve(
    session: &Session,
    config: &PlantConfig,
    plant: ::plant::Plant,
    (supervisor, board): (Arc<Supervisor>, Arc<Board>),
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused =
        |error: zenoh::Error| Failure::running("the network refuses a declaration", error);
    let structure = &config.structure.name;
    let run = board.run();
    let equipped: Vec<_> = config.structure.equipped().map(|module| module.name.clone()).collect();

    let attendance = Arc::new(Attendance::new(run, &equipped));
    let present = attendance.watch_tokens(session, structure).await.map_err(refused)?;
    let progress = ProgressEar::new(session, structure, &attendance);
    let (orders, replies) = order::channel();
    let taking = order::declare(session, structure, orders.sender, replies.sender.clone())
        .await
        .map_err(refused)?;
    let replying = tokio::spawn(order::reply(replies.receiver));
    let pace = Pace {
        speed: config.speed,
        step_s: config.parameters.step_s,
        burst_steps: config.burst_steps,
        lock_step: config.lock_step,
    };
    let pacing = Pacing::new(pace, Arc::clone(&attendance));
    let mut publishers = Vec::with_capacity(equipped.len());
    let mut recordings = Vec::with_capacity(equipped.len());
    for module in config.structure.modules.iter().filter(|module| module.is_equipped()) {
        let name = &module.name;
        let recording = Recording::new(run);
        recordings.push(recording.declare(session, structure, name).await.map_err(refused)?);
        let publisher = SamplePublisher::declare(session, structure, name, run, &pacing, recording);
        publishers.push(publisher.await.map_err(refused)?);
    }
    let reporting = tokio::spawn(status::report(
        status::declare(session, structure).await.map_err(refused)?,
        Arc::clone(&board),
        Arc::clone(&supervisor),
    ));
    let token_key = vocabulary::Key::of_plant(structure, PlantTopic::Alive).to_string();
    let token = session.liveliness().declare_token(token_key).await.map_err(refused)?;
    tracing::info!(%structure, %run, seed = config.seed, speed = %config.speed, "ready");
    supervisor.ready(&status_line::of_plant(&board.read()));

    let simulation = Simulation {
        plant,
        publishers,
        agenda: Agenda::from_schedule(&config.schedule),
        orders: orders.receiver,
        replies: replies.sender,
        attendance,
        progress,
        pacing,
        awaited: Awaited::new(config.wait_for.clone()),
        steps: config.steps,
        board: Arc::clone(&board),
        supervisor: Arc::clone(&supervisor),
        shutdown,
    };
    let (ending, ended) = oneshot::channel();
    std::thread::Builder::new()
        .name("plant".to_owned())
        .spawn(move || {
            simulation.run();
            // Fails only if the receiver is gone.
            let _ = ending.send(());
        })
        .map_err(|error| Failure::running("the plant's thread cannot be started", error))?;
    // An error means that the thread has failed.
    let ended = ended.await;
    reporting.abort();
    supervisor.stopping();
    replying.abort();
    token.undeclare().await.map_err(refused)?;
    for queryable in taking {
        queryable.undeclare().await.map_err(refused)?;
    }
    present.undeclare().await.map_err(refused)?;
    for recording in recordings {
        recording.undeclare().await.map_err(refused)?;
    }
    ended.map_err(|_| Failure::Running("the plant's thread has failed".to_owned()))?;
    tracing::info!("stopped");
    Ok(())
}
