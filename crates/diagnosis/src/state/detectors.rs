//! Windows of both lengths: a detector for each, and when the short ones are compared.

use std::sync::Arc;

use vocabulary::{ModuleName, Step};

use super::detector::{Conclusion, Reaction, StateDetector};
use super::reference::Reference;
use super::track::{Departed, Shares, WindowFinding};
use crate::settings::ModuleSetup;
use vocabulary::{Condition, StateAnswer, WindowLength, WindowMeans};

/// Questions to peers about short windows between two long ones: what they cannot settle waits for the long one.
const SHORT_QUESTIONS: u32 = 3;

/// A module's comparison with its reference over windows of both lengths. The long ones tell the condition of each
/// component; of the short ones only what has departed for certain counts.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Detectors {
    short: StateDetector,
    long: StateDetector,
    /// Short windows since the latest long one about which peers were asked.
    asked: u32,
}

impl Detectors {
    pub(crate) fn new(reference: &Arc<Reference>, setup: &ModuleSetup) -> Self {
        let detector = |length| StateDetector::new(length, Arc::clone(reference), setup);
        Self { short: detector(WindowLength::Short), long: detector(WindowLength::Long), asked: 0 }
    }

    /// Nothing has been compared yet: a run begins.
    pub(crate) fn restart(&mut self) {
        self.short.restart();
        self.long.restart();
        self.asked = 0;
    }

    /// A component was reset by an operator.
    pub(crate) fn forgive(&mut self, channel: usize) {
        self.short.forgive(channel);
        self.long.forgive(channel);
    }

    /// By how much a channel's mean, or oil content, was off in the latest long window.
    pub(crate) fn departure(&self, channel: usize) -> Option<f64> {
        self.long.departure(channel)
    }

    /// How a channel departed in the latest long window, if it did.
    pub(crate) fn departed(&self, channel: usize) -> Option<&Departed> {
        self.long.departed(channel)
    }

    /// How near a channel is to its limits over long windows.
    pub(crate) fn shares(&self, channel: usize) -> Shares {
        self.long.shares(channel)
    }

    /// The condition of a channel as of the latest long window.
    pub(crate) fn condition(&self, channel: usize) -> &Condition {
        self.long.condition(channel)
    }

    /// The end of the last window that a channel agreed in before it began to depart, if it departs in the latest long one.
    pub(crate) fn agreed_before(&self, channel: usize) -> Option<Step> {
        self.long.agreed_before(channel)
    }

    /// Takes a window; `known` are the channels that are known to be faulty. A short one counts only if it is `calm`: while
    /// something moves, it holds what a second would even out. Of long ones that are not, half count against a cylinder. Besides what becomes of it, what of an earlier one was
    /// concluded without waiting any longer.
    pub(crate) fn take(
        &mut self,
        window: &WindowMeans,
        known: Vec<bool>,
        calm: bool,
    ) -> (Option<Conclusion>, Option<Reaction>) {
        let length = window.length;
        if length == WindowLength::Short && (!calm || self.asked >= SHORT_QUESTIONS) {
            self.short.skip();
            return (None, None);
        }
        let (late, reaction) = self.of(length).take(window, known, calm);
        self.asked = match (length, &late, &reaction) {
            (WindowLength::Long, ..) => 0,
            // A peer that does not answer within a short window is not asked about the next ones.
            (WindowLength::Short, Some(_), _) => SHORT_QUESTIONS,
            (WindowLength::Short, None, Reaction::Ask(_)) => self.asked + 1,
            (WindowLength::Short, None, Reaction::Concluded(_)) => self.asked,
        };
        let late = late.map(|conclusion| self.weigh(length, conclusion));
        let reaction = match reaction {
            Reaction::Concluded(conclusion) => Reaction::Concluded(self.weigh(length, conclusion)),
            ask @ Reaction::Ask(_) => ask,
        };
        (late, Some(reaction))
    }

    /// Takes a peer's answer about a window, `None` if there was none; the conclusion if it was the last.
    ///
    /// # Errors
    /// What is wrong with the answer. It counts as none.
    pub(crate) fn answered(
        &mut self,
        peer: &ModuleName,
        (length, as_of): (WindowLength, Step),
        answer: Option<StateAnswer>,
    ) -> (Option<Conclusion>, Result<(), String>) {
        let (conclusion, fits) = self.of(length).answered(peer, as_of, answer);
        (conclusion.map(|conclusion| self.weigh(length, conclusion)), fits)
    }

    fn of(&mut self, length: WindowLength) -> &mut StateDetector {
        match length {
            WindowLength::Short => &mut self.short,
            WindowLength::Long => &mut self.long,
        }
    }

    /// Of a short window only what is certain counts. What agreed over a long one was healthy until then, whatever short
    /// ones find.
    fn weigh(&mut self, length: WindowLength, mut conclusion: Conclusion) -> Conclusion {
        if length == WindowLength::Short {
            conclusion
                .findings
                .retain(|(_, found)| matches!(found, WindowFinding::Departed { .. }));
            return conclusion;
        }
        for (channel, finding) in &conclusion.findings {
            if matches!(finding, WindowFinding::Agrees { .. }) {
                self.short.note_agreement(*channel, conclusion.until);
            }
        }
        conclusion
    }
}
