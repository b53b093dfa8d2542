//! The status of the plant.

use std::sync::Arc;
use std::time::Duration;

use parking_lot::{Mutex, MutexGuard};
use shell::clock;
use shell::supervision::Supervisor;
use tokio::time::{MissedTickBehavior, interval};
use vocabulary::{
    Key, ModuleName, PlantPhase, PlantStatus, PlantTopic, PresentFault, RunId, Step, StructureName,
};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

use super::pacing::Lateness;
use crate::config::Speed;
use crate::status_line;

const EVERY: Duration = Duration::from_secs(1);

/// The status as it stands, written by the plant's thread and read by the publishing task.
#[derive(Debug)]
pub(crate) struct Board(Mutex<PlantStatus>);

impl Board {
    pub(crate) fn new(structure: StructureName, run: RunId, speed: Speed) -> Self {
        Self(Mutex::new(PlantStatus {
            structure,
            software: env!("CARGO_PKG_VERSION").to_owned(),
            run,
            phase: PlantPhase::Waiting,
            waiting_for: Vec::new(),
            next_step: Step(0),
            speed: speed.factor(),
            late_steps: 0,
            latest_ms: 0.0,
            samples_unsent: 0,
            faults: Vec::new(),
            time_unix_ns: 0,
        }))
    }

    pub(crate) fn run(&self) -> RunId {
        self.status().run
    }

    pub(crate) fn waiting(&self, modules: Vec<ModuleName>) {
        self.status().waiting_for = modules;
    }

    pub(crate) fn phase(&self, phase: PlantPhase) {
        let mut status = self.status();
        status.phase = phase;
        status.waiting_for.clear();
    }

    pub(crate) fn step(&self, next_step: Step, lateness: Lateness, samples_unsent: u64) {
        let mut status = self.status();
        status.next_step = next_step;
        status.late_steps = lateness.steps;
        status.latest_ms = lateness.worst.as_secs_f64() * 1e3;
        status.samples_unsent = samples_unsent;
    }

    pub(crate) fn faults(&self, plant: &::plant::Plant) {
        let present = plant
            .faults()
            .iter()
            .map(|(component, fault)| PresentFault { component: component.clone(), fault: *fault });
        self.status().faults = present.collect();
    }

    pub(crate) fn read(&self) -> PlantStatus {
        let mut status = self.status().clone();
        status.time_unix_ns = clock::unix_ns();
        status
    }

    /// Every change is one assignment, so a thread that failed has left the status in order.
    fn status(&self) -> MutexGuard<'_, PlantStatus> {
        self.0.lock()
    }
}

pub(crate) async fn declare(
    session: &Session,
    structure: &StructureName,
) -> zenoh::Result<Publisher<'static>> {
    session
        .declare_publisher(Key::of_plant(structure, PlantTopic::Status).to_string())
        .encoding(Encoding::APPLICATION_JSON)
        .congestion_control(CongestionControl::Drop)
        .await
}

/// Publishes the status once a second, and notifies the service manager.
pub(crate) async fn report(
    publisher: Publisher<'static>,
    board: Arc<Board>,
    supervisor: Arc<Supervisor>,
) {
    let mut ticks = interval(EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let status = board.read();
        supervisor.status(&status_line::of_plant(&status));
        match vocabulary::encode(&status) {
            Ok(bytes) => {
                if let Err(error) = publisher.put(bytes).await {
                    tracing::debug!("status not sent: {error}");
                }
            }
            Err(error) => tracing::error!("{error}"),
        }
    }
}
