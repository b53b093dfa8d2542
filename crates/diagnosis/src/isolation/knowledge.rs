//! What a module knows of its peers, and as of which step.

use vocabulary::{Component, ComponentPath, ModuleName, Step, delivery::Backoff};

use crate::question::{MAX_CHANGES_IN_ANSWER, PeerFailure};
use vocabulary::{Change, StateAnswer, StateQuestion};

/// No plausible value gives a larger D/γ: a gage's strain is at most a million times its noise, which makes D 10¹².
const LARGEST_RATIO: f64 = 1e15;

/// A change somewhere in the structure.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct KnownChange {
    /// The channel.
    pub path: ComponentPath,
    /// Since when its residual may have been changing.
    pub onset: Step,
    /// The step at which D rose to γ or above.
    pub step: Step,
    /// Largest D/γ from that step until the tie window was over (or until the step judged as of), less what a
    /// cylinder's demand explains of it; 1 if that is all.
    pub ratio: f64,
    /// The last step at which D was at γ or above; `None` if it went on as of the step judged as of.
    pub until: Option<Step>,
}

/// The first and the last step of a change; `None` while it goes on.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct ChangePeriod {
    pub(super) since: Step,
    pub(super) until: Option<Step>,
}

impl KnownChange {
    pub(super) fn period(&self) -> ChangePeriod {
        ChangePeriod { since: self.step, until: self.until }
    }

    /// A cylinder's, and nothing but its demand's motion? Whatever moved the demand explains it.
    pub(super) fn follows_demand(&self) -> bool {
        matches!(self.path.component, Component::Actuator(_)) && self.ratio <= 1.0
    }

    /// Is this the likelier root of two simultaneous changes? The larger ratio is; an exact draw
    /// falls to the earlier change, then to the smaller name, so that every module agrees.
    pub(crate) fn outranks(&self, other: &KnownChange) -> bool {
        (self.ratio.total_cmp(&other.ratio))
            .then_with(|| other.step.cmp(&self.step))
            .then_with(|| other.path.cmp(&self.path))
            .is_gt()
    }
}

/// One peer: what it has reported and what it has been asked.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct PeerKnowledge {
    pub(crate) name: ModuleName,
    /// Changes reported, sorted by step.
    pub(crate) changes: Vec<KnownChange>,
    pub(crate) actuator_faults: Vec<(ComponentPath, Step)>,
    /// Components of whatever kind that it has declared faulty.
    pub(crate) faults: Vec<(ComponentPath, Step)>,
    /// The components for which it raised the alarm in its latest answer, if it has given one.
    pub(crate) alarms: Option<Vec<Component>>,
    /// All is known up to this step.
    pub(crate) answered_until: Option<Step>,
    pub(crate) watching_since: Option<Step>,
    /// The first step whose changes are kept.
    kept_from: Step,
    /// The question under way.
    pub(crate) outstanding: Option<StateQuestion>,
    /// The latest question failed: not asked again before this step.
    retry: Option<Retry>,
}

#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
struct Retry {
    at: Step,
    pauses: Backoff<u64>,
}

impl PeerKnowledge {
    pub(crate) fn new(name: ModuleName) -> Self {
        Self {
            name,
            changes: Vec::new(),
            actuator_faults: Vec::new(),
            faults: Vec::new(),
            alarms: None,
            answered_until: None,
            watching_since: None,
            kept_from: Step(0),
            outstanding: None,
            retry: None,
        }
    }

    /// Does the peer raise the alarm for its component, as far as it has told?
    pub(crate) fn stands_by(&self, component: &Component) -> bool {
        self.alarms.as_ref().is_none_or(|alarms| alarms.contains(component))
    }

    /// Did the latest question fail?
    pub(crate) fn is_silent(&self) -> bool {
        self.retry.is_some()
    }

    /// Has the peer answered as of `as_of`?
    pub(crate) fn has_answered(&self, as_of: Step) -> bool {
        self.answered_until.is_some_and(|until| until >= as_of)
    }

    /// Is enough known to judge a change at `change` as of `as_of`?
    pub(crate) fn suffices(&self, change: Step, as_of: Step) -> bool {
        self.has_answered(as_of) && self.watching_since.is_some_and(|since| since <= change)
    }

    /// Has the peer answered as of `as_of`, but without having watched at `change`?
    pub(crate) fn cannot_know(&self, change: Step, as_of: Step) -> bool {
        self.has_answered(as_of) && !self.suffices(change, as_of)
    }

    /// May the peer be asked now?
    pub(crate) fn may_be_asked(&self, now: Step) -> bool {
        self.outstanding.is_none() && self.retry.is_none_or(|retry| retry.at <= now)
    }

    /// The first step that is not finally known: a ratio is final a tie after its change.
    pub(crate) fn unknown_from(&self, tie: u64) -> Step {
        self.answered_until.map_or(Step(0), |until| until.minus(tie))
    }

    /// Notes that the question failed; it may be put again after a pause, of which these are the first ones \[steps\].
    pub(crate) fn fail(&mut self, now: Step, pauses: Backoff<u64>) {
        let mut pauses = self.retry.map_or(pauses, |retry| retry.pauses);
        self.retry = Some(Retry { at: now.plus(pauses.fail()), pauses });
        self.outstanding = None;
    }

    /// The peer is back after a failure: it may be asked at once, and the backoff restarts.
    pub(crate) fn retry_now(&mut self, now: Step, mut pauses: Backoff<u64>) {
        if let Some(retry) = &mut self.retry {
            pauses.fail();
            *retry = Retry { at: now, pauses };
        }
    }

    /// Takes an answer to the outstanding question in: every change that was not over before the steps asked
    /// for.
    ///
    /// # Errors
    /// An answer that does not fit the question; nothing was taken in.
    pub(crate) fn take(
        &mut self,
        answer: StateAnswer,
        quiet_steps: u64,
    ) -> Result<(), PeerFailure> {
        self.check(&answer, quiet_steps)?;
        self.check_against_former(&answer)?;
        let StateQuestion { from, as_of, .. } = answer.question;
        let path = |component| ComponentPath { module: self.name.clone(), component };
        let reported: Vec<KnownChange> = answer
            .changes
            .into_iter()
            .map(|change| KnownChange {
                path: path(change.component),
                onset: change.onset,
                step: change.step,
                ratio: change.ratio,
                until: change.until,
            })
            .collect();
        let same = |a: &KnownChange, b: &KnownChange| a.step == b.step && a.path == b.path;
        self.changes.retain(|known| known.step < from && !reported.iter().any(|c| same(c, known)));
        self.changes.extend(reported);
        self.changes.sort_by(|a, b| a.step.cmp(&b.step).then_with(|| a.path.cmp(&b.path)));
        self.actuator_faults = (answer.actuator_faults.into_iter())
            .map(|fault| (path(Component::Actuator(fault.actuator)), fault.step))
            .collect();
        self.faults = (answer.alarms.iter().filter(|alarm| alarm.faulty))
            .map(|alarm| (path(alarm.component.clone()), alarm.step))
            .collect();
        self.alarms = Some(answer.alarms.into_iter().map(|alarm| alarm.component).collect());
        self.answered_until = Some(as_of);
        self.watching_since = answer.watching_since;
        self.outstanding = None;
        self.retry = None;
        Ok(())
    }

    /// Forgets the changes up to a step.
    pub(crate) fn forget_until(&mut self, step: Step) {
        self.changes.retain(|change| change.step > step);
        self.kept_from = step.plus(1);
    }

    /// As of a step that it has answered for, no change can be added, unless it was not watching then.
    fn check_against_former(&self, answer: &StateAnswer) -> Result<(), PeerFailure> {
        let (Some(until), Some(watching)) = (self.answered_until, answer.watching_since) else {
            return Ok(());
        };
        let known = |change: &Change| {
            let same =
                |k: &KnownChange| k.step == change.step && k.path.component == change.component;
            self.changes.iter().any(same)
        };
        let could_be_known = watching.max(self.kept_from)..=until;
        let mut in_time = answer.changes.iter().filter(|c| could_be_known.contains(&c.step));
        match in_time.find(|change| !known(change)) {
            None => Ok(()),
            Some(change) => Err(PeerFailure::Malformed(format!(
                "{} changed at step {}, but there was no such change in its answer as of step {until}",
                change.component, change.step
            ))),
        }
    }

    fn check(&self, answer: &StateAnswer, quiet_steps: u64) -> Result<(), PeerFailure> {
        let malformed = |what: &str| Err(PeerFailure::Malformed(what.to_string()));
        let StateQuestion { from, as_of, .. } = answer.question;
        if answer.changes.len() > MAX_CHANGES_IN_ANSWER {
            return malformed("too many changes");
        }
        if answer.actuator_faults.len() > MAX_CHANGES_IN_ANSWER {
            return malformed("too many actuator faults");
        }
        if answer.changes.iter().any(|change| change.step > as_of) {
            return malformed("a change after the step asked for");
        }
        if answer.changes.iter().any(|change| change.onset > change.step) {
            return malformed("a change that shows before it begins");
        }
        let is_over = |until: Step| until.plus(quiet_steps) <= from;
        if answer.changes.iter().any(|change| change.until.is_some_and(is_over)) {
            return malformed("a change that was over before the steps asked for");
        }
        let ends = |change: &Change, until| (change.step..=as_of).contains(&until);
        if answer.changes.iter().any(|c| c.until.is_some_and(|until| !ends(c, until))) {
            return malformed("a change that ends before it begins, or after the step asked for");
        }
        if answer.changes.iter().any(|change| change.ratio.is_nan() || change.ratio < 1.0) {
            return malformed("a change below its threshold");
        }
        if answer.changes.iter().any(|change| change.ratio > LARGEST_RATIO) {
            return malformed("a change larger than any can be");
        }
        if answer.alarms.len() > MAX_CHANGES_IN_ANSWER {
            return malformed("too many alarms");
        }
        if answer.pending.len() > MAX_CHANGES_IN_ANSWER {
            return malformed("too many changes that are not judged");
        }
        if answer.alarms.iter().any(|alarm| alarm.step > as_of) {
            return malformed("an alarm after the step asked for");
        }
        if answer.actuator_faults.iter().any(|fault| fault.step > as_of) {
            return malformed("an actuator fault after the step asked for");
        }
        Ok(())
    }
}
