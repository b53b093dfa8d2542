//! What a diagnoser's process decides beside the diagnosis, without a runtime: neither Zenoh nor tokio, no threads, no
//! files, no clock. Every time is passed in, so that a simulation can drive the same code as the daemon.
//!
//! | file | decides |
//! |---|---|
//! | `arbiter` | whose samples are diagnosed, when several publishers publish on the module's key |
//! | `sequencer` | in which order samples are diagnosed, and which missing ones the publisher is asked for |
//! | `recovery` | what of the replies is used, and when the publisher is asked again |
//! | `staleness` | whether samples arrive, and why not; which phase is to be published |
//! | `peers` | how long samples wait for peers' answers, how long an answer is waited for, when a peer is asked again |
//! | `pending_replies` | how long queries of peers are held |
//! | `inputs` | which inputs are recorded, and their numbers |
//! | `components` | **the present state of each component**: behind journal, queries, status, metrics and restart |
//! | `identified_fault` | which identifications belong to the present fault, and which are published |
//! | `record` | what of it is written to the journal |
//! | `write_queue` | what is to be written, and how long a fault waits for the disk before it is published |

mod arbiter;
mod components;
mod identified_fault;
mod inputs;
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
pub use peers::{PeerRetries, PeerTimeouts, QueryPause};
pub use pending_replies::{PendingOrder, PendingReplies, UNAWAITED};
pub use record::{JOURNAL_VERSION, JournalRecord, WatchedSteps, check_version};
pub use recovery::{RecoveryAttempt, RecoveryRetries, SampleRecovery};
pub use sequencer::{ReceivedSample, SampleSize, Sequencer, SequencerStep};
pub use staleness::{NO_SAMPLE_YET, RecentRefusals, Staleness};
pub use write_queue::{WriteBatch, WriteQueue};
