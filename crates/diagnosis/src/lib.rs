//! One module's diagnoser: events in, actions out. No clock, no runtime, no socket.

pub mod detector;
pub mod divergence;
pub mod residual;

mod answering;
mod change;
mod change_log;
mod channels;
mod commands;
mod comparing;
mod correcting;
mod coverage;
mod diagnoser;
mod event;
mod freeze;
pub mod identification;
mod identifying;
mod intake;
mod isolation;
mod judging;
mod leaking;
mod learned_channels;
mod ledger;
pub mod messages;
mod monitor;
mod order;
mod question;
mod recent;
mod sample;
mod sections;
mod settings;
mod shelving;
mod shift;
pub mod state;
#[cfg(test)]
mod testing;
pub mod thresholds;
mod unseen;
mod validity;
mod verdict;

pub use change::MAX_TIE;
pub use diagnoser::{Diagnoser, Memory};
pub use event::{Action, Event, QuestionToken};
pub use isolation::{Explanation, FirstChange, KnownChange, Reason};
pub use monitor::{Monitor, Observation};
pub use order::{OrderRefusal, OrderToken};
pub use question::{MAX_CHANGES_IN_ANSWER, PeerFailure, Refusal};
pub use sample::{Measurements, SampleRejection, Signal};
pub use sections::{DetectionSection, IsolationSection};
pub use settings::{
    DetectionSettings, IsolationSettings, ModuleSetup, Rule, SetupError, SignalSettings,
};
pub use verdict::Transition;
pub use vocabulary::{
    ActuatorFault, Alarm, Change, Counters, Doubt, Evidence, GivenOrder, GivenOrderKind, PastWatch,
    Shelving, Span, StateAnswer, StateQuestion, Symptom, Verdict,
};
