//! Identifies faults, their kind and size, on a thread of its own: it takes milliseconds, for which the diagnosis does not
//! wait.

use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};

use diagnosis::identification::{Excerpt, Identification, identify};
use names::Component;
use names::fault::FaultKind;
use shell::occurrences::Occurrences;

/// Requests that may wait. Each is superseded by the next one of its component.
const WAITING: usize = 64;

/// The thread's queue.
#[derive(Debug)]
pub(crate) struct Identifier {
    queue: SyncSender<Box<Excerpt>>,
    lost: Occurrences,
}

impl Identifier {
    /// Starts the thread. It ends with this.
    ///
    /// # Errors
    /// The system has no thread.
    pub(crate) fn start() -> std::io::Result<Self> {
        let (queue, requests) = sync_channel(WAITING);
        let thread = std::thread::Builder::new().name("identifier".to_owned());
        thread.spawn(move || run(&requests))?;
        Ok(Self { queue, lost: Occurrences::default() })
    }

    /// Hands in a request without waiting.
    pub(crate) fn identify(&mut self, excerpt: Box<Excerpt>) {
        let Err(refused) = self.queue.try_send(excerpt) else { return };
        let (TrySendError::Full(excerpt) | TrySendError::Disconnected(excerpt)) = refused;
        if let Some(times) = self.lost.note() {
            tracing::warn!(component = %excerpt.component, times, "fault not identified: too many at once");
        }
    }
}

fn run(requests: &Receiver<Box<Excerpt>>) {
    let mut known = BTreeMap::new();
    while let Ok(excerpt) = requests.recv() {
        tell(&identify(&excerpt), &mut known);
    }
}

/// What is known of each fault: the transition that declared it, and its kind, once that is decided.
type Known = BTreeMap<Component, (u64, Option<FaultKind>)>;

/// Logs what a fault is as soon as that is decided, and when it turns out to be something else.
fn tell(found: &Identification, known: &mut Known) {
    let Some(likeliest) = found.candidates.first() else { return };
    let decided = found.decided().map(|candidate| candidate.kind);
    let now = (found.sequence, decided);
    if known.insert(found.component.clone(), now) == Some(now) {
        return;
    }
    let (component, as_of) = (&found.component, found.as_of);
    let probability = likeliest.probability;
    match decided {
        Some(_) => tracing::info!(%component, %as_of, probability, "identified: {likeliest}"),
        None => {
            let all: Vec<String> = found.candidates.iter().map(ToString::to_string).collect();
            tracing::info!(%component, %as_of, probability, "not yet identified: {}", all.join(", or "));
        }
    }
}
