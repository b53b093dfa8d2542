//! What every request sees.

use std::sync::Arc;

use axum::extract::FromRef;
use shell::shutdown::Shutdown;
use vocabulary::{OperatorName, StructureName};

use crate::access::Access;
use crate::drawing::LinkedDrawing;
use crate::metrics::Metrics;
use crate::observed::Observed;
use crate::part::Streams;

/// What every request sees.
#[derive(Debug)]
pub(crate) struct App {
    /// The structure, as it is observed.
    pub(crate) observed: Arc<Observed>,
    /// Who has signed in, and what each may order.
    pub(crate) access: Arc<Access>,
    /// Only this structure; otherwise every one that is seen.
    pub(crate) structure: Option<StructureName>,
    /// The operator whose certificate this process shows: access control admits orders under his name only.
    pub(crate) operator: Option<OperatorName>,
    /// The drawing of a structure, if one was given.
    pub(crate) drawing: Option<LinkedDrawing>,
    /// The pages that are kept up to date.
    pub(crate) streams: Streams,
    /// What is counted.
    pub(crate) metrics: Metrics,
    /// Whether the process is to end: open streams then do.
    pub(crate) shutdown: Shutdown,
}

/// The same, for handlers.
pub(crate) type Shared = Arc<App>;

impl FromRef<Shared> for Metrics {
    fn from_ref(app: &Shared) -> Self {
        app.metrics.clone()
    }
}
