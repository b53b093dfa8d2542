//! The verdicts on a module's components and their numbered transitions.

use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::isolation::Case;
use crate::order::OrderRefusal;
use crate::shelving::set_aside;
use crate::verdict::Transition;
use vocabulary::{Alarm, Doubt, Evidence, GivenOrder, Symptom, Verdict};

/// The verdict on one component.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct ComponentVerdict {
    component: Component,
    verdict: Verdict,
    latest: Option<Transition>,
    /// The change with which the component became open or faulty. A later finding about it does not move this.
    since: Option<(RunId, Step)>,
    /// The number of the latest transition that was about the verdict.
    judged: u64,
    tare: Option<f64>,
}

/// When a fault began, in steps of one run.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FaultySince {
    /// The step of the change that named it.
    pub(crate) change: Step,
    /// The step that it was found at.
    pub(crate) found: Step,
}

impl FaultySince {
    fn of(latest: &Transition, run: RunId) -> Self {
        if !latest.is_of(run) {
            // It came with an earlier run, whose steps mean nothing here.
            return Self { change: Step(0), found: Step(0) };
        }
        let change = latest.detection;
        // A command that left it faulty was issued later than it was found.
        let found = if latest.command().is_some() { change } else { latest.decided };
        Self { change, found }
    }
}

/// What a verdict is about.
#[derive(Debug, Clone)]
pub(crate) struct Detection {
    pub(crate) symptom: Symptom,
    pub(crate) onset: Step,
    pub(crate) detection: Step,
    pub(crate) evidence: Evidence,
    pub(crate) before_service: bool,
    /// This was said to explain it, and its module does not stand by that.
    pub(crate) disputed: Option<ComponentPath>,
}

impl Detection {
    /// What is found at the step of the evidence.
    pub(crate) fn new(symptom: Symptom, onset: Step, evidence: Evidence) -> Self {
        let detection = evidence.step;
        Self { symptom, onset, detection, evidence, before_service: false, disputed: None }
    }

    /// The change of a case.
    pub(crate) fn of(case: &Case) -> Self {
        Self { detection: case.change, ..Self::new(Symptom::Change, case.onset, case.evidence) }
    }
}

impl ComponentVerdict {
    /// Takes a transition that is about the verdict for the present one.
    fn enter(&mut self, transition: Transition) {
        let Transition { run, detection, sequence, tare, .. } = transition;
        self.since = match transition.verdict {
            Verdict::Normal | Verdict::Explained { .. } => None,
            _ => self.since.filter(|(since, _)| *since == run).or(Some((run, detection))),
        };
        self.verdict = transition.verdict.clone();
        (self.judged, self.tare) = (sequence, tare);
        self.latest = Some(transition);
    }

    /// A transition without an order. The alarm stays shelved or suppressed.
    fn transition(
        &self,
        (sequence, run): (u64, RunId),
        verdict: Verdict,
        decided: Step,
        found: Detection,
    ) -> Transition {
        let Detection { symptom, onset, detection, evidence, before_service, disputed } = found;
        Transition {
            sequence,
            run,
            run_ended: false,
            component: self.component.clone(),
            verdict,
            symptom,
            onset,
            detection,
            decided,
            evidence,
            before_service,
            disputed,
            tare: self.tare,
            order: None,
            verdict_order: None,
            shelved: self.latest.as_ref().and_then(|latest| latest.shelved.clone()),
            suppressed: self.latest.as_ref().and_then(|latest| latest.suppressed.clone()),
            shut_off: self.latest.as_ref().and_then(|latest| latest.shut_off.clone()),
        }
    }
}

/// All verdicts of a module.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Ledger {
    module: ModuleName,
    entries: Vec<ComponentVerdict>,
    sequence: u64,
}

impl Ledger {
    pub(crate) fn new(module: ModuleName, components: &[Component]) -> Self {
        let entry = |component: &Component| ComponentVerdict {
            component: component.clone(),
            verdict: Verdict::Normal,
            latest: None,
            since: None,
            judged: 0,
            tare: None,
        };
        Self { module, entries: components.iter().map(entry).collect(), sequence: 0 }
    }

    /// Takes up what was known before a restart; components that are not the module's are passed over.
    pub(crate) fn recall(&mut self, sequence: u64, latest: Vec<Transition>) {
        self.sequence = sequence;
        for transition in latest {
            let own = self.entries.iter_mut().find(|entry| entry.component == transition.component);
            if let Some(entry) = own {
                entry.enter(transition);
            }
        }
    }

    pub(crate) fn verdict(&self, channel: usize) -> &Verdict {
        &self.entries[channel].verdict
    }

    pub(crate) fn verdicts(&self) -> impl Iterator<Item = (&Component, &Verdict)> {
        self.entries.iter().map(|entry| (&entry.component, &entry.verdict))
    }

    pub(crate) fn latest(&self, component: &Component) -> Option<&Transition> {
        self.entries.iter().find(|e| e.component == *component).and_then(|e| e.latest.as_ref())
    }

    pub(crate) fn transitions(&self) -> impl Iterator<Item = &Transition> {
        self.entries.iter().filter_map(|entry| entry.latest.as_ref())
    }

    /// The number of the latest transition that was about the verdict on a component; 0 if there was none.
    pub(crate) fn judged(&self, channel: usize) -> u64 {
        self.entries[channel].judged
    }

    pub(crate) fn next_sequence(&self) -> u64 {
        self.sequence.saturating_add(1)
    }

    /// The components declared faulty, with when that began.
    pub(crate) fn faulty(&self, run: RunId) -> impl Iterator<Item = (ComponentPath, FaultySince)> {
        let latched = self.entries.iter().filter(|entry| entry.verdict.is_latched());
        latched.filter_map(move |entry| {
            let since = FaultySince::of(entry.latest.as_ref()?, run);
            let component = entry.component.clone();
            Some((ComponentPath { module: self.module.clone(), component }, since))
        })
    }

    /// The components for which the alarm is raised as of a step.
    pub(crate) fn alarms(&self, run: RunId, as_of: Step) -> Vec<Alarm> {
        let alarm = |entry: &ComponentVerdict| {
            let latest = entry.latest.as_ref()?;
            let since = FaultySince::of(latest, run);
            let faulty = entry.verdict.is_latched();
            let was_reset = entry.verdict == Verdict::Normal && latest.command().is_some();
            let is_open = matches!(entry.verdict, Verdict::Unconfirmed { .. });
            let raised = faulty && since.found <= as_of || is_open || was_reset;
            let (component, step) = (entry.component.clone(), since.change);
            (raised && step <= as_of).then_some(Alarm { component, step, faulty })
        };
        self.entries.iter().filter_map(alarm).collect()
    }

    /// The components with a change by a step that was not judged by then.
    pub(crate) fn pending(&self, run: RunId, as_of: Step) -> Vec<Component> {
        let is_pending = |entry: &&ComponentVerdict| {
            let latest = entry.latest.as_ref().map(|latest| FaultySince::of(latest, run));
            latest.is_some_and(|latest| {
                let first = entry.since.filter(|(since, _)| *since == run);
                let change = first.map_or(latest.change, |(_, step)| step);
                let is_later = entry.verdict.is_latched() && latest.found > as_of;
                change <= as_of && (entry.verdict == Verdict::Tentative || is_later)
            })
        };
        let pending = self.entries.iter().filter(is_pending);
        pending.map(|entry| entry.component.clone()).collect()
    }

    /// Returns a component to normal, unless it is faulty, or this is a step before its change: after a restart, samples
    /// from before may be judged again.
    pub(crate) fn clear(&mut self, channel: usize, decided: Step) -> Option<Transition> {
        let latest = self.entries[channel].latest.as_ref()?;
        if !latest.run_ended && decided < latest.detection {
            return None;
        }
        self.revise(channel, Verdict::Normal, decided)
    }

    /// Has one of these suspects, which departed by this step, been declared faulty since before it? Where another one is
    /// faulty as well, the next window tells.
    pub(crate) fn is_accounted_for(
        &self,
        (run, until): (RunId, Step),
        suspects: &[ComponentPath],
    ) -> bool {
        let faulty_before = |entry: &ComponentVerdict| {
            let latest = entry.latest.as_ref().filter(|_| entry.verdict.is_latched());
            latest.is_some_and(|latest| latest.is_of(run) && latest.onset <= until)
        };
        let mut own = suspects.iter().filter(|suspect| suspect.module == self.module);
        own.any(|suspect| {
            let entry = self.entries.iter().find(|entry| entry.component == suspect.component);
            entry.is_some_and(faulty_before)
        })
    }

    /// Once one of several suspects has been declared faulty, the others are none; their transitions.
    pub(crate) fn acquit(&mut self, decided: Step) -> Vec<Transition> {
        let is_acquitted = |entry: &ComponentVerdict| match (&entry.verdict, &entry.latest) {
            (Verdict::Unconfirmed { doubt: Doubt::OneOf(suspects) }, Some(latest)) => {
                self.is_accounted_for((latest.run, latest.detection), suspects)
            }
            _ => false,
        };
        let acquitted: Vec<usize> =
            (0..self.entries.len()).filter(|k| is_acquitted(&self.entries[*k])).collect();
        acquitted.into_iter().filter_map(|channel| self.clear(channel, decided)).collect()
    }

    /// Ends a run: explained changes end with it, and open changes will never be judged. Returns the resulting
    /// transitions.
    pub(crate) fn end_run(&mut self, decided: Step) -> Vec<Transition> {
        let channels = 0..self.entries.len();
        let end = |channel: usize| {
            let revised = match &self.entries[channel].verdict {
                Verdict::Explained { .. } => self.clear(channel, decided),
                open if is_open(open) => {
                    self.revise(channel, Verdict::Unconfirmed { doubt: Doubt::RunEnded }, decided)
                }
                _ => None,
            };
            let latest = self.entries[channel].latest.as_mut()?;
            latest.run_ended = true;
            revised.map(|_| latest.clone())
        };
        channels.filter_map(end).collect()
    }

    /// Gives a component another verdict on the same change.
    fn revise(&mut self, channel: usize, verdict: Verdict, decided: Step) -> Option<Transition> {
        let Transition { run, symptom, onset, detection, evidence, before_service, .. } =
            *self.entries[channel].latest.as_ref()?;
        let disputed = None;
        let found = Detection { symptom, onset, detection, evidence, before_service, disputed };
        self.record(run, channel, verdict, decided, found)
    }

    /// What is subtracted from what a component measures, from now on.
    pub(crate) fn set_tare(&mut self, channel: usize, tare: f64) {
        self.entries[channel].tare = Some(tare);
    }

    /// Gives a component the verdict that an operator commands; `None` if it never had a transition. Acknowledging a fault
    /// decides nothing: the step stays that as of which it was found. So does that of a fault of another run than the present
    /// one, because a transition has the steps of one run.
    pub(crate) fn obey(
        &mut self,
        channel: usize,
        verdict: Verdict,
        (run, now): (Option<RunId>, Step),
        order: GivenOrder,
    ) -> Option<Transition> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let latest = entry.latest.clone()?;
        let is_decided =
            verdict != Verdict::Acknowledged && run.is_some_and(|run| latest.is_of(run));
        let decided = if is_decided { now } else { latest.decided };
        let (order, tare) = (Some(order), entry.tare);
        let transition =
            Transition { sequence, verdict, decided, order, verdict_order: None, tare, ..latest };
        entry.enter(transition.clone());
        self.sequence = sequence;
        Some(transition)
    }

    /// Latches a component by order, as of this step.
    pub(crate) fn declare(
        &mut self,
        channel: usize,
        order: GivenOrder,
        (run, now): (RunId, Step),
        evidence: Evidence,
    ) -> Transition {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let found =
            Detection { detection: now, ..Detection::new(Symptom::default(), now, evidence) };
        let latched = entry.transition((sequence, run), Verdict::Latched, now, found);
        let transition = Transition { order: Some(order), ..latched };
        entry.enter(transition.clone());
        self.sequence = sequence;
        transition
    }

    /// Sets the alarm of a component aside, or lets it count again; shuts a cylinder off, or puts it back. The verdict stays what it is; run (0 before the first
    /// sample), step and evidence are what there is to say of it where it never had a transition.
    ///
    /// # Errors
    /// There is nothing to end.
    pub(crate) fn set_aside(
        &mut self,
        channel: usize,
        order: GivenOrder,
        (run, now): (RunId, Step),
        evidence: Evidence,
    ) -> Result<Transition, OrderRefusal> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let before = entry.latest.clone().unwrap_or_else(|| {
            let found =
                Detection { detection: now, ..Detection::new(Symptom::default(), now, evidence) };
            entry.transition((0, run), entry.verdict.clone(), now, found)
        });
        let verdict_order = before.command().cloned().map(Box::new);
        let after = set_aside(before, &order)?;
        let transition = Transition { sequence, order: Some(order), verdict_order, ..after };
        entry.latest = Some(transition.clone());
        self.sequence = sequence;
        Ok(transition)
    }

    /// Gives a component a verdict on what was found; `None` if that changes nothing.
    pub(crate) fn record(
        &mut self,
        run: RunId,
        channel: usize,
        verdict: Verdict,
        decided: Step,
        found: Detection,
    ) -> Option<Transition> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let known = entry.verdict == verdict
            && entry.latest.as_ref().is_none_or(|latest| latest.detection == found.detection);
        // What can never be judged stays until an operator resets it, or until it shows again.
        let stays = entry.verdict.is_latched()
            || (entry.verdict.is_undecidable() && verdict != Verdict::Latched);
        if known || stays || keeps_first(entry, run, &verdict, found.detection) {
            return None;
        }
        self.sequence = sequence;
        let transition = entry.transition((sequence, run), verdict, decided, found);
        entry.enter(transition.clone());
        Some(transition)
    }
}

/// Does the change wait for its judgement?
pub(crate) fn is_open(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) })
}

/// While a change is not judged, a later one of the same channel that is equally open does not replace its evidence.
fn keeps_first(entry: &ComponentVerdict, run: RunId, verdict: &Verdict, detection: Step) -> bool {
    let earlier = |latest: &Transition| latest.is_of(run) && latest.detection < detection;
    is_open(&entry.verdict) && is_open(verdict) && entry.latest.as_ref().is_some_and(earlier)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peer that asks as of a step at which the module was in doubt must not hear that there is nothing: it would hold
    /// the effects for faults of their own.
    #[test]
    fn what_was_in_doubt_is_pending_as_of_then_even_if_a_later_finding_latched_it() {
        let component: Component = "actuator/a1".parse().unwrap();
        let mut ledger = Ledger::new("lower".parse().unwrap(), std::slice::from_ref(&component));
        let run = RunId(1);
        let at = |step: u64| {
            let step = Step(step);
            let evidence =
                Evidence { step, residual: 0.0, level: 0.0, divergence: Some(2.0), threshold: 1.0 };
            Detection::new(Symptom::Change, step, evidence)
        };
        let doubt = Doubt::Silent(vec!["upper".parse().unwrap()]);
        ledger.record(run, 0, Verdict::Tentative, Step(100), at(100)).unwrap();
        ledger.record(run, 0, Verdict::Unconfirmed { doubt }, Step(110), at(100)).unwrap();
        assert_eq!(ledger.alarms(run, Step(150)).len(), 1);
        ledger.record(run, 0, Verdict::Latched, Step(900), at(800)).unwrap();
        assert_eq!(ledger.pending(run, Step(99)), []);
        assert_eq!(ledger.pending(run, Step(150)), [component]);
        assert_eq!(
            (ledger.pending(run, Step(900)).len(), ledger.alarms(run, Step(900)).len()),
            (0, 1)
        );
    }
}
