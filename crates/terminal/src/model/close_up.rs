//! The close-up of one component: answers requested once, and divergences received continuously.

use std::collections::VecDeque;

use observer::{ComponentId, why_no_fault};
use vocabulary::{Divergences, FaultTransition, FreezeFrame, Identification};

use super::ModelEffect;

/// Most divergences kept.
const LATEST: usize = 600;
/// Interval between requests for a missing freeze frame \[ns\]: a frame is complete two seconds after the fault.
const AGAIN_AFTER_NS: u64 = 2_000_000_000;

/// The answer of a module to a request.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Fetched<T> {
    /// Requested, not received yet.
    Awaited,
    /// The answer.
    Here(T),
    /// No answer, for this reason.
    Missing(String),
}

/// A channel at one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ChannelPoint {
    pub(crate) step: u64,
    pub(crate) residual: f64,
    /// The divergence over its threshold; NaN while undefined.
    pub(crate) ratio: f64,
    pub(crate) own_unit: bool,
}

/// What is known of a component besides its state.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CloseUp {
    pub(crate) subject: ComponentId,
    pub(crate) frame: Fetched<Box<FreezeFrame>>,
    pub(crate) identification: Fetched<Option<Box<Identification>>>,
    pub(crate) latest: VecDeque<ChannelPoint>,
    run: Option<vocabulary::RunId>,
    /// The sequence number of the transition whose frame was requested.
    asked_for: Option<u64>,
    asked_unix_ns: u64,
}

impl CloseUp {
    pub(crate) fn new(subject: ComponentId) -> Self {
        Self {
            subject,
            frame: Fetched::Awaited,
            identification: Fetched::Here(None),
            latest: VecDeque::new(),
            run: None,
            asked_for: None,
            asked_unix_ns: 0,
        }
    }

    /// The requests that are due for the component in its present state.
    pub(crate) fn questions(
        &mut self,
        present: &FaultTransition,
        now_unix_ns: u64,
    ) -> Vec<ModelEffect> {
        if !present.state().is_fault() {
            self.asked_for = None;
            self.identification = Fetched::Here(None);
            self.frame = Fetched::Missing(why_no_fault(present).to_owned());
            return Vec::new();
        }
        let is_new = self.asked_for != Some(present.sequence);
        let is_missing = matches!(self.frame, Fetched::Missing(_));
        let is_due = now_unix_ns.saturating_sub(self.asked_unix_ns) >= AGAIN_AFTER_NS;
        let is_worth_it = is_new || is_missing && is_due;
        if !is_worth_it {
            return Vec::new();
        }
        if is_new {
            (self.frame, self.identification) = (Fetched::Awaited, Fetched::Awaited);
        }
        (self.asked_for, self.asked_unix_ns) = (Some(present.sequence), now_unix_ns);
        let frame = ModelEffect::Frame(Box::new(present.clone()));
        vec![frame, ModelEffect::Identification(self.subject.clone())]
    }

    /// Adds published divergences of its module.
    pub(crate) fn listen(&mut self, message: &Divergences) {
        let ComponentId { structure, component } = &self.subject;
        if message.structure != *structure || message.module != component.module {
            return;
        }
        let own = message.channels.iter().find(|channel| channel.component == component.component);
        let Some(channel) = own else { return };
        if self.run.replace(message.run) != Some(message.run) {
            self.latest.clear();
        }
        if self.latest.len() == LATEST {
            self.latest.pop_front();
        }
        let ratio = channel.divergence.map_or(f64::NAN, |value| value / channel.threshold);
        let (step, residual, own_unit) = (message.step.0, channel.residual, channel.own_unit);
        self.latest.push_back(ChannelPoint { step, residual, ratio, own_unit });
    }
}
