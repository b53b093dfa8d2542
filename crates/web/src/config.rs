//! Where the page is served, and what it shows.

use std::path::PathBuf;
use std::time::Duration;

use session::Network;
use truss::Structure;
use vocabulary::{ModuleName, StructureName};

use crate::listener::ListenerSettings;

/// Where the page is served, and what it shows.
#[derive(Debug, Clone)]
pub struct WebConfig {
    /// The place on the network.
    pub network: Network,
    /// Only this structure; otherwise every one that is seen.
    pub structure: Option<StructureName>,
    /// Modules that should be there.
    pub expected: Vec<ModuleName>,
    /// Where the page is served, and over what.
    pub listener: ListenerSettings,
    /// Whether only those who have signed in see anything.
    pub require_sign_in: bool,
    /// A directory with the certificates that are revoked, such as a copy of `pki/revoked`.
    pub revoked: Option<PathBuf>,
    /// The structure that is drawn.
    pub drawing: Option<Structure>,
    /// Where what outlives the process is kept: one-time links.
    pub state_dir: Option<PathBuf>,
    /// How long an answer of a module is waited for.
    pub timeout: Duration,
}
