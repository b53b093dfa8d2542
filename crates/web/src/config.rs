//! Configuration of the web page.

use std::path::PathBuf;
use std::time::Duration;

use session::Network;
use truss::Structure;
use vocabulary::{ModuleName, StructureName};

use crate::listener::ListenerSettings;

/// Configuration of the web page.
#[derive(Debug, Clone)]
pub struct WebConfig {
    /// The network to connect to.
    pub network: Network,
    /// The structure to show; otherwise all observed structures.
    pub structure: Option<StructureName>,
    /// Modules that should be running.
    pub expected: Vec<ModuleName>,
    /// Addresses and protocol of the page.
    pub listener: ListenerSettings,
    /// Whether pages require sign-in.
    pub require_sign_in: bool,
    /// A directory of revoked certificates, such as a copy of `pki/revoked`.
    pub revoked: Option<PathBuf>,
    /// The structure to draw.
    pub drawing: Option<Structure>,
    /// The directory for persistent state: one-time links.
    pub state_dir: Option<PathBuf>,
    /// Timeout for answers of modules.
    pub timeout: Duration,
}
