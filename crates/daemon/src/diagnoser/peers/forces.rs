//! Peers' forces, listened to while a gage of the module is replaced: without them nothing is sent.

use std::time::Duration;

use diagnosis::Diagnoser;
use diagnosis::messages::Speaker;
use tokio::sync::{mpsc, watch};
use vocabulary::{Corrected, Key, ModuleName, Step, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;

use crate::messages;

/// Messages that wait for the diagnosis; further ones are dropped.
const QUEUE: usize = 256;
/// Until listening is tried again.
const AGAIN: Duration = Duration::from_secs(1);

/// What peers publish of their forces, while it is wanted.
#[derive(Debug)]
pub(crate) struct PeerForces {
    wanted: watch::Sender<bool>,
    inbox: mpsc::Receiver<Heard>,
    /// Was a message logged since listening began that cannot be used?
    has_warned: bool,
}

/// A peer and its message, or the reason why that cannot be used.
type Heard = (ModuleName, Result<Corrected, String>);

impl PeerForces {
    /// The receiving end, and the task that listens on its behalf.
    pub(crate) fn new(
        session: &Session,
        speaker: &Speaker,
        peers: &[ModuleName],
    ) -> (Self, impl Future<Output = ()> + Send + use<>) {
        let (wanted, is_wanted) = watch::channel(false);
        let (outlet, inbox) = mpsc::channel(QUEUE);
        let key = |peer: &ModuleName| {
            (peer.clone(), Key::of_module(&speaker.structure, peer, Topic::Corrected))
        };
        let keys = peers.iter().map(key).collect();
        let listening = listen(session.clone(), keys, is_wanted, outlet);
        (Self { wanted, inbox, has_warned: false }, listening)
    }

    /// Gives the diagnoser what came, and asks for more while it has use for it.
    pub(crate) fn follow(&mut self, diagnoser: &mut Diagnoser) {
        let wanted = diagnoser.replaces_any();
        if self.wanted.send_if_modified(|before| std::mem::replace(before, wanted) != wanted) {
            self.has_warned = false;
        }
        while let Ok((peer, message)) = self.inbox.try_recv() {
            let (step, forces_n, why) = match message {
                Ok(message) if diagnoser.run() != Some(message.run) => continue,
                Ok(message) => (
                    message.step,
                    message.forces_n,
                    "not those that the reference knows".to_owned(),
                ),
                Err(why) => (Step(0), Vec::new(), why),
            };
            // A peer without a pressure has no force.
            let Some(forces_n) = forces_n.into_iter().collect::<Option<Vec<f64>>>() else {
                continue;
            };
            let used = diagnoser.take_forces(&peer, step, &forces_n);
            if !used && !std::mem::replace(&mut self.has_warned, true) {
                tracing::warn!(%peer, "cannot use the forces of a peer: {why}");
            }
        }
    }
}

/// Listens whenever it is wanted.
async fn listen(
    session: Session,
    keys: Vec<(ModuleName, Key)>,
    mut is_wanted: watch::Receiver<bool>,
    outlet: mpsc::Sender<Heard>,
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
    keys: &[(ModuleName, Key)],
    outlet: &mpsc::Sender<Heard>,
) -> zenoh::Result<Vec<Subscriber<()>>> {
    let mut subscribers = Vec::with_capacity(keys.len());
    for (peer, key) in keys {
        let (peer, outlet) = (peer.clone(), outlet.clone());
        let subscriber = session
            .declare_subscriber(key.to_string())
            .callback(move |sample| {
                let message = messages::read(&sample, Corrected::key);
                let _ = outlet.try_send((peer.clone(), message));
            })
            .await?;
        subscribers.push(subscriber);
    }
    Ok(subscribers)
}
