//! A run step by step: the modules' measurements, and the results and reports of their diagnosers. The figures of the
//! paper are drawn from it.

use diagnosis::{Diagnoser, Evidence, Measurements};
use vocabulary::{Component, ComponentKind, ModuleName, Step};

use crate::group::RigEvent;
use crate::rig::{Rig, RigError};

/// The events and signals of a run between two steps.
#[derive(Debug, Clone, PartialEq)]
pub struct RunTrace {
    /// The steps of the samples, ascending.
    pub steps: Vec<Step>,
    /// The modules, in the order of the structure.
    pub modules: Vec<ModuleTrace>,
    /// Changes, questions and verdicts, in order.
    pub occurrences: Vec<RigEvent>,
}

/// One module of a run. Every signal has one value per step.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleTrace {
    /// The module.
    pub module: ModuleName,
    /// Demanded force of each actuator \[N\].
    pub demands_n: Vec<Vec<f64>>,
    /// Reading of each gage \[m\].
    pub elongations_m: Vec<Vec<f64>>,
    /// The channels: actuators, then gages, in the order of the description.
    pub channels: Vec<ChannelTrace>,
}

/// One channel of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelTrace {
    /// The monitored component.
    pub component: Component,
    /// The threshold γ of its divergence.
    pub threshold: f64,
    /// The residual: \[N\] for an actuator, \[m\] for a gage.
    pub residual: Vec<f64>,
    /// The divergence D; NaN while undefined.
    pub divergence: Vec<f64>,
}

impl RunTrace {
    /// Advances the rig by `steps` steps and records them.
    ///
    /// # Errors
    /// A fault in the rig's schedule does not fit the plant.
    pub fn record(rig: &mut Rig, steps: u64) -> Result<Self, RigError> {
        let mut trace = Self {
            steps: Vec::new(),
            modules: rig.diagnosers().iter().map(ModuleTrace::new).collect(),
            occurrences: Vec::new(),
        };
        for _ in 0..steps {
            rig.step()?;
            trace.steps.extend(rig.samples().first().map(|sample| sample.step));
            let latest = rig.samples().iter().zip(rig.diagnosers());
            for (module, (sample, diagnoser)) in trace.modules.iter_mut().zip(latest) {
                module.push(sample, diagnoser.evidence());
            }
        }
        trace.occurrences = rig.take_occurrences();
        Ok(trace)
    }
}

impl ModuleTrace {
    fn new(diagnoser: &Diagnoser) -> Self {
        let channels = diagnoser.components().iter().zip(diagnoser.evidence());
        let channel = |(component, evidence): (&Component, &Evidence)| ChannelTrace {
            component: component.clone(),
            threshold: evidence.threshold,
            residual: Vec::new(),
            divergence: Vec::new(),
        };
        Self {
            module: diagnoser.module().clone(),
            demands_n: Vec::new(),
            elongations_m: Vec::new(),
            channels: channels.map(channel).collect(),
        }
    }

    fn push(&mut self, sample: &Measurements, evidence: &[Evidence]) {
        extend(&mut self.demands_n, &sample.demands_n);
        extend(&mut self.elongations_m, &sample.elongations_m);
        for (channel, evidence) in self.channels.iter_mut().zip(evidence) {
            channel.residual.push(evidence.residual);
            channel.divergence.push(evidence.divergence.unwrap_or(f64::NAN));
        }
    }

    /// The channels of the components of one kind.
    pub fn of_kind(&self, kind: ComponentKind) -> impl Iterator<Item = &ChannelTrace> {
        self.channels.iter().filter(move |channel| channel.component.kind() == kind)
    }
}

/// Appends one value to each signal.
fn extend(signals: &mut Vec<Vec<f64>>, values: &[f64]) {
    signals.resize(values.len().max(signals.len()), Vec::new());
    for (signal, value) in signals.iter_mut().zip(values) {
        signal.push(*value);
    }
}
