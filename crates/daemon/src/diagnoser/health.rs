//! The health of a diagnoser.

use std::sync::Arc;
use std::time::Instant;

use parking_lot::{Mutex, MutexGuard};
use shell::health::{HealthCondition, ProcessReport, Subject, live};
use shell::supervision::Pulse;

use crate::metrics::{self, ModuleReport};
use crate::readiness;
use diagnosis::messages::Speaker;

/// The latest report, written by the diagnosis loop together with each status that it publishes.
#[derive(Debug, Default)]
pub(crate) struct LatestReport(Mutex<Option<Arc<ModuleReport>>>);

impl LatestReport {
    /// Takes the place of the report before.
    pub(crate) fn write(&self, report: ModuleReport) {
        *self.lock() = Some(Arc::new(report));
    }

    fn read(&self) -> Option<Arc<ModuleReport>> {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, Option<Arc<ModuleReport>>> {
        self.0.lock()
    }
}

/// A diagnoser's health.
#[derive(Debug)]
pub(crate) struct ModuleHealth {
    pub(crate) speaker: Speaker,
    pub(crate) pulse: Arc<Pulse>,
    pub(crate) report: Arc<LatestReport>,
}

impl Subject for ModuleHealth {
    fn live(&self) -> HealthCondition {
        live(self.pulse.sign(Instant::now()))
    }

    fn ready(&self) -> HealthCondition {
        readiness::module_ready(self.live(), self.report.read().as_deref())
    }

    fn metrics(&self) -> Result<String, std::fmt::Error> {
        let process = ProcessReport::read(self.pulse.sign(Instant::now()));
        metrics::of_module(&self.speaker, self.report.read().as_deref(), &process)
    }
}
