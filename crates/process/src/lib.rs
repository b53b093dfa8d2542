//! The decisions of a diagnoser process outside the diagnosis, without a runtime: no Zenoh, no tokio, no threads, no
//! files, no clock. Times are passed in, so that a simulation can drive the same code as the daemon.
//!
//! | file | decides |
//! |---|---|
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
//! | `record` | the records of the journal |
//! | `write_queue` | what to write, and how long a fault waits for the disk before it is published |

mod arbiter;
mod components;
mod identified_fault;
mod inputs;
mod interlock;
mod peers;
mod pending_replies;
mod record;
mod recovery;
mod sequencer;
mod staleness;
mod write_queue;

pub use arbiter::{Arbitration, PublisherArbiter, PublisherId, SampleSource};
pub use components::{ComponentStore, PresentComponent, PublishedState};
pub use inputs::InputNumbering;
pub use interlock::ShutOffInterlock;
pub use peers::{PeerRetries, PeerTimeouts, QueryPause};
pub use pending_replies::{PendingOrder, PendingReplies, UNAWAITED};
pub use record::{JOURNAL_VERSION, JournalRecord, WatchedSteps, check_version};
pub use recovery::{RecoveryAttempt, RecoveryRetries, SampleRecovery};
pub use sequencer::{ReceivedSample, SampleSize, Sequencer, SequencerStep};
pub use staleness::{ClockReading, NO_SAMPLE_YET, RecentRefusals, Staleness};
pub use write_queue::{WriteBatch, WriteQueue};
