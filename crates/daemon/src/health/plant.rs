//! What there is to say of a plant.

use std::sync::Arc;
use std::time::Instant;

use super::Subject;
use super::condition::{self, Condition};
use super::metrics::{self, ProcessReport};
use crate::plant::Board;
use crate::supervision::Pulse;

/// A plant's health.
#[derive(Debug)]
pub(crate) struct PlantHealth {
    pub(crate) pulse: Arc<Pulse>,
    pub(crate) board: Arc<Board>,
}

impl Subject for PlantHealth {
    fn live(&self) -> Condition {
        condition::live(self.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> Condition {
        condition::plant_ready(self.live(), &self.board.read())
    }

    fn metrics(&self) -> Result<String, std::fmt::Error> {
        let process = ProcessReport::read(self.pulse.sign(Instant::now()));
        metrics::of_plant(&self.board.read(), &process)
    }
}
