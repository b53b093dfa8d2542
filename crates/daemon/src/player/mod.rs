//! Recorded samples on the network, in the plant's place: at their pace, at another one, or as fast as the diagnosers.

mod programme;

use std::sync::Arc;

use session::Network;
use shell::exit::Failure;
use shell::opening::open_unless;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use vocabulary::{Encoding, ModuleName, RunId};
use zenoh::Session;

pub use programme::Programme;

use crate::config::{LockStep, Speed};
use crate::plant::source::{PRESENCE_EVERY, PacedSource, SourceSettings, on_a_thread};
use crate::plant::status::SharedStatus;

/// By the clock, so many steps are published together, as by the plant.
const BURST_STEPS: u64 = 4;

/// How recorded samples are published.
#[derive(Debug, Clone)]
pub struct Playback {
    /// How fast.
    pub speed: Speed,
    /// As which run. With one that the diagnosers have seen already they do not begin anew.
    pub run: RunId,
    /// Diagnosers that must be present before the first sample.
    pub wait_for: Vec<ModuleName>,
}

/// Publishes recorded samples until the last of them is out, or the end is asked for: how many were published. Questions
/// for past samples are answered meanwhile.
///
/// # Errors
/// No session can be opened, or a Zenoh declaration fails.
pub async fn run(
    network: &Network,
    programme: Programme,
    playback: Playback,
    mut shutdown: Shutdown,
) -> Result<u64, Failure> {
    let Some(session) = open_unless(network, &mut shutdown).await? else { return Ok(0) };
    let result = serve(&session, programme, playback, shutdown).await;
    session::close(&session).await;
    result
}

async fn serve(
    session: &Session,
    programme: Programme,
    playback: Playback,
    shutdown: Shutdown,
) -> Result<u64, Failure> {
    let refused = |error: zenoh::Error| Failure::running("Zenoh declaration failed", error);
    let Playback { speed, run, wait_for } = playback;
    let structure = programme.structure.clone();
    let supervisor = Arc::new(Supervisor::from_environment());
    let status = Arc::new(SharedStatus::new(structure.clone(), run, speed));
    let settings = SourceSettings {
        structure,
        run,
        modules: programme.modules(),
        wait_for,
        speed,
        step_s: programme.step_s,
        burst_steps: BURST_STEPS,
        blocks: false,
        encoding: Encoding::default(),
        lock_step: LockStep::default(),
    };
    let declared = PacedSource::declare(session, settings, status, supervisor, shutdown);
    let (source, declarations) = declared.await.map_err(refused)?;
    let published = on_a_thread("player", move || play(&programme, source)).await;
    declarations.undeclare().await.map_err(refused)?;
    published
}

/// Publishes all samples, or until the end is asked for: how many.
fn play(programme: &Programme, mut source: PacedSource) -> u64 {
    source.wait_for_diagnosers(|| std::thread::sleep(PRESENCE_EVERY));
    let mut published = 0;
    let mut next = programme.steps().map(|(first, _)| first);
    while let Some(step) = next.filter(|_| !source.is_to_end()) {
        source.wait_for_step(step);
        for (module, sample) in programme.at(step) {
            let (demands, pressures) = (&sample.demands_n, &sample.pressures_pa);
            let is_sent = source.publish(module, step, demands, pressures, &sample.elongations_m);
            published += u64::from(is_sent);
        }
        source.advance_to(step.plus(1));
        next = programme.after(step);
    }
    source.finish(programme.steps().map(|(_, last)| last.plus(1)));
    published
}
