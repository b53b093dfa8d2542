//! What was seen around the latching of a fault. An observer: what is published is noted, and no verdict depends on it.

use vocabulary::{Component, RunId, Step};

use crate::channels::Channels;
use crate::event::Action;
use crate::recent::Row;
use crate::settings::{ModuleSetup, Sampling};
use crate::verdict::Transition;
use vocabulary::Verdict;

/// How much is shown before onset and detection, and how much after the step as of which the fault was latched \[s\].
const AROUND_S: f64 = 2.0;

/// What was seen of a component from two seconds before the onset or the detection of its fault, whichever is earlier, to
/// two seconds after the latching, or to the end of the run. Of what lies further back than six seconds before its end
/// nothing is kept: of a fault that was latched long after its onset the beginning is missing.
#[derive(Debug, Clone, PartialEq)]
pub struct FreezeFrame {
    /// The run that the steps are counted in.
    pub run: RunId,
    /// The component that was latched.
    pub component: Component,
    /// The number of the transition that latched it.
    pub sequence: u64,
    /// Since when the residual has been changing.
    pub onset: Step,
    /// When the divergence reached its threshold, or the departure was found.
    pub detection: Step,
    /// As of which step the fault was latched.
    pub decided: Step,
    /// The threshold of the divergence.
    pub threshold: f64,
    /// Length of a step \[s\].
    pub step_s: f64,
    /// The steps that the values belong to, in order; one whose sample was missing is left out.
    pub steps: Vec<Step>,
    /// What was measured and computed.
    pub traces: Vec<Trace>,
}

/// One signal of a freeze frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// What it is.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// One value for each step of the frame; `None` where it was missing, cannot be used or is undefined. Residuals are
    /// less what an operator had subtracted.
    pub values: Vec<Option<f64>>,
}

/// The frames that are not complete yet: at most one of each channel.
#[derive(Debug, Clone)]
pub(crate) struct Freezing {
    /// The transitions that latched something, in their order.
    latched: Vec<Transition>,
    sampling: Sampling,
    step_s: f64,
    actuators: usize,
}

impl Freezing {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        Self {
            latched: Vec::new(),
            sampling: setup.sampling(),
            step_s: setup.step_s,
            actuators: setup.actuators(),
        }
    }

    /// Takes notice of what is published.
    pub(crate) fn note(&mut self, actions: &[Action]) {
        for action in actions {
            let Action::Publish(transition) = action else { continue };
            if transition.verdict == Verdict::Latched && transition.order.is_none() {
                // A component that was reset meanwhile and is faulty again: the earlier frame would be about both.
                self.latched.retain(|earlier| earlier.component != transition.component);
                self.latched.push(transition.clone());
            }
        }
    }

    /// Gives the frames that are complete at this step.
    pub(crate) fn follow(&mut self, now: Step, channels: &Channels, actions: &mut Vec<Action>) {
        if self.latched.is_empty() {
            return;
        }
        let around = self.sampling.steps(AROUND_S);
        let is_due = |latched: &mut Transition| latched.decided.plus(around) <= now;
        let due: Vec<Transition> = self.latched.extract_if(.., is_due).collect();
        actions.extend(due.iter().filter_map(|latched| self.frame(latched, channels)));
    }

    /// Gives every frame as it is: no step follows.
    pub(crate) fn end(&mut self, channels: &Channels, actions: &mut Vec<Action>) {
        let due = std::mem::take(&mut self.latched);
        actions.extend(due.iter().filter_map(|latched| self.frame(latched, channels)));
    }

    fn frame(&self, latched: &Transition, channels: &Channels) -> Option<Action> {
        let channel = channels.position(&latched.component)?;
        let around = self.sampling.steps(AROUND_S);
        let from = latched.onset.min(latched.detection).minus(around);
        // A fault that peers were silent about is latched as of an earlier step: everything since then is shown.
        let rows: Vec<Row<'_>> = channels.recent().rows(from, Step(u64::MAX)).collect();
        Some(Action::Freeze(Box::new(FreezeFrame {
            run: latched.run,
            component: latched.component.clone(),
            sequence: latched.sequence,
            onset: latched.onset,
            detection: latched.detection,
            decided: latched.decided,
            threshold: channels.evidence()[channel].threshold,
            step_s: self.step_s,
            steps: rows.iter().map(|row| row.step).collect(),
            traces: self.traces(channel, &rows),
        })))
    }

    fn traces(&self, channel: usize, rows: &[Row<'_>]) -> Vec<Trace> {
        let trace = |name, unit, value: &dyn Fn(&Row<'_>) -> f64| {
            let values = rows.iter().map(value).map(|value| value.is_finite().then_some(value));
            Trace { name, unit, values: values.collect() }
        };
        let divergence = trace("divergence", "1", &|row| row.divergence(channel));
        let residual = |unit| trace("residual", unit, &|row| row.residual(channel));
        match channel.checked_sub(self.actuators) {
            Some(gage) => {
                let reading = trace("reading", "m", &|row| row.readings_m()[gage]);
                vec![reading, residual("m"), divergence]
            }
            None => vec![
                trace("demand", "N", &|row| row.demand_n(channel)),
                trace("force", "N", &|row| row.forces_n()[channel]),
                residual("N"),
                divergence,
                trace("pressure_a", "Pa", &|row| row.pressures_pa(channel)[0]),
                trace("pressure_b", "Pa", &|row| row.pressures_pa(channel)[1]),
            ],
        }
    }
}
