//! The task that owns the module's process ([`ModuleProcess`]): takes inputs from the queues one at a time, and carries out
//! their effects. Nothing here waits for the network or the disk.

use std::sync::Arc;
use std::sync::mpsc::SyncSender;

use process::{
    ComponentStore, ModuleProcess, Now, PresentComponent, ProcessContext, ProcessEffect,
    ProcessSurroundings, ReceivedSample, RecentRefusals, StatusSurroundings, StoreState, TICK,
};
use shell::clock;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use vocabulary::{CylinderCapability, FaultTransition, ModuleName, ModuleStatus, Topic};
use zenoh::query::Query;

use super::answer::{InquiryQueues, OrderInquiry, SharedInquiryCounters, Snapshot, StateInquiry};
use super::duplicates::DuplicateWatch;
use super::freeze_frames::FreezeFrames;
use super::health::LatestReport;
use super::identify::{IdentificationReport, Identifier};
use super::input::{RecoveredSamples, RecoveryQuerier, SampleReceiver};
use super::peers::{PeerForces, PeerQueries, PeerTable, SharedInterlock};
use super::publish::{ModuleOutbox, RoutineMessage};
use super::store::ModuleStore;
use crate::counters::SharedCounters;
use crate::metrics::{AsideReport, ComponentReport, KindReport, ModuleReport};
use crate::status_line;

/// Samples that are taken at once: a long queue holds up nothing else.
const AT_ONCE: usize = 31;

/// What the loop takes from.
#[derive(Debug)]
pub(crate) struct Queues {
    pub(crate) samples: mpsc::Receiver<ReceivedSample>,
    pub(crate) recovered: mpsc::Receiver<RecoveredSamples>,
    pub(crate) inquiries: InquiryQueues,
    /// Peers' answers, and notice of their return.
    pub(crate) answers: mpsc::Receiver<diagnosis::Event>,
}

/// What the loop shares with other threads, and where effects go.
#[derive(Debug)]
pub(crate) struct SharedState {
    pub(crate) store: ModuleStore,
    pub(crate) outbox: ModuleOutbox,
    pub(crate) receiver: SampleReceiver,
    pub(crate) recovery: RecoveryQuerier,
    pub(crate) queries: PeerQueries,
    pub(crate) peers: PeerTable,
    /// Peers' forces, while a gage is replaced.
    pub(crate) forces: PeerForces,
    /// Whether a cylinder may be shut off.
    pub(crate) interlock: SharedInterlock,
    pub(crate) identifier: Identifier,
    pub(crate) freeze_frames: FreezeFrames,
    pub(crate) inquiries: SharedInquiryCounters,
    pub(crate) duplicates: DuplicateWatch,
    /// The certificate of the process.
    pub(crate) certificate: session::CertificateWatch,
    /// For the HTTP endpoints.
    pub(crate) health: Arc<LatestReport>,
    pub(crate) identifications: Arc<SharedCounters<IdentificationReport>>,
}

impl ProcessSurroundings for SharedState {
    fn refusals(&self) -> RecentRefusals {
        self.receiver.refusals().clone()
    }

    fn may_shut_off(
        &self,
        own: &[CylinderCapability],
        now: std::time::Instant,
    ) -> Result<(), String> {
        self.interlock.lock().check(own, now)
    }

    fn why_silent(&self, peer: &ModuleName) -> String {
        self.peers.why_silent(peer)
    }

    fn is_subscribed(&self, topic: &Topic) -> bool {
        let audiences = &self.outbox.audiences;
        match topic {
            Topic::Divergence => audiences.divergences.is_there(),
            Topic::Corrected => audiences.corrected.is_there(),
            Topic::Progress => audiences.progress.is_there(),
            _ => true,
        }
    }
}

/// The module's process with everything around it.
#[derive(Debug)]
pub(crate) struct DiagnosisLoop {
    module: ModuleProcess<Query>,
    shared: SharedState,
    supervisor: Supervisor,
    effects: Vec<ProcessEffect<Query>>,
    queued_samples: usize,
    /// The samples in the queue are to be dropped.
    drops_samples: bool,
}

impl DiagnosisLoop {
    pub(crate) fn new(
        module: ModuleProcess<Query>,
        shared: SharedState,
        supervisor: Supervisor,
    ) -> Self {
        let effects = Vec::new();
        Self { module, shared, supervisor, effects, queued_samples: 0, drops_samples: false }
    }

    /// Runs until the end is asked for.
    pub(crate) async fn run(mut self, mut queues: Queues, mut shutdown: Shutdown) {
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let store = self.shared.store.clone();
        let status = self.status(&store.lock(), now());
        self.supervisor.ready(&status_line::of_module(&status));
        loop {
            self.supervisor.progress();
            let pause = self.module.pause().map(Instant::from_std);
            // The senders of the queues live as long as the loop, so no queue ever closes.
            tokio::select! {
                () = shutdown.requested() => break,
                Some(StateInquiry { question, query }) = queues.inquiries.state.recv() => {
                    self.take(|module, context| module.question(question, query, context));
                }
                Some(OrderInquiry { kind, order, query }) = queues.inquiries.orders.recv() => {
                    self.take(|module, context| module.order(kind, &order, query, context));
                }
                Some(reply) = queues.inquiries.snapshots.recv() => self.give_snapshot(&reply),
                Some(event) = queues.answers.recv() => {
                    self.take(|module, context| module.answer(event, context));
                }
                Some(recovered) = queues.recovered.recv() => {
                    let RecoveredSamples { question, samples } = recovered;
                    self.module.recovered(question, samples, std::time::Instant::now());
                }
                Some(arrival) = queues.samples.recv(), if pause.is_none() => {
                    self.module.sample(arrival);
                    // The other steps of a block are there already.
                    let others = std::iter::from_fn(|| queues.samples.try_recv().ok());
                    others.take(AT_ONCE).for_each(|arrival| self.module.sample(arrival));
                }
                () = sleep_until(pause.unwrap_or_else(Instant::now)), if pause.is_some() => {
                    self.module.end_pause();
                }
                _ = ticks.tick() => self.tick(&mut queues.samples),
            }
            while self.advance() {
                // A long backlog on a busy machine takes longer than the watchdog waits.
                self.supervisor.progress();
            }
        }
        self.queued_samples = queues.samples.len();
        self.take(ModuleProcess::finish);
        self.supervisor.stopping();
    }

    fn advance(&mut self) -> bool {
        self.shared.forces.follow(self.module.diagnoser_mut());
        self.take(ModuleProcess::advance)
    }

    fn tick(&mut self, samples: &mut mpsc::Receiver<ReceivedSample>) {
        self.queued_samples = samples.len();
        self.shared.receiver.tick(std::time::Instant::now());
        let overflown = self.shared.receiver.take_overflow();
        self.take(|module, context| module.tick(overflown, context));
        if std::mem::take(&mut self.drops_samples) {
            let dropped = std::iter::from_fn(|| samples.try_recv().ok()).count() as u64;
            self.shared.receiver.count(|counters| counters.dropped += dropped);
        }
    }

    /// Here between two inputs, so that state and number of inputs fit.
    fn give_snapshot(&mut self, reply: &SyncSender<Snapshot>) {
        let (head, state) = self.module.state(clock::unix_ns());
        let diagnoser = self.module.diagnoser().clone();
        // Fails only if the asker has stopped waiting.
        let _ = reply.try_send(Snapshot { head, state, diagnoser });
    }

    /// Gives the module an input, and carries out its effects.
    fn take<T>(
        &mut self,
        input: impl FnOnce(&mut ModuleProcess<Query>, &mut ProcessContext<'_, Query>) -> T,
    ) -> T {
        let now = now();
        let mut effects = std::mem::take(&mut self.effects);
        let store = self.shared.store.clone();
        let mut locked = store.lock();
        let surroundings = &self.shared;
        let mut context =
            ProcessContext { now, store: &mut locked, surroundings, effects: &mut effects };
        let output = input(&mut self.module, &mut context);
        // Locked until events are in the queue: journal and publication keep the same order for any caller.
        let mut reports = Vec::new();
        let others = effects.extract_if(.., |effect| {
            matches!(effect, ProcessEffect::Publish(_) | ProcessEffect::Status { .. })
        });
        for effect in others {
            match effect {
                ProcessEffect::Publish(event) => self.shared.outbox.publish(event),
                ProcessEffect::Status { reason } => {
                    let status = self.status(&locked, now);
                    reports.push(self.report(status, reason, &locked.components));
                }
                _ => {}
            }
        }
        store.unlock(locked);
        reports.into_iter().for_each(|report| self.tell(report));
        effects.drain(..).for_each(|effect| self.carry_out(effect));
        self.effects = effects;
        output
    }

    fn carry_out(&mut self, effect: ProcessEffect<Query>) {
        let shared = &mut self.shared;
        match effect {
            // Carried out while the store is locked.
            ProcessEffect::Publish(_) | ProcessEffect::Status { .. } => {}
            ProcessEffect::Routine(message) => shared.outbox.routine(message),
            ProcessEffect::Fetch(question) => shared.recovery.ask(question),
            ProcessEffect::Ask { peer, question } => shared.queries.ask(peer, question),
            ProcessEffect::Identify(excerpt) => shared.identifier.identify(excerpt),
            ProcessEffect::Freeze { component, signals } => {
                shared.freeze_frames.keep(component, signals)
            }
            ProcessEffect::DropQueuedSamples => self.drops_samples = true,
            ProcessEffect::SampleRefused(reason) => {
                shared.receiver.note_refusal(reason, std::time::Instant::now());
            }
            ProcessEffect::AnswerRejected { peer, reason } => {
                shared.peers.note_rejection(&peer, reason)
            }
            ProcessEffect::WordBroken(peer) => shared.peers.note_dispute(&peer),
        }
    }

    fn status(&mut self, store: &StoreState, now: Now) -> ModuleStatus {
        let shared = &self.shared;
        let around = StatusSurroundings {
            queued_samples: self.queued_samples,
            peers: shared.peers.read(),
            another_process: shared.duplicates.are_there(now.at),
            intake: shared.receiver.counters(),
            inquiries: shared.inquiries.read(),
            publisher: shared.outbox.counters(),
            certificate_until_unix_s: shared.certificate.until_unix_s(),
        };
        self.module.status(store, around, now)
    }

    fn report(&self, status: ModuleStatus, reason: String, store: &ComponentStore) -> ModuleReport {
        let mut identifications = self.shared.identifications.read();
        identifications.kinds = kinds(store);
        ModuleReport { reason, components: of_components(store), status, identifications }
    }

    fn tell(&self, report: ModuleReport) {
        self.supervisor.status(&status_line::of_module(&report.status));
        self.shared.outbox.routine(RoutineMessage::Status(Box::new(report.status.clone())));
        self.shared.health.write(report);
    }
}

/// The clocks.
pub(super) fn now() -> Now {
    Now { at: std::time::Instant::now(), unix_ns: clock::unix_ns() }
}

/// How each component is.
fn of_components(store: &ComponentStore) -> Vec<ComponentReport> {
    let report = |present: PresentComponent<'_>| {
        let component = present.component.clone();
        let aside = present.latest.map(aside).unwrap_or_default();
        ComponentReport { component, state: present.state, aside }
    };
    store.present().map(report).collect()
}

/// What the present faults may be.
fn kinds(store: &ComponentStore) -> Vec<KindReport> {
    let kinds = store.identifications(|_| true).flat_map(|found| {
        found.candidates.iter().map(|candidate| KindReport {
            component: found.component.component.clone(),
            kind: candidate.kind,
            probability: candidate.probability,
        })
    });
    kinds.collect()
}

fn aside(latest: &FaultTransition) -> Vec<AsideReport> {
    let both = [("shelved", &latest.shelved), ("suppressed", &latest.suppressed)];
    let report = |(how, shelving): (&'static str, &Option<vocabulary::Shelving>)| {
        let until_unix_ns = shelving.as_ref()?.until_unix_ns;
        Some(AsideReport { how, until_unix_ns })
    };
    both.into_iter().filter_map(report).collect()
}
