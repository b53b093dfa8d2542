//! Where the page is served, and what it shows.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use names::{ModuleName, StructureName};
use session::Network;
use truss::Structure;

/// Where the page is served, and what it shows.
#[derive(Debug, Clone)]
pub struct WebConfig {
    /// The place on the network.
    pub network: Network,
    /// Only this structure; otherwise every one that is seen.
    pub structure: Option<StructureName>,
    /// Modules that should be there.
    pub expected: Vec<ModuleName>,
    /// The address on which the page is served.
    pub listen: SocketAddr,
    /// The structure that is drawn.
    pub drawing: Option<Structure>,
    /// Where what outlives the process is kept.
    pub state_dir: Option<PathBuf>,
    /// How long an answer of a module is waited for.
    pub timeout: Duration,
}
