//! A diagnoser's process as a plain value ([`ModuleProcess`]), with everything that it decides, without a runtime: no Zenoh, no tokio, no threads, no
//! files, no clock. Times are passed in, so that a simulation can drive the same code as the daemon.
//!
//! | file | decides |
//! |---|---|
//! | `module` | **what comes of each input**: samples, questions, orders, answers, the passing of time |
//! | `outgoing` | what goes out |
//! | `store_state` | the present state of each component, and what of it is still to be written |
//! | `arbiter` | which publisher's samples are diagnosed, if several publish on the module's key |
//! | `sequencer` | the order of samples, and which missing ones to request from the publisher |
//! | `recovery` | which samples in replies to use, and when to repeat a request |
//! | `staleness` | whether samples arrive, why not, and which phase to publish |
//! | `peers` | how long samples wait for peers, timeouts of queries to peers, and retries |
//! | `interlock` | whether a cylinder may be shut off |
//! | `pending_replies` | how long queries of peers are held |
//! | `inputs` | which inputs are recorded, and their numbers |
//! | `components` | **the present state of each component**: behind journal, queries, status, metrics and restart |
//! | `identified_fault` | which identifications belong to the present fault, and which are published |
//! | `journal_keeper` | what is written to the journal, and when it counts as kept |
//! | `record` | the records of the journal |
//! | `write_queue` | what to write, and how long a fault waits for the disk before it is published |

mod arbiter;
mod components;
mod identified_fault;
mod inputs;
mod interlock;
mod journal_keeper;
mod module;
mod outgoing;
mod peers;
mod pending_replies;
mod record;
mod recovery;
mod sequencer;
mod staleness;
mod store_state;
mod write_queue;

pub use arbiter::{Arbitration, PublisherArbiter, PublisherId, SampleSource};
pub use components::{ComponentStore, PresentComponent, PublishedState};
pub use inputs::InputNumbering;
pub use interlock::ShutOffInterlock;
pub use journal_keeper::{Disk, JournalKeeper};
pub use module::{
    ModuleProcess, Now, ProcessContext, ProcessEffect, ProcessSettings, ProcessSurroundings,
    StatusSurroundings, TICK,
};
pub use outgoing::{Outgoing, QueuedEvent, Routine};
pub use peers::PeerTimeouts;
pub use record::{JOURNAL_VERSION, JournalRecord, WatchedSteps, check_version};
pub use recovery::{RecoveryAttempt, RecoveryRetries, SampleRecovery};
pub use sequencer::{ReceivedSample, SampleSize};
pub use staleness::{ClockReading, NO_SAMPLE_YET, RecentRefusals, Staleness};
pub use store_state::StoreState;
pub use write_queue::{WriteBatch, WriteQueue};
