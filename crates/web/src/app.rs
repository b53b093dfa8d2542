//! What every request sees.

use std::sync::Arc;
use std::time::Duration;

use names::{OperatorName, StructureName};
use observer::Live;

use crate::access::Access;

/// What every request sees.
#[derive(Debug)]
pub(crate) struct App {
    /// The structure as it is at every moment.
    pub(crate) live: Live,
    /// Who may do what.
    pub(crate) access: Access,
    /// Only this structure; otherwise every one that is seen.
    pub(crate) structure: Option<StructureName>,
    /// The operator whose certificate this process shows: access control admits orders under his name only.
    pub(crate) operator: Option<OperatorName>,
    /// How long an answer of a module is waited for.
    pub(crate) timeout: Duration,
}

/// The same, for handlers.
pub(crate) type Shared = Arc<App>;
