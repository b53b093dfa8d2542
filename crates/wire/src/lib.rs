//! Messages and keys: the only place that knows the byte format.
//!
//! | key, under `trusswatch/{structure}/` | message |
//! |---|---|
//! | `{module}/sample` | [`Sample`] |
//! | `{module}/divergence` | [`Divergences`] |
//! | `{module}/change` | [`Change`] |
//! | `{module}/fault/actuator/{name}`, `{module}/fault/sensor/{name}` | [`FaultTransition`] |
//! | `{module}/state` | [`StateQuestion`] as parameters, [`StateAnswer`] or [`Refused`] in reply |
//! | `{module}/status` | [`ModuleStatus`] |
//! | `{module}/progress` | [`Progress`] |
//! | `{module}/alive`, `plant/alive` | liveliness tokens, without a message |
//! | `plant/command/inject` | [`Injection`], [`Injected`] or [`Refused`] in reply |
//! | `plant/status` | [`PlantStatus`] |
//!
//! Every message is one JSON object with the format's version in its field `v`; [`encode`] and
//! [`decode`] say what becomes of anything else. Keys are made and read by [`Key`] alone.
//!
//! This crate names neither network nor runtime, and of the other crates only `truss`, for the
//! identifiers.

mod change;
mod divergence;
mod encoding;
mod evidence;
mod fault;
mod injection;
pub mod keys;
mod plant_status;
mod progress;
mod refusal;
mod sample;
mod state;
mod status;

pub use change::Change;
pub use divergence::{Channel, Divergences};
pub use encoding::{DecodeError, EncodeError, MAX_MESSAGE_BYTES, Message, VERSION, decode, encode};
pub use evidence::Evidence;
pub use fault::{FaultState, FaultTransition};
pub use injection::{Injected, Injection};
pub use keys::{Key, KeyError, PlantTopic, Topic};
pub use plant_status::{PlantPhase, PlantStatus, PresentFault};
pub use progress::Progress;
pub use refusal::Refused;
pub use sample::Sample;
pub use state::{ActuatorFault, QuestionError, StateAnswer, StateChange, StateQuestion};
pub use status::{DiagnosisCounters, IntakeCounters, ModulePhase, ModuleStatus, PublisherCounters};
