//! The clock of a module's sample publisher jumps an hour to and fro.
//!
//! The plant's own clock is this machine's and is left alone: the plant and the first module are cut
//! off from each other, and the test passes the samples on, with another time in them while it lasts.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use super::{Deed, Disturbance};
use crate::chaos::stage::{Site, Stage};
use crate::lab::{Impairment, Node};

/// The samples that are passed on.
const KEY: &str = "trusswatch/tower/module1/sample";
const HOUR_NS: u64 = 3_600_000_000_000;
/// Steps from one jump to the next.
const JUMP_EVERY: u64 = 300;

/// Passes the first module's samples on, with the time as it is or as a jumping clock has it.
#[derive(Default)]
pub struct ClockJump {
    jumping: Arc<AtomicBool>,
    shifted: Arc<AtomicU64>,
    relay: Option<Relay>,
}

/// Both sides of the relay; each stands in for the node missing on the other side.
struct Relay {
    sessions: [Session; 2],
    _tokens: [LivelinessToken; 2],
    _samples: Subscriber<()>,
}

impl ClockJump {
    async fn connect(&mut self, site: &Site) {
        site.lab.impair_between(Node::Plant, Node::Module1, Impairment::cut());
        // Sessions whose node is not there yet connect as soon as it is.
        let (plant, module) =
            (site.session_with(Node::Plant).await, site.session_with(Node::Module1).await);
        let token = async |session: &Session, name: &str| {
            let key = format!("trusswatch/tower/{name}/alive");
            session.liveliness().declare_token(key).await.unwrap()
        };
        let tokens = [token(&plant, "module1").await, token(&module, "plant").await];
        let publisher = module.declare_publisher(KEY).await.unwrap();
        let (jumping, shifted) = (Arc::clone(&self.jumping), Arc::clone(&self.shifted));
        let pass_on = move |received: zenoh::sample::Sample| {
            let mut sample: vocabulary::Sample =
                vocabulary::decode(&received.payload().to_bytes()).unwrap();
            if jumping.load(Ordering::Relaxed) {
                sample.time_unix_ns = shift(sample.time_unix_ns, sample.step.0);
                shifted.fetch_add(1, Ordering::Relaxed);
            }
            // Fails if the module is gone, which the row reports.
            let _ = publisher.put(vocabulary::encode(&sample).unwrap()).wait();
        };
        let samples = plant.declare_subscriber(KEY).callback(pass_on).await.unwrap();
        self.relay = Some(Relay { sessions: [plant, module], _tokens: tokens, _samples: samples });
    }
}

fn shift(time_unix_ns: u64, step: u64) -> u64 {
    if (step / JUMP_EVERY).is_multiple_of(2) {
        time_unix_ns + HOUR_NS
    } else {
        time_unix_ns - HOUR_NS
    }
}

impl Disturbance for ClockJump {
    fn set_up<'a>(&'a mut self, site: &'a mut Site) -> Deed<'a> {
        Box::pin(self.connect(site))
    }

    fn begin<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        self.jumping.store(true, Ordering::Relaxed);
        Box::pin(async {})
    }

    fn end<'a>(&'a mut self, _stage: &'a mut Stage) -> Deed<'a> {
        self.jumping.store(false, Ordering::Relaxed);
        Box::pin(async {})
    }

    fn tear_down(&mut self) -> Deed<'_> {
        Box::pin(async {
            let Some(relay) = self.relay.take() else { return };
            for session in &relay.sessions {
                session::close(session).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        match self.shifted.load(Ordering::Relaxed) {
            0 => Err("no sample had another time".into()),
            shifted => Ok(format!("{shifted} samples an hour off")),
        }
    }
}
