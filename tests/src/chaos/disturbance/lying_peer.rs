//! Somebody else answers a module's questions in the name of its peer.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::{Value, json};
use wire::StateQuestion;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::lab::{Impairment, Node};

/// Where the second module is asked.
const KEY: &str = "trusswatch/tower/module2/state";

/// What is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lie {
    /// "No changes", but to another question.
    AnotherQuestion,
    /// No JSON.
    Malformed,
    /// A change after the step that was asked about.
    ChangeOutside,
    /// "No changes", while the true peer, who is there too, knows better.
    Contradiction,
}

/// Steps after which the first module has given up a true peer that is cut off.
const GIVEN_UP_AFTER: u64 = 1200;

/// A second voice for the second module, which the first one hears. The true one is cut off from the
/// first; for a contradiction it comes back soon, so that there are two, of whom the liar was first.
pub struct LyingPeer {
    lie: Lie,
    told: Arc<AtomicU64>,
    voice: Option<(Session, Queryable<()>)>,
}

impl LyingPeer {
    /// Nobody has lied yet.
    #[must_use]
    pub fn new(lie: Lie) -> Self {
        Self { lie, told: Arc::default(), voice: None }
    }

    async fn speak_up(&mut self, stage: &mut Stage) {
        stage.lab.impair_between(Node::Module1, Node::Module2, Impairment::cut());
        let session = stage.session_with(Node::Module1).await;
        let (lie, told) = (self.lie, Arc::clone(&self.told));
        let queryable = session.declare_queryable(KEY).complete(true);
        let answer = move |query: Query| {
            if let Ok(question) = StateQuestion::from_parameters(query.parameters().as_str()) {
                told.fetch_add(1, Ordering::Relaxed);
                // Fails if the asker is no longer there.
                let _ = query.reply(KEY, lie.words(question)).wait();
            }
        };
        let queryable = queryable.callback(answer).await.unwrap();
        self.voice = Some((session, queryable));
        if self.lie == Lie::Contradiction {
            stage.pass(GIVEN_UP_AFTER).await;
            stage.lab.heal();
        }
    }
}

impl Disturbance for LyingPeer {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(self.speak_up(stage))
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            stage.lab.heal();
            if let Some((session, queryable)) = self.voice.take() {
                queryable.undeclare().await.unwrap();
                daemon::session::close(&session).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        match self.told.load(Ordering::Relaxed) {
            0 => Err("nobody asked the liar".into()),
            told => Ok(format!("{told} lies told")),
        }
    }
}

impl Lie {
    fn words(self, question: StateQuestion) -> Vec<u8> {
        let mut answer = nothing_changed(question);
        match self {
            Lie::AnotherQuestion => answer["as_of_step"] = json!(question.step.0 + 1000),
            Lie::Malformed => return b"{\"v\":1,\"structure\":".to_vec(),
            Lie::ChangeOutside => {
                let late = question.step.0 + 1;
                answer["changes"] = json!([{"component": "sensor/g1", "step": late, "ratio": 9.0}]);
            }
            Lie::Contradiction => {}
        }
        serde_json::to_vec(&answer).unwrap()
    }
}

fn nothing_changed(question: StateQuestion) -> Value {
    json!({
        "v": wire::VERSION,
        "structure": "tower",
        "module": "module2",
        "run": question.run.map_or(0, |run| run.0),
        "from_step": question.from.0,
        "as_of_step": question.step.0,
        "watching_since_step": 0,
        "changes": [],
        "actuator_faults": [],
    })
}

#[cfg(test)]
mod tests {
    use truss::ids::{RunId, Step};
    use wire::StateAnswer;

    use super::*;

    #[test]
    fn lies_are_well_formed_but_for_the_one_that_is_not_meant_to_be() {
        let question = StateQuestion { run: Some(RunId(7)), from: Step(100), step: Step(200) };
        let answer = |lie: Lie| wire::decode::<StateAnswer>(&lie.words(question));
        assert!(answer(Lie::Malformed).is_err());
        assert_eq!(answer(Lie::AnotherQuestion).unwrap().as_of_step, Step(1200));
        assert_eq!(answer(Lie::ChangeOutside).unwrap().changes[0].step, Step(201));
        let contradiction = answer(Lie::Contradiction).unwrap();
        assert_eq!((contradiction.run, contradiction.changes.len()), (RunId(7), 0));
    }
}
