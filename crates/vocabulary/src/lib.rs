//! What everything is called and what is said of it: names of structures, modules, components, steps and runs; kinds of
//! faults; verdicts, orders and all other messages with their keys; and how these are worded for people ([`words`]). The
//! lowest crate, and the only place that knows the byte format.
//!
//! | key, under `trusswatch/{structure}/` | message |
//! |---|---|
//! | `{module}/sample` | [`Sample`]; in reply to [`SampleQuestion`], past ones |
//! | `{module}/divergence` | [`Divergences`] |
//! | `{module}/change` | [`ChangeReport`] |
//! | `{module}/corrected` | [`Corrected`] |
//! | `{module}/capability` | [`Capability`] |
//! | `{module}/fault/actuator/{name}`, `{module}/fault/sensor/{name}` | [`FaultTransition`] |
//! | `{module}/identification/actuator/{name}`, `{module}/identification/sensor/{name}` | [`Identification`] |
//! | `{module}/state` | [`StateQuestion`] as parameters, [`StateAnswer`] or [`Refused`] in reply |
//! | `{module}/status` | [`ModuleStatus`] |
//! | `{module}/phase` | [`PhaseChange`] |
//! | `{module}/progress` | [`Progress`] |
//! | `{module}/history` | [`HistoryQuestion`] as parameters, [`HistoryPage`] in reply |
//! | `{module}/input` | [`Input`]; in reply to [`InputQuestion`], past ones |
//! | `{module}/configuration` | [`ModuleConfiguration`] in reply |
//! | `{module}/freeze-frame` | [`FreezeFrameQuestion`] as parameters, [`FreezeFrame`] or [`Refused`] in reply |
//! | `{module}/command/acknowledge`, `{module}/command/reset` | [`Order`], [`Obeyed`] or [`Refused`] in reply |
//! | `{module}/alive`, `plant/alive` | liveliness tokens, without a message |
//! | `plant/command/inject` | [`Injection`], [`Injected`] or [`Refused`] in reply |
//! | `plant/command/stroke` | [`Stroke`], [`StrokeBegun`] or [`Refused`] in reply |
//! | `plant/status` | [`PlantStatus`] |
//!
//! Every message is one JSON object with the format's version in its field `v`; [`encode`] and
//! [`decode`] document what becomes of anything else. Keys are made and read by [`Key`] alone. [`catalogue`] describes all this for other programs: a schema and an example of
//! each message.
//!
//! This crate names neither network nor runtime, and no other crate.
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets: [m] is no link")]

mod capability;
pub mod catalogue;
mod change;
mod clock_difference;
mod component;
mod condition;
mod configuration;
mod corrected;
pub mod delivery;
mod divergence;
mod encoding;
mod evidence;
pub mod fault;
mod fault_state;
pub mod fleet;
mod freeze_frame;
mod given_order;
mod history;
mod identification;
mod injection;
mod input;
pub mod keys;
mod name;
mod occurrences;
mod order;
mod phase;
mod plant_status;
mod printable;
mod progress;
mod question;
mod quotation;
pub mod realm;
mod recording;
mod refusal;
mod sample;
mod schema;
mod shelving;
mod signal;
mod state;
mod status;
mod step;
mod stroke;
mod transition;
mod verdict;
mod window;
pub mod words;

pub use capability::{Ability, Capability, CylinderCapability};
pub use change::{Change, ChangeReport};
pub use clock_difference::ClockDifference;
pub use component::{Component, ComponentError, ComponentKind, ComponentPath, Mention};
pub use condition::{Condition, Obstacle};
pub use configuration::ModuleConfiguration;
pub use corrected::{Corrected, CorrectedReadings, ReadingSource, ReplacedReading};
pub use divergence::{Channel, Divergences};
pub use encoding::{
    DecodeError, EncodeError, Encoding, MAX_MESSAGE_BYTES, Message, VERSION, decode, decode_as,
    encode, encode_as,
};
pub use evidence::Evidence;
pub use fault_state::FaultState;
pub use freeze_frame::{FreezeFrame, FreezeFrameQuestion, FrozenSignals, Trace};
pub use given_order::{GivenOrder, GivenOrderKind};
pub use history::{
    HistoryPage, HistoryQuestion, MAX_HISTORY_PAGE, MAX_IDENTIFICATIONS_OF_FAULT,
    MAX_PHASE_CHANGES_ON_PAGE,
};
pub use identification::{
    Candidate, FaultSize, Identification, IdentifiedKind, MAX_SIGNATURE_POINTS, Signature,
    SignaturePoint,
};
pub use injection::{Injected, Injection};
pub use input::{Input, InputQuestion, PastWatch, Remembered, StatePart, Taken};
pub use keys::{Key, KeyError, PlantTopic, Topic};
pub use name::{
    ActuatorName, GageName, MAX_NAME_LENGTH, MaterialName, MemberName, ModuleName, NameError,
    NodeName, OperatorName, SectionName, StructureName,
};
pub use occurrences::Occurrences;
pub use order::{MAX_ORDER_TEXT, Obeyed, Order, OrderKind};
pub use phase::{ModulePhase, PhaseChange};
pub use plant_status::{PlantPhase, PlantStatus, PresentFault};
pub use printable::{in_ascii, is_printable, printable, printable_lines};
pub use progress::Progress;
pub use question::QuestionError;
pub use quotation::quotation;
pub use recording::SampleQuestion;
pub use refusal::Refused;
pub use sample::{MAX_BLOCK_STEPS, Sample, StepValues};
pub use schema::schema;
pub use shelving::{Aside, SHELVING_SECONDS, Shelving, Span};
pub use signal::Signal;
pub use state::{ActuatorFault, Alarm, StateAnswer, StateQuestion};
pub use status::{
    CounterMetric, Counters, InquiryCounters, IntakeCounters, JournalStatus, Margins, ModuleStatus,
    PeerOutcome, PeerStatus, PublisherCounters,
};
pub use step::{RunId, Step};
pub use stroke::{Stroke, StrokeBegun};
pub use transition::{FaultTransition, Symptom, Unknown};
pub use verdict::{Doubt, Verdict};
pub use window::{CylinderMeans, GageMeans, WindowLength, WindowMeans};
