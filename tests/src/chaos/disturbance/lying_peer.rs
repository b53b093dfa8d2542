//! An impostor answers a module's queries in the name of its peer.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use serde_json::{Value, json};
use vocabulary::{Refused, StateQuestion};
use zenoh::liveliness::LivelinessToken;
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};

use super::{Deed, Disturbance};
use crate::chaos::stage::Stage;
use crate::lab::{Impairment, Node};

/// Key on which the second module is queried.
const KEY: &str = "trusswatch/tower/module2/state";
const TOKEN: &str = "trusswatch/tower/module2/alive";

/// What is answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lie {
    /// "No changes", but to another query.
    AnotherQuestion,
    /// No JSON.
    Malformed,
    /// A change after the queried step.
    ChangeOutside,
    /// "No changes", while the true peer is connected as well and replies otherwise.
    Contradiction,
    /// A huge change at the beginning of what is asked for, for which the alarm is raised: plausible, and the cause of
    /// whatever came later.
    Cause,
    /// A reason for not answering.
    Refusal,
}

/// Steps after which the first module has given up a disconnected true peer.
const GIVEN_UP_AFTER: u64 = 1200;

/// A second queryable for the second module, reachable by the first one. The true one is disconnected from
/// the first; for a contradiction it reconnects soon, so that both reply, the impostor first.
pub struct LyingPeer {
    lie: Lie,
    replies: Arc<AtomicU64>,
    declared: Option<(Session, Queryable<()>, Option<LivelinessToken>)>,
}

impl LyingPeer {
    /// No reply yet.
    #[must_use]
    pub fn new(lie: Lie) -> Self {
        Self { lie, replies: Arc::default(), declared: None }
    }

    async fn declare(&mut self, stage: &mut Stage) {
        stage.lab.impair_between(Node::Module1, Node::Module2, Impairment::cut());
        let session = stage.session_with(Node::Module1).await;
        let (lie, replies) = (self.lie, Arc::clone(&self.replies));
        let queryable = session.declare_queryable(KEY).complete(true);
        let answer = move |query: Query| {
            if let Ok(question) = StateQuestion::from_parameters(query.parameters().as_str()) {
                replies.fetch_add(1, Ordering::Relaxed);
                // Fails if the asker is no longer there.
                let _ = match lie {
                    Lie::Refusal => query.reply_err(refusal()).wait(),
                    _ => query.reply(KEY, lie.words(question)).wait(),
                };
            }
        };
        let queryable = queryable.callback(answer).await.unwrap();
        let token = if self.lie.is_plausible() {
            Some(session.liveliness().declare_token(TOKEN).await.unwrap())
        } else {
            None
        };
        self.declared = Some((session, queryable, token));
        if self.lie == Lie::Contradiction {
            stage.pass(GIVEN_UP_AFTER).await;
            stage.lab.heal();
        }
    }
}

impl Disturbance for LyingPeer {
    fn begin<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(self.declare(stage))
    }

    fn end<'a>(&'a mut self, stage: &'a mut Stage) -> Deed<'a> {
        Box::pin(async {
            stage.lab.heal();
            if let Some((session, queryable, token)) = self.declared.take() {
                if let Some(token) = token {
                    token.undeclare().await.unwrap();
                }
                queryable.undeclare().await.unwrap();
                session::close(&session).await;
            }
        })
    }

    fn effect(&self) -> Result<String, String> {
        match self.replies.load(Ordering::Relaxed) {
            0 => Err("the lying peer was never queried".into()),
            replies => Ok(format!("{replies} false replies")),
        }
    }
}

impl Lie {
    /// Does the impostor behave as the module would, and show its token?
    fn is_plausible(self) -> bool {
        matches!(self, Lie::Cause | Lie::Refusal)
    }

    fn words(self, question: StateQuestion) -> Vec<u8> {
        let mut answer = nothing_changed(question);
        match self {
            Lie::AnotherQuestion => {
                answer["question"]["as_of_step"] = json!(question.as_of.0 + 1000)
            }
            Lie::Malformed => return b"{\"v\":1,\"module\":".to_vec(),
            Lie::ChangeOutside => {
                let late = question.as_of.0 + 1;
                answer["changes"] = json!([change(late, 9.0)]);
            }
            Lie::Cause => {
                let first = question.from.0;
                answer["changes"] = json!([change(first, 1e300)]);
                let alarm = json!({"component": "sensor/g1", "step": first, "faulty": true});
                answer["alarms"] = json!([alarm]);
            }
            Lie::Contradiction | Lie::Refusal => {}
        }
        serde_json::to_vec(&answer).unwrap()
    }
}

fn change(step: u64, ratio: f64) -> Value {
    json!({"component": "sensor/g1", "onset_step": step, "step": step, "ratio": ratio, "until_step": step})
}

fn refusal() -> Vec<u8> {
    vocabulary::encode(&Refused { reason: "no sample received yet".to_owned() }).unwrap()
}

fn nothing_changed(question: StateQuestion) -> Value {
    json!({
        "v": vocabulary::VERSION,
        "module": "module2",
        "question": question,
        "watching_since_step": 0,
        "changes": [],
        "actuator_faults": [],
        "alarms": [],
    })
}

#[cfg(test)]
mod tests {
    use vocabulary::{RunId, StateAnswer, Step};

    use super::*;

    #[test]
    fn lies_are_well_formed_but_for_the_one_that_is_not_meant_to_be() {
        let question =
            StateQuestion { run: RunId(7), from: Step(100), as_of: Step(200), window: None };
        let answer = |lie: Lie| vocabulary::decode::<StateAnswer>(&lie.words(question));
        assert!(answer(Lie::Malformed).is_err());
        assert_eq!(answer(Lie::AnotherQuestion).unwrap().question.as_of, Step(1200));
        assert_eq!(answer(Lie::ChangeOutside).unwrap().changes[0].step, Step(201));
        assert_eq!(answer(Lie::Cause).unwrap().changes[0].step, Step(100));
        let contradiction = answer(Lie::Contradiction).unwrap();
        assert_eq!((contradiction.question, contradiction.changes.len()), (question, 0));
    }
}
