//! From changes to numbered transitions: cases, what peers know of them, judgements, verdicts.

use std::collections::BTreeMap;

use vocabulary::{Component, Step};

use crate::change::LoggedChange;
use crate::channels::{Channels, Occurrence};
use crate::event::{Action, Handling};
use crate::isolation::{Case, Finding, Isolator, Judgement, Word};
use crate::ledger::{Detection, Ledger, is_open};
use crate::settings::ModuleSetup;
use vocabulary::{Change, Doubt, PastWatch, StateAnswer, Symptom, Verdict};

/// The open cases of a module and the verdicts on its components.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Judging {
    pub(crate) isolator: Isolator,
    pub(crate) ledger: Ledger,
    /// There is a reference: what was explained is closed once it agrees with that.
    has_reference: bool,
}

impl Judging {
    pub(crate) fn new(setup: &ModuleSetup, components: &[Component]) -> Self {
        Self {
            isolator: Isolator::new(setup, components.to_vec()),
            ledger: Ledger::new(setup.module.clone(), components),
            has_reference: setup.reference.is_some() || setup.learned.is_some(),
        }
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
        self.isolator.log.recall(known.into_values());
        for (channel, component) in channels.components().iter().enumerate() {
            let latest = self.ledger.latest(component).filter(|latest| latest.is_of(past.run));
            let Some(latest) = latest else { continue };
            let case = self.isolator.recalled_case(channel, latest);
            if let Verdict::Explained { by, since } = &latest.verdict {
                self.isolator.rest_on(&case, by, *since);
            }
            if !is_open(&latest.verdict) {
                continue;
            }
            self.isolator.cases.push(case);
            let (step, ratio) = (latest.detection, latest.evidence.ratio());
            if !self.isolator.log.merge_repeat(channel, step, ratio) {
                let change = LoggedChange::new(channel, latest.onset, step, ratio);
                self.isolator.log.recall([change]);
            }
        }
    }

    /// Takes what a channel did at a step.
    pub(crate) fn note(
        &mut self,
        channel: usize,
        occurrence: Occurrence,
        handling: &mut Handling<'_>,
    ) {
        let Handling { run, now: step, channels, .. } = *handling;
        let component = &channels.components()[channel];
        let evidence = channels.evidence()[channel];
        match occurrence {
            Occurrence::Restarted(violation) => {
                handling.counters.restarts += 1;
                let component = component.clone();
                handling.actions.push(Action::Restarted { component, violation });
            }
            // What is known to be faulty has been repaired, or is back. Of what is not, the divergence tells.
            Occurrence::Shifted { .. } if !self.ledger.verdict(channel).is_latched() => {}
            Occurrence::Changed { .. } | Occurrence::Shifted { .. }
                if self.isolator.log.merge_repeat(channel, step, channels.excess(channel)) => {}
            Occurrence::Changed { onset } | Occurrence::Shifted { onset } => {
                handling.counters.changes += 1;
                // Whatever the verdict on an earlier change will be, this one is judged too: the
                // outcome must not depend on when a peer's answer comes.
                let judge = !self.ledger.verdict(channel).is_latched();
                let of_gap = channels.may_come_of_gap(channel);
                let excess = channels.excess(channel).max(1.0);
                self.isolator.change((channel, onset, excess), evidence, judge, of_gap);
                handling.counters.changes_unjudged = self.isolator.given_up;
                let component = component.clone();
                let change = Change { component, onset, step, ratio: excess, until: None };
                handling.actions.push(Action::Report { run, change, evidence });
            }
            Occurrence::SignalLost { signal, since } => {
                self.isolator.drop_cases(channel);
                let component = component.clone();
                handling.actions.push(Action::SignalLost { component, signal, since });
                let found = Detection::new(Symptom::NoSignal, since, evidence);
                let lost = self.ledger.record(run, channel, Verdict::Latched, step, found);
                handling.publish(lost);
            }
            Occurrence::Departed { onset, before_service } => {
                let found = Detection::new(Symptom::Reading, onset, evidence);
                let found = Detection { before_service, ..found };
                self.depart(channel, Verdict::Latched, found, handling);
            }
            Occurrence::Quiet if !self.has_reference => {
                self.close_explained(channel, step, handling);
            }
            Occurrence::Quiet => {}
        }
    }

    /// Follows the changes that are still rising, or going on. Their final ratios and ends are to be stored.
    pub(crate) fn follow(&mut self, handling: &mut Handling<'_>) {
        let Handling { run, now: step, channels, .. } = *handling;
        let log = &mut self.isolator.log;
        // During warm-up a channel's divergence counts neither as a change nor as the size of one.
        log.follow(step, |channel| match channels.monitor(channel).is_watched() {
            true => channels.excess(channel),
            false => 0.0,
        });
        for channel in 0..channels.components().len() {
            if channels.monitor(channel).changed_until() == Some(step) {
                log.prolong(channel, step, channels.excess(channel));
            }
        }
        let of = |change: &LoggedChange, until| change.as_of(step, until, channels.components());
        while let Some(settled) = log.settle(step) {
            handling.actions.push(Action::Settled { run, change: of(settled, None) });
        }
        while let Some((ended, until)) = log.end(step) {
            handling.actions.push(Action::Settled { run, change: of(ended, Some(until)) });
        }
    }

    /// Changes → judgements → transitions, and questions where something is not known.
    pub(crate) fn judge(&mut self, handling: &mut Handling<'_>) {
        let Handling { run, now, channels, .. } = *handling;
        if self.isolator.is_idle(now) {
            return;
        }
        let faulty = self.ledger.faulty(run).map(|(path, since)| (path, since.change)).collect();
        for (case, finding) in self.isolator.findings(now, faulty, channels.coverage()) {
            self.enter(&case, finding, handling);
        }
        for case in self.isolator.cases.iter_mut().filter(|case| case.new) {
            case.new = false;
            let (tentative, found) = (Verdict::Tentative, Detection::of(case));
            handling.publish(self.ledger.record(run, case.channel, tentative, now, found));
        }
        for (peer, question) in self.isolator.questions(run, now) {
            handling.counters.questions_asked += 1;
            handling.actions.push(Action::Ask { peer, question });
        }
    }

    fn enter(&mut self, case: &Case, finding: Finding, handling: &mut Handling<'_>) {
        let Handling { run, now, channels, .. } = *handling;
        let (verdict, decided) = match finding {
            // A change that could not be judged recurs or leaves the interval, which adds no information.
            Finding::Judged(Judgement::Again)
                if self.ledger.verdict(case.channel).is_undecidable() =>
            {
                return;
            }
            Finding::Judged(Judgement::Root | Judgement::First | Judgement::Again) => {
                match channels.assumes_force_of(case.channel) {
                    Some(actuator) => {
                        let assumed = self.isolator.path(actuator);
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
        let found = Detection::of(case);
        handling.publish(self.ledger.record(run, case.channel, verdict, decided, found));
        self.close_after(case.channel, now, handling);
    }

    /// Acts on a verdict as of a step: acquits suspects beside a component declared faulty, and closes explained
    /// changes that have ended.
    fn close_after(&mut self, channel: usize, as_of: Step, handling: &mut Handling<'_>) {
        if self.has_reference {
            handling.publish(self.ledger.acquit(as_of));
        } else {
            self.close_explained(channel, as_of, handling);
        }
    }

    /// A component, or one of several, has departed from its reference.
    pub(crate) fn depart(
        &mut self,
        channel: usize,
        verdict: Verdict,
        departure: Detection,
        handling: &mut Handling<'_>,
    ) {
        if self.ledger.verdict(channel).is_latched() {
            return;
        }
        if verdict == Verdict::Latched {
            self.isolator.drop_cases(channel);
        }
        let decided = departure.detection;
        let departed = self.ledger.record(handling.run, channel, verdict, decided, departure);
        handling.publish(departed);
        handling.publish(self.ledger.acquit(decided));
    }

    /// Closes an explained change that has ended, once that does not depend on a peer's confirmation.
    pub(crate) fn close_explained(
        &mut self,
        channel: usize,
        as_of: Step,
        handling: &mut Handling<'_>,
    ) {
        let explained = matches!(self.ledger.verdict(channel), Verdict::Explained { .. });
        let is_over = !handling.channels.monitor(channel).is_active();
        if explained && is_over && !self.isolator.claims.are_open(channel) {
            handling.publish(self.ledger.clear(channel, as_of));
        }
    }

    /// Takes a peer's answer.
    pub(crate) fn answered(&mut self, answer: StateAnswer, handling: &mut Handling<'_>) {
        let (peer, as_of) = (answer.module.clone(), answer.question.as_of);
        match self.isolator.answered(answer, handling.now) {
            Ok(words) => {
                for (case, word) in words {
                    self.take_word(&case, word, as_of, handling);
                }
            }
            Err(failure) => {
                handling.counters.answers_malformed += 1;
                handling.actions.push(Action::AnswerRejected { peer, failure });
            }
        }
    }

    /// A peer stands by what explains a case, or does not.
    fn take_word(&mut self, case: &Case, word: Word, as_of: Step, handling: &mut Handling<'_>) {
        let mut found = Detection::of(case);
        let verdict = match word {
            Word::Kept => None,
            Word::Broken(by) => {
                handling.counters.verdicts_disputed += 1;
                let component = handling.channels.components()[case.channel].clone();
                handling.actions.push(Action::WordBroken { component, by: by.clone() });
                found.disputed = Some(by);
                Some(Verdict::Latched)
            }
            Word::Forgotten(peer) => {
                Some(Verdict::Unconfirmed { doubt: Doubt::Unknowing(vec![peer]) })
            }
        };
        if let Some(verdict) = verdict {
            let run = handling.run;
            handling.publish(self.ledger.record(run, case.channel, verdict, as_of, found));
        }
        self.close_after(case.channel, as_of, handling);
    }
}
