//! From changes to numbered transitions: cases, what peers know of them, judgements, verdicts.

use std::collections::BTreeMap;

use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::change::LoggedChange;
use crate::channels::{Channels, Occurrence};
use crate::event::Action;
use crate::isolation::{Case, Finding, Isolator, Judgement, Word};
use crate::ledger::{Departure, Ledger};
use crate::memory::PastWatch;
use crate::question::{Answer, Question};
use crate::settings::ModuleSetup;
use crate::verdict::Transition;
use vocabulary::{Change, Counters, Doubt, Verdict};

/// The open cases of a module and the verdicts on its components.
#[derive(Debug, Clone)]
pub(crate) struct Judging {
    module: ModuleName,
    isolator: Isolator,
    ledger: Ledger,
    /// There is a reference: what was explained is closed once it agrees with that.
    has_reference: bool,
}

impl Judging {
    pub(crate) fn new(setup: &ModuleSetup, components: &[Component]) -> Self {
        Self {
            isolator: Isolator::new(setup, components.to_vec()),
            ledger: Ledger::new(components),
            module: setup.module.clone(),
            has_reference: setup.reference.is_some(),
        }
    }

    pub(crate) fn isolator(&self) -> &Isolator {
        &self.isolator
    }

    pub(crate) fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    pub(crate) fn ledger_mut(&mut self) -> &mut Ledger {
        &mut self.ledger
    }

    /// A component was reset: its open cases are dropped.
    pub(crate) fn drop_cases(&mut self, channel: usize) {
        self.isolator.drop_cases(channel);
    }

    /// Takes up the verdicts from before a restart.
    pub(crate) fn recall_verdicts(&mut self, sequence: u64, latest: Vec<Transition>) {
        self.ledger.recall(sequence, latest);
    }

    /// Takes up the changes from before a restart. Those that were not judged are judged after it.
    pub(crate) fn recall_changes(&mut self, past: &PastWatch, channels: &Channels) {
        let watched_until = past.watched.map_or(Step(0), |(_, until)| until);
        let mut known = BTreeMap::new();
        for change in &past.changes {
            let Some(channel) = channels.position(&change.component) else { continue };
            let recalled = LoggedChange::recalled(channel, change, watched_until);
            known.insert((change.step, channel), recalled);
        }
        self.isolator.recall_changes(known.into_values());
        for (channel, component) in channels.components().iter().enumerate() {
            let Some(latest) = self.ledger.latest(component) else { continue };
            if latest.is_of(past.run)
                && let Verdict::Explained { by, since } = &latest.verdict
            {
                self.isolator.recall_claim(channel, latest, by, *since);
            }
            let open = matches!(
                latest.verdict,
                Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) }
            );
            if !open || !latest.is_of(past.run) {
                continue;
            }
            self.isolator.recall_case(channel, latest);
            let (step, ratio) = (latest.detection, latest.evidence.ratio());
            if !self.isolator.merge_repeat(channel, step, ratio) {
                self.isolator.recall_changes([LoggedChange::new(
                    channel,
                    latest.onset,
                    step,
                    ratio,
                )]);
            }
        }
    }

    /// Forgets what belongs to a run that ended at `last`; what is latched stays.
    pub(crate) fn end_run(&mut self, channels: usize, last: Step, actions: &mut Vec<Action>) {
        self.isolator.restart();
        for channel in 0..channels {
            actions.extend(self.ledger.end_run(channel, last).map(Action::Publish));
        }
    }

    /// Takes what a channel did at a step.
    pub(crate) fn note(
        &mut self,
        (channel, occurrence): (usize, Occurrence),
        (run, step): (RunId, Step),
        channels: &Channels,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        let component = &channels.components()[channel];
        let evidence = channels.evidence()[channel];
        match occurrence {
            Occurrence::Restarted(violation) => {
                counters.restarts += 1;
                actions.push(Action::Restarted { component: component.clone(), violation });
            }
            // What is known to be faulty has been repaired, or is back. Of what is not, the divergence tells.
            Occurrence::Shifted { .. } if !self.ledger.verdict(channel).is_latched() => {}
            Occurrence::Changed { .. } | Occurrence::Shifted { .. }
                if self.isolator.merge_repeat(channel, step, channels.excess(channel)) => {}
            Occurrence::Changed { onset } | Occurrence::Shifted { onset } => {
                counters.changes += 1;
                // Whatever the verdict on an earlier change will be, this one is judged too: the
                // outcome must not depend on when a peer's answer comes.
                let judge = !self.ledger.verdict(channel).is_latched();
                let of_gap = channels.may_come_of_gap(channel);
                let excess = channels.excess(channel).max(1.0);
                self.isolator.change((channel, onset, excess), evidence, judge, of_gap);
                counters.changes_unjudged = self.isolator.unjudged();
                let component = component.clone();
                let change = Change { component, onset, step, ratio: excess, until: None };
                actions.push(Action::Report { run, change, evidence });
            }
            Occurrence::SignalLost { signal, since } => {
                self.isolator.drop_cases(channel);
                let component = component.clone();
                actions.push(Action::SignalLost { component, signal, since });
                let lost = self.ledger.lose_signal(run, channel, since, evidence);
                actions.extend(lost.map(Action::Publish));
            }
            Occurrence::Quiet => {
                let explained = matches!(self.ledger.verdict(channel), Verdict::Explained { .. });
                if explained && !self.has_reference && !self.isolator.rests_on_a_word(channel) {
                    actions.extend(self.ledger.clear(channel, step).map(Action::Publish));
                }
            }
        }
    }

    /// Follows the changes that are still rising, or going on. Their final ratios and ends are to be stored.
    pub(crate) fn follow(
        &mut self,
        (run, step): (RunId, Step),
        channels: &Channels,
        actions: &mut Vec<Action>,
    ) {
        // What a channel shows while it warms up is no change, and not the size of one either.
        self.isolator.follow(step, |channel| match channels.monitor(channel).is_watched() {
            true => channels.excess(channel),
            false => 0.0,
        });
        for channel in 0..channels.components().len() {
            if channels.monitor(channel).changed_until() == Some(step) {
                self.isolator.prolong(channel, step, channels.excess(channel));
            }
        }
        let of = |change: &LoggedChange, until| Change {
            component: channels.components()[change.channel].clone(),
            onset: change.onset,
            step: change.step,
            ratio: change.ratio_as_of(step),
            until,
        };
        while let Some(settled) = self.isolator.settle(step) {
            actions.push(Action::Settled { run, change: of(settled, None) });
        }
        while let Some((ended, until)) = self.isolator.end(step) {
            actions.push(Action::Settled { run, change: of(ended, Some(until)) });
        }
    }

    /// Changes → judgements → transitions, and questions where something is not known.
    pub(crate) fn judge(
        &mut self,
        (run, now): (RunId, Step),
        channels: &Channels,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        if self.isolator.is_idle(now) {
            return;
        }
        let faulty: Vec<_> = (self.ledger.faulty(&self.module, run))
            .map(|(path, since)| (path, since.change))
            .collect();
        for (case, finding) in self.isolator.findings(now, faulty, channels.coverage()) {
            self.enter(run, &case, finding, now, channels, actions);
        }
        for case in self.isolator.new_cases() {
            let tentative = self.ledger.enter(run, &case, Verdict::Tentative, now);
            actions.extend(tentative.map(Action::Publish));
        }
        for (peer, question) in self.isolator.questions(run, now) {
            counters.questions_asked += 1;
            actions.push(Action::Ask { peer, question });
        }
    }

    fn enter(
        &mut self,
        run: RunId,
        case: &Case,
        finding: Finding,
        now: Step,
        channels: &Channels,
        actions: &mut Vec<Action>,
    ) {
        let (verdict, decided) = match finding {
            // What nobody could judge is back, or leaves the interval: that tells no more than it did.
            Finding::Judged(Judgement::Again)
                if self.ledger.verdict(case.channel).is_undecidable() =>
            {
                return;
            }
            Finding::Judged(Judgement::Root | Judgement::First | Judgement::Again) => {
                match channels.assumes_force_of(case.channel) {
                    Some(actuator) => {
                        let component = actuator.clone();
                        let assumed = ComponentPath { module: self.module.clone(), component };
                        (Verdict::Unconfirmed { doubt: Doubt::Assumed(assumed) }, now)
                    }
                    None => (Verdict::Latched, case.decide_at),
                }
            }
            Finding::Judged(Judgement::Explained { by, since }) => {
                (Verdict::Explained { by, since }, case.decide_at)
            }
            Finding::Silent(silent) => (Verdict::Unconfirmed { doubt: Doubt::Silent(silent) }, now),
            Finding::Unknowing(modules) => {
                (Verdict::Unconfirmed { doubt: Doubt::Unknowing(modules) }, now)
            }
        };
        if let Verdict::Explained { by, since } = &verdict {
            self.isolator.rest_on(case, by, *since);
        }
        actions.extend(self.ledger.enter(run, case, verdict, decided).map(Action::Publish));
        self.acquit(now, actions);
        if !self.has_reference {
            self.close_explained(case.channel, now, channels, actions);
        }
    }

    /// Suspects beside one that has been declared faulty are none any more.
    fn acquit(&mut self, now: Step, actions: &mut Vec<Action>) {
        if self.has_reference {
            actions.extend(self.ledger.acquit(&self.module, now).into_iter().map(Action::Publish));
        }
    }

    /// Is a departure by this step that of a suspect that has been declared faulty since before?
    pub(crate) fn is_accounted_for(&self, by: (RunId, Step), suspects: &[ComponentPath]) -> bool {
        self.ledger.is_accounted_for(by, suspects, &self.module)
    }

    /// Does a change of this channel wait for its judgement?
    pub(crate) fn is_open(&self, channel: usize) -> bool {
        matches!(
            self.ledger.verdict(channel),
            Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) }
        )
    }

    /// A component, or one of several, has departed from its reference.
    pub(crate) fn depart(
        &mut self,
        (run, channel): (RunId, usize),
        verdict: Verdict,
        departure: Departure,
        actions: &mut Vec<Action>,
    ) {
        if self.ledger.verdict(channel).is_latched() {
            return;
        }
        if verdict == Verdict::Latched {
            self.isolator.drop_cases(channel);
        }
        let now = departure.evidence.step;
        let departed = self.ledger.depart(run, channel, verdict, departure);
        actions.extend(departed.map(Action::Publish));
        self.acquit(now, actions);
    }

    /// An explained change that is over leaves nothing, once nobody's word is needed for that.
    pub(crate) fn close_explained(
        &mut self,
        channel: usize,
        now: Step,
        channels: &Channels,
        actions: &mut Vec<Action>,
    ) {
        let explained = matches!(self.ledger.verdict(channel), Verdict::Explained { .. });
        let is_over = !channels.monitor(channel).is_active();
        if explained && is_over && !self.isolator.rests_on_a_word(channel) {
            actions.extend(self.ledger.clear(channel, now).map(Action::Publish));
        }
    }

    /// Takes a peer's answer.
    pub(crate) fn answered(
        &mut self,
        (peer, answer): (&ModuleName, Answer),
        (run, now): (RunId, Step),
        channels: &Channels,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        let as_of = answer.question.as_of;
        match self.isolator.answered(peer, answer, now) {
            Ok(words) => {
                for (case, word) in words {
                    self.take_word(&case, word, (run, as_of), channels, counters, actions);
                }
            }
            Err(failure) => {
                counters.answers_malformed += 1;
                actions.push(Action::AnswerRejected { peer: peer.clone(), failure });
            }
        }
    }

    /// A peer stands by what explains a case, or does not.
    fn take_word(
        &mut self,
        case: &Case,
        word: Word,
        (run, as_of): (RunId, Step),
        channels: &Channels,
        counters: &mut Counters,
        actions: &mut Vec<Action>,
    ) {
        let transition = match word {
            Word::Kept => None,
            Word::Broken(by) => {
                counters.verdicts_disputed += 1;
                let component = channels.components()[case.channel].clone();
                actions.push(Action::WordBroken { component, by: by.clone() });
                self.ledger.dispute(run, case, by, as_of)
            }
            Word::Forgotten(peer) => {
                let doubt = Doubt::Unknowing(vec![peer]);
                self.ledger.enter(run, case, Verdict::Unconfirmed { doubt }, as_of)
            }
        };
        actions.extend(transition.map(Action::Publish));
        self.acquit(as_of, actions);
        if !self.has_reference {
            self.close_explained(case.channel, as_of, channels, actions);
        }
    }

    /// A peer did not answer; was the question still open?
    pub(crate) fn unanswered(
        &mut self,
        peer: &ModuleName,
        question: Question,
        now: Step,
        counters: &mut Counters,
    ) -> bool {
        let open = self.isolator.unanswered(peer, question, now);
        counters.questions_unanswered += u64::from(open);
        open
    }

    /// A peer that was gone is back.
    pub(crate) fn returned(&mut self, peer: &ModuleName, now: Step) {
        self.isolator.returned(peer, now);
    }
}
