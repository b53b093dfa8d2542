//! A world: the plant, its modules' computers and what is between them, on virtual time. Everything that happens is taken
//! from one queue in the order of its time, and is decided by the seed.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use diagnosis::identification::{IdentificationResult, identify};
use diagnosis::{Event, Measurements, PeerFailure};
use observer::feed::{Incoming, ModuleAnswer, ModuleKey, ModuleQuery};
use plant::{ModuleMessage, Plant, Tolerance, ToleranceSettings};
use process::{
    Context, Effect, Now, Outgoing, PublisherId, ReceivedSample, Routine, SampleSource,
    StatusSurroundings, TICK,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocabulary::{
    Capability, Component, ComponentPath, FaultState, ModuleName, ModulePhase, Order, OrderKind,
    RunId, SampleQuestion, StateAnswer, StateQuestion, Step,
};

use crate::check::Watcher;
use crate::coverage::Coverage;
use crate::module::{Computer, INCUMBENT, MOST_SHUT_OFF, QueryId, Reception, RunningProcess};
use crate::scenario::{DisturbanceKind, END, Scenario};
use crate::setup::{Setup, SimulationError};
use crate::trace::Trace;
use crate::view::View;

pub(crate) const MS: u64 = 1_000_000;
pub(crate) const SECOND: u64 = 1_000 * MS;
/// The system clocks at the beginning \[ns since 1970\].
pub(crate) const BEGIN_UNIX_NS: u64 = 1_800_000_000 * SECOND;
/// A message takes so long \[ns\].
const HOP: std::ops::Range<u64> = 100_000..600_000;
/// A disk takes so long \[ns\].
const DISK: std::ops::Range<u64> = MS..6 * MS;
/// Samples that the publisher keeps.
const KEPT: usize = 8192;
/// How long samples are asked for in vain, and how often \[ns\].
const FETCHED_FOR: u64 = 9 * SECOND;
const FETCH_AGAIN: u64 = 550 * MS;
/// How long an operator waits for a reply \[ns\].
const ORDER_TIMEOUT: u64 = 3 * SECOND;
/// An identification takes so long \[ns\].
const IDENTIFYING: u64 = 8 * MS;

/// What happens.
#[derive(Debug)]
pub(crate) enum Happening {
    Measure,
    Sample {
        to: usize,
        source: SampleSource,
        sample: Measurements,
        published_unix_ns: u64,
    },
    Tick {
        of: usize,
        life: u64,
    },
    PauseEnds {
        of: usize,
        life: u64,
    },
    DiskWakes {
        of: usize,
        life: u64,
    },
    DiskAnswers {
        of: usize,
        life: u64,
    },
    OutletWakes {
        of: usize,
        life: u64,
    },
    Identified {
        of: usize,
        life: u64,
        found: Box<IdentificationResult>,
    },
    Fetch {
        of: usize,
        life: u64,
        question: SampleQuestion,
        until: u64,
    },
    Asked {
        to: usize,
        query: QueryId,
        question: StateQuestion,
    },
    Ordered {
        to: usize,
        query: QueryId,
        order: usize,
    },
    Replied {
        query: QueryId,
        reply: Reply,
    },
    TimedOut {
        query: QueryId,
    },
    PeerReturned {
        to: usize,
        life: u64,
        peer: usize,
    },
    Begins(usize),
    Ends(usize),
    Orders(usize),
    Starts {
        of: usize,
    },
    ViewOpens,
    ViewLooks,
    ViewAsksStates,
    ViewHears(Box<Incoming>),
    ViewAsked {
        of: usize,
        key: ModuleKey,
        query: ModuleQuery,
    },
    PlantHears(Box<ModuleMessage>),
    PeerHears {
        to: usize,
        life: u64,
        said: Box<Capability>,
    },
    /// With whether it ends a question to one module.
    ViewAnswered(Box<ModuleAnswer>, bool),
}

/// How a query ends.
#[derive(Debug, Clone)]
pub(crate) enum Reply {
    Answer(Box<StateAnswer>),
    Refused(String),
    Obeyed(FaultState),
    Absent,
}

/// Who asked what, and waits.
#[derive(Debug)]
pub(crate) struct OpenQuery {
    pub(crate) from: Option<(usize, u64)>,
    peer: usize,
    question: Option<StateQuestion>,
    timeout: Duration,
    order: Option<usize>,
}

/// How a world ended.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// What must never happen and did, with when \[s\].
    pub violations: Vec<String>,
    /// What happened of what must sometimes happen.
    pub coverage: Coverage,
    /// Everything.
    pub trace: Trace,
    /// The components that are held for faulty at the end, or were until they were reset.
    pub named: BTreeSet<ComponentPath>,
    /// Hours that modules watched.
    pub module_hours: f64,
}

/// A world that runs.
pub struct World<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) scenario: &'a Scenario,
    draw: ChaCha8Rng,
    pub(crate) plant: Plant,
    /// What another publisher measures.
    other: Option<Plant>,
    /// The same plant without any fault.
    healthy: Plant,
    tolerance: Tolerance,
    /// What modules say of their components, until the next step.
    heard: Vec<Result<ModuleMessage, String>>,
    origin: Instant,
    pub(crate) now: u64,
    number: u64,
    queue: BTreeMap<(u64, u64), Happening>,
    pub(crate) computers: Vec<Computer>,
    /// The samples that the publisher keeps, the oldest first.
    kept: VecDeque<Vec<Measurements>>,
    pub(crate) queries: BTreeMap<QueryId, OpenQuery>,
    asked: u64,
    active: Vec<DisturbanceKind>,
    /// What each fault was last said to be.
    kinds: BTreeMap<ComponentPath, String>,
    samples: Vec<Measurements>,
    trace: Trace,
    pub(crate) coverage: Coverage,
    pub(crate) watcher: Watcher,
    pub(crate) view: View,
}

impl<'a> World<'a> {
    /// The world of a scenario, before anything happens in it.
    ///
    /// # Errors
    /// Its plant cannot be made.
    pub fn new(
        setup: &'a Setup,
        scenario: &'a Scenario,
        keep: bool,
    ) -> Result<Self, SimulationError> {
        let modules = setup.modules.len();
        let mut plant = setup.plant(scenario.seed)?;
        let healthy = plant.clone();
        let tolerance = ToleranceSettings {
            corrected_readings: true,
            reallocation: true,
            most_shut_off: MOST_SHUT_OFF,
            ..ToleranceSettings::default()
        };
        let step_s = setup.step_ns() as f64 / 1e9;
        let mut world = Self {
            setup,
            scenario,
            draw: ChaCha8Rng::seed_from_u64(scenario.seed ^ 0x5eed),
            tolerance: Tolerance::new(&tolerance, step_s, RunId(1), &mut plant),
            heard: Vec::new(),
            plant,
            healthy,
            other: None,
            origin: Instant::now(),
            now: 0,
            number: 0,
            queue: BTreeMap::new(),
            computers: (0..modules).map(Computer::new).collect(),
            kept: VecDeque::new(),
            queries: BTreeMap::new(),
            asked: 0,
            active: Vec::new(),
            kinds: BTreeMap::new(),
            samples: Vec::new(),
            trace: Trace::new(keep),
            coverage: Coverage::default(),
            watcher: Watcher::new(setup, scenario),
            view: View::default(),
        };
        for place in 0..modules {
            world.at(0, Happening::Starts { of: place });
        }
        world.at(setup.step_ns(), Happening::Measure);
        for (place, one) in scenario.disturbances.iter().enumerate() {
            world.at(one.from_ms * MS, Happening::Begins(place));
            world.at(one.until_ms * MS, Happening::Ends(place));
        }
        for (place, order) in scenario.orders.iter().enumerate() {
            world.at(order.at_ms * MS, Happening::Orders(place));
        }
        world.open_view();
        world.note_faults();
        Ok(world)
    }

    /// Runs it to its end.
    ///
    /// # Errors
    /// A fault does not fit the plant.
    pub fn run(mut self) -> Result<Outcome, SimulationError> {
        while let Some((&(time, number), _)) = self.queue.first_key_value() {
            if time > END * MS {
                break;
            }
            let Some(happening) = self.queue.remove(&(time, number)) else { break };
            self.now = time;
            self.happen(number, happening)?;
        }
        self.end();
        let named = self.watcher.named();
        let module_hours = self.setup.modules.len() as f64 * END as f64 / 3.6e6;
        let Self { trace, coverage, watcher, .. } = self;
        Ok(Outcome { violations: watcher.violations, coverage, trace, named, module_hours })
    }

    pub(crate) fn at(&mut self, time: u64, happening: Happening) {
        self.number += 1;
        self.queue.insert((time, self.number), happening);
    }

    pub(crate) fn after(&mut self, ns: u64, happening: Happening) {
        self.at(self.now + ns, happening);
    }

    pub(crate) fn instant(&self, time: u64) -> Instant {
        self.origin + Duration::from_nanos(time)
    }

    pub(crate) fn clocks(&self, of: usize) -> Now {
        let unix_ns = (BEGIN_UNIX_NS + self.now).saturating_add_signed(self.computers[of].clock_ns);
        Now { at: self.instant(self.now), unix_ns }
    }

    pub(crate) fn name(&self, place: usize) -> &'a ModuleName {
        &self.setup.modules[place].setup.module
    }

    pub(crate) fn is_active(&self, wanted: impl Fn(DisturbanceKind) -> bool) -> bool {
        self.active.iter().any(|one| wanted(*one))
    }

    /// The module whose process something is about; it happens when that moves again.
    fn subject(happening: &Happening) -> Option<(usize, Option<u64>)> {
        match happening {
            Happening::Tick { of, life }
            | Happening::PauseEnds { of, life }
            | Happening::DiskWakes { of, life }
            | Happening::DiskAnswers { of, life }
            | Happening::OutletWakes { of, life }
            | Happening::Identified { of, life, .. }
            | Happening::Fetch { of, life, .. }
            | Happening::PeerHears { to: of, life, .. }
            | Happening::PeerReturned { to: of, life, .. } => Some((*of, Some(*life))),
            Happening::Sample { to, .. }
            | Happening::Asked { to, .. }
            | Happening::ViewAsked { of: to, .. }
            | Happening::Ordered { to, .. } => Some((*to, None)),
            _ => None,
        }
    }

    fn happen(&mut self, number: u64, happening: Happening) -> Result<(), SimulationError> {
        if let Some((of, life)) = Self::subject(&happening) {
            let computer = &self.computers[of];
            if life.is_some_and(|life| life != computer.life) {
                return Ok(());
            }
            if computer.frozen_until > self.now {
                self.queue.insert((computer.frozen_until, number), happening);
                return Ok(());
            }
        }
        match happening {
            Happening::Measure => self.measure()?,
            Happening::Sample { to, source, sample, published_unix_ns } => {
                self.receive(to, source, sample, published_unix_ns);
            }
            Happening::Tick { of, life } => self.tick(of, life),
            Happening::PauseEnds { of, .. } => self.end_pause(of),
            Happening::DiskWakes { of, .. } => self.write(of),
            Happening::DiskAnswers { of, .. } => self.written(of),
            Happening::OutletWakes { of, .. } => self.publish(of),
            Happening::Identified { of, found, .. } => self.identified(of, *found),
            Happening::Fetch { of, life, question, until } => self.fetch(of, life, question, until),
            Happening::Asked { to, query, question } => self.asked(to, query, question),
            Happening::Ordered { to, query, order } => self.ordered(to, query, order),
            Happening::Replied { query, reply } => self.replied(query, reply),
            Happening::TimedOut { query } => self.timed_out(query),
            Happening::PeerReturned { to, peer, .. } => {
                self.coverage.reach("a peer asked again after it came back");
                let peer = self.name(peer).clone();
                self.take(to, |running, context| {
                    running.answer(Event::Returned { peer }, context);
                });
            }
            Happening::Begins(place) => self.begin(place)?,
            Happening::Ends(place) => self.finish(place),
            Happening::Orders(place) => self.order(place),
            Happening::Starts { of } => self.start(of)?,
            Happening::PlantHears(said) => self.heard.push(Ok(*said)),
            Happening::PeerHears { to, said, .. } => {
                let now = self.instant(self.now);
                if let Some(running) = self.computers[to].process.as_mut() {
                    running.around.interlock.hear(&said.module, &said.cylinders, now);
                }
            }
            Happening::ViewOpens => self.view_opens(),
            Happening::ViewLooks => self.view_looks(),
            Happening::ViewAsksStates => self.view_asks_states(),
            Happening::ViewHears(incoming) => self.view_hears(*incoming),
            Happening::ViewAsked { of, key, query } => self.view_asked(of, key, query),
            Happening::ViewAnswered(answer, is_one) => self.view_answered(*answer, is_one),
        }
        Ok(())
    }

    // The plant and its publisher.

    fn measure(&mut self) -> Result<(), SimulationError> {
        let step = self.plant.next_step();
        for fault in &self.scenario.faults {
            if fault.until == Some(step) {
                self.plant.clear(&fault.component)?;
                self.trace.note(self.now, format_args!("{} is healthy again", fault.component));
                let place = self.place_of(&fault.component.module);
                if self.computers[place].process.is_none() {
                    self.coverage.reach("a fault ended while its module was down");
                }
            }
            if fault.at == step {
                self.plant.inject(&fault.component, fault.fault)?;
                let kind = fault.fault.kind();
                self.trace.note(self.now, format_args!("{} is faulty: {kind}", fault.component));
                self.note_onset(&fault.component);
            }
        }
        self.control();
        let mut samples = std::mem::take(&mut self.samples);
        read(&mut self.plant, RunId(1), &mut samples);
        self.healthy.advance();
        self.watcher.drift(self.now, drift_m(&self.plant, &self.healthy));
        for one in &self.active {
            if let DisturbanceKind::NoValue(module, gage) = *one
                && let Some(value) = samples[module].elongations_m.get_mut(gage)
            {
                *value = f64::NAN;
            }
        }
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(samples.clone());
        if !self.is_active(|one| one == DisturbanceKind::SilentPublisher) {
            self.send(&samples, 1);
        }
        self.samples = samples;
        if let Some(other) = &mut self.other {
            let mut samples = Vec::new();
            read(other, RunId(2), &mut samples);
            self.send(&samples, 2);
        }
        self.after(self.setup.step_ns(), Happening::Measure);
        Ok(())
    }

    /// The controller acts on what modules say of their components.
    fn control(&mut self) {
        let now = self.instant(self.now);
        let heard = std::mem::take(&mut self.heard);
        if self.tolerance.follow(heard, &mut self.plant, now) {
            for component in self.tolerance.done_without() {
                self.coverage.reach(match component.component {
                    Component::Sensor(_) => "the controller used what a gage should read",
                    Component::Actuator(_) => "the controller did without a cylinder",
                });
            }
        }
        for cylinder in self.tolerance.shut_off_cylinders() {
            if self.watcher.shut_off.insert(cylinder.clone()) {
                self.coverage.reach("a cylinder was shut off");
                self.trace.note(self.now, format_args!("{cylinder} is shut off"));
            }
        }
    }

    fn send(&mut self, samples: &[Measurements], publisher: u8) {
        let loss = self.active.iter().fold(0.0_f64, |most, one| match one {
            DisturbanceKind::Loss(share) => most.max(*share),
            _ => most,
        });
        let twice = self.active.iter().fold(0.0_f64, |most, one| match one {
            DisturbanceKind::Twice(share) => most.max(*share),
            _ => most,
        });
        let id = PublisherId { session: [publisher; 16], entity: 1 };
        let source = SampleSource { publisher: Some(id), run: RunId(u64::from(publisher)) };
        let published_unix_ns = BEGIN_UNIX_NS + self.now;
        for (to, sample) in samples.iter().enumerate() {
            if loss > 0.0 && self.draw.random_bool(loss) {
                continue;
            }
            let times = if twice > 0.0 && self.draw.random_bool(twice) { 2 } else { 1 };
            for _ in 0..times {
                let Some(delay) = self.way(None, Some(to)) else { continue };
                let sample = sample.clone();
                self.after(delay, Happening::Sample { to, source, sample, published_unix_ns });
            }
        }
    }

    /// How long a message takes, if it arrives. Outside of modules are the publisher, operators and views.
    pub(crate) fn way(&mut self, from: Option<usize>, to: Option<usize>) -> Option<u64> {
        let mut delay = self.draw.random_range(HOP);
        for one in &self.active {
            match *one {
                DisturbanceKind::NoRouter => return None,
                DisturbanceKind::CutOff(module) if from == Some(module) || to == Some(module) => {
                    return None;
                }
                DisturbanceKind::Deaf(module) if to == Some(module) => return None,
                DisturbanceKind::Mute(module) if from == Some(module) => return None,
                DisturbanceKind::Split(module) => {
                    if let (Some(from), Some(to)) = (from, to)
                        && (from < module) != (to < module)
                    {
                        return None;
                    }
                }
                DisturbanceKind::Late(ms) => delay += self.draw.random_range(0..=ms) * MS,
                _ => {}
            }
        }
        Some(delay)
    }

    // A module's process.

    fn start(&mut self, of: usize) -> Result<(), SimulationError> {
        let now = self.clocks(of);
        let computer = &mut self.computers[of];
        computer.disk.is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        computer.start(self.setup, now).map_err(|problems| {
            let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
            SimulationError::Setup(problems.join("; "))
        })?;
        let life = computer.life;
        self.trace.note(self.now, format_args!("{} starts", self.setup.modules[of].setup.module));
        if life > 1 {
            self.note_restart(of);
        }
        self.tell_presence(of, true);
        self.after(0, Happening::Tick { of, life });
        self.after(0, Happening::DiskWakes { of, life });
        for peer in (0..self.computers.len()).filter(|peer| *peer != of && life > 1) {
            let life = self.computers[peer].life;
            if let Some(delay) = self.way(Some(of), Some(peer)) {
                self.after(delay, Happening::PeerReturned { to: peer, life, peer: of });
            }
        }
        Ok(())
    }

    /// Gives a process an input, and carries out its effects.
    fn take<T>(
        &mut self,
        of: usize,
        input: impl FnOnce(&mut process::ModuleProcess<QueryId>, &mut Context<'_, QueryId>) -> T,
    ) -> Option<T> {
        let now = self.clocks(of);
        let mut effects = Vec::new();
        let output = {
            let RunningProcess { module, store, around, .. } =
                self.computers[of].process.as_mut()?;
            let mut context = Context { now, store, surroundings: around, effects: &mut effects };
            input(module, &mut context)
        };
        effects.into_iter().for_each(|effect| self.carry_out(of, effect));
        self.write(of);
        self.publish(of);
        Some(output)
    }

    fn receive(
        &mut self,
        to: usize,
        source: SampleSource,
        sample: Measurements,
        time_unix_ns: u64,
    ) {
        let received = self.instant(self.now);
        let room = self.setup.modules[to].settings.sample_queue;
        let Some(running) = self.computers[to].process.as_mut() else { return };
        let arrival = ReceivedSample { sample, time_unix_ns, received };
        let own = usize::from(source.run == RunId(2));
        let other_heard = running.heard[1 - own];
        running.heard[own] = Some(self.now);
        let reception = running.receive(source, arrival, room);
        let others = other_heard.is_some_and(|at| self.now - at < INCUMBENT.as_nanos() as u64 / 2);
        if reception == Reception::TakenOver && others {
            let what = format!("{} left a publisher that it heard", self.name(to));
            self.watcher.violated(self.now, what);
        }
        match reception {
            Reception::Queued => {}
            Reception::PutAside => self.coverage.reach("another publisher's samples put aside"),
            Reception::TakenOver => self.coverage.reach("another publisher taken over"),
            Reception::Dropped => {
                if let Some(running) = self.computers[to].process.as_mut() {
                    running.may_miss_samples = true;
                }
                self.coverage.reach("samples dropped because too many waited");
            }
        }
        self.pump(to);
    }

    /// Diagnoses what there is to be diagnosed.
    fn pump(&mut self, of: usize) {
        loop {
            let Some(running) = self.computers[of].process.as_mut() else { return };
            if running.module.pause().is_none()
                && let Some(arrival) = running.inbox.pop_front()
            {
                running.module.sample(arrival);
            }
            running.around.corrects = running.module.diagnoser().replaces_any();
            while self.take(of, process::ModuleProcess::advance) == Some(true) {}
            let Some(running) = self.computers[of].process.as_mut() else { return };
            if let Some(until) = running.module.pause() {
                let ends = u64::try_from(until.duration_since(self.origin).as_nanos());
                let ends = ends.unwrap_or(u64::MAX);
                if running.pause_ends != Some(ends) {
                    running.pause_ends = Some(ends);
                    let life = self.computers[of].life;
                    self.coverage.reach("samples waited for a peer's answer");
                    self.at(ends, Happening::PauseEnds { of, life });
                }
                return;
            }
            running.pause_ends = None;
            if running.inbox.is_empty() {
                return;
            }
        }
    }

    fn end_pause(&mut self, of: usize) {
        let now = self.instant(self.now);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        if running.module.pause().is_some_and(|until| until <= now) {
            running.module.end_pause();
            self.coverage.reach("the wait for a peer's answer expired");
        }
        self.pump(of);
    }

    fn tick(&mut self, of: usize, life: u64) {
        let now = self.instant(self.now);
        let room = self.setup.modules[of].settings.sample_queue;
        let Some(running) = self.computers[of].process.as_mut() else { return };
        if running.promote(now, room) {
            self.coverage.reach("another publisher taken over");
        }
        let overflown = std::mem::take(&mut running.overflown);
        self.take(of, |module, context| module.tick(overflown, context));
        self.pump(of);
        self.after(TICK.as_nanos() as u64, Happening::Tick { of, life });
    }

    fn carry_out(&mut self, of: usize, effect: Effect<QueryId>) {
        let life = self.computers[of].life;
        let module = self.name(of);
        match effect {
            Effect::Publish(event) => {
                let Some(running) = self.computers[of].process.as_mut() else { return };
                running.outlet.push_back(event);
            }
            Effect::Routine(Routine::Answer { query, answer }) => self.answer(of, query, answer),
            Effect::Routine(Routine::Refusal { query, reason }) => {
                self.reply(of, query, Reply::Refused(reason));
            }
            Effect::Routine(Routine::Capability(said)) => self.tell_capability(of, said),
            Effect::Routine(Routine::Corrected(said)) => {
                if let Some(delay) = self.way(Some(of), None) {
                    let said = Box::new(ModuleMessage::Readings(said));
                    self.after(delay, Happening::PlantHears(said));
                }
            }
            Effect::Routine(_) => {}
            Effect::Fetch(question) => {
                let SampleQuestion { from, to, .. } = question;
                self.trace.note(self.now, format_args!("{module} fetches {from} to {to}"));
                if to.since(from) > 1000 {
                    self.coverage.reach("a fetch of more than a thousand samples");
                }
                let until = self.now + FETCHED_FOR;
                self.after(0, Happening::Fetch { of, life, question, until });
            }
            Effect::Ask { peer, question } => self.ask(of, &peer, question),
            Effect::Identify(excerpt) => {
                let found = Box::new(identify(&excerpt, None));
                self.after(IDENTIFYING, Happening::Identified { of, life, found });
            }
            Effect::Freeze { .. } | Effect::SampleRefused(_) => {}
            Effect::Status { .. } => self.status(of),
            Effect::DropQueuedSamples => {
                self.coverage.reach("a backlog dropped");
                self.trace.note(self.now, format_args!("{module} drops its backlog"));
                if let Some(running) = self.computers[of].process.as_mut() {
                    running.inbox.clear();
                    running.may_miss_samples = true;
                }
            }
            Effect::AnswerRejected { peer, reason } => {
                self.coverage.reach("an answer rejected");
                let line = format_args!("{module} rejects what {peer} says: {reason}");
                self.trace.note(self.now, line);
            }
            Effect::WordBroken(peer) => {
                self.coverage.reach("a peer that broke its word");
                self.trace.note(self.now, format_args!("{module}: {peer} broke its word"));
            }
        }
    }

    fn tell_capability(&mut self, of: usize, said: Capability) {
        for to in (0..self.computers.len()).filter(|to| *to != of) {
            if let Some(delay) = self.way(Some(of), Some(to)) {
                let (life, said) = (self.computers[to].life, Box::new(said.clone()));
                self.after(delay, Happening::PeerHears { to, life, said });
            }
        }
        if let Some(delay) = self.way(Some(of), None) {
            self.after(delay, Happening::PlantHears(Box::new(ModuleMessage::Cylinders(said))));
        }
    }

    fn status(&mut self, of: usize) {
        let now = self.clocks(of);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let around = StatusSurroundings {
            queued_samples: running.inbox.len(),
            ..StatusSurroundings::default()
        };
        let status = running.module.status(&running.store, around, now);
        if status.phase == ModulePhase::Stale {
            self.coverage.reach("a module stale");
        }
        self.watcher.status(self.now, &status);
        self.tell_view(of, Incoming::Status(Box::new(status)));
    }

    // What goes out of it.

    /// Publishes events whose records the disk has, or has not had for too long.
    fn publish(&mut self, of: usize) {
        loop {
            let life = self.computers[of].life;
            let now = self.instant(self.now);
            let Some(running) = self.computers[of].process.as_mut() else { return };
            let Some(front) = running.outlet.front() else { return };
            let Some(durable) = running.store.writes.answer(front.ticket, now) else {
                let left = running.store.writes.left(now).as_nanos() as u64;
                self.after(left.max(1), Happening::OutletWakes { of, life });
                return;
            };
            let ticket = front.ticket;
            let hangs = running.store.writes.note_hang(ticket).is_some();
            let Some(mut queued) = running.outlet.pop_front() else { return };
            queued.event.set_durable(durable);
            if hangs {
                self.coverage.reach("a fault published although the disk hangs");
            }
            self.published(of, queued.event);
        }
    }

    fn published(&mut self, of: usize, event: Outgoing<QueryId>) {
        match event {
            Outgoing::Fault(transition) => {
                let (component, state) = (&transition.component, transition.state());
                let words = match transition.verdict.explained_by() {
                    Some(by) => format!("{state} by {by}"),
                    None => state.to_string(),
                };
                let number = transition.sequence;
                let durable = if transition.durable { "" } else { ", not on disk" };
                let line = format_args!("{component}: {words}, number {number}{durable}");
                self.trace.note(self.now, line);
                self.note_transition(of, &transition);
                self.tell_view(of, Incoming::Transition(transition.clone()));
                if self.watcher.transition(self.now, of, &transition) {
                    self.coverage.reach("a number given again after a loss of power");
                }
            }
            Outgoing::Phase(change) => {
                let (module, phase) = (&change.module, change.phase);
                let line = format_args!("{module}: {}: {}", phase.as_str(), change.reason);
                self.trace.note(self.now, line);
                self.tell_view(of, Incoming::Phase((*change).clone()));
                if phase == ModulePhase::InService && change.before == Some(ModulePhase::Stale) {
                    self.coverage.reach("a module in service again");
                }
            }
            Outgoing::Obeyed { query, obeyed } => {
                self.reply(of, query, Reply::Obeyed(obeyed.state))
            }
            Outgoing::Identification(found) => {
                self.coverage.reach("a fault identified");
                self.tell_view(of, Incoming::Identification(found.clone()));
                if found.decided {
                    self.coverage.reach("an identification decided");
                }
                let kind = found.candidates.first().map(|candidate| candidate.kind.to_string());
                let kind = kind.unwrap_or_else(|| "nothing known".to_owned());
                let before = self.kinds.insert(found.component.clone(), kind.clone());
                if before.is_some_and(|before| before != kind) {
                    self.coverage.reach("an identification changed");
                }
                self.trace.note(self.now, format_args!("{} may be: {kind}", found.component));
            }
            Outgoing::Input(input) => {
                if matches!(input.taken, vocabulary::Taken::RunBegan { .. }) && input.number > 2 {
                    self.coverage.reach("a new run began");
                }
            }
            Outgoing::Change(_) => {}
        }
    }

    fn identified(&mut self, of: usize, found: IdentificationResult) {
        let now = self.clocks(of);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let message = running.module.speaker().identification(found, now.unix_ns);
        let event = Outgoing::Identification(Box::new(message));
        if let Some(queued) = running.store.enter(event, now.at) {
            running.outlet.push_back(queued);
        }
        self.write(of);
        self.publish(of);
    }

    // Its disk.

    /// Has the disk write what waits, unless it is busy.
    fn write(&mut self, of: usize) {
        let (now, life) = (self.instant(self.now), self.computers[of].life);
        let hangs_until = self.scenario.disturbances.iter().filter(|one| {
            one.what == DisturbanceKind::HungDisk(of) && self.is_now(one.from_ms, one.until_ms)
        });
        let hangs_until = hangs_until.map(|one| one.until_ms * MS).max();
        let slow = self.active.iter().filter_map(|one| match *one {
            DisturbanceKind::SlowDisk(module, ms) if module == of => Some(ms * MS),
            _ => None,
        });
        let slow = slow.max();
        let computer = &mut self.computers[of];
        let Some(running) = computer.process.as_mut() else { return };
        if running.writing.is_some() {
            return;
        }
        if running.store.writes.is_empty() && running.keeper.retry().is_none() {
            return;
        }
        if running.store.writes.is_empty() && !running.retries_now(now) {
            return;
        }
        let batch = running.keeper.take(&mut running.store, &computer.disk, now);
        if batch.1.is_some() {
            self.coverage.reach("a new file of the journal");
        }
        running.writing = Some(batch);
        let takes = slow.unwrap_or_else(|| self.draw.random_range(DISK));
        let at = hangs_until.unwrap_or(self.now) + takes;
        self.at(at, Happening::DiskAnswers { of, life });
    }

    fn written(&mut self, of: usize) {
        let (now, life) = (self.instant(self.now), self.computers[of].life);
        let is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        let computer = &mut self.computers[of];
        computer.disk.is_full = is_full;
        let Some(running) = computer.process.as_mut() else { return };
        let Some(batch) = running.writing.take() else { return };
        let had_problem = running.keeper.status.problem.is_some();
        let durable = running.keeper.write(batch, &mut computer.disk);
        let status = running.keeper.status.clone();
        running.store.writes.settle(durable, status, now);
        if durable && had_problem {
            self.coverage.reach("a record written after the disk came back");
        }
        if let Some(retry) = running.keeper.retry() {
            running.retry_at = Some(now + retry);
            self.after(retry.as_nanos() as u64, Happening::DiskWakes { of, life });
        }
        self.publish(of);
        self.write(of);
    }

    // Queries.

    fn open_query(&mut self, query: OpenQuery) -> QueryId {
        self.asked += 1;
        self.queries.insert(self.asked, query);
        self.asked
    }

    fn ask(&mut self, of: usize, peer: &ModuleName, question: StateQuestion) {
        let to = self.place_of(peer);
        let life = self.computers[of].life;
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let timeout = running.timeouts.of_next(peer);
        let query = self.open_query(OpenQuery {
            from: Some((of, life)),
            peer: to,
            question: Some(question),
            timeout,
            order: None,
        });
        let line = format_args!("{} asks {peer} about {}", self.name(of), question.as_of);
        self.trace.note(self.now, line);
        self.after(timeout.as_nanos() as u64, Happening::TimedOut { query });
        if let Some(delay) = self.way(Some(of), Some(to)) {
            self.after(delay, Happening::Asked { to, query, question });
        }
    }

    fn asked(&mut self, to: usize, query: QueryId, question: StateQuestion) {
        if self.computers[to].process.is_none() {
            self.coverage.reach("a question to a peer that is down");
            let Some(delay) = self.way(Some(to), None) else { return };
            return self.after(delay, Happening::Replied { query, reply: Reply::Absent });
        }
        self.take(to, |module, context| module.question(question, query, context));
        self.pump(to);
    }

    fn answer(&mut self, of: usize, query: QueryId, mut answer: StateAnswer) {
        if self.active.contains(&DisturbanceKind::Liar(of)) {
            self.coverage.reach("a liar asked");
            answer.changes.clear();
            answer.actuator_faults.clear();
            answer.alarms.clear();
        }
        self.reply(of, query, Reply::Answer(Box::new(answer)));
    }

    fn reply(&mut self, of: usize, query: QueryId, reply: Reply) {
        let asker = self.queries.get(&query).and_then(|open| open.from);
        if let Some(delay) = self.way(Some(of), asker.map(|(place, _)| place)) {
            self.after(delay, Happening::Replied { query, reply });
        }
    }

    fn replied(&mut self, query: QueryId, reply: Reply) {
        // It may have timed out.
        let Some(open) = self.queries.remove(&query) else { return };
        match (open.from, open.question) {
            (Some((of, life)), Some(question)) => {
                if self.computers[of].life != life {
                    return;
                }
                let frozen = self.computers[of].frozen_until;
                if frozen > self.now {
                    self.queries.insert(query, open);
                    return self.at(frozen, Happening::Replied { query, reply });
                }
                let outcome = match reply {
                    Reply::Answer(answer) => Ok(*answer),
                    Reply::Absent => Err(PeerFailure::Absent),
                    Reply::Refused(reason) => Err(PeerFailure::Refused(reason)),
                    Reply::Obeyed(_) => Err(PeerFailure::Malformed("an order obeyed".to_owned())),
                };
                self.coverage.reach(match &outcome {
                    Ok(_) => "a question answered",
                    Err(_) => "a question refused",
                });
                self.ended(of, open.peer, question, open.timeout, outcome);
            }
            _ => self.order_replied(&open, Some(reply)),
        }
    }

    fn timed_out(&mut self, query: QueryId) {
        let Some(open) = self.queries.remove(&query) else { return };
        match (open.from, open.question) {
            (Some((of, life)), Some(question)) => {
                if self.computers[of].life != life {
                    return;
                }
                let frozen = self.computers[of].frozen_until;
                if frozen > self.now {
                    self.queries.insert(query, open);
                    return self.at(frozen, Happening::TimedOut { query });
                }
                self.coverage.reach("a question timed out");
                self.ended(of, open.peer, question, open.timeout, Err(PeerFailure::TimedOut));
            }
            _ => self.order_replied(&open, None),
        }
    }

    fn ended(
        &mut self,
        of: usize,
        peer: usize,
        question: StateQuestion,
        timeout: Duration,
        outcome: Result<StateAnswer, PeerFailure>,
    ) {
        let peer = self.name(peer).clone();
        let Some(running) = self.computers[of].process.as_mut() else { return };
        running.timeouts.note(&peer, timeout, outcome.as_ref().err());
        let event = match outcome {
            Ok(answer) => Event::Answered(answer),
            Err(failure) => Event::Unanswered { peer, question, failure },
        };
        self.take(of, |module, context| module.answer(event, context));
        self.pump(of);
    }

    /// Asks the publisher for samples, until it is reached or they are given up.
    fn fetch(&mut self, of: usize, life: u64, question: SampleQuestion, until: u64) {
        let publisher = SampleSource {
            publisher: Some(PublisherId { session: [1; 16], entity: 2 }),
            run: question.run,
        };
        let is_reached = self.way(Some(of), None).is_some() && self.way(None, Some(of)).is_some();
        let received = self.instant(self.now);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let uses = running.uses(publisher);
        if !is_reached && self.now < until {
            return self.after(FETCH_AGAIN, Happening::Fetch { of, life, question, until });
        }
        let mut samples = Vec::new();
        if is_reached && uses && question.run == RunId(1) {
            let wanted = question.from..=question.to;
            let kept = self.kept.iter().map(|all| &all[of]);
            let fitting = kept.filter(|sample| wanted.contains(&sample.step));
            samples.extend(fitting.map(|sample| ReceivedSample {
                sample: sample.clone(),
                time_unix_ns: BEGIN_UNIX_NS + self.now,
                received,
            }));
        }
        running.may_miss_samples |= samples.is_empty();
        let what = if samples.is_empty() {
            "a fetch in vain"
        } else {
            "samples fetched from the publisher"
        };
        self.coverage.reach(what);
        running.module.recovered(question, samples, received);
        self.pump(of);
    }

    // Operators.

    fn order(&mut self, place: usize) {
        let order = &self.scenario.orders[place];
        let to = self.place_of(&order.component.module);
        let query = self.open_query(OpenQuery {
            from: None,
            peer: to,
            question: None,
            timeout: Duration::from_nanos(ORDER_TIMEOUT),
            order: Some(place),
        });
        let line = format_args!("an operator orders {:?}: {}", order.kind, order.component);
        self.trace.note(self.now, line);
        self.after(ORDER_TIMEOUT, Happening::TimedOut { query });
        if let Some(delay) = self.way(None, Some(to)) {
            self.after(delay, Happening::Ordered { to, query, order: place });
        }
    }

    fn ordered(&mut self, to: usize, query: QueryId, place: usize) {
        let (kind, order) = self.given(place);
        if self.computers[to].process.is_none() {
            return;
        }
        self.take(to, |module, context| module.order(kind, &order, query, context));
        self.pump(to);
    }

    fn given(&self, place: usize) -> (OrderKind, Order) {
        let timed = &self.scenario.orders[place];
        let component = Some(timed.component.clone().into());
        let is_shelving = timed.kind == OrderKind::Shelve;
        let order = Order {
            component,
            by: "ada".to_owned(),
            on_behalf_of: None,
            note: is_shelving.then(|| "painting".to_owned()),
            for_s: is_shelving.then_some(4),
            force: false,
            re_tare: false,
        };
        (timed.kind, order)
    }

    fn order_replied(&mut self, open: &OpenQuery, reply: Option<Reply>) {
        let Some(place) = open.order else { return };
        let order = &self.scenario.orders[place];
        let (component, kind) = (&order.component, order.kind);
        match reply {
            Some(Reply::Obeyed(state)) => {
                self.trace.note(self.now, format_args!("obeyed: {kind:?} {component}: {state}"));
            }
            Some(Reply::Refused(reason)) => {
                self.coverage.reach("an order refused");
                self.trace.note(self.now, format_args!("refused: {kind:?} {component}: {reason}"));
            }
            _ => {
                self.coverage.reach("an order without a reply");
                self.trace.note(self.now, format_args!("no reply: {kind:?} {component}"));
                let asked_ms = self.now.saturating_sub(ORDER_TIMEOUT) / MS;
                if !self.scenario.is_disturbed(asked_ms, self.now / MS) {
                    let what = format!("no reply to {kind:?} of {component}");
                    self.watcher.violated(self.now, what);
                }
            }
        }
    }

    // Disturbances.

    fn is_now(&self, from_ms: u64, until_ms: u64) -> bool {
        (from_ms * MS..until_ms * MS).contains(&self.now)
    }

    fn begin(&mut self, place: usize) -> Result<(), SimulationError> {
        let one = &self.scenario.disturbances[place];
        let (what, until) = (one.what, one.until_ms * MS);
        self.trace.note(self.now, format_args!("begins: {what}"));
        self.active.push(what);
        match what {
            DisturbanceKind::Kill(of) => self.kill(of, false),
            DisturbanceKind::PowerLoss(of) => self.kill(of, true),
            DisturbanceKind::Freeze(of) => {
                let computer = &mut self.computers[of];
                if computer.process.is_some() {
                    computer.frozen_until = computer.frozen_until.max(until);
                }
            }
            DisturbanceKind::WrongClock(of, s) => {
                self.computers[of].clock_ns += (s * 1e9) as i64;
            }
            DisturbanceKind::NoValue(..) => self.note_loss(one),
            DisturbanceKind::SecondPublisher if self.other.is_none() => {
                self.other = Some(self.setup.plant(self.scenario.seed ^ 1)?);
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(&mut self, place: usize) {
        let what = self.scenario.disturbances[place].what;
        self.trace.note(self.now, format_args!("ends: {what}"));
        if let Some(known) = self.active.iter().position(|one| *one == what) {
            self.active.remove(known);
        }
        match what {
            DisturbanceKind::Kill(of) | DisturbanceKind::PowerLoss(of) => {
                let is_down = |one: &DisturbanceKind| matches!(*one, DisturbanceKind::Kill(m) | DisturbanceKind::PowerLoss(m) if m == of);
                if !self.active.iter().any(is_down) {
                    self.after(0, Happening::Starts { of });
                }
            }
            DisturbanceKind::WrongClock(of, s) => {
                self.computers[of].clock_ns -= (s * 1e9) as i64;
            }
            DisturbanceKind::SecondPublisher => {
                let others = self.active.contains(&DisturbanceKind::SecondPublisher);
                self.other = self.other.take().filter(|_| others);
            }
            _ => {}
        }
    }

    fn kill(&mut self, of: usize, power: bool) {
        self.note_kill(of, power);
        self.tell_presence(of, false);
        let is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        // The kernel may have what the disk was writing.
        let kernel_has = self.draw.random_bool(0.5);
        let computer = &mut self.computers[of];
        computer.disk.is_full = is_full;
        if let Some(mut running) = computer.end()
            && let Some(batch) = running.writing.take().filter(|_| kernel_has && !power)
        {
            running.keeper.write(batch, &mut computer.disk);
            computer.disk.process_ended();
        }
        if power {
            computer.disk.lose_power();
        }
        let records = self.computers[of].disk.records();
        self.watcher.killed(self.now, of, &records);
    }

    pub(crate) fn place_of(&self, module: &ModuleName) -> usize {
        self.setup.module_names().position(|name| name == module).unwrap_or(0)
    }

    // The end.

    fn end(&mut self) {
        let last = self.plant.next_step();
        for place in 0..self.computers.len() {
            let name = self.name(place);
            let Some(running) = self.computers[place].process.as_ref() else {
                self.watcher.violated(self.now, format!("{name} is down"));
                continue;
            };
            let diagnoser = running.module.diagnoser();
            let mut problems = Vec::new();
            if running.module.phase() != ModulePhase::InService {
                problems.push(format!("is {}", running.module.phase().as_str()));
            }
            let behind = last.since(diagnoser.last_step().unwrap_or(Step(0)));
            if behind > 4 {
                problems.push(format!("is {behind} steps behind"));
            }
            if diagnoser.waiting_questions() > 0 {
                problems.push(format!("holds {} questions", diagnoser.waiting_questions()));
            }
            if let Some(front) = running.outlet.front() {
                problems.push(format!("has not published {:?}", front.ticket));
            }
            let present = running.store.components.present();
            let latest: Vec<_> = present.filter_map(|one| one.latest.cloned()).collect();
            let status = &running.keeper.status;
            if status.unsaved > 0 || status.problem.is_some() {
                problems.push(format!("has {} records that no disk has", status.unsaved));
            }
            let missed = diagnoser.counters().samples_missing;
            if missed > 0 && !running.may_miss_samples && self.scenario.is_of_one_plant() {
                problems.push(format!("missed {missed} samples that the publisher has"));
            }
            for problem in problems {
                self.watcher.violated(self.now, format!("{name} {problem} at the end"));
            }
            for latest in &latest {
                self.watcher.knows(self.now, latest);
            }
        }
        self.check_view();
        self.watcher.check_shut_off(self.now);
    }
}

/// How far the tops of two plants are from each other \[m\].
fn drift_m(one: &Plant, other: &Plant) -> f64 {
    let pairs = one.tops_m().zip(other.tops_m());
    let distances = pairs.map(|(one, other)| {
        let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    });
    distances.fold(0.0, f64::max)
}

/// Advances a plant, and reads its modules.
fn read(plant: &mut Plant, run: RunId, samples: &mut Vec<Measurements>) {
    let signals = plant.advance();
    samples.clear();
    samples.extend(signals.modules.iter().map(|module| Measurements {
        run,
        step: signals.step,
        demands_n: module.demands_n.clone(),
        pressures_pa: module.pressures_pa.clone(),
        elongations_m: module.elongations_m.clone(),
    }));
}
