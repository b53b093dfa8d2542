//! Makes things happen to a diagnoser, and holds every event against what must always be true.

use std::collections::BTreeSet;

use diagnosis::{
    Action, Event, GivenOrder, GivenOrderKind, Measurements, ModuleSetup, OrderToken, PeerFailure,
    Rule, StateQuestion, Transition, Verdict,
};
use vocabulary::{Component, RunId, Step};

use super::happening::{Happening, Said};
use super::inquiries::Inquiries;
use super::journal::Journal;
use super::life::{Lives, is_about_verdict};
use super::peer::Peer;
use crate::fixture::{Bench, HOLD, WARM_UP, name, setup};

const COMPONENTS: [&str; 6] =
    ["actuator/a1", "actuator/a2", "sensor/g1", "sensor/g2", "sensor/g3", "sensor/g99"];

/// A diagnoser and everything around it.
pub struct Driver {
    /// Every action, of all processes.
    pub history: Vec<Action>,
    rule: Rule,
    /// From this ratio on a change needs nobody who does not answer or was not watching.
    root_ratio: f64,
    bench: Bench,
    /// The samples of the present run, as the publisher keeps them.
    store: Vec<Measurements>,
    peers: Vec<Peer>,
    inquiries: Inquiries,
    orders: u64,
    journal: Journal,
    lives: Lives,
    /// Components whose present change was found by a process before this one.
    recalled: BTreeSet<Component>,
}

impl Driver {
    /// A diagnoser that has been in service for a while.
    pub fn in_service(rule: Rule, root_ratio: f64, peers: &[&str]) -> Self {
        let peers: Vec<_> = peers.iter().map(|peer| name(peer)).collect();
        let mut setup = ModuleSetup { peers: peers.clone(), ..setup("lower", rule) };
        setup.isolation.root_ratio = root_ratio;
        let mut driver = Self {
            history: Vec::new(),
            rule,
            root_ratio,
            bench: Bench::of(setup),
            store: Vec::new(),
            peers: peers.into_iter().map(Peer::new).collect(),
            inquiries: Inquiries::default(),
            orders: 0,
            journal: Journal::default(),
            lives: Lives::default(),
            recalled: BTreeSet::new(),
        };
        (0..WARM_UP + 100).for_each(|_| driver.sample());
        driver
    }

    /// Makes something happen.
    pub fn apply(&mut self, happening: &Happening) {
        match happening {
            Happening::Samples(count) => (0..*count).for_each(|_| self.sample()),
            Happening::Fault { gage, offset_m } => {
                self.bench.signals.gage_offsets[*gage] = *offset_m;
            }
            Happening::Pressure { actuator, offset_pa } => {
                self.bench.signals.pressure_offsets[*actuator] = *offset_pa;
            }
            Happening::Gap(count) => self.skip(*count),
            Happening::Repeat => {
                if let Some(sample) = self.store.last().cloned() {
                    self.give(Event::Sample(sample));
                }
            }
            Happening::NotANumber => {
                let mut sample = self.bench.signals.sample();
                sample.elongations_m[1] = f64::NAN;
                self.give(Event::Sample(sample));
            }
            Happening::NewRun => {
                self.bench.signals.run = RunId(self.bench.signals.run.0 + 1);
                self.bench.signals.step = Step(0);
                self.store.clear();
            }
            Happening::Asked { from, ahead, run } => self.ask(*from, *ahead, *run),
            Happening::Withdrawn { back } => {
                let token = self.inquiries.withdraw(*back);
                self.give(Event::Withdrawn { token });
            }
            Happening::Answered(said) => self.answer(said, |peer| peer.asked),
            Happening::Stale(said) => self.answer(said, |peer| peer.past),
            Happening::Unanswered { peer } => self.fall_silent(*peer),
            Happening::Returned { peer } => {
                let peer = self.peers.get(*peer).map_or(name("impostor"), |p| p.name.clone());
                self.give(Event::Returned { peer });
            }
            Happening::Ordered { component, kind } => self.order(COMPONENTS[*component], *kind),
            Happening::Restart { missed, again } => self.restart(*missed, usize::from(*again)),
        }
    }

    fn sample(&mut self) {
        let sample = self.bench.signals.sample();
        self.store.push(sample.clone());
        self.give(Event::Sample(sample));
    }

    fn skip(&mut self, steps: u16) {
        self.bench.signals.step = self.bench.signals.step.plus(u64::from(steps));
    }

    fn ask(&mut self, from: u64, ahead: i64, run: u64) {
        let as_of = Step(self.bench.signals.step.0.saturating_add_signed(ahead));
        let from = Step(from.min(as_of.0));
        let question = StateQuestion { run: RunId(run), from, as_of, window: None };
        let token = self.inquiries.ask(question);
        self.give(Event::Asked { token, question });
    }

    fn answer(&mut self, said: &Said, question: impl Fn(&Peer) -> Option<StateQuestion>) {
        let Some(place) = self.place(said.peer) else { return };
        let peer = &self.peers[place];
        let Some(question) = question(peer) else { return };
        let (asked, answer) = (peer.asked, peer.answer(question, said));
        let malformed = self.bench.diagnoser.counters().answers_malformed;
        self.carry(Event::Answered(answer.clone()), |driver| {
            let refused = driver.bench.diagnoser.counters().answers_malformed > malformed;
            let peer = &mut driver.peers[place];
            match (refused, asked) {
                (false, Some(asked)) if asked == answer.question => peer.answered(&answer),
                // It was not asked, at least not by what there is since a restart or in this run.
                (false, _) => {}
                (true, Some(_)) => peer.failed(),
                (true, None) => {}
            }
        });
    }

    /// Falls back on another peer, so that shorter lists are asked as often.
    fn place(&self, peer: usize) -> Option<usize> {
        (!self.peers.is_empty()).then(|| peer % self.peers.len())
    }

    fn fall_silent(&mut self, peer: usize) {
        let Some(place) = self.place(peer) else { return };
        let Some(question) = self.peers[place].asked else { return };
        let peer = self.peers[place].name.clone();
        let event = Event::Unanswered { peer, question, failure: PeerFailure::TimedOut };
        self.carry(event, |driver| driver.peers[place].failed());
    }

    fn order(&mut self, component: &str, kind: GivenOrderKind) {
        self.orders += 1;
        let token = OrderToken(self.orders);
        let order = GivenOrder { kind, by: "ada".into(), on_behalf_of: None, note: None };
        let component: Component = component.parse().unwrap();
        let seen = self.history.len();
        self.give(Event::Ordered { token, component: component.clone(), order: order.clone() });
        match &self.history[seen..] {
            [Action::OrderRefused { token: replied, .. }] => assert_eq!(*replied, token),
            [Action::Publish(transition), Action::Obeyed { token: replied, sequence }] => {
                assert_eq!((*replied, *sequence), (token, transition.sequence));
                assert_eq!((&transition.component, &transition.order), (&component, &Some(order)));
                if kind.is_about_verdict() {
                    self.recalled.remove(&component);
                }
            }
            other => panic!("a command has one outcome: {other:?}"),
        }
    }

    fn restart(&mut self, missed: u16, again: usize) {
        let signals = self.bench.signals.clone();
        self.bench = self.bench.recalling(self.journal.recollection());
        self.bench.signals = signals;
        self.inquiries.forget();
        self.peers.iter_mut().for_each(Peer::forget);
        self.recalled = self.lives.latest().map(|latest| latest.component.clone()).collect();
        self.check();
        self.skip(missed);
        let from = self.store.len().saturating_sub(again);
        let again = self.store[from..].to_vec();
        for sample in again {
            self.give(Event::Sample(sample));
        }
    }

    fn give(&mut self, event: Event) {
        self.carry(event, |_| ());
    }

    /// Hands an event over; `then` says what it means before its actions are looked at.
    fn carry(&mut self, event: Event, then: impl FnOnce(&mut Self)) {
        self.bench.give(event);
        then(self);
        for action in std::mem::take(&mut self.bench.actions) {
            self.look(&action);
            self.history.push(action);
        }
        self.journal.watch(&self.bench.diagnoser);
        self.check();
    }

    /// Holds an action against what must always be true.
    fn look(&mut self, action: &Action) {
        self.inquiries.note(action);
        self.journal.note(action);
        match action {
            Action::RunStarted(_) => self.peers.iter_mut().for_each(Peer::forget),
            Action::Ask { peer, question } => {
                assert!(Some(question.as_of) <= self.bench.diagnoser.last_step());
                let peer = self.peers.iter_mut().find(|known| known.name == *peer);
                peer.expect("only peers are asked").ask(*question);
            }
            Action::Publish(transition) => {
                self.check_commitment(transition);
                self.lives.note(transition);
                if transition.verdict == Verdict::Tentative && is_about_verdict(transition) {
                    self.recalled.remove(&transition.component);
                }
            }
            _ => {}
        }
    }

    /// Nothing is committed while an answer may come, and nothing but a jump while an expected peer is silent; by
    /// the paper, actuators are.
    fn check_commitment(&self, transition: &Transition) {
        let alone = self.rule == Rule::Paper && is_actuator(&transition.component);
        // A person commits himself.
        if transition.verdict != Verdict::Latched || alone || transition.order.is_some() {
            return;
        }
        let Transition { detection, decided, .. } = *transition;
        for peer in &self.peers {
            let may_jump = self.rule == Rule::FirstChange && self.root_ratio.is_finite();
            let is_heard = may_jump && (peer.silent || peer.has_answered(decided));
            let knows = peer.knows(detection, decided);
            assert!(knows || is_heard, "committed without {peer:?}: {transition:?}");
        }
    }

    /// What must be true between any two events.
    fn check(&self) {
        let diagnoser = &self.bench.diagnoser;
        assert_eq!(diagnoser.waiting_questions(), self.inquiries.waiting());
        assert_eq!(diagnoser.next_sequence(), self.lives.sequence() + 1);
        for (component, verdict) in diagnoser.verdicts() {
            assert_eq!(*verdict, self.lives.verdict(component), "{component}");
        }
        self.lives.latest().for_each(|latest| self.check_doubt(latest));
    }

    /// What is due and cannot be judged because a peer is silent is marked as in doubt. A jump needs no silent peer, but
    /// waits for those that may still answer.
    fn check_doubt(&self, latest: &Transition) {
        let due = latest.detection.plus(HOLD);
        let alone = self.rule == Rule::Paper;
        let recalled = self.recalled.contains(&latest.component);
        let is_due = self.bench.diagnoser.last_step().is_some_and(|now| now >= due)
            && self.bench.diagnoser.run() == Some(latest.run);
        if alone || recalled || !is_due || latest.verdict != Verdict::Tentative {
            return;
        }
        let may_answer = |peer: &Peer| !peer.silent && !peer.has_answered(due);
        if self.root_ratio.is_finite() && self.peers.iter().any(may_answer) {
            return;
        }
        let silent = self.peers.iter().find(|peer| peer.silent && !peer.has_answered(due));
        assert!(silent.is_none(), "{latest:?} is in doubt because of {silent:?}");
    }
}

fn is_actuator(component: &Component) -> bool {
    matches!(component, Component::Actuator(_))
}
