//! What a module measures at one step.

use vocabulary::{Counters, RunId, Step};

/// What one module measures at one step, actuators and gages in the order of its description. A value that is missing is
/// not a number.
///
/// It is what a diagnoser uses of a published [`vocabulary::Sample`]: neither the module, which the shell has checked, nor
/// the publisher's clock, on which no verdict may depend.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Measurements {
    /// The run that the step is counted in.
    pub run: RunId,
    /// The sampling instant.
    pub step: Step,
    /// Demanded force u of each actuator \[N\].
    pub demands_n: Vec<f64>,
    /// Pressures of chambers A and B of each actuator \[Pa\].
    pub pressures_pa: Vec<[f64; 2]>,
    /// Measured elongation y of each gage \[m\]; in a learned module the reading of each channel, in its own unit.
    pub elongations_m: Vec<f64>,
}

/// One of a sample's values, by the number of its actuator or gage, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub enum Signal {
    /// The demanded force of an actuator.
    Demand(usize),
    /// A chamber pressure of an actuator.
    Pressure(usize),
    /// The elongation of a gage.
    Elongation(usize),
    /// The reading of a learned module's channel.
    Reading(usize),
}

impl std::fmt::Display for Signal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Signal::Demand(_) => "demand",
            Signal::Pressure(_) => "pressure",
            Signal::Elongation(_) => "elongation",
            Signal::Reading(_) => "reading",
        })
    }
}

/// Why a sample was not used. Each reason has its own counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SampleRejection {
    /// A signal has not as many values as the module has components.
    #[error("wrong number of values")]
    WrongLength,
    /// The step is the one before once more.
    #[error("step repeated")]
    Repeated,
    /// The step lies before the one before: the gap it belonged into is closed.
    #[error("step already passed")]
    Late,
    /// The step lies so far ahead that a single sample is not trusted: accepting it would turn every
    /// valid sample after it into a repeated one.
    #[error("step implausibly far ahead")]
    FarAhead,
}

impl SampleRejection {
    pub(crate) fn count_in(self, counters: &mut Counters) {
        let counter = match self {
            SampleRejection::WrongLength => &mut counters.samples_wrong_length,
            SampleRejection::Repeated => &mut counters.samples_repeated,
            SampleRejection::Late => &mut counters.samples_late,
            SampleRejection::FarAhead => &mut counters.samples_far_ahead,
        };
        *counter += 1;
    }
}

impl Measurements {
    /// Checks the lengths against a module of `actuators` actuators and `gages` gages. Values are judged one by
    /// one (see [`crate::validity`]).
    pub(crate) fn check(&self, actuators: usize, gages: usize) -> Result<(), SampleRejection> {
        let lengths = [self.demands_n.len(), self.pressures_pa.len(), self.elongations_m.len()];
        if lengths == [actuators, actuators, gages] {
            Ok(())
        } else {
            Err(SampleRejection::WrongLength)
        }
    }
}
