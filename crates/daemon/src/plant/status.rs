//! The status of the plant: published, on the service manager and over HTTP.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;
use shell::clock;
use shell::health::{HealthCondition, ProcessReport, Subject, live};
use shell::supervision::{Pulse, Supervisor};
use tokio::time::{MissedTickBehavior, interval};
use vocabulary::{Key, PlantPhase, PlantStatus, PlantTopic, RunId, Step, StructureName};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;

use crate::config::Speed;
use crate::{metrics, readiness, status_line};

const EVERY: Duration = Duration::from_secs(1);

/// The status as it stands, written by the plant's thread and read by the publishing task.
#[derive(Debug)]
pub(crate) struct SharedStatus(Mutex<PlantStatus>);

impl SharedStatus {
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
            done_without: Vec::new(),
            messages_refused: 0,
            time_unix_ns: 0,
        }))
    }

    /// Changes it. What is shown then is what the change has written, even if the thread fails meanwhile.
    pub(crate) fn update(&self, change: impl FnOnce(&mut PlantStatus)) {
        change(&mut self.0.lock());
    }

    pub(crate) fn phase(&self, phase: PlantPhase) {
        self.update(|status| {
            status.phase = phase;
            status.waiting_for.clear();
        });
    }

    pub(crate) fn read(&self) -> PlantStatus {
        PlantStatus { time_unix_ns: clock::unix_ns(), ..self.0.lock().clone() }
    }
}

/// A plant's health.
#[derive(Debug)]
pub(crate) struct PlantHealth {
    pub(crate) pulse: Arc<Pulse>,
    pub(crate) status: Arc<SharedStatus>,
}

impl Subject for PlantHealth {
    fn live(&self) -> HealthCondition {
        live(self.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> HealthCondition {
        readiness::plant_ready(self.live(), &self.status.read())
    }

    fn metrics(&self) -> Result<String, std::fmt::Error> {
        let process = ProcessReport::read(self.pulse.sign(Instant::now()));
        metrics::of_plant(&self.status.read(), &process)
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
    status: Arc<SharedStatus>,
    supervisor: Arc<Supervisor>,
) {
    let mut ticks = interval(EVERY);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let status = status.read();
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
