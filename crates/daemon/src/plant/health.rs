//! The health of a plant.

use std::sync::Arc;
use std::time::Instant;

use shell::health::{Condition, ProcessReport, Subject, live};
use shell::supervision::Pulse;

use super::status::Board;
use crate::{metrics, readiness};

/// A plant's health.
#[derive(Debug)]
pub(crate) struct PlantHealth {
    pub(crate) pulse: Arc<Pulse>,
    pub(crate) board: Arc<Board>,
}

impl Subject for PlantHealth {
    fn live(&self) -> Condition {
        live(self.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> Condition {
        readiness::plant_ready(self.live(), &self.board.read())
    }

    fn metrics(&self) -> Result<String, std::fmt::Error> {
        let process = ProcessReport::read(self.pulse.sign(Instant::now()));
        metrics::of_plant(&self.board.read(), &process)
    }
}
