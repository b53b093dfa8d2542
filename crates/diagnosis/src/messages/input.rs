//! What a diagnoser took beside samples.

use crate::{Event, Memory, OrderToken, PeerFailure};
use vocabulary::{Remembered, Taken};

use super::{Speaker, from_transition};

/// An event as the input that it is recorded as; none for samples, and for peers' questions, which no verdict
/// depends on.
#[must_use]
pub fn to_taken(event: &Event) -> Option<Taken> {
    match event {
        Event::Sample(_) | Event::Asked { .. } | Event::Withdrawn { .. } => None,
        Event::Answered(answer) => Some(Taken::Answered { answer: Box::new(answer.clone()) }),
        Event::Unanswered { peer, question, failure } => Some(Taken::Unanswered {
            peer: peer.clone(),
            question: *question,
            reason: failure.to_string(),
        }),
        Event::Returned { peer } => Some(Taken::Returned { peer: peer.clone() }),
        Event::Ordered { component, order, .. } => {
            Some(Taken::Ordered { component: component.clone(), order: order.clone() })
        }
    }
}

/// The event that an input was; none for those that only tell which sample follows, or that a process began.
#[must_use]
pub fn from_taken(taken: Taken) -> Option<Event> {
    match taken {
        Taken::Answered { answer } => Some(Event::Answered(*answer)),
        Taken::Unanswered { peer, question, reason } => {
            Some(Event::Unanswered { peer, question, failure: PeerFailure::Refused(reason) })
        }
        Taken::Returned { peer } => Some(Event::Returned { peer }),
        Taken::Ordered { component, order } => {
            Some(Event::Ordered { token: OrderToken(0), component, order })
        }
        Taken::Started { .. }
        | Taken::RunBegan { .. }
        | Taken::Gap { .. }
        | Taken::Rejected { .. }
        | Taken::State(_) => None,
    }
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
