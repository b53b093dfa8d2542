//! Questions and commands, and whether each had its one reply.

use std::collections::BTreeMap;

use diagnosis::{Action, Change, QuestionToken, StateAnswer, StateQuestion};
use vocabulary::Step;

use crate::fixture::QUIET;

/// Questions of peers that have no reply yet.
#[derive(Debug, Default)]
pub struct Inquiries {
    latest: u64,
    waiting: BTreeMap<QuestionToken, StateQuestion>,
}

impl Inquiries {
    /// A new question.
    pub fn ask(&mut self, question: StateQuestion) -> QuestionToken {
        self.latest += 1;
        let token = QuestionToken(self.latest);
        self.waiting.insert(token, question);
        token
    }

    /// The asker of one of the latest questions gives up.
    pub fn withdraw(&mut self, back: u64) -> QuestionToken {
        let token = QuestionToken(self.latest.saturating_sub(back));
        self.waiting.remove(&token);
        token
    }

    /// The process ends; no asker waits for it any more.
    pub fn forget(&mut self) {
        self.waiting.clear();
    }

    /// Takes a reply away.
    pub fn note(&mut self, action: &Action) {
        match action {
            Action::Answer { token, answer } => {
                let question = self.waiting.remove(token).expect("answered once, and before long");
                assert_eq!(answer.question, question);
                check(answer);
            }
            Action::Refuse { token, .. } => {
                self.waiting.remove(token).expect("refused once, and before long");
            }
            _ => {}
        }
    }

    /// How many have no reply yet.
    pub fn waiting(&self) -> usize {
        self.waiting.len()
    }
}

/// What this module answers, a peer can use.
fn check(answer: &StateAnswer) {
    let StateQuestion { from, as_of, .. } = answer.question;
    let changes = &answer.changes;
    assert!(changes.iter().all(|change| change.step <= as_of), "{answer:?}");
    let overlaps = |until: Step| until.plus(QUIET) > from && until <= as_of;
    assert!(changes.iter().all(|change| change.until.is_none_or(overlaps)), "{answer:?}");
    let once =
        |pair: &[Change]| (pair[0].step, &pair[0].component) != (pair[1].step, &pair[1].component);
    assert!(changes.windows(2).all(once), "{answer:?}");
    assert!(changes.iter().all(|change| change.ratio >= 1.0), "{answer:?}");
    assert!(changes.is_sorted_by_key(|change| change.step), "{answer:?}");
    assert!(answer.actuator_faults.iter().all(|fault| fault.step <= as_of), "{answer:?}");
    assert!(answer.watching_since.is_none_or(|since| since <= as_of), "{answer:?}");
}
