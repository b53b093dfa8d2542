//! The process that stands in for the tower.
//!
//! | file | job |
//! |---|---|
//! | `simulation` | a thread: commands and agenda, one step, its samples out, and again |
//! | `source` | samples out, simulated or recorded, and what else a plant declares on the network |
//! | `pacing` | when the next step may come: by the clock, or as fast as the diagnosers |
//! | `diagnosers` | which diagnosers are present and how far they have come |
//! | `commands` | faults, repairs and strokes from the network: queued, carried out, answered |
//! | `agenda` | faults and repairs to come |
//! | `tolerance` | what modules say of their components, for the controller |
//! | `sample_publisher` | one module's samples |
//! | `recent_samples` | the latest of them, for diagnosers that missed some |
//! | `status` | the status of it all, published, for the service manager and over HTTP |

mod agenda;
mod args;
mod commands;
mod diagnosers;
mod pacing;
mod recent_samples;
mod sample_publisher;
mod simulation;
pub(crate) mod source;
pub(crate) mod status;
mod tolerance;

use std::sync::Arc;

use tokio::sync::mpsc;
use vocabulary::RunId;
use zenoh::Session;

pub use args::{command_line, main};

use agenda::Agenda;
use shell::clock;
use shell::exit::Failure;
use shell::health::Listening;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::{OPENING, Supervisor};
use simulation::SimulationLoop;
use source::{PacedSource, SourceSettings, on_a_thread};
use status::{PlantHealth, SharedStatus};

use crate::config::PlantConfig;
use crate::status_line;

/// Runs a plant until its last step is done or it is asked to end.
///
/// # Errors
/// No plant can be made, no session can be opened, or a Zenoh declaration fails.
pub async fn run(config: PlantConfig, mut shutdown: Shutdown) -> Result<(), Failure> {
    let plant =
        config.make_plant().map_err(|error| Failure::running("no plant can be made", error))?;
    let listening = Listening::on(config.health)?;
    let supervisor = Arc::new(Supervisor::from_environment());
    supervisor.status(OPENING);
    let run = config.run.unwrap_or(RunId(clock::unix_ns() / 1000));
    let status = Arc::new(SharedStatus::new(config.structure.name.clone(), run, config.speed));
    let health = PlantHealth { pulse: supervisor.pulse(), status: Arc::clone(&status) };
    let serving = listening
        .serve(health)
        .map_err(|error| Failure::running("health cannot be served", error))?;
    let Some(session) = open_unless(&config.network, &mut shutdown).await? else {
        return Ok(());
    };
    let result = serve(&session, config, plant, run, (supervisor, status), shutdown).await;
    session::close(&session).await;
    drop(serving);
    result
}

async fn serve(
    session: &Session,
    config: PlantConfig,
    mut plant: ::plant::Plant,
    run: RunId,
    (supervisor, status): (Arc<Supervisor>, Arc<SharedStatus>),
    shutdown: Shutdown,
) -> Result<(), Failure> {
    let refused = |error: zenoh::Error| Failure::running("Zenoh declaration failed", error);
    let structure = config.structure.name.clone();
    let (command_sender, commands) = std::sync::mpsc::sync_channel(commands::QUEUE);
    let (replies, reply_receiver) = mpsc::channel(commands::QUEUE);
    let taking = commands::declare(session, &structure, command_sender, replies.clone())
        .await
        .map_err(refused)?;
    let replying = tokio::spawn(commands::reply(reply_receiver));
    let measures = &config.tolerance;
    let tolerance = plant::Tolerance::new(measures, config.parameters.step_s, run, &mut plant);
    let (news_in, news) = std::sync::mpsc::sync_channel(tolerance::QUEUE);
    let listening =
        tolerance::subscribe(session, &structure, measures, news_in).await.map_err(refused)?;
    let settings = SourceSettings {
        structure: structure.clone(),
        run,
        modules: config.structure.equipped().map(|module| module.name.clone()).collect(),
        wait_for: config.wait_for,
        speed: config.speed,
        step_s: config.parameters.step_s,
        burst_steps: config.burst_steps,
        blocks: config.blocks,
        encoding: config.encoding,
        lock_step: config.lock_step,
    };
    let declared =
        PacedSource::declare(session, settings, status, Arc::clone(&supervisor), shutdown);
    let (source, mut declarations) = declared.await.map_err(refused)?;
    declarations.queryables.extend(taking);
    tracing::info!(%structure, %run, seed = config.seed, speed = %config.speed, "ready");
    supervisor.ready(&status_line::of_plant(&source.status.read()));
    let agenda = Agenda::from_schedule(&config.schedule);
    let steps = config.steps;
    let simulation = SimulationLoop { plant, agenda, commands, replies, tolerance, news, steps };
    let ended = on_a_thread("plant", move || simulation.run(source)).await;
    declarations.reporting.abort();
    supervisor.stopping();
    replying.abort();
    declarations.undeclare().await.map_err(refused)?;
    drop(listening);
    ended?;
    tracing::info!("stopped");
    Ok(())
}
