//! The freeze frame of a component's fault, drawn once for all pages.

use std::sync::Arc;

use vocabulary::FaultTransition;

use super::Observed;

/// A drawing, or the reason why it is missing.
pub(crate) type Frame = Result<Arc<str>, Arc<str>>;

impl Observed {
    /// The freeze frame of a component's present fault, as SVG text.
    pub(crate) async fn frame(&self, fault: &FaultTransition) -> Frame {
        let Some(session) = self.session() else {
            return Err("the network is not connected".into());
        };
        let key = format!("{}/{}/{}", fault.structure, fault.component, fault.sequence);
        let fetch = || async {
            let frame = observer::freeze_frame_of(&session, fault, self.timeout).await;
            frame.map(|frame| figure::freeze_frame::svg(&frame).into()).map_err(Into::into)
        };
        self.frames.get(key, fetch).await
    }
}
