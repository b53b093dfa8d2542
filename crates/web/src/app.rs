//! The state shared by all request handlers.

use std::sync::Arc;

use axum::extract::FromRef;
use shell::shutdown::Shutdown;
use vocabulary::{OperatorName, StructureName};

use crate::access::Access;
use crate::drawing::LinkedDrawing;
use crate::metrics::Metrics;
use crate::observed::Observed;
use crate::part::Streams;

/// The state shared by all request handlers.
#[derive(Debug)]
pub(crate) struct App {
    /// The observed structures.
    pub(crate) observed: Arc<Observed>,
    /// Access control: sessions and permissions.
    pub(crate) access: Arc<Access>,
    /// The structure to show; otherwise all observed structures.
    pub(crate) structure: Option<StructureName>,
    /// The operator in this process's certificate: access control admits orders only under this name.
    pub(crate) operator: Option<OperatorName>,
    /// The drawing of a structure, if configured.
    pub(crate) drawing: Option<LinkedDrawing>,
    /// The pages that are kept up to date.
    pub(crate) streams: Streams,
    /// Metrics.
    pub(crate) metrics: Metrics,
    /// Whether the process is shutting down, upon which open streams end.
    pub(crate) shutdown: Shutdown,
}

/// Shared reference for handlers.
pub(crate) type Shared = Arc<App>;

impl FromRef<Shared> for Metrics {
    fn from_ref(app: &Shared) -> Self {
        app.metrics.clone()
    }
}
