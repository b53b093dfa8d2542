//! Peers' forces, listened to while a gage of the module is replaced: without them nothing is sent.

use std::time::Duration;

use diagnosis::Diagnoser;
use diagnosis::messages::Speaker;
use tokio::sync::{mpsc, watch};
use vocabulary::{Corrected, Key, ModuleName, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

/// Messages that wait for the diagnosis; further ones are dropped.
const QUEUE: usize = 256;
/// Until listening is tried again.
const AGAIN: Duration = Duration::from_secs(1);

/// What peers publish of their forces, while it is wanted.
#[derive(Debug)]
pub(crate) struct PeerForces {
    wanted: watch::Sender<bool>,
    inbox: mpsc::Receiver<Corrected>,
}

impl PeerForces {
    /// The receiving end, and the task that listens on its behalf.
    pub(crate) fn new(
        session: &Session,
        speaker: &Speaker,
        peers: &[ModuleName],
    ) -> (Self, impl Future<Output = ()> + Send + use<>) {
        let (wanted, is_wanted) = watch::channel(false);
        let (outlet, inbox) = mpsc::channel(QUEUE);
        let key = |peer| Key::of_module(&speaker.structure, peer, Topic::Corrected);
        let keys = peers.iter().map(key).collect();
        (Self { wanted, inbox }, listen(session.clone(), keys, is_wanted, outlet))
    }

    /// Gives the diagnoser what came, and asks for more while it has use for it.
    pub(crate) fn follow(&mut self, diagnoser: &mut Diagnoser) {
        let wanted = diagnoser.replaces_any();
        self.wanted.send_if_modified(|before| std::mem::replace(before, wanted) != wanted);
        while let Ok(message) = self.inbox.try_recv() {
            let forces: Option<Vec<f64>> = message.forces_n.into_iter().collect();
            if let Some(forces) = forces.filter(|_| diagnoser.run() == Some(message.run)) {
                diagnoser.take_forces(&message.module, message.step, &forces);
            }
        }
    }
}

/// Listens whenever it is wanted.
async fn listen(
    session: Session,
    keys: Vec<Key>,
    mut is_wanted: watch::Receiver<bool>,
    outlet: mpsc::Sender<Corrected>,
) {
    // The sender lives as long as the diagnosis.
    while is_wanted.wait_for(|wanted| *wanted).await.is_ok() {
        match subscribe(&session, &keys, &outlet).await {
            Ok(subscribers) => {
                let _ = is_wanted.wait_for(|wanted| !wanted).await;
                drop(subscribers);
            }
            Err(error) => {
                tracing::warn!("cannot subscribe to the forces of peers: {error}");
                tokio::time::sleep(AGAIN).await;
            }
        }
    }
}

async fn subscribe(
    session: &Session,
    keys: &[Key],
    outlet: &mpsc::Sender<Corrected>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::with_capacity(keys.len());
    for key in keys {
        let (key, outlet) = (key.clone(), outlet.clone());
        let subscriber = session
            .declare_subscriber(key.to_string())
            .callback(move |sample| {
                let message = vocabulary::decode::<Corrected>(&sample.payload().to_bytes());
                let Ok(message) = message else { return };
                let own = Key::of_module(&message.structure, &message.module, Topic::Corrected);
                if own == key {
                    let _ = outlet.try_send(message);
                }
            })
            .await?;
        subscribers.push(subscriber);
    }
    Ok(subscribers)
}
