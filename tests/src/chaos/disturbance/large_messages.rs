//! A stranger sends a module messages that are far longer than any of ours.

use zenoh::Session;

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::hostile::{blocking_session, put_large};
use crate::lab::Node;

/// The first module's samples.
const KEY: &str = "trusswatch/tower/module1/sample";

/// Such messages, one of each of some priorities.
#[derive(Default)]
pub struct LargeMessages {
    stranger: Option<Session>,
}

impl Disturbance for LargeMessages {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            let stranger = blocking_session(&[stage.endpoint_of(Node::Module1)]).await;
            put_large(&stranger, KEY).await;
            self.stranger = Some(stranger);
        })
    }

    fn end<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            if let Some(stranger) = &self.stranger {
                session::close(stranger).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        let sent = || "messages of 64 MiB sent".to_owned();
        self.stranger.as_ref().map(|_| sent()).ok_or_else(|| "nothing was sent".to_owned())
    }
}
