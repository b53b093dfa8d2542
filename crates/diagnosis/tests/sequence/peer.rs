//! What one peer has answered validly, and what it was asked.

use diagnosis::{ActuatorFault, Alarm, Change, StateAnswer, StateQuestion};
use vocabulary::{ModuleName, Step};

use super::happening::Said;

/// A peer.
#[derive(Debug, Clone)]
pub struct Peer {
    pub name: ModuleName,
    /// The question under way.
    pub asked: Option<StateQuestion>,
    /// Questions that are no longer under way.
    pub past: Option<StateQuestion>,
    /// The latest question failed.
    pub silent: bool,
    /// As of which step it has answered in full.
    answered_until: Option<Step>,
    watching_since: Option<Step>,
}

impl Peer {
    pub fn new(name: ModuleName) -> Self {
        Self {
            name,
            asked: None,
            past: None,
            silent: false,
            answered_until: None,
            watching_since: None,
        }
    }

    /// The diagnoser forgets what it received: a new run, or a new process.
    pub fn forget(&mut self) {
        let past = self.asked.or(self.past);
        *self = Self { past, ..Self::new(self.name.clone()) };
    }

    pub fn ask(&mut self, question: StateQuestion) {
        assert!(self.asked.is_none(), "one question at a time");
        assert!(question.from <= question.as_of, "{question:?}");
        self.asked = Some(question);
    }

    pub fn answered(&mut self, answer: &StateAnswer) {
        self.past = self.asked.take();
        self.silent = false;
        self.answered_until = Some(answer.question.as_of);
        self.watching_since = answer.watching_since;
    }

    pub fn failed(&mut self) {
        self.past = self.asked.take();
        self.silent = true;
    }

    /// Has it answered in full as of this step?
    pub fn has_answered(&self, as_of: Step) -> bool {
        self.answered_until.is_some_and(|until| until >= as_of)
    }

    /// Has it answered in full as of this step, having watched since the other one?
    pub fn knows(&self, change: Step, as_of: Step) -> bool {
        self.has_answered(as_of) && self.watching_since.is_some_and(|since| since <= change)
    }

    /// An answer to a question; one that fits it, if so wanted.
    pub fn answer(&self, question: StateQuestion, said: &Said) -> StateAnswer {
        let length = (question.as_of.since(question.from) + 1) as f64;
        let at = |share: f64| question.from.plus((share * length) as u64);
        let change = |&(share, ratio): &(f64, f64)| {
            let component = "actuator/a1".parse().unwrap();
            Change { component, onset: at(share), step: at(share), ratio, until: None }
        };
        let mut changes: Vec<_> = said.changes.iter().map(change).collect();
        let fault =
            |share: &f64| ActuatorFault { actuator: "a1".parse().unwrap(), step: at(*share) };
        let mut actuator_faults: Vec<_> = said.actuator_faults.iter().map(fault).collect();
        if said.fits {
            changes.retain(|change| change.step <= question.as_of && change.ratio >= 1.0);
            actuator_faults.retain(|fault| fault.step <= question.as_of);
        }
        let watching_since = said.watching_since.map(Step);
        // It raises the alarm for whatever it says has changed.
        let of = |step, faulty| Alarm { component: "actuator/a1".parse().unwrap(), step, faulty };
        let faults = actuator_faults.iter().map(|fault| of(fault.step, true));
        let alarms = faults.chain([of(question.from, false)]).collect();
        let (module, pending, window) = (self.name.clone(), Vec::new(), None);
        StateAnswer {
            module,
            question,
            watching_since,
            changes,
            actuator_faults,
            alarms,
            pending,
            window,
        }
    }
}
