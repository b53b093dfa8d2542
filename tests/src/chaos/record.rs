//! What the witness has seen so far.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use ::observer::News;
use vocabulary::{
    ComponentPath, FaultTransition, ModuleName, ModulePhase, ModuleStatus, Progress, RunId, Step,
};

use super::judgement::{Judgement, Seen, judge};
use crate::deployment::MODULES;
use crate::held::Held;
use crate::timeline::Timeline;

/// What is undecided for longer must be reported as such \[the module's own steps\].
const UNDECIDED_LIMIT: u64 = 1000;
/// From the deciding sample to a reply that states it, with room for the rounds of progress and for a busy machine
/// \[steps\].
const SLACK: u64 = 500;
/// How far behind the plant a module may be \[steps\].
const LAG: u64 = 500;

/// A module's reported status.
#[derive(Debug, Clone, Default)]
pub(super) struct Standing {
    pub(super) status: Option<ModuleStatus>,
    /// The latest step of the present run that it has processed.
    pub(super) step: Step,
    /// When it last reported progress.
    heard: Option<Instant>,
    /// The longest time without reported progress.
    pub(super) longest_standstill: Duration,
}

impl Standing {
    fn come_further(&mut self) {
        let now = Instant::now();
        let standstill = self.heard.replace(now).map_or(Duration::ZERO, |last| now - last);
        self.longest_standstill = self.longest_standstill.max(standstill);
    }
}

/// Everything seen in a row.
#[derive(Debug)]
pub(super) struct Record {
    timeline: Timeline,
    run: RunId,
    /// Latched in an earlier run.
    carried: BTreeSet<ComponentPath>,
    pub(super) standings: BTreeMap<ModuleName, Standing>,
    /// Verdicts that were reached, by any message.
    reached: BTreeSet<(ComponentPath, Held)>,
    /// Since which step of its module a component is behind without a report.
    behind: BTreeMap<ComponentPath, Step>,
    /// Violations.
    pub(super) wrong: BTreeSet<String>,
    /// Components that were unconfirmed at some time.
    pub(super) unconfirmed: BTreeSet<ComponentPath>,
}

impl Record {
    pub(super) fn against(timeline: Timeline, run: RunId) -> Self {
        Self {
            timeline,
            run,
            carried: BTreeSet::new(),
            standings: BTreeMap::new(),
            reached: BTreeSet::new(),
            behind: BTreeMap::new(),
            wrong: BTreeSet::new(),
            unconfirmed: BTreeSet::new(),
        }
    }

    /// What the undisturbed run finds.
    pub(super) fn expected(&self) -> String {
        let (latched, explained): (Vec<_>, Vec<_>) = self
            .timeline
            .verdicts_until(Step(u64::MAX))
            .partition(|(_, held)| matches!(held, Held::Latched));
        let names: Vec<String> = latched.iter().map(|(name, _)| name.to_string()).collect();
        match explained.len() {
            0 => names.join(", "),
            count => format!("{}; {count} explained", names.join(", ")),
        }
    }

    /// A new run begins: what is latched stays, everything else is found again.
    pub(super) fn begin_run(&mut self, run: RunId) {
        self.run = run;
        let latched = self.reached.iter().filter(|(_, held)| *held == Held::Latched);
        self.carried = latched.map(|(component, _)| component.clone()).collect();
        self.reached.clear();
        self.behind.clear();
        for standing in self.standings.values_mut() {
            standing.step = Step(0);
        }
    }

    /// How far a module has come. After a restart it takes samples from before once more, and knows what it found by then.
    pub(super) fn note_progress(&mut self, module: ModuleName, progress: Progress) {
        let standing = self.standings.entry(module).or_default();
        if progress.run == self.run && progress.step > standing.step {
            standing.come_further();
            standing.step = progress.step;
        }
    }

    /// How a module is.
    pub(super) fn note_status(&mut self, status: ModuleStatus) {
        let standing = self.standings.entry(status.module.clone()).or_default();
        standing.status = Some(status);
    }

    /// A transition that was published.
    pub(super) fn note_transition(&mut self, message: &FaultTransition) {
        let seen = Seen::of_message(message);
        self.note_reached(&seen);
        // Whenever it was found, it must be true at some time.
        if let Judgement::Wrong(what) =
            judge(&seen, Step(0)..=Step(u64::MAX), &self.timeline, &self.carried)
        {
            self.wrong.insert(what);
        }
    }

    /// Transitions that a subscriber never got.
    pub(super) fn note_missed(&mut self, news: &News) {
        self.wrong.insert(format!("{news:?}"));
    }

    fn note_reached(&mut self, seen: &Seen) {
        match seen.held {
            Held::Latched | Held::Explained(_) => {
                self.reached.insert((seen.component.clone(), seen.held.clone()));
            }
            Held::Unconfirmed => {
                self.unconfirmed.insert(seen.component.clone());
            }
            Held::Normal | Held::Tentative => {}
        }
    }

    /// A state that was asked for when the module's latest step was known to be `since`.
    pub(super) fn note_state(&mut self, message: &FaultTransition, since: Step) {
        let seen = Seen::of_message(message);
        self.note_reached(&seen);
        match self.judged(&seen, since) {
            Judgement::Wrong(what) => {
                self.wrong.insert(what);
            }
            Judgement::Behind if self.is_in_service(&message.module) => self.note_behind(seen),
            _ => {
                self.behind.remove(&seen.component);
            }
        }
    }

    fn note_behind(&mut self, seen: Seen) {
        let now = self.step_of(&seen.component.module);
        let since = *self.behind.entry(seen.component.clone()).or_insert(now);
        if now.since(since) > UNDECIDED_LIMIT {
            let Seen { component, held, .. } = seen;
            self.wrong.insert(format!("{component} {held} for over {UNDECIDED_LIMIT} steps"));
        }
    }

    fn judged(&self, seen: &Seen, since: Step) -> Judgement {
        let now = self.step_of(&seen.component.module);
        judge(seen, since.minus(SLACK)..=now.max(since).plus(SLACK), &self.timeline, &self.carried)
    }

    fn step_of(&self, module: &ModuleName) -> Step {
        self.standings.get(module).map_or(Step(0), |standing| standing.step)
    }

    fn is_in_service(&self, module: &ModuleName) -> bool {
        let status = self.standings.get(module).and_then(|standing| standing.status.as_ref());
        status.is_some_and(|status| status.phase == ModulePhase::InService)
    }

    /// How the states that were just asked for differ from those of the undisturbed run at the plant's
    /// step, and which of its verdicts were never reached.
    pub(super) fn differences(&self, states: &[(FaultTransition, Step)], now: Step) -> Vec<String> {
        let mut differences: Vec<String> = self.absent(states, now).collect();
        for (message, since) in states {
            let seen = Seen::of_message(message);
            if self.judged(&seen, *since) != Judgement::Agrees {
                differences.push(format!("{} {}", seen.component, seen.held));
            }
        }
        for (component, held) in self.timeline.verdicts_until(now.minus(LAG)) {
            let verdict = (component.clone(), held.clone());
            if !self.carried.contains(component) && !self.reached.contains(&verdict) {
                differences.push(format!("{component} never {held}"));
            }
        }
        differences
    }

    /// Modules that do not answer or are not where the plant is.
    fn absent<'a>(
        &'a self,
        states: &'a [(FaultTransition, Step)],
        now: Step,
    ) -> impl Iterator<Item = String> + 'a {
        MODULES.into_iter().filter_map(move |name| {
            let answers = states.iter().any(|(message, _)| message.module.as_str() == name);
            let module = name.parse().unwrap();
            let step = self.step_of(&module);
            match answers {
                false => Some(format!("{name} does not answer")),
                true if step < now.minus(LAG) => Some(format!("{name} at step {step} of {now}")),
                true => None,
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::Verdict;

    #[test]
    fn a_verdict_from_before_a_restart_is_true_while_older_samples_are_taken_again() {
        let gage: ComponentPath = "module2/sensor/g1".parse().unwrap();
        let mut timeline = Timeline::default();
        timeline.note(gage.clone(), Step(3040), Held::Latched);
        let mut record = Record::against(timeline, RunId(1));
        let module = gage.module.clone();
        let waiting = ModuleStatus::waiting("tower".parse().unwrap(), module.clone());
        record.note_status(ModuleStatus { phase: ModulePhase::InService, ..waiting });
        let untouched = FaultTransition::untouched("tower".parse().unwrap(), gage, 0);
        let state = FaultTransition { verdict: Verdict::Latched, ..untouched };
        for step in [3100, 500, 1200, 2000, 2900, 3100, 4000] {
            let progress = Progress { run: RunId(1), step: Step(step) };
            record.note_progress(module.clone(), progress);
            let since = record.standings[&module].step;
            record.note_state(&state, since);
        }
        assert_eq!(record.wrong, BTreeSet::new());
    }
}
