//! An unauthorised publisher floods the first module's sample key at full rate.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use tokio::task::JoinHandle;
use zenoh::Session;

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::hostile::{hostile_samples, true_sample};
use crate::lab::Node;

/// The first module's samples.
const KEY: &str = "trusswatch/tower/module1/sample";
/// Samples between two checks for the end.
const BATCH: usize = 64;

/// Samples that are malformed, and well-formed ones that are not of this run or no step of it, until
/// it is over.
#[derive(Default)]
pub struct Flood {
    published: Arc<AtomicU64>,
    source: Option<(Session, JoinHandle<()>)>,
}

impl Flood {
    async fn pour(&mut self, stage: &mut Stage) {
        let samples = hostile_samples(&true_sample(&stage.observer.session, KEY).await);
        let session = stage.session_with(Node::Module1).await;
        let (mouth, published) = (session.clone(), Arc::clone(&self.published));
        let task = tokio::spawn(async move {
            let mut samples = samples.iter().cycle();
            loop {
                for sample in samples.by_ref().take(BATCH) {
                    // Fails if the module is gone, which the row reports.
                    let _ = mouth.put(KEY, sample.bytes.clone()).await;
                    published.fetch_add(1, Ordering::Relaxed);
                }
                tokio::task::yield_now().await;
            }
        });
        self.source = Some((session, task));
    }
}

impl Disturbance for Flood {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(self.pour(stage))
    }

    fn end<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            if let Some((session, task)) = self.source.take() {
                task.abort();
                // It ends by being aborted.
                let _ = task.await;
                session::close(&session).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        match self.published.load(Ordering::Relaxed) {
            0 => Err("nothing was published".into()),
            published => Ok(format!("{published} hostile samples")),
        }
    }
}
