//! What every request sees.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use names::{ModuleName, OperatorName, StructureName};
use observer::Live;
use shell::shutdown::Shutdown;
use shell::supervision::Pulse;
use tokio::sync::watch::Receiver;

use crate::access::Access;
use crate::desk::{self, Desk, Traces};
use crate::drawing::Drawing;

/// What every request sees.
#[derive(Debug)]
pub(crate) struct App {
    /// The structure as it is at every moment.
    pub(crate) live: Live,
    /// Who has signed in, and what each may order.
    pub(crate) access: Arc<Access>,
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

impl App {
    /// The divergences of a module as they come.
    pub(crate) fn traces(
        self: &Arc<Self>,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Receiver<Arc<Traces>> {
        let whose = (structure.clone(), module.clone());
        let (app, key) = (Arc::clone(self), whose.clone());
        let work = |sender| desk::watch(move || app.live.session(), whose, sender);
        self.desk.traces.look(key, Arc::default(), work)
    }
}

/// What is counted as long as the process lives.
#[derive(Debug, Default)]
pub(crate) struct Counters {
    pub(crate) requests: AtomicU64,
    streams_opened: AtomicU64,
    streams_closed: AtomicU64,
    pub(crate) streams_refused: AtomicU64,
    pub(crate) updates: AtomicU64,
}

impl Counters {
    pub(crate) fn request(&self) {
        self.requests.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_opened(&self) {
        self.streams_opened.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_closed(&self) {
        self.streams_closed.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn stream_refused(&self) {
        self.streams_refused.fetch_add(1, Ordering::Relaxed);
    }

    pub(crate) fn update(&self) {
        self.updates.fetch_add(1, Ordering::Relaxed);
    }

    /// Streams that are open.
    pub(crate) fn streams(&self) -> u64 {
        let closed = self.streams_closed.load(Ordering::Relaxed);
        self.streams_opened.load(Ordering::Relaxed).saturating_sub(closed)
    }
}
