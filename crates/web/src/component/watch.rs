//! Keeps the changing parts of a component's page up to date while it is viewed.

use std::sync::Arc;
use std::time::Duration;

use observer::ComponentId;
use tokio::sync::watch::Receiver;
use tokio::task::JoinSet;
use tokio::time::Instant;
use vocabulary::{FaultState, FaultTransition};

use super::evidence::ModuleAnswers;
use super::shown::Shown;
use crate::layout::not_reported;
use crate::observed::{Observed, Traces};
use crate::part::{PagePart, part};
use crate::view::LinkedScene;

/// Interval for asking again for what was missing.
const ASK_AGAIN_AFTER: Duration = Duration::from_secs(4);
/// Interval for asking again for everything: this component may by then explain changes of others.
const ASK_ANEW_AFTER: Duration = Duration::from_secs(20);

/// Parts that show answers of the modules.
const OF_EVIDENCE: [&str; 4] = ["trail", "frame", "margins", "journal"];

/// A component whose page is viewed.
pub(crate) struct ComponentWatch {
    observed: Arc<Observed>,
    id: ComponentId,
    traces: Option<Receiver<Arc<Traces>>>,
    /// `None` until the first answers: the browser keeps the parts that came with the page meanwhile.
    evidence: Option<ModuleAnswers>,
    fetching: JoinSet<ModuleAnswers>,
    /// The state for which the evidence was requested, and the time of the request.
    asked: Option<(Version, Instant)>,
}

/// A different version has a different history.
type Version = ((u64, u64), FaultState);

impl ComponentWatch {
    pub(crate) fn new(observed: &Arc<Observed>, id: ComponentId) -> Self {
        Self {
            observed: Arc::clone(observed),
            id,
            traces: None,
            evidence: None,
            fetching: JoinSet::new(),
            asked: None,
        }
    }

    /// Waits for a change that is not part of the scene.
    pub(crate) async fn news(&mut self) {
        let traces = async {
            match &mut self.traces {
                // Without a sender, the next rendering subscribes again.
                Some(traces) => traces.changed().await.is_ok(),
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            lasting = traces => if !lasting { self.traces = None },
            Some(fetched) = self.fetching.join_next() => self.evidence = fetched.ok().or(self.evidence.take()),
        }
    }

    /// The present parts of the page.
    pub(crate) fn parts(&mut self, view: &LinkedScene<'_>) -> Vec<PagePart> {
        let known = view.scene.state_of(&self.id);
        let Some(transition) = known else { return vec![part("summary", not_reported())] };
        self.ask_if_due(transition);
        let (structure, module) = (&transition.structure, &transition.module);
        let observed = &self.observed;
        let live = self.traces.get_or_insert_with(|| observed.traces(structure, module));
        let traces = Arc::clone(&live.borrow_and_update());
        let nothing = ModuleAnswers::default();
        let evidence = self.evidence.as_ref().unwrap_or(&nothing);
        let mut parts = Shown { view, transition, evidence, traces: &traces }.parts();
        parts.retain(|part| self.evidence.is_some() || !OF_EVIDENCE.contains(&part.id));
        parts
    }

    fn ask_if_due(&mut self, transition: &FaultTransition) {
        let version = (transition.place(), transition.state());
        let due = match self.asked {
            None => true,
            Some((asked, at)) => {
                let wait = if self.evidence.as_ref().is_none_or(ModuleAnswers::lacks) {
                    ASK_AGAIN_AFTER
                } else {
                    ASK_ANEW_AFTER
                };
                asked != version || at.elapsed() >= wait
            }
        };
        if !due || !self.fetching.is_empty() {
            return;
        }
        self.asked = Some((version, Instant::now()));
        // The scene is read when the request is sent.
        let (observed, transition) = (Arc::clone(&self.observed), transition.clone());
        self.fetching.spawn(async move {
            let scene = observed.scene();
            ModuleAnswers::fetch(&observed, &scene, &transition).await
        });
    }
}
