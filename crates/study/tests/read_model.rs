//! What the read model says of a component is never false: random histories of faults, repairs, commands, gaps and
//! restarts on the virtual clock, with what a diagnoser's process decides, and a view that hears all that it publishes
//! unless it is cut off. After each tenth of a second, and whenever something is published, what the view shows is compared
//! with what the study knows.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use diagnosis::messages::Speaker;
use diagnosis::{GivenOrder, GivenOrderKind, Span};
use observer::{Journals, ModuleHistory, ModuleView, NetworkState, News, StateRow, Structures};
use process::{
    ClockReading, ComponentStore, JournalRecord, NO_SAMPLE_YET, RecentRefusals, Staleness,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use study::conditions::{ConditionCampaign, HiddenFaults, Situation};
use study::{Campaign, CampaignCase, CommissionedPlant, Rig, RigEvent, SampleGap, TimedFault};
use vocabulary::{
    ComponentPath, Condition, FaultState, FaultTransition, ModulePhase, ModuleStatus, PhaseChange,
    Step, StructureName, Symptom, Verdict, fault::Fault,
};

use crate::conditions::PLANT;
use crate::tower;

/// The view's clock at step 0, and a step \[ns\].
const BEGIN_NS: u64 = 1_800_000_000_000_000_000;
const STEP_NS: u64 = 1_000_000;
/// In steps: a module without samples is stale; its process looks around; it publishes a status; a view queries states,
/// and is looked at.
const STALE_AFTER: u64 = 500;
const TICK: u64 = 50;
const STATUS_EVERY: u64 = 1000;
const QUERY_EVERY: u64 = 2000;
const LOOK_EVERY: u64 = 100;
/// An agreement that is shown is at most as old as the time between two queries and that between two windows.
const AGREEMENT_WITHIN: u64 = QUERY_EVERY + 2 * 1000;
/// The smallest leak of a campaign is seen in the oil content after this time \[steps\].
const LEAK_SEEN_AFTER: u64 = 8000;
/// An effect shows this long after its cause began or ended, at most: until that has left the interval of the Gaussian.
const EFFECT_WITHIN: u64 = 2500;

fn unix_ns(step: u64) -> u64 {
    BEGIN_NS + step * STEP_NS
}

/// A diagnoser's process without its runtime.
struct Process {
    speaker: Speaker,
    store: ComponentStore,
    staleness: Staleness,
    journal: Vec<JournalRecord>,
    is_up: bool,
    last_sample: Option<u64>,
    /// The latest that were noted.
    conditions: Vec<Condition>,
}

impl Process {
    fn new(
        speaker: Speaker,
        records: Vec<JournalRecord>,
        rig: &Rig,
        place: usize,
        now: u64,
    ) -> Self {
        let mut store = ComponentStore::restore(records.clone(), &speaker.module, unix_ns(now));
        let components = rig.diagnosers()[place].components();
        store.configure(&speaker.module, components, NO_SAMPLE_YET.to_owned(), unix_ns(now));
        let staleness = Staleness::new(Duration::from_millis(STALE_AFTER));
        Self {
            speaker,
            store,
            staleness,
            journal: records,
            is_up: true,
            last_sample: None,
            conditions: Vec::new(),
        }
    }

    /// The message on its phase, if that or what it monitors has changed.
    fn phase(&mut self, rig: &Rig, place: usize, now: u64, at: Instant) -> Option<PhaseChange> {
        let diagnoser = &rig.diagnosers()[place];
        // Before the first sample of this process the diagnoser is that of its predecessor.
        let of_diagnoser = self.last_sample.map_or(ModulePhase::Waiting, |_| diagnoser.phase());
        let phase = self.staleness.phase(of_diagnoser);
        let reason = self.staleness.reason(phase, &RecentRefusals::default(), at);
        let present = ClockReading { at, time_unix_ns: unix_ns(now), step: diagnoser.last_step() };
        let (before, not_monitored, since) = match self.staleness.change_to(phase) {
            Some(before) => {
                self.store.monitored(phase, reason.clone(), unix_ns(now));
                (before, BTreeMap::new(), present)
            }
            None => {
                let lost = self.store.not_monitored();
                let is_due = now.is_multiple_of(TICK) && phase == ModulePhase::InService;
                let changed = is_due.then(|| self.staleness.change_of_monitored(&lost, present));
                (Some(phase), self.staleness.not_monitored(), changed.flatten()?)
            }
        };
        let change = PhaseChange {
            structure: self.speaker.structure.clone(),
            module: self.speaker.module.clone(),
            phase,
            number: 0,
            before,
            not_monitored,
            run: diagnoser.run(),
            step: since.step,
            reason,
            time_unix_ns: since.time_unix_ns,
        };
        let change = self.store.phase_changed(change);
        self.journal.push(JournalRecord::Phase(Box::new(change.clone())));
        Some(change)
    }

    fn history(&self) -> ModuleHistory {
        let mut history = ModuleHistory::new(&self.speaker.structure, &self.speaker.module, 1);
        for record in &self.journal {
            match record {
                JournalRecord::Transition(known) => history.transitions.push((**known).clone()),
                JournalRecord::Phase(change) => history.phases.push((**change).clone()),
                _ => {}
            }
        }
        history.first_sequence = history.transitions.first().map(|first| first.sequence);
        history.next_sequence = Some(history.transitions.last().map_or(1, |t| t.sequence + 1));
        history
    }
}

/// A state and the change that it is about: what an alarm's beginning belongs to.
type AlarmKey = (FaultState, Step);

struct World<'a> {
    case: &'a CampaignCase<Situation>,
    /// When the view is cut off.
    cuts: Vec<std::ops::Range<u64>>,
    plant: Option<&'a CommissionedPlant>,
    rig: Rig,
    processes: Vec<Process>,
    view: Structures,
    /// Published while the view was cut off.
    missed: Vec<News>,
    now: u64,
    started: Instant,
    asked: u64,
    since: BTreeMap<ComponentPath, (AlarmKey, Option<u64>)>,
    /// The components for which the alarm was ever raised.
    alarmed: BTreeSet<ComponentPath>,
    generator: ChaCha8Rng,
    false_words: BTreeMap<String, String>,
}

impl<'a> World<'a> {
    fn new(
        case: &'a CampaignCase<Situation>,
        cuts: Vec<std::ops::Range<u64>>,
        plant: Option<&'a CommissionedPlant>,
        mut rig: Rig,
    ) -> Self {
        rig.keep_samples(case.kept_samples);
        let structure: StructureName = "tower".parse().unwrap();
        let process = |place: usize| {
            let module = rig.diagnosers()[place].module().clone();
            Process::new(Speaker::of(structure.clone(), module), Vec::new(), &rig, place, 0)
        };
        let processes = (0..rig.diagnosers().len()).map(process).collect();
        let mut world = Self {
            case,
            cuts,
            plant,
            processes,
            rig,
            view: Structures::default(),
            missed: Vec::new(),
            now: 0,
            started: Instant::now(),
            asked: 0,
            since: BTreeMap::new(),
            alarmed: BTreeSet::new(),
            generator: ChaCha8Rng::seed_from_u64(case.seed),
            false_words: BTreeMap::new(),
        };
        world.view.network(NetworkState::Open, BEGIN_NS);
        for place in 0..world.processes.len() {
            world.note_conditions(place);
            world.tell_phase(place);
            world.tell_presence(place);
        }
        world
    }

    fn at(&self) -> Instant {
        self.started + Duration::from_millis(self.now)
    }

    fn is_cut_off(&self) -> bool {
        self.cuts.iter().any(|cut| cut.contains(&self.now))
    }

    fn tell(&mut self, news: News) {
        if self.is_cut_off() {
            self.missed.push(news);
        } else {
            self.view.news(news, unix_ns(self.now));
            // A view queries the states soon after.
            self.asked = self.asked.min(self.now.saturating_sub(QUERY_EVERY - 100));
        }
    }

    fn tell_presence(&mut self, place: usize) {
        let process = &self.processes[place];
        let (structure, who) =
            (process.speaker.structure.clone(), process.speaker.module.to_string());
        let there = process.is_up;
        self.tell(News::Presence { structure, who, there, at_start: false });
    }

    fn tell_phase(&mut self, place: usize) {
        let at = self.at();
        if let Some(change) = self.processes[place].phase(&self.rig, place, self.now, at) {
            self.tell(News::Phase(change));
            self.tell_status(place);
        }
    }

    fn tell_status(&mut self, place: usize) {
        let process = &self.processes[place];
        let diagnoser = &self.rig.diagnosers()[place];
        let Speaker { structure, module, .. } = process.speaker.clone();
        let phase = process.store.phase().map_or(ModulePhase::Waiting, |change| change.phase);
        let status = ModuleStatus {
            phase,
            run: diagnoser.run(),
            step: diagnoser.last_step(),
            time_unix_ns: unix_ns(self.now),
            ..ModuleStatus::waiting(structure, module)
        };
        if !self.is_cut_off() {
            self.view.status(status, unix_ns(self.now));
        }
    }

    /// Publishes what the diagnosers have concluded.
    fn publish(&mut self) {
        for event in self.rig.take_occurrences() {
            let RigEvent::Transition { module, transition } = event else { continue };
            let place = self.rig.diagnosers().iter().position(|d| *d.module() == module).unwrap();
            let process = &mut self.processes[place];
            let message = process.speaker.transition(*transition, unix_ns(self.now));
            let message = process
                .store
                .transition(FaultTransition { since_unix_ns: unix_ns(self.now), ..message }, 0);
            process.journal.push(JournalRecord::Transition(Box::new(message.clone())));
            let state = match message.state() {
                FaultState::Acknowledged => FaultState::Latched,
                other => other,
            };
            let key = (state, message.detection_step.unwrap());
            let begins = self.since.get(&message.component).is_none_or(|(known, _)| *known != key);
            if begins {
                // Shelving precedes its first change, so nothing tells since when it has been normal.
                let is_first = !self.since.contains_key(&message.component);
                let is_known = !is_first || message.state() != FaultState::Normal;
                let since = is_known.then(|| unix_ns(self.now));
                self.since.insert(message.component.clone(), (key, since));
            }
            self.judge_transition(&message);
            if matches!(message.state(), FaultState::Latched | FaultState::Unconfirmed) {
                self.alarmed.insert(message.component.clone());
            }
            if self.processes[place].is_up {
                self.tell(News::Fault(Box::new(message)));
            }
        }
    }

    fn note_conditions(&mut self, place: usize) {
        let conditions: Vec<Condition> =
            self.rig.diagnosers()[place].conditions().cloned().collect();
        self.processes[place].store.conditions(conditions.clone(), unix_ns(self.now));
        self.processes[place].conditions = conditions;
    }

    fn restart(&mut self, place: usize) {
        let old = &self.processes[place];
        let (speaker, journal) = (old.speaker.clone(), old.journal.clone());
        self.processes[place].is_up = false;
        self.tell_presence(place);
        self.processes[place] = Process::new(speaker, journal, &self.rig, place, self.now);
        let (published, _) = self.processes[place].store.published();
        for transition in published {
            self.tell(News::Fault(Box::new(transition)));
        }
        self.tell_phase(place);
        self.tell_presence(place);
        self.rig.restart(place).unwrap();
        self.publish();
        self.processes[place].last_sample = self.rig.diagnosers()[place].last_step().map(|s| s.0);
        let at = self.at();
        self.processes[place].staleness.sample(at);
        self.note_conditions(place);
        self.tell_phase(place);
    }

    /// Runs to the end.
    fn false_words(mut self) -> BTreeMap<String, String> {
        for _ in 0..self.case.steps {
            self.step();
        }
        self.judge_journals();
        self.false_words
    }

    fn step(&mut self) {
        let step = self.rig.plant().next_step();
        self.now = step.0;
        self.connect();
        for gap in &self.case.gaps {
            if gap.restarted && gap.until == step {
                self.restart(gap.place);
            } else if gap.restarted && gap.from == step {
                self.processes[gap.place].is_up = false;
                self.tell_presence(gap.place);
            }
        }
        let gaps = &self.case.gaps;
        let is_lost = |place: usize| {
            gaps.iter().any(|gap| gap.place == place && (gap.from..gap.until).contains(&step))
        };
        self.rig.step_without(is_lost).unwrap();
        for place in (0..self.processes.len()).filter(|place| !is_lost(*place)) {
            let at = self.at();
            self.processes[place].last_sample = Some(self.now);
            self.processes[place].staleness.sample(at);
        }
        self.publish();
        for place in 0..self.processes.len() {
            if self.processes[place].is_up {
                self.surround(place, is_lost(place));
            }
        }
        self.order();
        if !self.is_cut_off() && self.now >= self.asked + QUERY_EVERY {
            self.query();
        }
        if self.now.is_multiple_of(LOOK_EVERY) {
            self.look();
        }
    }

    fn connect(&mut self) {
        if self.cuts.iter().any(|cut| cut.start == self.now) {
            let state = NetworkState::CutOff(unix_ns(self.now));
            self.view.network(state, unix_ns(self.now));
        }
        if self.cuts.iter().any(|cut| cut.end == self.now) {
            self.view.network(NetworkState::Open, unix_ns(self.now));
            for news in std::mem::take(&mut self.missed) {
                self.tell(news);
            }
            self.asked = 0;
        }
    }

    /// What the process does beside diagnosing.
    fn surround(&mut self, place: usize, lost: bool) {
        // A window ended, or a peer's answer concluded one.
        let noted = &self.processes[place].conditions;
        if !self.rig.diagnosers()[place].conditions().eq(noted) {
            self.note_conditions(place);
        }
        let is_tick = self.now.is_multiple_of(TICK);
        if is_tick {
            let at = self.at();
            self.processes[place].staleness.look(at, unix_ns(self.now));
            self.lapse(place);
        }
        if is_tick || !lost {
            self.tell_phase(place);
        }
        if self.now.is_multiple_of(STATUS_EVERY) {
            self.tell_status(place);
        }
    }

    fn lapse(&mut self, place: usize) {
        let now_unix_ns = unix_ns(self.now);
        let latest = self.rig.diagnosers()[place].last_transitions();
        let over = latest.filter(|latest| {
            let mut both = latest.shelved.iter().chain(&latest.suppressed);
            both.any(|shelving| shelving.span().is_over(now_unix_ns))
        });
        let over: Vec<_> = over.map(|latest| latest.component.clone()).collect();
        for component in over {
            let kind = GivenOrderKind::Lapse { now_unix_ns };
            let order =
                GivenOrder { kind, by: "trusswatch".into(), on_behalf_of: None, note: None };
            assert_eq!(self.rig.order(place, component, order), None);
        }
        self.publish();
    }

    /// Now and then an operator issues a command, mostly about what is not normal.
    fn order(&mut self) {
        if !self.generator.random_bool(1.0 / 700.0) {
            return;
        }
        let place = self.generator.random_range(0..self.processes.len());
        let process = &self.processes[place];
        if !process.is_up || process.staleness.is_stale() || process.last_sample.is_none() {
            return;
        }
        let diagnoser = &self.rig.diagnosers()[place];
        let all = diagnoser.components();
        let open = diagnoser.verdicts().filter(|(_, verdict)| **verdict != Verdict::Normal);
        let open: Vec<_> = open.map(|(component, _)| component.clone()).collect();
        let among = if open.is_empty() || self.generator.random_bool(0.2) { all } else { &open };
        let component = among[self.generator.random_range(0..among.len())].clone();
        let now = unix_ns(self.now);
        let until_unix_ns = now + self.generator.random_range(300..6000) * STEP_NS;
        let span = Span { since_unix_ns: now, until_unix_ns };
        let kind = match self.generator.random_range(0..12) {
            0..4 => GivenOrderKind::Acknowledge,
            4..7 => GivenOrderKind::Reset { force: false },
            7 => GivenOrderKind::Reset { force: true },
            8 => GivenOrderKind::Shelve(span),
            9 => GivenOrderKind::Unshelve,
            10 => GivenOrderKind::Suppress(span),
            _ => GivenOrderKind::Unsuppress,
        };
        let note = Some("seen".to_owned());
        let order = GivenOrder { kind, by: "ada".to_owned(), on_behalf_of: None, note };
        let _ = self.rig.order(place, component, order);
        self.publish();
        self.note_conditions(place);
    }

    fn query(&mut self) {
        self.asked = self.now;
        self.view.asked();
        for process in self.processes.iter().filter(|process| process.is_up) {
            let states = process.store.states(&process.speaker, |_| true, None, unix_ns(self.now));
            for published in states {
                self.view.state(published.state, Some("1".to_owned()), unix_ns(self.now));
            }
        }
        self.view.answered();
    }

    fn is_false(&mut self, what: &str, of: &ComponentPath, details: String) {
        let now = self.now;
        let text = format!("{of} at step {now}: {details}");
        self.false_words.entry(what.to_owned()).or_insert(text);
    }

    fn verdict(&self, path: &ComponentPath) -> Option<&Verdict> {
        let of_module = |diagnoser: &&diagnosis::Diagnoser| *diagnoser.module() == path.module;
        let mut verdicts = self.rig.diagnosers().iter().find(of_module)?.verdicts();
        verdicts.find(|(component, _)| **component == path.component).map(|(_, verdict)| verdict)
    }

    fn faults_of<'b>(&'b self, path: &'b ComponentPath) -> impl Iterator<Item = &'b TimedFault> {
        self.case.faults.iter().filter(move |fault| fault.component == *path)
    }

    /// What an event says.
    fn judge_transition(&mut self, message: &FaultTransition) {
        let path = &message.component;
        let [onset, detection, decided] =
            [message.onset_step, message.detection_step, message.decided_step].map(Option::unwrap);
        if onset > detection || (detection > decided && message.order.is_none()) {
            let steps = format!("{} {onset} {detection} {decided}", message.state());
            self.is_false("order of steps", path, steps);
        }
        match &message.verdict {
            Verdict::Latched => {
                let began = self.faults_of(path).map(|fault| fault.at).filter(|at| *at <= decided);
                let Some(began) = began.max() else {
                    return self.is_false("faulty", path, format!("{message:?}"));
                };
                let is_departure = message.symptom != Symptom::Change
                    && message.symptom != Symptom::NoSignal
                    && !message.before_service;
                let of_fault =
                    self.faults_of(path).filter(|fault| fault.at == began).last().cloned();
                if is_departure
                    && message.order.is_none()
                    && of_fault.is_some_and(|fault| {
                        onset > began.plus(1000) && self.is_seen(&fault, onset.minus(1000))
                    })
                {
                    let words = format!("agreed up to {onset}, faulty since {began}");
                    self.is_false("last agreement", path, words);
                }
            }
            Verdict::Explained { by, since } => {
                let caused = self.faults_of(by).any(|fault| {
                    let end = fault.until.map_or(u64::MAX, |until| until.0 + EFFECT_WITHIN);
                    fault.at <= *since && since.0 <= end
                });
                // Otherwise it changed first and is not decided itself, or explained in turn, or its alarm was raised
                // earlier: that its fault has been repaired does not show before it is reset.
                let is_open = self
                    .verdict(by)
                    .is_some_and(|verdict| !verdict.is_latched() && *verdict != Verdict::Normal);
                if !caused && !is_open && !self.alarmed.contains(by) {
                    let words = format!("by {by} since {since}, which was healthy");
                    self.is_false("explained by", path, words);
                }
            }
            _ => {}
        }
    }

    /// Compares what the view shows with the truth.
    fn look(&mut self) {
        let scene = self.view.scene(self.now, unix_ns(self.now));
        for module in &scene.modules {
            let Some(place) = self.place(module) else { continue };
            let process = &self.processes[place];
            let is_watched = process.is_up
                && !self.is_cut_off()
                && process.last_sample.is_some_and(|last| self.now - last <= STALE_AFTER + TICK)
                && self.rig.diagnosers()[place].phase() == ModulePhase::InService;
            if module.is_in_service() && !is_watched {
                let path = module.components[0].component.clone();
                self.is_false("in service", &path, format!("{:?}", module.phase_change));
            }
            for state in &module.components {
                self.judge_state(state, module, is_watched, place);
            }
        }
    }

    fn place(&self, module: &ModuleView) -> Option<usize> {
        self.processes.iter().position(|process| process.speaker.module == module.module)
    }

    fn judge_state(
        &mut self,
        state: &FaultTransition,
        module: &ModuleView,
        is_watched: bool,
        place: usize,
    ) {
        let path = &state.component;
        let diagnoser = &self.rig.diagnosers()[place];
        if state.state() == FaultState::Normal {
            let known = diagnoser.last_transition(&path.component);
            let is_open = known.is_some_and(|latest| latest.verdict != Verdict::Normal);
            let allows = state.condition.as_ref().is_some_and(Condition::allows_normal);
            if !is_watched || is_open || !allows {
                let latest = known.map(|known| &known.verdict);
                let words = format!("watched {is_watched}, {latest:?}, {:?}", state.condition);
                self.is_false("normal", path, words);
            }
        }
        if let Some(Condition::Agrees { from, as_of }) = &state.condition
            && state.is_verified()
            && state.state() != FaultState::Unknown
        {
            self.judge_agreement(path, *from, *as_of, state.state() == FaultState::Normal);
        }
        if state.state().is_fault() && self.faults_of(path).all(|fault| fault.at.0 > self.now) {
            self.is_false("faulty", path, state.state().to_string());
        }
        let row = StateRow::of_component(state);
        let hears = !module.is_silent && state.sequence > 0 && state.state() != FaultState::Unknown;
        if let Some((_, since)) = self.since.get(path).filter(|_| hears)
            && row.since_unix_ns != *since
        {
            let words = format!("{:?} instead of {since:?}: {}", row.since_unix_ns, state.state());
            self.is_false("since", path, words);
        }
        if row.since_unix_ns.is_some_and(|since| since > unix_ns(self.now)) {
            self.is_false("since", path, "the future".to_owned());
        }
    }

    /// Whether a component can have agreed with its reference in this window.
    fn judge_agreement(&mut self, path: &ComponentPath, from: Step, as_of: Step, is_normal: bool) {
        if is_normal && self.now > as_of.0 + AGREEMENT_WITHIN {
            self.is_false("agrees at present", path, format!("as of {as_of}"));
        }
        let during = self
            .faults_of(path)
            .find(|fault| fault.at <= from && fault.until.is_none_or(|until| until > as_of));
        let Some(during) = during else { return };
        if self.is_seen(during, from) {
            let words = format!("{} since {} agrees from {from}", during.fault, during.at);
            self.is_false("agrees", path, words);
        }
    }

    /// Whether the reference states that a fault of this size is detectable from this step on.
    fn is_seen(&self, fault: &TimedFault, from: Step) -> bool {
        let lasting = (from.0 - fault.at.0) as f64;
        let offset = match fault.fault {
            Fault::Bias { offset_m } => offset_m.abs(),
            Fault::Drift { drift_m_per_s } => drift_m_per_s.abs() * lasting * 1e-3,
            Fault::RandomWalk { drift_m_per_s, increment_m } => {
                drift_m_per_s.abs() * lasting * 1e-3 - 4.0 * increment_m * lasting.sqrt()
            }
            Fault::HardOver {} => return true,
            Fault::InternalLeakage { .. }
            | Fault::ExternalLeakageA { .. }
            | Fault::ExternalLeakageB { .. } => return from.0 >= fault.at.0 + LEAK_SEEN_AFTER,
            // What a gage reads that reads almost nothing is right.
            _ => return false,
        };
        let own = self.plant.into_iter().flat_map(|plant| &plant.setups);
        let smallest = own.filter_map(|setup| {
            let reference = setup.reference.as_ref()?;
            let place = reference.gages.iter().position(|gage| *gage == fault.component)?;
            reference.smallest_biases_m()[1].get(place).copied()
        });
        smallest.min_by(f64::total_cmp).is_some_and(|smallest| offset >= 2.0 * smallest)
    }

    /// What the journals say in the end.
    fn judge_journals(&mut self) {
        let histories: Vec<ModuleHistory> = self.processes.iter().map(Process::history).collect();
        let any = self.case.faults[0].component.clone();
        for contradiction in Journals::merge(&histories).contradictions {
            self.is_false("clocks", &any, contradiction.to_string());
        }
        let mut latest = BTreeMap::<&ComponentPath, &FaultTransition>::new();
        for transition in histories.iter().flat_map(|history| &history.transitions) {
            let before = latest.insert(&transition.component, transition);
            if let Some(before) = before
                && transition.decided_step < before.detection_step
            {
                let of = |t: &FaultTransition| format!("{} at {:?}", t.state(), t.decided_step);
                let words = format!("{}, then {}", of(before), of(transition));
                self.is_false("order of a journal", &transition.component, words);
            }
        }
    }
}

fn campaign(situations: &[Situation]) -> ConditionCampaign {
    ConditionCampaign {
        system: tower::system(0.1, 20_261_127),
        situations: situations.to_vec(),
        hidden: HiddenFaults::default(),
        plants: 1,
        cases: 1_000_000,
        alone: false,
    }
}

/// Some modules lose samples or their process for seconds, and some views their connection.
fn disturb(case: &mut CampaignCase<Situation>) -> Vec<std::ops::Range<u64>> {
    let mut generator = ChaCha8Rng::seed_from_u64(case.seed ^ 1);
    let mut stretch = |longest: u64| {
        let from = generator.random_range(3000..case.steps);
        (generator.random_range(0..4), from, from + generator.random_range(1..longest))
    };
    let (place, from, until) = stretch(4000);
    let is_free = |gap: &SampleGap| gap.place != place || gap.until.0 < from || gap.from.0 > until;
    if place < 2 && case.gaps.iter().all(is_free) {
        let (from, until, restarted) = (Step(from), Step(until), from % 2 == 0);
        case.gaps.push(SampleGap { place, from, until, restarted });
    }
    let (chance, from, until) = stretch(8000);
    if chance == 0 { std::iter::once(from..until).collect() } else { Vec::new() }
}

/// What is false of a history.
fn false_words(number: u64) -> BTreeMap<String, String> {
    let hidden = [Situation::InAGap, Situation::WhileDown, Situation::Drift, Situation::Second];
    let situations = if number.is_multiple_of(4) { &hidden } else { &Situation::HISTORIES };
    let (campaign, plant) = (campaign(situations), (!number.is_multiple_of(5)).then_some(&*PLANT));
    let mut case = campaign.draw(number / 4 * 3 + number % 4, Some(&PLANT)).unwrap();
    case.steps = case.steps.min(60_000);
    let cuts = disturb(&mut case);
    let faults = case.faults.clone();
    let rig = match plant {
        Some(plant) => plant.rig(case.seed, faults).unwrap(),
        None => campaign.system.rig(case.seed, faults).unwrap(),
    };
    World::new(&case, cuts, plant, rig).false_words()
}

fn nothing_is_false(numbers: std::ops::Range<u64>) {
    let mut found = BTreeMap::<String, Vec<String>>::new();
    let worker = |first: u64| {
        let numbers = numbers.clone().filter(move |number| number % 2 == first);
        let told = |number| (number, false_words(number));
        numbers
            .map(told)
            .inspect(|told| {
                if !told.1.is_empty() {
                    println!("{told:?}")
                }
            })
            .collect::<Vec<_>>()
    };
    let results = std::thread::scope(|scope| {
        [scope.spawn(|| worker(0)), scope.spawn(|| worker(1))].map(|thread| thread.join().unwrap())
    });
    for (number, words) in results.into_iter().flatten() {
        for (what, details) in words {
            found.entry(what).or_default().push(format!("history {number}: {details}"));
        }
    }
    for (what, cases) in &found {
        println!(
            "{what}: {} histories, such as\n  {}",
            cases.len(),
            cases[..cases.len().min(6)].join("\n  ")
        );
    }
    assert!(found.is_empty());
}

/// Killed while the effects of a fault go on, a diagnoser takes the samples from before that the publisher still has.
#[test]
fn what_is_recovered_after_a_restart_is_told_in_its_order() {
    for (seed, down) in [(1, 700..4200), (2, 300..3600), (3, 1100..4000)] {
        let at = 9283;
        let fault = TimedFault {
            at: Step(at),
            until: None,
            component: "module1/sensor/g2".parse().unwrap(),
            fault: tower::bias(3e-4),
        };
        let gap = SampleGap {
            place: 0,
            from: Step(at + down.start),
            until: Step(at + down.end),
            restarted: true,
        };
        let case = CampaignCase {
            number: 0,
            kind: Situation::WhileDown,
            seed,
            faults: vec![fault],
            gaps: vec![gap],
            kept_samples: 4000,
            steps: at + 9000,
        };
        let rig = PLANT.rig(seed, case.faults.clone()).unwrap();
        let world = World::new(&case, Vec::new(), Some(&PLANT), rig);
        assert_eq!(world.false_words(), BTreeMap::new());
    }
}

#[test]
fn what_is_shown_of_components_is_never_false() {
    nothing_is_false(0..40);
}

#[test]
#[ignore = "takes minutes: profile nightly"]
fn two_thousand_histories_are_shown_as_they_were() {
    nothing_is_false(0..2000);
}
