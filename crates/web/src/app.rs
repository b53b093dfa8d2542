//! What every request sees.

use std::sync::Arc;
use std::time::Duration;

use names::{OperatorName, StructureName};
use observer::Live;
use shell::shutdown::Shutdown;
use shell::supervision::Pulse;

use crate::access::Access;
use crate::desk::Desk;
use crate::drawing::Drawing;
use crate::metrics::Counters;

/// What every request sees.
#[derive(Debug)]
pub(crate) struct App {
    /// The structure as it is at every moment.
    pub(crate) live: Live,
    /// Who has signed in, and what each may order.
    pub(crate) access: Access,
    /// Only this structure; otherwise every one that is seen.
    pub(crate) structure: Option<StructureName>,
    /// The operator whose certificate this process shows: access control admits orders under his name only.
    pub(crate) operator: Option<OperatorName>,
    /// How long an answer of a module is waited for.
    pub(crate) timeout: Duration,
    /// The drawing of a structure, if one was given.
    pub(crate) drawing: Option<Drawing>,
    /// What is shown beside the scene, had once for all pages.
    pub(crate) desk: Desk,
    /// What is counted.
    pub(crate) counters: Counters,
    /// The progress of the process.
    pub(crate) pulse: Arc<Pulse>,
    /// Whether the process is to end: open streams then do.
    pub(crate) shutdown: Shutdown,
}

/// The same, for handlers.
pub(crate) type Shared = Arc<App>;
