//! What was seen around the latching of a fault. An observer: what is published is noted, and no verdict depends on it.

use vocabulary::{FrozenSignals, Step, Trace, Verdict};

use crate::channels::Channels;
use crate::event::Action;
use crate::recent::Row;
use crate::settings::{ModuleSetup, Sampling};
use crate::verdict::Transition;

/// How much is shown before onset and detection, and how much after the step as of which the fault was latched \[s\].
const AROUND_S: f64 = 2.0;

/// The frames that are not complete yet: at most one of each channel.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Freezing {
    /// The transitions that latched something, in their order.
    latched: Vec<Transition>,
    sampling: Sampling,
    step_s: f64,
    actuators: usize,
    /// Of gages' readings and residuals; empty if each has its own.
    unit: String,
}

impl Freezing {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        Self {
            latched: Vec::new(),
            sampling: setup.sampling(),
            step_s: setup.step_s,
            actuators: setup.actuators(),
            unit: if setup.learned.is_some() { String::new() } else { "m".to_owned() },
        }
    }

    /// Observes the published transitions.
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
        let signals = FrozenSignals {
            sequence: latched.sequence,
            run: latched.run,
            step_s: self.step_s,
            onset_step: latched.onset,
            detection_step: latched.detection,
            decided_step: latched.decided,
            threshold: channels.evidence()[channel].threshold,
            steps: rows.iter().map(|row| row.step).collect(),
            traces: self.traces(channel, &rows),
        };
        let component = latched.component.clone();
        Some(Action::Freeze { component, signals: Box::new(signals) })
    }

    fn traces(&self, channel: usize, rows: &[Row<'_>]) -> Vec<Trace> {
        let trace = |name: &str, unit: &str, value: &dyn Fn(&Row<'_>) -> f64| {
            let values = rows.iter().map(value).map(|value| value.is_finite().then_some(value));
            Trace { name: name.to_owned(), unit: unit.to_owned(), values: values.collect() }
        };
        let divergence = trace("divergence", "1", &|row| row.divergence(channel));
        let residual = |unit: &str| trace("residual", unit, &|row| row.residual(channel));
        match channel.checked_sub(self.actuators) {
            Some(gage) => {
                let reading = trace("reading", &self.unit, &|row| row.readings_m()[gage]);
                vec![reading, residual(&self.unit), divergence]
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
