//! What a module measures at one step.

use names::{RunId, Step};

/// The signals of one module at one step, in the order of its description.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The run that the step is counted in.
    pub run: RunId,
    /// The sampling instant.
    pub step: Step,
    /// Demanded force u of each actuator \[N\].
    pub demands_n: Vec<f64>,
    /// Pressures of chambers A and B of each actuator \[Pa\].
    pub pressures_pa: Vec<[f64; 2]>,
    /// Measured elongation y of each gage \[m\].
    pub elongations_m: Vec<f64>,
}

/// Why a sample was not used. Each reason has its own counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
pub enum SampleRejection {
    /// A signal has not as many values as the module has components.
    #[error("wrong number of values")]
    WrongLength,
    /// A value is not a finite number.
    #[error("non-finite value")]
    NonFinite,
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

impl Sample {
    /// Checks lengths and values against a module of `actuators` actuators and `gages` gages.
    pub(crate) fn check(&self, actuators: usize, gages: usize) -> Result<(), SampleRejection> {
        let lengths = [self.demands_n.len(), self.pressures_pa.len(), self.elongations_m.len()];
        if lengths != [actuators, actuators, gages] {
            return Err(SampleRejection::WrongLength);
        }
        let mut values = (self.demands_n.iter())
            .chain(self.pressures_pa.as_flattened())
            .chain(&self.elongations_m);
        if values.all(|x| x.is_finite()) { Ok(()) } else { Err(SampleRejection::NonFinite) }
    }
}
