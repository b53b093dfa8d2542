//! What must never happen.

use std::collections::{BTreeMap, BTreeSet};

use process::{JournalRecord, TICK};
use study::TimedFault;
use vocabulary::{
    ComponentPath, Doubt, FaultState, FaultTransition, GivenOrderKind, ModuleName, ModuleStatus,
    Symptom,
};

use crate::scenario::WorldScenario;
use crate::setup::Setup;
use crate::world::BEGIN_UNIX_NS;

/// The top is never farther than this from that of the same plant without faults \[m\].
const MOST_DRIFT_M: f64 = 0.01;
/// More samples and questions do not wait.
const MOST_WAITING: u64 = 4096;
/// Time after its deadline by which a pause or a held question must have ended \[ns\].
const LATE_NS: u64 = 2 * TICK.as_nanos() as u64;
/// A fault that began this long ago is seen by its module \[ns\].
const SEEN_AFTER_NS: u64 = 2_000_000_000;

/// What is known of a module's transitions.
#[derive(Debug, Default)]
struct Numbering {
    incarnation: u64,
    latest: u64,
    /// The highest number that the disk had.
    durable: u64,
}

/// Watches a world.
#[derive(Debug)]
pub(crate) struct InvariantWatcher {
    pub(crate) violations: Vec<String>,
    modules: Vec<ModuleName>,
    faults: Vec<TimedFault>,
    /// The gages that lose their values at some time, which is a fault.
    valueless: BTreeSet<ComponentPath>,
    is_honest: bool,
    /// Every module is given samples of the plant with the faults.
    is_of_one_plant: bool,
    step_ns: u64,
    numbering: Vec<Numbering>,
    /// Of each module what was published as being on the disk, by its number.
    durable: Vec<BTreeMap<(u64, u64), FaultTransition>>,
    /// What each component is held for.
    pub(crate) states: BTreeMap<ComponentPath, FaultState>,
    /// Those whose change could not be judged.
    pub(crate) doubted: BTreeSet<ComponentPath>,
    /// When each shelving expires \[ns since 1970\]; `None` in worlds with a wrong clock.
    shelved: Option<BTreeMap<ComponentPath, u64>>,
    /// Those that were faulty and were reset.
    pub(crate) reset: BTreeSet<ComponentPath>,
    /// The cylinders that were ever shut off.
    pub(crate) shut_off: BTreeSet<ComponentPath>,
    /// How far the top was at most from that of the same plant without faults \[m\].
    largest_drift_m: f64,
    /// Something lasted too long, which is said once.
    is_late: bool,
}

impl InvariantWatcher {
    pub(crate) fn new(setup: &Setup, scenario: &WorldScenario) -> Self {
        let modules = setup.modules.len();
        Self {
            violations: Vec::new(),
            modules: setup.module_names().cloned().collect(),
            faults: scenario.faults.clone(),
            valueless: scenario.valueless(setup).collect(),
            is_honest: scenario.is_honest(),
            is_of_one_plant: scenario.is_of_one_plant(),
            step_ns: setup.step_ns(),
            numbering: (0..modules).map(|_| Numbering::default()).collect(),
            durable: vec![BTreeMap::new(); modules],
            states: BTreeMap::new(),
            doubted: BTreeSet::new(),
            shelved: scenario.clocks_agree().then(BTreeMap::new),
            reset: BTreeSet::new(),
            shut_off: BTreeSet::new(),
            largest_drift_m: 0.0,
            is_late: false,
        }
    }

    pub(crate) fn violated(&mut self, now_ns: u64, what: impl std::fmt::Display) {
        self.violations.push(format!("{:.3} s: {what}", now_ns as f64 / 1e9));
    }

    /// Returns whether its number was given before, to one that no disk had.
    pub(crate) fn transition(
        &mut self,
        now_ns: u64,
        of: usize,
        transition: &FaultTransition,
    ) -> bool {
        let component = &transition.component;
        let state = transition.state();
        let before = self.states.insert(component.clone(), state).unwrap_or(FaultState::Normal);
        if state == FaultState::Unconfirmed {
            self.doubted.insert(component.clone());
        }
        self.follow_shelving(now_ns, transition);
        // No healthy component is latched.
        let began = |fault: &TimedFault| {
            fault.component == *component && fault.at.0 * self.step_ns <= now_ns
        };
        let is_valueless =
            transition.symptom == Symptom::NoSignal && self.valueless.contains(component);
        let is_faulty = is_valueless || self.faults.iter().any(began);
        if state == FaultState::Latched && self.is_honest && !is_faulty {
            self.violated(now_ns, format_args!("{component} is healthy, and latched"));
        }
        // A fault stays until it is reset.
        if before.is_fault() && !state.is_fault() {
            let order = transition.order.as_ref().map(|order| order.kind);
            if matches!(order, Some(GivenOrderKind::Reset { .. } | GivenOrderKind::ReTare)) {
                self.reset.insert(component.clone());
            } else {
                self.violated(now_ns, format_args!("{component} was {before}, and is {state}"));
            }
            if order == Some(GivenOrderKind::Reset { force: false })
                && self.is_faulty(now_ns, component)
            {
                self.violated(now_ns, format_args!("{component} was reset, and is still faulty"));
            }
        }
        // Numbers have no gap and no number is given twice.
        let (incarnation, sequence) = (transition.incarnation, transition.sequence);
        let numbering = self.numbering_of(of, incarnation);
        let follows = sequence == numbering.latest + 1;
        // A number that no disk had may be given again.
        let again = sequence <= numbering.latest && sequence == numbering.durable + 1;
        let (latest, durable) = (numbering.latest, numbering.durable);
        numbering.latest = sequence;
        if transition.durable {
            numbering.durable = sequence;
        }
        if !follows && !again {
            let what = format!("{component}: number {sequence} after {latest} ({durable} on disk)");
            self.violated(now_ns, what);
        }
        if transition.durable {
            self.durable[of].insert((incarnation, sequence), transition.clone());
        }
        again && !follows
    }

    /// A shelving does not end before its time.
    fn follow_shelving(&mut self, now_ns: u64, transition: &FaultTransition) {
        let (component, order) = (&transition.component, transition.order.as_ref());
        let Some(shelved) = &mut self.shelved else { return };
        let until = transition.shelved.as_ref().map(|shelving| shelving.until_unix_ns);
        let before = match until {
            Some(until) => shelved.insert(component.clone(), until),
            None => shelved.remove(component),
        };
        let is_lapse = order.is_some_and(|one| matches!(one.kind, GivenOrderKind::Lapse { .. }));
        if is_lapse && until.is_none() && before.is_some_and(|end| end > BEGIN_UNIX_NS + now_ns) {
            self.violated(now_ns, format_args!("{component}: its shelving ended early"));
        }
    }

    /// No shelving outlives its time.
    pub(crate) fn check_shelved(&mut self, now_ns: u64) {
        let is_over = |until: &u64| until + 1_000_000_000 < BEGIN_UNIX_NS + now_ns;
        let late = self.shelved.iter().flatten().filter(|(_, until)| is_over(until));
        for component in late.map(|(component, _)| component.clone()).collect::<Vec<_>>() {
            self.violated(now_ns, format_args!("{component} is still shelved"));
        }
    }

    /// Is a component faulty in the plant, for so long that its module has seen it?
    fn is_faulty(&self, now_ns: u64, component: &ComponentPath) -> bool {
        let is_there = |fault: &TimedFault| {
            fault.at.0 * self.step_ns + SEEN_AFTER_NS <= now_ns
                && fault.until.is_none_or(|until| now_ns < until.0 * self.step_ns)
        };
        let mut own = self.faults.iter().filter(|fault| fault.component == *component);
        self.is_of_one_plant && self.is_honest && own.any(is_there)
    }

    /// Something of a module's that had its time is not over: `until` when it was to be.
    pub(crate) fn lasts(&mut self, now_ns: u64, module: &ModuleName, what: &str, until_ns: u64) {
        if until_ns + LATE_NS < now_ns && !std::mem::replace(&mut self.is_late, true) {
            let until_s = until_ns as f64 / 1e9;
            self.violated(now_ns, format_args!("{module}: {what} was to end at {until_s:.3} s"));
        }
    }

    /// A module does not use what its peer says.
    pub(crate) fn rejects(&mut self, now_ns: u64, module: &ModuleName, peer: &ModuleName) {
        if self.is_honest {
            self.violated(now_ns, format_args!("{module} rejects what {peer} says"));
        }
    }

    /// A process begins on a disk that has numbers of this incarnation up to this one. Those of a new one may all have
    /// been written without being published.
    pub(crate) fn restarted(&mut self, of: usize, incarnation: u64, latest: u64) {
        let numbering = self.numbering_of(of, incarnation);
        numbering.latest = numbering.latest.max(latest);
        numbering.durable = numbering.durable.max(latest);
    }

    fn numbering_of(&mut self, module: usize, incarnation: u64) -> &mut Numbering {
        let numbering = &mut self.numbering[module];
        if numbering.incarnation != incarnation {
            *numbering = Numbering { incarnation, ..Numbering::default() };
        }
        numbering
    }

    pub(crate) fn status(&mut self, now_ns: u64, status: &ModuleStatus) {
        for (what, count) in
            [("samples", status.queued_samples), ("questions", status.waiting_questions)]
        {
            if count > MOST_WAITING {
                self.violated(now_ns, format_args!("{}: {count} {what} wait", status.module));
            }
        }
    }

    /// After a process ended at once, the journal has what was published as being on the disk, unless newer files need it
    /// no more.
    pub(crate) fn killed(&mut self, now_ns: u64, of: usize, records: &[String]) {
        let read = records.iter().filter_map(|text| JournalRecord::from_text(text));
        let mut latest: BTreeMap<ComponentPath, FaultTransition> = BTreeMap::new();
        for record in read {
            let JournalRecord::Transition(one) = record else { continue };
            let known = latest.entry(one.component.clone()).or_insert_with(|| (*one).clone());
            if known.place() < one.place() {
                *known = *one;
            }
        }
        let published = self.durable[of].iter().map(|(number, one)| (&one.component, *number));
        let lost = published.filter(|(component, number)| {
            latest.get(*component).is_none_or(|known| known.place() < *number)
        });
        let lost: Vec<String> =
            lost.map(|(component, number)| format!("{component}, number {}", number.1)).collect();
        self.forget(of, &latest);
        if !lost.is_empty() {
            self.violated(now_ns, format_args!("published as on disk, and not there: {lost:?}"));
        }
    }

    /// What no disk had is forgotten with the process.
    fn forget(&mut self, of: usize, kept: &BTreeMap<ComponentPath, FaultTransition>) {
        let Some(module) = self.modules.get(of) else { return };
        self.states.retain(|component, _| component.module != *module);
        let kept = kept.iter().map(|(component, one)| (component.clone(), one.state()));
        self.states.extend(kept);
    }

    /// What is held for faulty, or was until it was reset; without gages that lose their values.
    pub(crate) fn named(&self) -> BTreeSet<ComponentPath> {
        let standing = self.states.iter().filter(|(_, state)| state.is_fault());
        let named = standing.map(|(component, _)| component.clone()).chain(self.reset.clone());
        named.filter(|component| !self.valueless.contains(component)).collect()
    }

    /// The top is so far from that of the same plant without faults.
    pub(crate) fn drift(&mut self, now_ns: u64, drift_m: f64) {
        if drift_m > MOST_DRIFT_M && self.largest_drift_m <= MOST_DRIFT_M {
            self.violated(now_ns, format_args!("the top is {drift_m:.3} m from where it would be"));
        }
        self.largest_drift_m = self.largest_drift_m.max(drift_m);
    }

    /// No cylinder was shut off without a verdict against it.
    pub(crate) fn check_shut_off(&mut self, now_ns: u64) {
        let named = self.named();
        for cylinder in self.shut_off.clone() {
            if !named.contains(&cylinder) {
                self.violated(now_ns, format_args!("{cylinder} was shut off, and never named"));
            }
        }
    }

    /// What the modules know at the end is what they published, and is decided.
    pub(crate) fn knows(&mut self, now_ns: u64, latest: &FaultTransition) {
        let (component, state) = (&latest.component, latest.verdict.state());
        // A peer that did not watch at the time will never know.
        let waits = matches!(latest.verdict.doubt(), Some(Doubt::Silent(_)));
        // Effects are over long since.
        let is_open = matches!(state, FaultState::Tentative | FaultState::Explained);
        if (waits || is_open) && self.is_honest {
            self.violated(now_ns, format_args!("{component} is still {state}"));
        }
        let published = self.states.get(component).copied().unwrap_or(FaultState::Normal);
        if published != state {
            let what = format!("{component} is {state} in the store, and {published} as published");
            self.violated(now_ns, what);
        }
    }
}
