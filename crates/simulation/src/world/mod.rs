//! A world: the plant, its modules' computers and what is between them, on virtual time. Everything that happens is taken
//! from one queue in the order of its time, and is decided by the seed.

mod computer;
mod disturbances;
mod outlet;
mod queries;
mod structure;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::{Duration, Instant};

use diagnosis::identification::{IdentificationResult, identify};
use diagnosis::{Event, Measurements, PeerFailure};
use observer::feed::{Incoming, ModuleAnswer, ModuleKey, ModuleQuery};
use plant::{ModuleMessage, Plant, Tolerance, ToleranceSettings};
use process::{
    Now, Outgoing, ProcessContext, ProcessEffect, PublisherId, ReceivedSample, Routine,
    SampleSource, StatusSurroundings, TICK,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use vocabulary::{
    Capability, Component, ComponentPath, FaultState, FaultTransition, ModuleName, ModulePhase,
    Order, OrderKind, RunId, SampleQuestion, StateAnswer, StateQuestion, Step,
};

use crate::check::InvariantWatcher;
use crate::coverage::ReachedHistories;
use crate::module::{Computer, INCUMBENT, MOST_SHUT_OFF, QueryId, RunningProcess, SampleFate};
use crate::scenario::{DisturbanceKind, END, KillMoment, WorldScenario};
use crate::setup::{Setup, SimulationError};
use crate::trace::WorldTrace;
use crate::view::View;

pub(crate) const MS: u64 = 1_000_000;
pub(crate) const SECOND: u64 = 1_000 * MS;
/// The system clocks at the beginning \[ns since 1970\].
pub(crate) const BEGIN_UNIX_NS: u64 = 1_800_000_000 * SECOND;
/// A message takes so long \[ns\].
const HOP: std::ops::Range<u64> = 100_000..600_000;
/// How long later a message is that was lost and is sent again \[ns\].
const AGAIN: std::ops::Range<u64> = 200 * MS..1_200 * MS;
/// The limit on innovations of the controller \[m/m\]: that of the configurations.
const LARGEST_INNOVATION: f64 = 3e-6;
/// A disk takes so long \[ns\].
const DISK: std::ops::Range<u64> = MS..6 * MS;
/// The run of another publisher.
pub(crate) const OTHER_RUN: RunId = RunId(1_000);
/// How long samples are asked for in vain, and how often \[ns\].
const FETCHED_FOR: u64 = 9 * SECOND;
const FETCH_AGAIN: u64 = 550 * MS;
/// Samples that all come twice fill the queue in this time \[ns\].
const QUEUE_FULL_AFTER: u64 = 5 * SECOND;
/// A process that catches up is so many steps behind.
pub(crate) const BEHIND: u64 = 400;
/// A process whose samples have waited so long has no time to ask for others \[ns\].
const HURRY: u64 = SECOND / 2;
/// How long an operator waits for a reply \[ns\].
const ORDER_TIMEOUT: u64 = 3 * SECOND;
/// An identification takes so long \[ns\].
const IDENTIFYING: std::ops::Range<u64> = 8 * MS..2_000 * MS;
/// An event waits no longer for the disk \[ns\].
const DISK_DEADLINE: u64 = SECOND;

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
    StepDone {
        of: usize,
        life: u64,
    },
    Dies {
        of: usize,
        life: u64,
        power: bool,
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
        reply: QueryReply,
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
pub(crate) enum QueryReply {
    Answer(Box<StateAnswer>),
    Refused(String),
    Obeyed(FaultState),
    Absent,
    /// None came in time.
    TimedOut,
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
    /// Which histories it reached.
    pub coverage: ReachedHistories,
    /// Everything.
    pub trace: WorldTrace,
    /// The components that are held for faulty at the end, or were until they were reset.
    pub named: BTreeSet<ComponentPath>,
    /// The components that were unconfirmed at some time.
    pub doubted: BTreeSet<ComponentPath>,
    /// The modules that may have missed what happened, for want of samples.
    pub unseeing: BTreeSet<ModuleName>,
    /// Hours that modules watched.
    pub module_hours: f64,
}

/// A world that runs.
pub struct World<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) scenario: &'a WorldScenario,
    draw: ChaCha8Rng,
    pub(crate) plant: Plant,
    /// What another publisher measures.
    other: Option<Plant>,
    /// The same plant without any fault, once it may differ.
    healthy: Option<Plant>,
    tolerance: Tolerance,
    /// What modules say of their components, until the next step.
    heard: Vec<Result<ModuleMessage, String>>,
    origin: Instant,
    pub(crate) now: u64,
    number: u64,
    queue: BTreeMap<(u64, u64), Happening>,
    pub(crate) computers: Vec<Computer>,
    /// The publisher's run, and the plant's step at which it began.
    run: (RunId, Step),
    /// The samples that the publisher keeps, the oldest first.
    kept: VecDeque<Vec<Measurements>>,
    pub(crate) queries: BTreeMap<QueryId, OpenQuery>,
    asked: u64,
    active: Vec<DisturbanceKind>,
    /// What each fault was last said to be.
    kinds: BTreeMap<ComponentPath, String>,
    samples: Vec<Measurements>,
    trace: WorldTrace,
    pub(crate) coverage: ReachedHistories,
    pub(crate) watcher: InvariantWatcher,
    pub(crate) view: View,
}

impl<'a> World<'a> {
    /// The world of a scenario, before anything happens in it.
    ///
    /// # Errors
    /// Its plant cannot be made.
    pub fn new(
        setup: &'a Setup,
        scenario: &'a WorldScenario,
        keep: bool,
    ) -> Result<Self, SimulationError> {
        let modules = setup.modules.len();
        let mut plant = setup.plant(scenario.seed)?;
        let tolerance = ToleranceSettings {
            corrected_readings: true,
            reallocation: true,
            most_shut_off: MOST_SHUT_OFF,
            largest_innovation: Some(LARGEST_INNOVATION),
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
            healthy: None,
            other: None,
            origin: Instant::now(),
            now: 0,
            number: 0,
            queue: BTreeMap::new(),
            computers: (0..modules).map(Computer::new).collect(),
            run: (RunId(1), Step(0)),
            kept: VecDeque::new(),
            queries: BTreeMap::new(),
            asked: 0,
            active: Vec::new(),
            kinds: BTreeMap::new(),
            samples: Vec::new(),
            trace: WorldTrace::new(keep),
            coverage: ReachedHistories::default(),
            watcher: InvariantWatcher::new(setup, scenario),
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
        let unseeing = self.computers.iter().filter(|computer| computer.may_miss_samples());
        let unseeing = unseeing.map(|computer| self.name(computer.place).clone()).collect();
        let Self { trace, coverage, watcher, .. } = self;
        let InvariantWatcher { violations, doubted, .. } = watcher;
        Ok(Outcome { violations, coverage, trace, named, doubted, unseeing, module_hours })
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
            | Happening::StepDone { of, life }
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
            let is_sample = matches!(happening, Happening::Sample { .. });
            let busy_until = if is_sample { 0 } else { computer.busy_until };
            let moves_again = computer.frozen_until.max(busy_until);
            if moves_again > self.now {
                self.queue.insert((moves_again, number), happening);
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
            Happening::StepDone { of, .. } => self.pump(of),
            // Nothing postpones it.
            Happening::Dies { of, life, power } => {
                if self.computers[of].life == life {
                    self.kill(of, power);
                }
            }
            Happening::DiskWakes { of, .. } => self.write(of),
            Happening::DiskAnswers { of, .. } => self.written(of),
            Happening::OutletWakes { of, .. } => self.publish(of),
            Happening::Identified { of, found, .. } => self.identified(of, *found),
            Happening::Fetch { of, life, question, until } => self.fetch(of, life, question, until),
            Happening::Asked { to, query, question } => self.asked(to, query, question),
            Happening::Ordered { to, query, order } => self.ordered(to, query, order),
            Happening::Replied { query, reply } => self.replied(query, reply),
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
            // It may not have ended.
            Happening::Starts { of } if self.computers[of].process.is_none() => self.start(of)?,
            Happening::Starts { .. } => {}
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
}
