//! A process's place on the network: the table `[network]` with its flags, and the session that follows from it.
//!
//! | file | what |
//! |---|---|
//! | `network` | where to listen and connect, as file and flags have it |
//! | `identity` | the certificate that it authenticates with, and whether it is the right one |
//! | `zenoh_file` | a file of Zenoh's own settings |
//! | `zenoh_settings` | what all this means for Zenoh, and how long a message may be that is received |
//! | `session` | opened and closed; why there is none |
//! | `loopback` | free ports of this machine, for demo and tests |

mod identity;
pub mod loopback;
mod network;
mod session;
mod zenoh_file;
mod zenoh_settings;

pub use identity::mistake;
pub use network::{
    DEFAULT_LEASE_MS, EndpointError, LEASES_MS, Mode, Network, NetworkFlags, endpoint,
};
pub use session::{NetworkError, close, open};
pub use zenoh_file::{from_file, identities};
pub use zenoh_settings::{
    ACCEPTING_MS, LONGEST_MESSAGE_BYTES, OPENING_MS, settings, wait_before_close_us,
};
