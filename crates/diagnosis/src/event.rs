//! Inputs and outputs of a diagnoser: events in, actions out. The shell around it carries samples,
//! questions and answers; the diagnoser has no clock and no network.

use vocabulary::{Component, ComponentPath, FrozenSignals, ModuleName, ModulePhase, RunId, Step};

use crate::channels::Channels;
use crate::divergence::Violation;
use crate::identification::Excerpt;
use crate::order::{OrderRefusal, OrderToken};
use crate::question::{PeerFailure, Refusal};
use crate::sample::{Measurements, SampleRejection, Signal};
use crate::verdict::Transition;
use vocabulary::{Change, Counters, Evidence, GivenOrder, StateAnswer, StateQuestion};

/// The shell's token of a question it passed in, returned with the answer.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct QuestionToken(pub u64);

/// An input of a diagnoser.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The module's next sample.
    Sample(Measurements),
    /// A peer asks.
    Asked {
        /// To be returned with the answer.
        token: QuestionToken,
        /// What it asks.
        question: StateQuestion,
    },
    /// The asker of a held question no longer waits.
    Withdrawn {
        /// The question's token.
        token: QuestionToken,
    },
    /// A peer answered.
    Answered(StateAnswer),
    /// A peer did not answer.
    Unanswered {
        /// The peer.
        peer: ModuleName,
        /// The question.
        question: StateQuestion,
        /// How it failed.
        failure: PeerFailure,
    },
    /// A peer that was gone is back: it may be asked again at once.
    Returned {
        /// The peer.
        peer: ModuleName,
    },
    /// An operator issues a command.
    Ordered {
        /// To be returned with the outcome.
        token: OrderToken,
        /// The component.
        component: Component,
        /// The command, who issued it, why.
        order: GivenOrder,
    },
}

/// The handling of an event after some sample: what it is judged by, and where its outcome goes.
#[derive(Debug)]
pub(crate) struct Handling<'a> {
    /// The run being diagnosed.
    pub(crate) run: RunId,
    /// The latest step processed.
    pub(crate) now: Step,
    pub(crate) channels: &'a Channels,
    pub(crate) counters: &'a mut Counters,
    pub(crate) actions: &'a mut Vec<Action>,
}

impl Handling<'_> {
    pub(crate) fn publish(&mut self, transitions: impl IntoIterator<Item = Transition>) {
        self.actions.extend(transitions.into_iter().map(Action::Publish));
    }
}

/// An action for the shell to carry out, in this order.
#[derive(Debug, Clone, PartialEq)]
pub enum Action {
    /// Publish that a channel changed.
    Report {
        /// The run that the step is counted in.
        run: RunId,
        /// The change.
        change: Change,
        /// The channel at the change.
        evidence: Evidence,
    },
    /// Make a transition durable, then publish it.
    Publish(Transition),
    /// Identify a fault ([`crate::identification::identify`]), which takes milliseconds: at leisure, and publish what comes
    /// of it.
    Identify(Box<Excerpt>),
    /// The signals around the latching of a fault, for later analysis. No verdict depends on them.
    Freeze {
        /// The component that was latched.
        component: Component,
        /// The signals.
        signals: Box<FrozenSignals>,
    },
    /// The ratio of a change is final: peers receive this value from now on, and it is to be stored. Repeated with the
    /// change's last step when the change ends.
    Settled {
        /// The run that the step is counted in.
        run: RunId,
        /// The change.
        change: Change,
    },
    /// A command was accepted; its transition precedes this.
    Obeyed {
        /// The command's token.
        token: OrderToken,
        /// The sequence number of the transition.
        sequence: u64,
    },
    /// A command was refused.
    OrderRefused {
        /// The command's token.
        token: OrderToken,
        /// Why.
        refusal: OrderRefusal,
    },
    /// Ask a peer; come back with [`Event::Answered`] or [`Event::Unanswered`].
    Ask {
        /// The peer.
        peer: ModuleName,
        /// The question.
        question: StateQuestion,
    },
    /// Answer a peer's question.
    Answer {
        /// The question's token.
        token: QuestionToken,
        /// The answer.
        answer: StateAnswer,
    },
    /// Refuse a peer's question.
    Refuse {
        /// The question's token.
        token: QuestionToken,
        /// Why.
        refusal: Refusal,
    },
    /// The phase changed, or the step since which every channel is watched.
    Phase {
        /// The phase.
        phase: ModulePhase,
        /// Since which step every channel is watched, if the module is in service.
        in_service_since: Option<Step>,
    },
    /// A sample was not used (and was counted).
    Rejected {
        /// Its step.
        step: Step,
        /// Why.
        rejection: SampleRejection,
    },
    /// Samples are missing (and were counted).
    Gap {
        /// First step missing.
        from: Step,
        /// How many.
        missing: u64,
    },
    /// A signal is lost: too many of its values were missing or implausible. The component is faulty.
    SignalLost {
        /// Its component.
        component: Component,
        /// Which of its signals.
        signal: Signal,
        /// The first step without a value.
        since: Step,
    },
    /// A peer's answer does not fit (and was counted): it counts as none.
    AnswerRejected {
        /// The peer.
        peer: ModuleName,
        /// What is wrong with it.
        failure: PeerFailure,
    },
    /// A peer does not stand by what it said (and was counted): that its component changed first.
    WordBroken {
        /// The component here whose change that explained.
        component: Component,
        /// The peer's component.
        by: ComponentPath,
    },
    /// A channel's Gaussian was lost and restarted (and was counted).
    Restarted {
        /// The channel.
        component: Component,
        /// Why.
        violation: Violation,
    },
    /// The run ended, whatever the number of the next one. To be stored: it holds of every transition published so far
    /// ([`Transition::run_ended`]), and the changes stored so far are those of runs that are over.
    RunEnded,
    /// A new run began: everything but latched faults was forgotten.
    RunStarted(RunId),
}
