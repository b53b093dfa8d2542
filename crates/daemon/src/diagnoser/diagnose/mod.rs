//! The task that owns the diagnoser: takes samples, questions, orders and answers one at a time and has
//! the actions carried out that follow. Nothing here waits for the network or the disk.
//!
//! While a peer is being asked, the next sample stays in the queue for a moment. If the answer comes
//! by then, as it does in microseconds, the diagnoser gets it at the step at which it asked, just as
//! in a single process, and every transition is the same. Peers cannot wait for each other in a
//! circle: the querying module has processed the step in question, and queries are answered
//! meanwhile.

mod actions;
mod shelving;
mod status;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use diagnosis::messages::Speaker;
use diagnosis::{Action, Diagnoser, Event, Transition};
use process::{
    ClockReading, PeerRetries, PendingOrder, ReceivedSample, Sequencer, SequencerStep, Staleness,
    UNAWAITED, WatchedSteps,
};
use shell::clock;
use shell::occurrences::Occurrences;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use vocabulary::{
    Ability, Capability, Component, ComponentPath, CylinderCapability, GivenOrder, GivenOrderKind,
    ModulePhase, ModuleStatus, OrderKind, PhaseChange, Progress, Step,
};

pub(crate) use actions::ActionExecutor;
pub(crate) use status::conditions;

use super::CertificateWatch;
use super::answer::{InquiryQueues, OrderInquiry, Snapshot, StateInquiry};
use super::duplicates::DuplicateWatch;
use super::health::LatestReport;
use super::identify::IdentificationReport;
use super::input::{RecoveredSamples, RecoveryQuerier, SampleReceiver};
use super::peers::{PeerForces, PeerTable, SharedInterlock};
use super::publish::{Outgoing, Routine};
use super::store::ModuleStore;
use crate::config::{DiagnoserConfig, PublishSettings};
use crate::counters::SharedCounters;
use crate::metrics::ModuleReport;
use crate::status_line;
use shelving::ITSELF;
use status::Surroundings;

/// How often held queries, staleness and the last step's progress are checked.
const TICK: Duration = Duration::from_millis(50);
/// A backlog that stays this old for this long is dropped.
const BEHIND_FOR: Duration = Duration::from_millis(250);

/// What the loop takes from.
#[derive(Debug)]
pub(crate) struct Queues {
    pub(crate) samples: mpsc::Receiver<ReceivedSample>,
    pub(crate) recovered: mpsc::Receiver<RecoveredSamples>,
    pub(crate) inquiries: InquiryQueues,
    /// Peers' answers, and notice of their return.
    pub(crate) answers: mpsc::Receiver<Event>,
}

/// Where samples come from.
#[derive(Debug)]
pub(crate) struct SampleInput {
    pub(crate) receiver: SampleReceiver,
    pub(crate) sequencer: Sequencer,
    pub(crate) recovery: RecoveryQuerier,
    pub(crate) resync_after: Duration,
}

/// What the loop shares with other threads.
#[derive(Debug)]
pub(crate) struct SharedState {
    pub(crate) store: ModuleStore,
    /// How far the module had watched before the restart.
    pub(crate) watch: Option<WatchedSteps>,
    pub(crate) peers: PeerTable,
    /// Peers' forces, while a gage is replaced.
    pub(crate) forces: PeerForces,
    /// Whether a cylinder may be shut off.
    pub(crate) interlock: SharedInterlock,
    pub(crate) duplicates: DuplicateWatch,
    /// The certificate of the process.
    pub(crate) certificate: CertificateWatch,
    /// For the HTTP endpoints.
    pub(crate) health: Arc<LatestReport>,
    pub(crate) identifications: Arc<SharedCounters<IdentificationReport>>,
}

/// The diagnoser with everything around it.
#[derive(Debug)]
pub(crate) struct DiagnosisLoop {
    diagnoser: Diagnoser,
    actions: Vec<Action>,
    executor: ActionExecutor,
    input: SampleInput,
    shared: SharedState,
    supervisor: Supervisor,
    staleness: Staleness,
    retries: PeerRetries,
    publish: PublishSettings,
    thresholds: String,
    reference: Option<String>,
    tie_steps: u64,
    lag_ms: Option<f64>,
    latest_sample_unix_ns: Option<u64>,
    behind_since: Option<Instant>,
    resynchronised: Occurrences,
    last_watch: Option<WatchedSteps>,
    last_status: Option<Instant>,
    last_capability: Vec<CylinderCapability>,
    /// Shuts a cylinder off by itself that is hard over.
    shuts_off: bool,
    not_shut_off: Occurrences,
    last_progress: Option<(Progress, Instant)>,
    /// Of each channel the largest excess of its divergence since the latest status.
    largest_change: Vec<f64>,
}

impl DiagnosisLoop {
    pub(crate) fn new(
        diagnoser: Diagnoser,
        config: &DiagnoserConfig,
        executor: ActionExecutor,
        input: SampleInput,
        shared: SharedState,
        supervisor: Supervisor,
    ) -> Self {
        let last_watch = shared.watch;
        let largest_change = vec![0.0; diagnoser.components().len()];
        Self {
            diagnoser,
            actions: Vec::new(),
            executor,
            input,
            shared,
            supervisor,
            staleness: Staleness::new(config.input.stale_after()),
            retries: PeerRetries::default(),
            publish: config.publish,
            thresholds: config.thresholds.clone(),
            reference: config.reference(),
            tie_steps: config.tie_steps(),
            lag_ms: None,
            latest_sample_unix_ns: None,
            behind_since: None,
            resynchronised: Occurrences::default(),
            last_watch,
            last_status: None,
            last_capability: Vec::new(),
            shuts_off: config.tolerance.by_itself,
            not_shut_off: Occurrences::default(),
            last_progress: None,
            largest_change,
        }
    }

    /// Runs until the end is asked for.
    pub(crate) async fn run(mut self, mut queues: Queues, mut shutdown: Shutdown) {
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        self.note_conditions();
        let status = status_line::of_module(&self.status(0));
        self.supervisor.ready(&status);
        loop {
            self.supervisor.progress();
            let pause = self.executor.query_pause.until().map(Instant::from_std);
            // The senders of the queues live as long as the loop, so no queue ever closes.
            tokio::select! {
                () = shutdown.requested() => break,
                Some(inquiry) = queues.inquiries.state.recv() => self.inquire(inquiry),
                Some(inquiry) = queues.inquiries.orders.recv() => self.order(inquiry),
                Some(reply) = queues.inquiries.snapshots.recv() => self.give_snapshot(&reply),
                Some(event) = queues.answers.recv() => self.take_answer(event),
                Some(recovered) = queues.recovered.recv() => self.take_recovered(recovered),
                Some(arrival) = queues.samples.recv(), if pause.is_none() => {
                    self.input.sequencer.push(arrival);
                }
                () = sleep_until(pause.unwrap_or_else(Instant::now)), if pause.is_some() => {
                    self.executor.query_pause.expire();
                }
                now = ticks.tick() => self.tick(now, &mut queues.samples),
            }
            self.advance();
        }
        self.end_freeze_frames();
        self.send_status(queues.samples.len());
        self.supervisor.stopping();
    }

    /// Diagnoses what is there to be diagnosed.
    fn advance(&mut self) {
        while self.executor.query_pause.until().is_none() {
            // A long backlog on a busy machine takes longer than the watchdog waits.
            self.supervisor.progress();
            let last = self.diagnoser.run().zip(self.diagnoser.last_step());
            match self.input.sequencer.next(last, std::time::Instant::now()) {
                Some(SequencerStep::Process(arrival)) => self.take_sample(arrival),
                Some(SequencerStep::Fetch(question)) => self.input.recovery.ask(question),
                None => return,
            }
        }
    }

    fn take_recovered(&mut self, recovered: RecoveredSamples) {
        let RecoveredSamples { question, samples } = recovered;
        let _ = self.input.sequencer.take(question, samples, std::time::Instant::now());
    }

    fn take_sample(&mut self, arrival: ReceivedSample) {
        let ReceivedSample { sample, time_unix_ns, received } = arrival;
        self.note_backlog(received);
        let used_before = self.diagnoser.counters().samples;
        let changes_before = self.diagnoser.counters().changes;
        let runs_before = self.diagnoser.counters().runs;
        self.handle(Event::Sample(sample));
        if self.diagnoser.counters().samples == used_before {
            return;
        }
        for (channel, largest) in self.largest_change.iter_mut().enumerate() {
            *largest = largest.max(self.diagnoser.excess(channel));
        }
        self.staleness.sample(std::time::Instant::now());
        self.note_time(time_unix_ns);
        let is_new_run = self.diagnoser.counters().runs != runs_before;
        if is_new_run || self.diagnoser.has_compared() {
            self.note_conditions();
        }
        let changed = self.diagnoser.counters().changes != changes_before;
        self.publish_routinely(changed);
        self.tell_phase();
    }

    fn note_conditions(&self) {
        let mut state = self.shared.store.lock();
        state.components.conditions(status::conditions(&self.diagnoser), clock::unix_ns());
    }

    /// Why it is in this phase.
    fn reason(&self, phase: ModulePhase) -> String {
        let refusals = self.input.receiver.refusals();
        self.staleness.reason(phase, &refusals, std::time::Instant::now())
    }

    /// No decision depends on the publisher's clock, so its irregularities are only reported.
    fn note_time(&mut self, time_unix_ns: u64) {
        if self.latest_sample_unix_ns.is_some_and(|before| time_unix_ns <= before) {
            self.input.receiver.count(|counters| counters.clock_standing += 1);
        }
        self.latest_sample_unix_ns = Some(time_unix_ns);
        self.lag_ms = Some(ms_since(time_unix_ns));
    }

    fn note_backlog(&mut self, received: std::time::Instant) {
        let behind = received.elapsed() >= self.input.resync_after;
        self.behind_since = behind.then(|| self.behind_since.unwrap_or_else(Instant::now));
    }

    /// Drops the backlog when samples had to be dropped, or have been diagnosed too late for a
    /// while: what is diagnosed must be the present. A process that was frozen finds an old sample and a
    /// gap behind it: what the publisher still has is waited for.
    fn resynchronise(&mut self, now: Instant, samples: &mut mpsc::Receiver<ReceivedSample>) {
        let behind = !self.input.sequencer.is_owed()
            && self.behind_since.is_some_and(|since| now.duration_since(since) >= BEHIND_FOR);
        if !self.input.receiver.take_overflow() && !behind {
            return;
        }
        let mut thrown = self.input.sequencer.clear(now.into_std());
        while samples.try_recv().is_ok() {
            thrown += 1;
        }
        self.behind_since = None;
        self.input.receiver.count(|counters| {
            counters.dropped += thrown as u64;
            counters.resynchronised += 1;
        });
        if let Some(times) = self.resynchronised.note(now.into_std()) {
            let problem =
                "backlog of samples dropped: they arrive faster than they can be diagnosed";
            tracing::warn!(thrown, times, "{problem}");
        }
    }

    /// Divergences, corrected readings and progress, when they are due and have subscribers.
    fn publish_routinely(&mut self, changed: bool) {
        let (Some(run), Some(step)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        let due_now = changed || due(step, self.publish.divergence_every_steps);
        if due_now && self.executor.outbox.audiences.divergences.is_there() {
            let speaker = &self.executor.speaker;
            let message = speaker.divergences((run, step), &self.diagnoser, clock::unix_ns());
            self.executor.outbox.routine(Routine::Divergences(message));
        }
        self.shared.forces.follow(&mut self.diagnoser);
        if self.executor.outbox.audiences.corrected.is_there() {
            let speaker = &self.executor.speaker;
            let message = speaker.corrected((run, step), &self.diagnoser, clock::unix_ns());
            self.executor.outbox.routine(Routine::Corrected(message));
        }
        if due(step.plus(1), self.publish.progress_every_steps) {
            self.send_progress(Instant::now());
        }
    }

    fn inquire(&mut self, inquiry: StateInquiry) {
        let StateInquiry { question, query } = inquiry;
        if self.staleness.is_stale() && Some(question.as_of) > self.diagnoser.last_step() {
            let reason = self.reason(ModulePhase::Stale);
            self.executor.refuse(query, reason);
            return;
        }
        let token = self.executor.pending.put_question(query, std::time::Instant::now());
        self.handle(Event::Asked { token, question });
    }

    /// Here between two events, so that state and number of inputs fit.
    fn give_snapshot(&mut self, reply: &SyncSender<Snapshot>) {
        let (head, mut state) = self.executor.numbering.state(&self.diagnoser, clock::unix_ns());
        state.sample_time_unix_ns = self.latest_sample_unix_ns;
        // Fails only if the asker has stopped waiting.
        let _ = reply.try_send(Snapshot { head, state, diagnoser: self.diagnoser.clone() });
    }

    fn order(&mut self, inquiry: OrderInquiry) {
        let OrderInquiry { kind, order, query } = inquiry;
        let components = match self.concerned(kind, &order) {
            Ok(components) => components,
            Err(reason) => return self.executor.refuse_order(query, reason),
        };
        let (now, is_of_module) = (clock::unix_ns(), kind.is_of_module());
        let awaited = self.executor.pending.put_order(PendingOrder { query, is_of_module });
        let mut left = components.len();
        for component in components {
            left -= 1;
            // The reply comes after the last.
            let token = if left == 0 { awaited } else { UNAWAITED };
            let order = order.clone().given(kind, now);
            self.handle(Event::Ordered { token, component, order });
        }
        self.note_conditions();
        self.executor.status_is_due = true;
        self.tell_phase();
    }

    /// The components that an order is about; or why it is refused.
    fn concerned(
        &self,
        kind: OrderKind,
        order: &vocabulary::Order,
    ) -> Result<Vec<Component>, String> {
        let Some(mention) = &order.component else {
            return shelving::concerned(kind, &self.diagnoser);
        };
        let own = self.executor.speaker.path(&mention.component);
        if !mention.may_be(&own) {
            let module = &own.module;
            return Err(format!("`{mention}` is not a component of module `{module}`"));
        }
        if kind == OrderKind::ShutOff {
            let own = self.cylinders();
            self.shared.interlock.lock().check(&own, std::time::Instant::now())?;
        }
        if kind == OrderKind::Reset && !order.force && self.staleness.is_stale() {
            let why = self.reason(ModulePhase::Stale);
            return Err(format!("state of `{mention}` unknown: {why}"));
        }
        Ok(vec![mention.component.clone()])
    }

    /// Shelvings and suppressions expire, whether samples come or not.
    fn end_shelvings(&mut self) {
        for (component, order) in shelving::lapses(&self.diagnoser, clock::unix_ns()) {
            self.handle(Event::Ordered { token: UNAWAITED, component, order });
            self.executor.status_is_due = true;
        }
    }

    fn take_answer(&mut self, event: Event) {
        let ended = match &event {
            Event::Answered(answer) => Some((answer.module.clone(), true)),
            Event::Unanswered { peer, .. } => Some((peer.clone(), false)),
            _ => None,
        };
        if let Some((peer, _)) = &ended {
            // Before what comes of it: a query that follows pauses the samples anew.
            self.executor.query_pause.end(peer);
        }
        self.handle(event);
        if let Some((peer, answered)) = ended {
            self.note_conditions();
            self.retries.note(&peer, answered, std::time::Instant::now());
        }
    }

    /// Peers that did not answer are queried again, whether samples come or not.
    fn ask_again(&mut self, now: Instant) {
        for peer in self.retries.over(now.into_std()) {
            self.handle(Event::Returned { peer });
        }
    }

    fn handle(&mut self, event: Event) {
        self.executor.note_event(&event, &self.diagnoser);
        self.act(|diagnoser, actions| diagnoser.handle(event, actions));
    }

    /// No sample follows for now.
    fn end_freeze_frames(&mut self) {
        self.act(Diagnoser::end_freeze_frames);
    }

    fn act(&mut self, act: impl FnOnce(&mut Diagnoser, &mut Vec<Action>)) {
        let mut actions = std::mem::take(&mut self.actions);
        act(&mut self.diagnoser, &mut actions);
        for action in actions.drain(..) {
            self.executor.carry_out(action, &self.diagnoser);
        }
        self.actions = actions;
    }

    fn tick(&mut self, now: Instant, samples: &mut mpsc::Receiver<ReceivedSample>) {
        self.input.receiver.tick(now.into_std());
        self.resynchronise(now, samples);
        if self.staleness.look(now.into_std(), clock::unix_ns()) {
            self.input.receiver.count(|counters| counters.silences += 1);
            self.end_freeze_frames();
        }
        self.tell_phase();
        self.tell_monitored();
        self.shared.store.lock().components.readings(self.diagnoser.replaced_readings());
        if self.shuts_off {
            self.shut_off_by_itself();
        }
        self.end_shelvings();
        self.ask_again(now);
        self.give_up_questions(now);
        self.repeat_progress(now);
        self.note_watch();
        let every = Duration::from_millis(self.publish.status_every_ms);
        let due = self.last_status.is_none_or(|last| now.duration_since(last) >= every);
        if due || std::mem::take(&mut self.executor.status_is_due) {
            self.send_status(samples.len());
            self.last_status = Some(now);
        }
        self.tell_capability(due);
    }

    /// Publishes the phase when it changes.
    fn tell_phase(&mut self) {
        let phase = self.staleness.phase(self.diagnoser.phase());
        let Some(before) = self.staleness.change_to(phase) else { return };
        let reason = self.reason(phase);
        self.note_phase(phase, reason.clone());
        self.publish_phase(before, BTreeMap::new(), reason, self.moment());
    }

    /// Publishes which components cannot be monitored when that changes.
    fn tell_monitored(&mut self) {
        if self.staleness.phase(self.diagnoser.phase()) != ModulePhase::InService {
            return;
        }
        let lost = self.shared.store.lock().components.not_monitored();
        let Some(since) = self.staleness.change_of_monitored(&lost, self.moment()) else { return };
        let reason = self.staleness.monitored_in_words(self.diagnoser.components().len());
        let not_monitored = self.staleness.not_monitored();
        self.publish_phase(Some(ModulePhase::InService), not_monitored, reason, since);
    }

    /// What the cylinders can do.
    fn cylinders(&self) -> Vec<CylinderCapability> {
        let state = self.shared.store.lock();
        state.components.capability(|one, kind| self.diagnoser.leak_ends_in_s(one, kind)).collect()
    }

    /// Shuts off what is known to be hard over, unless an operator has put it back.
    fn shut_off_by_itself(&mut self) {
        for cylinder in self.cylinders() {
            if cylinder.ability != Ability::HardOver || !cylinder.decided {
                continue;
            }
            let component = Component::Actuator(cylinder.name);
            let is_put_back = |latest: &Transition| {
                let order = latest.order.as_ref().map(|order| order.kind);
                latest.component == component && order == Some(GivenOrderKind::PutBack)
            };
            if self.diagnoser.last_transitions().any(is_put_back) {
                continue;
            }
            let permitted = {
                let interlock = self.shared.interlock.lock();
                interlock.check(&self.cylinders(), std::time::Instant::now())
            };
            if let Err(why) = permitted {
                if let Some(times) = self.not_shut_off.note(std::time::Instant::now()) {
                    tracing::warn!(%component, times, "hard over, but not shut off: {why}");
                }
                continue;
            }
            let kind = GivenOrderKind::ShutOff { since_unix_ns: clock::unix_ns() };
            let (by, note) = (ITSELF.to_owned(), Some("hard over".to_owned()));
            let order = GivenOrder { kind, by, on_behalf_of: None, note };
            tracing::warn!(%component, "hard over: shut off");
            self.handle(Event::Ordered { token: UNAWAITED, component, order });
            self.executor.status_is_due = true;
        }
    }

    /// Publishes what cylinders can do when that changes, or when it is due.
    fn tell_capability(&mut self, due: bool) {
        let cylinders = self.cylinders();
        if cylinders == self.last_capability && !due {
            return;
        }
        self.last_capability.clone_from(&cylinders);
        let Speaker { structure, module, .. } = self.executor.speaker.clone();
        let message = Capability { structure, module, cylinders, time_unix_ns: clock::unix_ns() };
        self.executor.outbox.routine(Routine::Capability(message));
    }

    fn moment(&self) -> ClockReading {
        let step = self.diagnoser.last_step();
        ClockReading { at: std::time::Instant::now(), time_unix_ns: clock::unix_ns(), step }
    }

    fn publish_phase(
        &mut self,
        before: Option<ModulePhase>,
        not_monitored: BTreeMap<ComponentPath, String>,
        reason: String,
        since: ClockReading,
    ) {
        let phase = self.staleness.phase(self.diagnoser.phase());
        let ClockReading { step, time_unix_ns, .. } = since;
        tracing::info!(phase = phase.as_str(), step = ?step.map(|step| step.0), "{reason}");
        let Speaker { structure, module, .. } = self.executor.speaker.clone();
        let run = self.diagnoser.run();
        // The store gives it its number.
        let number = 0;
        let change = PhaseChange {
            structure,
            module,
            number,
            phase,
            before,
            not_monitored,
            run,
            step,
            reason,
            time_unix_ns,
        };
        self.executor.outbox.event(Outgoing::Phase(Box::new(change)));
        self.executor.status_is_due = true;
    }

    /// Expired queries are refused; all of them if samples have stopped.
    fn give_up_questions(&mut self, now: Instant) {
        let stale = self.staleness.is_stale();
        let hold = self.executor.pending.hold();
        for token in self.executor.pending.expired(now.into_std(), stale) {
            self.handle(Event::Withdrawn { token });
            let reason = if stale {
                self.reason(ModulePhase::Stale)
            } else {
                format!("step not reached within {} ms", hold.as_millis())
            };
            if let Some(query) = self.executor.pending.take_question(token) {
                self.executor.refuse(query, reason);
            }
        }
    }

    /// A plant in lock step must receive the last step even if it is not a multiple of the interval, or if the message
    /// was dropped.
    fn repeat_progress(&mut self, now: Instant) {
        let stale = match (&self.last_progress, self.diagnoser.last_step()) {
            (_, None) => false,
            (None, Some(_)) => true,
            (Some((progress, at)), Some(step)) => {
                progress.step != step || now.duration_since(*at) >= 10 * TICK
            }
        };
        if stale {
            self.send_progress(now);
        }
    }

    fn send_progress(&mut self, now: Instant) {
        let (Some(run), Some(step)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        if !self.executor.outbox.audiences.progress.is_there() {
            return;
        }
        let progress = Progress { run, step };
        self.last_progress = Some((progress, now));
        self.executor.outbox.routine(Routine::Progress(progress));
    }

    /// Remembers how far every channel was watched. Changes of the last few steps are not in the journal
    /// yet, so these steps do not count.
    fn note_watch(&mut self) {
        let (Some(run), Some(last)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        let until = last.minus(self.tie_steps + 1);
        let since = self.diagnoser.in_service_since();
        let watched = since.filter(|since| *since <= until).map(|since| (since, until));
        let watch = WatchedSteps { run, watched };
        // Unless the publisher has begun again with the same run, so that these steps are yet to come.
        let stands = |before: WatchedSteps| {
            before.run == run && before.watched.is_none_or(|(_, until)| until <= last)
        };
        let says_less = watched.is_none() && self.last_watch.is_some_and(stands);
        if self.last_watch == Some(watch) || says_less {
            return;
        }
        self.shared.store.watched(watch);
        self.last_watch = Some(watch);
    }

    fn status(&mut self, queued_samples: usize) -> ModuleStatus {
        let around = Surroundings {
            speaker: &self.executor.speaker,
            thresholds: &self.thresholds,
            reference: self.reference.as_deref(),
            phase: self.staleness.phase(self.diagnoser.phase()),
            lag_ms: self.lag_ms,
            sample_age_ms: self.latest_sample_unix_ns.map(ms_since),
            queued_samples: queued_samples + self.input.sequencer.len(),
            journal: self.shared.store.journal_status(),
            peers: self.shared.peers.read(),
            another_process: self.shared.duplicates.are_there(std::time::Instant::now()),
            intake: self.input.receiver.counters(),
            inquiries: self.executor.inquiries.read(),
            publisher: self.executor.outbox.counters(),
            certificate_until_unix_s: self.shared.certificate.until_unix_s(),
            largest_change: std::mem::replace(
                &mut self.largest_change,
                vec![0.0; self.diagnoser.components().len()],
            ),
        };
        status::compile(&self.diagnoser, &self.shared.store.lock().components, around)
    }

    /// For replies, which name the reason as long as the module is not in service.
    fn note_phase(&self, phase: ModulePhase, reason: String) {
        let mut state = self.shared.store.lock();
        state.components.monitored(phase, reason, clock::unix_ns());
    }

    fn send_status(&mut self, queued_samples: usize) {
        let phase = self.staleness.phase(self.diagnoser.phase());
        let reason = self.reason(phase);
        self.note_phase(phase, reason.clone());
        let status = self.status(queued_samples);
        self.supervisor.status(&status_line::of_module(&status));
        let mut identifications = self.shared.identifications.read();
        let components = {
            let state = self.shared.store.lock();
            identifications.kinds = status::kinds(&state.components);
            status::of_components(&state.components)
        };
        let report = ModuleReport { reason, components, status: status.clone(), identifications };
        self.shared.health.write(report);
        self.executor.outbox.routine(Routine::Status(Box::new(status)));
    }
}

fn due(step: Step, every: u64) -> bool {
    step.0.is_multiple_of(every)
}

/// Milliseconds since a time on another's clock; negative if that clock is ahead.
fn ms_since(time_unix_ns: u64) -> f64 {
    let elapsed_ns = i128::from(clock::unix_ns()) - i128::from(time_unix_ns);
    // A display value, and small.
    #[expect(clippy::cast_precision_loss, reason = "a display value")]
    let ms = elapsed_ns as f64 / 1e6;
    ms
}
