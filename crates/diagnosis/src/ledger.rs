//! The verdicts on a module's components and their numbered transitions.

use vocabulary::{Component, ComponentPath, ModuleName, RunId, Step};

use crate::isolation::Case;
use crate::order::OrderRefusal;
use crate::shelving::aside_after;
use crate::verdict::Transition;
use vocabulary::{Alarm, Doubt, Evidence, GivenOrder, Symptom, Verdict};

/// The verdict on one component.
#[derive(Debug, Clone)]
struct Entry {
    component: Component,
    verdict: Verdict,
    latest: Option<Transition>,
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

/// A departure from a reference.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    pub(crate) symptom: Symptom,
    pub(crate) onset: Step,
    pub(crate) evidence: Evidence,
    pub(crate) before_service: bool,
}

/// All verdicts of a module.
#[derive(Debug, Clone)]
pub(crate) struct Ledger {
    entries: Vec<Entry>,
    sequence: u64,
}

impl Ledger {
    pub(crate) fn new(components: &[Component]) -> Self {
        let entry = |component: &Component| Entry {
            component: component.clone(),
            verdict: Verdict::Normal,
            latest: None,
            judged: 0,
            tare: None,
        };
        Self { entries: components.iter().map(entry).collect(), sequence: 0 }
    }

    /// Takes up what was known before a restart; components that are not the module's are passed over.
    pub(crate) fn recall(&mut self, sequence: u64, latest: Vec<Transition>) {
        self.sequence = sequence;
        for transition in latest {
            let own = self.entries.iter_mut().find(|entry| entry.component == transition.component);
            if let Some(entry) = own {
                entry.verdict = transition.verdict.clone();
                entry.tare = transition.tare;
                entry.judged = transition.sequence;
                entry.latest = Some(transition);
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
    pub(crate) fn faulty(
        &self,
        module: &ModuleName,
        run: RunId,
    ) -> impl Iterator<Item = (ComponentPath, FaultySince)> {
        let latched = self.entries.iter().filter(|entry| entry.verdict.is_latched());
        latched.filter_map(move |entry| {
            let since = FaultySince::of(entry.latest.as_ref()?, run);
            let component = entry.component.clone();
            Some((ComponentPath { module: module.clone(), component }, since))
        })
    }

    /// The components for which the alarm is raised as of a step.
    pub(crate) fn alarms(&self, run: RunId, as_of: Step) -> Vec<Alarm> {
        let alarm = |entry: &Entry| {
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

    /// Gives a component a new verdict on a case; `None` if it has that verdict already.
    pub(crate) fn enter(
        &mut self,
        run: RunId,
        case: &Case,
        verdict: Verdict,
        decided: Step,
    ) -> Option<Transition> {
        self.record(run, case.channel, verdict, decided, Record::of(case))
    }

    /// A component is faulty: `by` was said to explain its change, and its module does not stand by that.
    pub(crate) fn dispute(
        &mut self,
        run: RunId,
        case: &Case,
        by: ComponentPath,
        decided: Step,
    ) -> Option<Transition> {
        let record = Record { disputed: Some(by), ..Record::of(case) };
        self.record(run, case.channel, Verdict::Latched, decided, record)
    }

    /// A component has had no usable signal since `since`: it is faulty.
    pub(crate) fn lose_signal(
        &mut self,
        run: RunId,
        channel: usize,
        since: Step,
        evidence: Evidence,
    ) -> Option<Transition> {
        let now = evidence.step;
        let record = Record {
            symptom: Symptom::NoSignal,
            onset: since,
            detection: now,
            evidence,
            before_service: false,
            disputed: None,
        };
        self.record(run, channel, Verdict::Latched, now, record)
    }

    /// A component, or one of several, has departed from its reference.
    pub(crate) fn depart(
        &mut self,
        run: RunId,
        channel: usize,
        verdict: Verdict,
        departure: Departure,
    ) -> Option<Transition> {
        let Departure { symptom, onset, evidence, before_service } = departure;
        let detection = evidence.step;
        let record = Record { symptom, onset, detection, evidence, before_service, disputed: None };
        self.record(run, channel, verdict, detection, record)
    }

    /// Returns a component to normal, unless it is faulty.
    pub(crate) fn clear(&mut self, channel: usize, decided: Step) -> Option<Transition> {
        self.revise(channel, Verdict::Normal, decided)
    }

    /// Has one of these suspects, which departed by this step, been declared faulty since before it? Where another one is
    /// faulty as well, the next window tells.
    pub(crate) fn is_accounted_for(
        &self,
        (run, until): (RunId, Step),
        suspects: &[ComponentPath],
        module: &ModuleName,
    ) -> bool {
        let faulty_before = |entry: &Entry| {
            let latest = entry.latest.as_ref().filter(|_| entry.verdict.is_latched());
            latest.is_some_and(|latest| latest.is_of(run) && latest.onset <= until)
        };
        let mut own = suspects.iter().filter(|suspect| suspect.module == *module);
        own.any(|suspect| {
            let entry = self.entries.iter().find(|entry| entry.component == suspect.component);
            entry.is_some_and(faulty_before)
        })
    }

    /// Once one of several suspects has been declared faulty, the others are none; their transitions.
    pub(crate) fn acquit(&mut self, module: &ModuleName, decided: Step) -> Vec<Transition> {
        let is_acquitted = |entry: &Entry| match (&entry.verdict, &entry.latest) {
            (Verdict::Unconfirmed { doubt: Doubt::OneOf(suspects) }, Some(latest)) => {
                self.is_accounted_for((latest.run, latest.detection), suspects, module)
            }
            _ => false,
        };
        let acquitted: Vec<usize> =
            (0..self.entries.len()).filter(|k| is_acquitted(&self.entries[*k])).collect();
        acquitted.into_iter().filter_map(|channel| self.clear(channel, decided)).collect()
    }

    /// What was found in a run that is over: what was explained is over too, what was not judged never
    /// will be.
    pub(crate) fn end_run(&mut self, channel: usize, decided: Step) -> Option<Transition> {
        let revised = match &self.entries[channel].verdict {
            Verdict::Explained { .. } => self.clear(channel, decided),
            Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) } => {
                self.revise(channel, Verdict::Unconfirmed { doubt: Doubt::RunEnded }, decided)
            }
            _ => None,
        };
        let latest = self.entries[channel].latest.as_mut()?;
        latest.run_ended = true;
        revised.map(|_| latest.clone())
    }

    /// Gives a component another verdict on the same change.
    fn revise(&mut self, channel: usize, verdict: Verdict, decided: Step) -> Option<Transition> {
        let Transition { run, symptom, onset, detection, evidence, before_service, .. } =
            *self.entries[channel].latest.as_ref()?;
        let record = Record { symptom, onset, detection, evidence, before_service, disputed: None };
        self.record(run, channel, verdict, decided, record)
    }

    /// What is subtracted from what a component measures, from now on.
    pub(crate) fn set_tare(&mut self, channel: usize, tare: f64) {
        self.entries[channel].tare = Some(tare);
    }

    /// Gives a component the verdict that an operator commands; `None` if it never had a transition. A transition has
    /// the steps of one run: of a fault that was found in another than the present one, the step stays that it had.
    pub(crate) fn obey(
        &mut self,
        channel: usize,
        verdict: Verdict,
        (run, now): (Option<RunId>, Step),
        order: GivenOrder,
    ) -> Option<Transition> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let tare = entry.tare;
        let latest = entry.latest.as_mut()?;
        let decided = if run.is_some_and(|run| latest.is_of(run)) { now } else { latest.decided };
        let order = Some(order);
        *latest = Transition {
            sequence,
            verdict: verdict.clone(),
            decided,
            order,
            verdict_order: None,
            tare,
            ..latest.clone()
        };
        entry.verdict = verdict;
        entry.judged = sequence;
        self.sequence = sequence;
        Some(latest.clone())
    }

    /// Sets the alarm of a component aside, or lets it count again. The verdict stays what it is; `blank` is what there
    /// is to say of it where it never had a transition.
    ///
    /// # Errors
    /// There is nothing to end.
    pub(crate) fn set_aside(
        &mut self,
        channel: usize,
        order: GivenOrder,
        blank: Blank,
    ) -> Result<Transition, OrderRefusal> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let before = entry.latest.clone().unwrap_or_else(|| blank.transition(entry));
        let (shelved, suppressed) = aside_after(&before, &order)?;
        let (order, verdict_order) = (Some(order), before.command().cloned().map(Box::new));
        let transition =
            Transition { sequence, order, verdict_order, shelved, suppressed, ..before };
        entry.latest = Some(transition.clone());
        self.sequence = sequence;
        Ok(transition)
    }

    fn record(
        &mut self,
        run: RunId,
        channel: usize,
        verdict: Verdict,
        decided: Step,
        record: Record,
    ) -> Option<Transition> {
        let sequence = self.next_sequence();
        let entry = &mut self.entries[channel];
        let known = entry.verdict == verdict
            && entry.latest.as_ref().is_none_or(|latest| latest.detection == record.detection);
        // What can never be judged stays until an operator resets it, or until it shows again.
        let stays = entry.verdict.is_latched()
            || (entry.verdict.is_undecidable() && verdict != Verdict::Latched);
        if known || stays || keeps_first(entry, run, &verdict, &record) {
            return None;
        }
        self.sequence = sequence;
        let Record { symptom, onset, detection, evidence, before_service, disputed } = record;
        let transition = Transition {
            sequence,
            run,
            run_ended: false,
            component: entry.component.clone(),
            verdict: verdict.clone(),
            symptom,
            onset,
            detection,
            decided,
            evidence,
            before_service,
            disputed,
            tare: entry.tare,
            order: None,
            verdict_order: None,
            shelved: entry.latest.as_ref().and_then(|latest| latest.shelved.clone()),
            suppressed: entry.latest.as_ref().and_then(|latest| latest.suppressed.clone()),
        };
        entry.verdict = verdict;
        entry.judged = sequence;
        entry.latest = Some(transition.clone());
        Some(transition)
    }
}

/// How a component without any transition is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Blank {
    /// The present run; before the first sample, the one of the number 0.
    pub(crate) run: RunId,
    /// The latest step.
    pub(crate) now: Step,
    /// The channel at it.
    pub(crate) evidence: Evidence,
}

impl Blank {
    fn transition(self, entry: &Entry) -> Transition {
        let Self { run, now, evidence } = self;
        Transition {
            sequence: 0,
            run,
            run_ended: false,
            component: entry.component.clone(),
            verdict: entry.verdict.clone(),
            symptom: Symptom::default(),
            onset: now,
            detection: now,
            decided: now,
            evidence,
            before_service: false,
            disputed: None,
            tare: entry.tare,
            order: None,
            verdict_order: None,
            shelved: None,
            suppressed: None,
        }
    }
}

/// As long as a change is not judged, a later one of the same channel, as open as it, takes nothing of its
/// evidence away.
fn keeps_first(entry: &Entry, run: RunId, verdict: &Verdict, record: &Record) -> bool {
    let open = |verdict: &Verdict| {
        matches!(verdict, Verdict::Tentative | Verdict::Unconfirmed { doubt: Doubt::Silent(_) })
    };
    let earlier = |latest: &Transition| latest.is_of(run) && latest.detection < record.detection;
    open(&entry.verdict) && open(verdict) && entry.latest.as_ref().is_some_and(earlier)
}

struct Record {
    symptom: Symptom,
    onset: Step,
    detection: Step,
    evidence: Evidence,
    before_service: bool,
    disputed: Option<ComponentPath>,
}

impl Record {
    fn of(case: &Case) -> Self {
        Self {
            symptom: Symptom::Change,
            onset: case.onset,
            detection: case.change,
            evidence: case.evidence,
            before_service: false,
            disputed: None,
        }
    }
}
