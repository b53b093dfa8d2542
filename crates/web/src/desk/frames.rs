//! The freeze frame of a component's fault, drawn once for all pages.

use std::sync::Arc;
use std::time::Duration;

use wire::FaultTransition;
use zenoh::Session;

use super::answers::Answers;

/// A frame does not change, but may not be there yet.
const KEEP: Duration = Duration::from_secs(3);

/// A drawing, or why there is none.
pub(crate) type Frame = Result<Arc<str>, Arc<str>>;

/// Those of all components.
#[derive(Debug)]
pub(crate) struct Frames(Answers<String, Frame>);

impl Default for Frames {
    fn default() -> Self {
        Self(Answers::new(KEEP))
    }
}

impl Frames {
    /// What was seen around the latching of the fault that a component has, as SVG text.
    pub(crate) async fn of(
        &self,
        session: Option<Session>,
        timeout: Duration,
        fault: &FaultTransition,
    ) -> Frame {
        let Some(session) = session else { return Err("there is no network".into()) };
        let key = format!("{}/{}/{}", fault.structure, fault.component, fault.sequence);
        let fetch = || async {
            let frame = observer::freeze_frame_of(&session, fault, timeout).await;
            frame.map(|frame| figure::freeze_frame::svg(&frame).into()).map_err(Into::into)
        };
        self.0.get(key, fetch).await
    }
}
