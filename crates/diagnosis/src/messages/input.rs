//! What a diagnoser took beside samples.

use crate::{Event, Memory, Order, PeerFailure, Question};
use vocabulary::{Component, Remembered, StructureName, Taken, WindowLength};

use super::{Speaker, from_answer, from_transition};

/// An event as the input that it is recorded as; none for samples, and for peers' questions, which no verdict
/// depends on.
#[must_use]
pub fn to_taken(event: &Event, structure: &StructureName) -> Option<Taken> {
    let words = |length: WindowLength| length.as_str().to_owned();
    match event {
        Event::Sample(_) | Event::Asked { .. } | Event::Withdrawn { .. } => None,
        Event::Answered { peer, answer } => {
            let window = answer.question.window.map(words);
            let peer = Speaker::of(structure.clone(), peer.clone());
            Some(Taken::Answered { answer: Box::new(peer.answer(answer.clone())), window })
        }
        Event::Unanswered { peer, question, failure } => {
            let Question { run, from, as_of, window } = *question;
            Some(Taken::Unanswered {
                peer: peer.clone(),
                run,
                from_step: from,
                as_of_step: as_of,
                window: window.map(words),
                reason: failure.to_string(),
            })
        }
        Event::Returned { peer } => Some(Taken::Returned { peer: peer.clone() }),
        Event::Ordered { order, .. } => {
            let Order { component, given } = order.clone();
            Some(Taken::Ordered { component, order: given })
        }
    }
}

/// The event that an input was; none for those that only tell which sample follows, or that a process began.
#[must_use]
pub fn from_taken(taken: Taken) -> Option<Event> {
    match taken {
        Taken::Answered { answer, window } => {
            let peer = answer.module.clone();
            let window = length(window);
            Some(Event::Answered { peer, answer: from_answer(*answer, window) })
        }
        Taken::Unanswered { peer, run, from_step, as_of_step, window, reason } => {
            let window = length(window);
            let question = Question { run, from: from_step, as_of: as_of_step, window };
            let failure = PeerFailure::Refused(reason);
            Some(Event::Unanswered { peer, question, failure })
        }
        Taken::Returned { peer } => Some(Event::Returned { peer }),
        Taken::Ordered { component, order } => Some(ordered(component, order)),
        Taken::Started { .. }
        | Taken::RunBegan { .. }
        | Taken::Gap { .. }
        | Taken::Rejected { .. } => None,
    }
}

fn ordered(component: Component, order: vocabulary::GivenOrder) -> Event {
    let order = Order { component, given: order };
    Event::Ordered { token: crate::OrderToken(0), order }
}

fn length(words: Option<String>) -> Option<WindowLength> {
    let words = words?;
    WindowLength::ALL.into_iter().find(|length| length.as_str() == words)
}

impl Speaker {
    /// What its diagnoser recalled of an earlier process.
    #[must_use]
    pub fn remembered(&self, memory: &Memory) -> Remembered {
        let Memory { sequence, latest, watch } = memory.clone();
        let latest = latest.into_iter().map(|transition| self.transition(transition, 0));
        Remembered { sequence, latest: latest.collect(), watch }
    }
}

/// What a diagnoser is to recall of an earlier process.
#[must_use]
pub fn to_memory(remembered: Remembered) -> Memory {
    let Remembered { sequence, latest, watch } = remembered;
    Memory { sequence, latest: latest.into_iter().filter_map(from_transition).collect(), watch }
}
