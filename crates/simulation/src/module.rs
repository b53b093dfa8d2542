//! A module's computer: its process, its disk and its clock.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use diagnosis::messages::Speaker;
use diagnosis::{Diagnoser, SetupError};
use process::{
    Arbitration, ComponentStore, JournalKeeper, JournalRecord, ModuleProcess, Now, PeerTimeouts,
    ProcessSettings, ProcessSurroundings, PublisherArbiter, QueuedEvent, ReceivedSample,
    RecentRefusals, SampleSource, ShutOffInterlock, StoreState, WriteBatch,
};
use vocabulary::{CylinderCapability, ModuleName, Topic};

use crate::disk::SimulatedDisk;
use crate::scenario::{KillMoment, WorldScenario};
use crate::setup::Setup;

/// A query that waits for its reply, by its number.
pub(crate) type QueryId = u64;

const FIRST_TIMEOUT: Duration = Duration::from_millis(300);
/// Cylinders that may be shut off at a time, and how long what a peer says of its own counts.
pub(crate) const MOST_SHUT_OFF: u64 = 1;
const FRESH: Duration = Duration::from_secs(5);
pub(crate) const INCUMBENT: Duration = Duration::from_millis(200);

/// A module's computer.
#[derive(Debug)]
pub(crate) struct Computer {
    pub(crate) place: usize,
    /// Counts the processes: what was meant for one of them reaches no other.
    pub(crate) life: u64,
    pub(crate) process: Option<RunningProcess>,
    pub(crate) disk: SimulatedDisk,
    /// Its system clock is ahead by so much \[ns\].
    pub(crate) clock_ns: i64,
    /// Until when the process stands still \[ns\].
    pub(crate) frozen_until: u64,
    /// A process that has ended may have missed samples.
    missed_samples: bool,
    /// Until when it is busy with a step \[ns\]; only samples are received meanwhile.
    pub(crate) busy_until: u64,
    /// How the process is to end, with the loss of power or without, and before when \[ns\].
    pub(crate) doom: Vec<(KillMoment, bool, u64)>,
}

/// A process with what is around the decisions in it: queues, the journal's thread, the events' thread.
#[derive(Debug)]
pub(crate) struct RunningProcess {
    pub(crate) module: ModuleProcess<QueryId>,
    pub(crate) store: StoreState,
    pub(crate) keeper: JournalKeeper,
    pub(crate) timeouts: PeerTimeouts,
    arbiter: PublisherArbiter,
    pub(crate) inbox: VecDeque<ReceivedSample>,
    pub(crate) overflown: bool,
    /// When a sample of each publisher arrived last, by its run \[ns\].
    pub(crate) heard: [Option<u64>; 2],
    /// Samples were dropped, asked for in vain, or so late that there was no time to ask.
    pub(crate) may_miss_samples: bool,
    /// The questions of peers that have no reply so far, and until when they may be held \[ns\].
    pub(crate) held: BTreeMap<QueryId, u64>,
    /// Events on their way out, and since when \[ns\].
    pub(crate) outlet: VecDeque<(QueuedEvent<QueryId>, u64)>,
    /// When a sample was diagnosed last \[ns\].
    pub(crate) diagnosed_at: u64,
    /// What the disk is writing.
    pub(crate) writing: Option<(WriteBatch, Option<Vec<JournalRecord>>)>,
    /// When a disk that refused is tried again.
    pub(crate) retry_at: Option<Instant>,
    /// For when the end of a pause is expected \[ns\].
    pub(crate) pause_ends: Option<u64>,
    pub(crate) around: Around,
}

/// What the decisions read beside.
#[derive(Debug)]
pub(crate) struct Around {
    refusals: RecentRefusals,
    /// What peers say of their cylinders.
    pub(crate) interlock: ShutOffInterlock,
    /// The controller wants what gages should read.
    pub(crate) corrects: bool,
}

impl ProcessSurroundings for Around {
    fn refusals(&self) -> RecentRefusals {
        self.refusals.clone()
    }

    fn may_shut_off(&self, own: &[CylinderCapability], now: Instant) -> Result<(), String> {
        self.interlock.check(own, now)
    }

    fn why_silent(&self, _: &ModuleName) -> String {
        "no answer in time".to_owned()
    }

    fn is_subscribed(&self, topic: &Topic) -> bool {
        *topic == Topic::Corrected && self.corrects
    }
}

impl Computer {
    pub(crate) fn new(place: usize) -> Self {
        Self {
            place,
            life: 0,
            process: None,
            disk: SimulatedDisk::default(),
            clock_ns: 0,
            frozen_until: 0,
            missed_samples: false,
            busy_until: 0,
            doom: Vec::new(),
        }
    }

    /// Starts the process on what the disk holds.
    pub(crate) fn start(
        &mut self,
        setup: &Setup,
        scenario: &WorldScenario,
        now: Now,
    ) -> Result<(), Vec<SetupError>> {
        use process::Disk as _;
        let known = &setup.modules[self.place];
        let name = known.setup.module.clone();
        let mut keeper = JournalKeeper::new(Some("/state".to_owned()), scenario.rotate_bytes);
        let records = match self.disk.open() {
            Ok((records, _)) => records,
            Err(problem) => {
                keeper.tell_problem(&problem);
                self.disk.records()
            }
        };
        let records = records.iter().filter_map(|text| JournalRecord::from_text(text)).collect();
        let components = ComponentStore::restore(records, &name, now.unix_ns);
        keeper.status.incarnation = components.incarnation();
        let incarnation = components.incarnation();
        let mut store = StoreState::new(components, keeper.status.clone());
        let speaker = Speaker { structure: setup.name.clone(), module: name, incarnation };
        let diagnoser = Diagnoser::new(known.setup.clone())?;
        let (module, _) = ModuleProcess::start(
            (diagnoser, speaker),
            ProcessSettings {
                recover_steps: scenario.remembered_samples as u64,
                ..known.settings.clone()
            },
            String::new(),
            (&mut store, self.disk.watch),
            now,
        );
        store.record(keeper.start(now.unix_ns), now.at);
        self.life += 1;
        self.process = Some(RunningProcess {
            module,
            store,
            keeper,
            timeouts: PeerTimeouts::new(FIRST_TIMEOUT),
            arbiter: PublisherArbiter::new(INCUMBENT, known.settings.sample_queue),
            inbox: VecDeque::new(),
            overflown: false,
            heard: [None; 2],
            may_miss_samples: false,
            held: BTreeMap::new(),
            outlet: VecDeque::new(),
            diagnosed_at: 0,
            writing: None,
            retry_at: None,
            pause_ends: None,
            around: Around {
                refusals: RecentRefusals::default(),
                interlock: ShutOffInterlock::new(MOST_SHUT_OFF, FRESH, &known.setup.peers),
                corrects: false,
            },
        });
        Ok(())
    }

    /// The process is gone, at once.
    pub(crate) fn end(&mut self) -> Option<RunningProcess> {
        self.disk.process_ended();
        (self.frozen_until, self.busy_until) = (0, 0);
        self.life += 1;
        self.missed_samples = self.may_miss_samples();
        self.process.take()
    }

    /// May what happened have been missed for want of samples?
    pub(crate) fn may_miss_samples(&self) -> bool {
        let present = self.process.as_ref();
        self.missed_samples || present.is_some_and(|running| running.may_miss_samples)
    }
}

impl RunningProcess {
    /// Takes a sample from the network. Returns how it was decided: put aside, or taken over.
    pub(crate) fn receive(
        &mut self,
        source: SampleSource,
        arrival: ReceivedSample,
        room: usize,
    ) -> SampleFate {
        match self.arbiter.admit(source, arrival) {
            Arbitration::Use(arrival) => self.queue(arrival, room),
            Arbitration::UseAll(arrivals) => {
                arrivals.into_iter().for_each(|arrival| {
                    self.queue(arrival, room);
                });
                SampleFate::TakenOver
            }
            Arbitration::PutAside => SampleFate::PutAside,
        }
    }

    /// Another publisher may take the place of one that is silent.
    pub(crate) fn promote(&mut self, now: Instant, room: usize) -> bool {
        let promoted = self.arbiter.promote(now);
        let any = !promoted.is_empty();
        promoted.into_iter().for_each(|arrival| {
            self.queue(arrival, room);
        });
        any
    }

    /// Is a disk that refused tried again by now?
    pub(crate) fn retries_now(&self, now: Instant) -> bool {
        self.retry_at.is_some_and(|at| at <= now)
    }

    /// Whose samples are used.
    pub(crate) fn present(&self) -> Option<SampleSource> {
        self.arbiter.present()
    }

    /// Are samples used that this one gives in reply to a query?
    pub(crate) fn uses(&self, replier: SampleSource) -> bool {
        self.arbiter.present().is_some_and(|source| source.replies_as(replier))
    }

    fn queue(&mut self, arrival: ReceivedSample, room: usize) -> SampleFate {
        if self.inbox.len() >= room {
            self.overflown = true;
            return SampleFate::Dropped;
        }
        self.inbox.push_back(arrival);
        SampleFate::Queued
    }
}

/// What became of a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SampleFate {
    Queued,
    TakenOver,
    PutAside,
    Dropped,
}
