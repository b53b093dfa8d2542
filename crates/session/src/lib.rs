//! The network connection of a process: the table `[network]` with its flags, and the resulting session.
//!
//! | file | what |
//! |---|---|
//! | `network` | endpoints to listen on and connect to, from file and flags |
//! | `identity` | the certificate of the process, and checks of it |
//! | `certificate_watch` | when certificates of the process expire |
//! | `zenoh_file` | a file of Zenoh's own settings |
//! | `zenoh_settings` | the resulting Zenoh configuration, and the longest message received |
//! | `session` | opens and closes sessions |
//! | `loopback` | free ports of this machine, for demo and tests |
//! | `client` | what monitoring clients do over a session |

mod certificate_watch;
pub mod client;
mod identity;
pub mod loopback;
mod network;
mod session;
mod zenoh_file;
mod zenoh_settings;

pub use certificate_watch::{CertificateWatch, expiring};
pub use identity::mistake;
pub use network::{
    DEFAULT_LEASE_MS, EndpointError, LEASES_MS, Mode, Network, NetworkFlags, endpoint,
};
pub use session::{NetworkError, close, open, open_within};
pub use zenoh_file::{from_file, identities, without_source_locations};
pub use zenoh_settings::{
    ACCEPTING_MS, LONGEST_MESSAGE_BYTES, OPENING_MS, settings, wait_before_close_us,
};
