//! A process's place on the network: the table `[network]` with its flags, and the session that follows from it.
//!
//! | file | what |
//! |---|---|
//! | `network` | where to listen and connect, as file and flags have it |
//! | `endpoint` | one such place |
//! | `identity` | the certificate that it authenticates with, and whether it is the right one |
//! | `zenoh_file` | a file of Zenoh's own settings |
//! | `zenoh_settings` | what all this means for Zenoh |
//! | `longest_message` | how long a message may be that is received |
//! | `session` | opened and closed |
//! | `loopback` | free ports of this machine, for demo and tests |

mod endpoint;
mod error;
mod flags;
mod identity;
mod longest_message;
pub mod loopback;
mod network;
mod session;
mod zenoh_file;
mod zenoh_settings;

pub use endpoint::{EndpointError, endpoint};
pub use error::NetworkError;
pub use flags::NetworkFlags;
pub use identity::mistake;
pub use longest_message::LONGEST_MESSAGE_BYTES;
pub use network::{DEFAULT_LEASE_MS, LEASES_MS, Mode, Network};
pub use session::{close, open};
pub use zenoh_file::{from_file, identities};
pub use zenoh_settings::{ACCEPTING_MS, OPENING_MS, settings, wait_before_close_us};
