//! How long what is measured, and which faults are injected when.

use std::time::Duration;

use daemon::config::{Schedule, ScheduledFault};
use vocabulary::{ComponentPath, Step, fault::Fault};

use super::row::Setting;

/// From here on every channel is watched: warm-up, lagged vectors, and some.
const WATCHED_FROM: u64 = 2_700;
/// Between the end of the quiet time and the first fault.
const PAUSE: u64 = 100;
/// Between faults in different towers.
const APART: u64 = 300;
/// Between faults in the same tower: the effects of one are over when the next comes.
const FAR_APART: u64 = 3_000;

/// What happens in a run, in steps.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Nothing happens from here to the first fault.
    pub quiet: std::ops::Range<u64>,
    /// The faulty gages, each with its onset.
    pub faults: Vec<(ComponentPath, Step)>,
}

impl Plan {
    /// This many faults after a quiet time of this length.
    ///
    /// # Panics
    /// If there is no tower.
    #[must_use]
    pub fn new(setting: &Setting, quiet: Duration, faults: usize) -> Self {
        let quiet_steps = (quiet.as_secs_f64() * 1000.0 * setting.speed) as u64;
        let end = WATCHED_FROM + quiet_steps;
        let apart = if setting.copies >= faults { APART } else { FAR_APART };
        let fault = |number: usize| {
            let module = setting.module(number * setting.copies / faults, number % 2);
            let gage = 1 + number % 4;
            let component = format!("{module}/sensor/g{gage}").parse().unwrap();
            (component, Step(end + PAUSE + apart * number as u64))
        };
        Self { quiet: WATCHED_FROM..end, faults: (0..faults).map(fault).collect() }
    }

    /// The plant's fault schedule: faults so large that each is found at its first sample.
    #[must_use]
    pub fn schedule(&self) -> Schedule {
        let fault = |(component, onset): &(ComponentPath, Step)| ScheduledFault {
            at_step: *onset,
            until_step: None,
            component: component.clone(),
            fault: Fault::Bias { offset_m: 4e-4 },
        };
        Schedule { faults: self.faults.iter().map(fault).collect() }
    }

    /// The modules that become faulty.
    #[must_use]
    pub fn modules(&self) -> Vec<String> {
        let mut modules: Vec<String> =
            self.faults.iter().map(|(component, _)| component.module.to_string()).collect();
        modules.sort();
        modules.dedup();
        modules
    }

    /// Every effect of the last fault has been judged by then.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.faults.iter().map(|(_, onset)| onset.0).max().unwrap_or(self.quiet.end) + APART
    }
}
