//! A module's process as a plain value: samples, questions, orders, answers and the passing of time in, effects out.
//! Nothing here waits for the network or the disk.
//!
//! While a peer is being asked, the next sample stays in the queue for a moment. If the answer comes
//! by then, as it does in microseconds, the diagnoser gets it at the step at which it asked, just as
//! in a single process, and every transition is the same. Peers cannot wait for each other in a
//! circle: the querying module has processed the step in question, and queries are answered
//! meanwhile.

mod actions;
mod status;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use diagnosis::identification::Excerpt;
use diagnosis::messages::Speaker;
use diagnosis::{Action, Diagnoser, Event, Transition};
use vocabulary::{
    Ability, Capability, Component, ComponentPath, CylinderCapability, FrozenSignals, GivenOrder,
    GivenOrderKind, Input, InquiryCounters, IntakeCounters, ModuleName, ModulePhase, Occurrences,
    Order, OrderKind, PhaseChange, Progress, SampleQuestion, StateQuestion, Step, Topic,
};

pub use status::StatusSurroundings;

use crate::inputs::InputNumbering;
use crate::outgoing::{Outgoing, QueuedEvent, Routine};
use crate::peers::{PeerRetries, QueryPause};
use crate::pending_replies::{PendingOrder, PendingReplies, UNAWAITED};
use crate::record::WatchedSteps;
use crate::sequencer::{ReceivedSample, Sequencer, SequencerStep};
use crate::staleness::{ClockReading, NO_SAMPLE_YET, RecentRefusals, Staleness};
use crate::store_state::StoreState;

/// How often [`ModuleProcess::tick`] is to be called.
pub const TICK: Duration = Duration::from_millis(50);
/// A backlog that stays this old for this long is dropped.
const BEHIND_FOR: Duration = Duration::from_millis(250);
/// Samples that are diagnosed before effects are carried out.
const AT_A_TIME: usize = 16;

/// The settings of a module's process.
#[derive(Debug, Clone)]
pub struct ProcessSettings {
    /// Samples count as missing after this time without one.
    pub stale_after: Duration,
    /// Samples that wait for so long count as a backlog.
    pub resync_after: Duration,
    /// Missing steps that are asked for at most.
    pub recover_steps: u64,
    /// Samples that may wait.
    pub sample_queue: usize,
    /// How long a peer's question waits for its step.
    pub hold: Duration,
    /// How long samples wait for a peer's answer.
    pub pause: Duration,
    /// Steps between two messages on divergences, and on progress.
    pub divergence_every_steps: u64,
    /// Steps between two messages on progress.
    pub progress_every_steps: u64,
    /// Time between two statuses.
    pub status_every: Duration,
    /// The name of the thresholds.
    pub thresholds: String,
    /// The name of the reference.
    pub reference: Option<String>,
    /// Steps between changes that count as simultaneous.
    pub tie_steps: u64,
    /// Shuts a cylinder off by itself that is hard over.
    pub shuts_off_by_itself: bool,
}

/// The two clocks.
#[derive(Debug, Clone, Copy)]
pub struct Now {
    /// On the monotonic clock.
    pub at: Instant,
    /// On the system clock \[ns since 1970\].
    pub unix_ns: u64,
}

/// What the process knows beside the module: read when it is needed.
pub trait ProcessSurroundings {
    /// The latest samples that were refused.
    fn refusals(&self) -> RecentRefusals;
    /// May another cylinder be shut off, beside the module's own?
    ///
    /// # Errors
    /// Why not.
    fn may_shut_off(&self, own: &[CylinderCapability], now: Instant) -> Result<(), String>;
    /// Why a peer has not answered so far.
    fn why_silent(&self, peer: &ModuleName) -> String;
    /// Has a topic of frequent messages subscribers?
    fn is_subscribed(&self, topic: &Topic) -> bool;
}

/// What an input meets: the clocks, the store and the surroundings; and where its effects go.
pub struct ProcessContext<'a, Q> {
    /// The time of the input.
    pub now: Now,
    /// What the process knows and keeps.
    pub store: &'a mut StoreState,
    /// The rest of the process.
    pub surroundings: &'a dyn ProcessSurroundings,
    /// Appended to, in the order in which they are to be carried out.
    pub effects: &'a mut Vec<ProcessEffect<Q>>,
}

/// What is to be done.
#[derive(Debug)]
pub enum ProcessEffect<Q> {
    /// An event, stored already, is published once the disk has it. Those of one store keep their order.
    Publish(QueuedEvent<Q>),
    /// A message that may be dropped goes out.
    Routine(Routine<Q>),
    /// The publisher is asked for samples.
    Fetch(SampleQuestion),
    /// A peer is asked.
    Ask {
        /// Which one.
        peer: ModuleName,
        /// What.
        question: StateQuestion,
    },
    /// The kind of a fault is to be found.
    Identify(Box<Excerpt>),
    /// What was seen around the latching of a fault is kept.
    Freeze {
        /// The component.
        component: Component,
        /// Its signals.
        signals: Box<FrozenSignals>,
    },
    /// A status is due; the reason is that of the phase.
    Status {
        /// The reason.
        reason: String,
    },
    /// Samples that wait outside are dropped, too.
    DropQueuedSamples,
    /// A sample was not used.
    SampleRefused(String),
    /// An answer of the peer was not used.
    AnswerRejected {
        /// Which one.
        peer: ModuleName,
        /// Why.
        reason: String,
    },
    /// A peer does not stand by what it said.
    WordBroken(ModuleName),
}

/// A module's diagnoser with everything that its process decides around it. `Q` is a query that waits for its reply.
#[derive(Debug)]
pub struct ModuleProcess<Q> {
    diagnoser: Diagnoser,
    speaker: Speaker,
    settings: ProcessSettings,
    actions: Vec<Action>,
    sequencer: Sequencer,
    staleness: Staleness,
    retries: PeerRetries,
    numbering: InputNumbering,
    pending: PendingReplies<Q>,
    query_pause: QueryPause,
    /// Of what comes in, what is counted here.
    intake: IntakeCounters,
    /// Of what is asked, what is counted here.
    inquiries: InquiryCounters,
    lag_ms: Option<f64>,
    latest_sample_unix_ns: Option<u64>,
    /// Since when samples have been diagnosed too late, and the latest of them.
    behind: Option<(Instant, Instant)>,
    last_watch: Option<WatchedSteps>,
    last_status: Option<Instant>,
    /// Something changed: a status is due.
    status_is_due: bool,
    last_capability: Vec<CylinderCapability>,
    last_progress: Option<(Progress, Instant)>,
    /// Of each channel the largest excess of its divergence since the latest status.
    largest_change: Vec<f64>,
    rejections: [Occurrences; 2],
    gaps: Occurrences,
    resynchronised: Occurrences,
    not_shut_off: Occurrences,
}

impl<Q> ModuleProcess<Q> {
    /// A process that starts: the diagnoser is given what the store holds and how far the module had watched. Returns
    /// the first input, for subscribers.
    #[must_use]
    pub fn start(
        (mut diagnoser, speaker): (Diagnoser, Speaker),
        settings: ProcessSettings,
        fingerprint: String,
        (store, watch): (&mut StoreState, Option<WatchedSteps>),
        now: Now,
    ) -> (Self, Input) {
        let memory = store.components.memory(&speaker.module, watch);
        let mut numbering = InputNumbering::new(speaker.clone(), now.unix_ns);
        let started = numbering.start(&memory, fingerprint, now.unix_ns);
        diagnoser.recall(memory);
        let (components, reason) = (diagnoser.components(), NO_SAMPLE_YET.to_owned());
        store.components.configure(&speaker.module, components, reason, now.unix_ns);
        store.components.conditions(diagnoser.conditions().cloned(), now.unix_ns);
        let process = Self {
            actions: Vec::new(),
            sequencer: Sequencer::new(settings.recover_steps, settings.sample_queue),
            staleness: Staleness::new(settings.stale_after),
            retries: PeerRetries::default(),
            numbering,
            pending: PendingReplies::new(settings.hold),
            query_pause: QueryPause::new(settings.pause),
            intake: IntakeCounters::default(),
            inquiries: InquiryCounters::default(),
            lag_ms: None,
            latest_sample_unix_ns: None,
            behind: None,
            last_watch: watch,
            last_status: None,
            status_is_due: true,
            last_capability: Vec::new(),
            last_progress: None,
            largest_change: vec![0.0; components.len()],
            rejections: Default::default(),
            gaps: Occurrences::default(),
            resynchronised: Occurrences::default(),
            not_shut_off: Occurrences::default(),
            diagnoser,
            speaker,
            settings,
        };
        (process, started)
    }

    /// The diagnoser.
    #[must_use]
    pub fn diagnoser(&self) -> &Diagnoser {
        &self.diagnoser
    }

    /// Who speaks.
    #[must_use]
    pub fn speaker(&self) -> &Speaker {
        &self.speaker
    }

    /// The diagnoser, for what does not change its verdicts.
    pub fn diagnoser_mut(&mut self) -> &mut Diagnoser {
        &mut self.diagnoser
    }

    /// The start of the process \[ns since 1970\], which distinguishes its inputs.
    #[must_use]
    pub fn process(&self) -> u64 {
        self.numbering.process()
    }

    /// Until when samples wait for a peer's answer; meanwhile none need be handed in.
    #[must_use]
    pub fn pause(&self) -> Option<Instant> {
        self.query_pause.until()
    }

    /// Samples have waited long enough.
    pub fn end_pause(&mut self) {
        self.query_pause.expire();
    }

    /// A sample arrived; [`ModuleProcess::advance`] diagnoses it.
    pub fn sample(&mut self, arrival: ReceivedSample) {
        self.sequencer.push(arrival);
    }

    /// What the publisher still had arrived.
    pub fn recovered(
        &mut self,
        question: SampleQuestion,
        samples: Vec<ReceivedSample>,
        now: Instant,
    ) {
        let _ = self.sequencer.take(question, samples, now);
    }

    /// Diagnoses what is there to be diagnosed, some of it at a time. Returns whether there may be more.
    pub fn advance(&mut self, context: &mut ProcessContext<'_, Q>) -> bool {
        for _ in 0..AT_A_TIME {
            if self.query_pause.until().is_some() {
                return false;
            }
            let last = self.diagnoser.run().zip(self.diagnoser.last_step());
            match self.sequencer.next(last, context.now.at) {
                Some(SequencerStep::Process(arrival)) => self.take_sample(arrival, context),
                Some(SequencerStep::Fetch(question)) => {
                    context.effects.push(ProcessEffect::Fetch(question));
                }
                None => return false,
            }
        }
        true
    }

    fn take_sample(&mut self, arrival: ReceivedSample, context: &mut ProcessContext<'_, Q>) {
        let ReceivedSample { sample, time_unix_ns, received } = arrival;
        self.note_backlog(received, context.now.at);
        let used_before = self.diagnoser.counters().samples;
        let changes_before = self.diagnoser.counters().changes;
        let runs_before = self.diagnoser.counters().runs;
        self.handle(Event::Sample(sample), context);
        if self.diagnoser.counters().samples == used_before {
            return;
        }
        for (channel, largest) in self.largest_change.iter_mut().enumerate() {
            *largest = largest.max(self.diagnoser.excess(channel));
        }
        self.staleness.sample(context.now.at);
        self.note_time(time_unix_ns, context.now.unix_ns);
        let is_new_run = self.diagnoser.counters().runs != runs_before;
        if is_new_run || self.diagnoser.has_compared() {
            self.note_conditions(context);
        }
        let changed = self.diagnoser.counters().changes != changes_before;
        self.publish_routinely(changed, context);
        self.tell_phase(context);
    }

    fn note_conditions(&self, context: &mut ProcessContext<'_, Q>) {
        let conditions = self.diagnoser.conditions().cloned();
        context.store.components.conditions(conditions, context.now.unix_ns);
    }

    /// The phase of the module.
    #[must_use]
    pub fn phase(&self) -> ModulePhase {
        self.staleness.phase(self.diagnoser.phase())
    }

    /// Why it is in this phase.
    fn reason(&self, phase: ModulePhase, context: &ProcessContext<'_, Q>) -> String {
        self.staleness.reason(phase, &context.surroundings.refusals(), context.now.at)
    }

    /// No decision depends on the publisher's clock, so its irregularities are only reported.
    fn note_time(&mut self, time_unix_ns: u64, now_unix_ns: u64) {
        if self.latest_sample_unix_ns.is_some_and(|before| time_unix_ns <= before) {
            self.intake.clock_standing += 1;
        }
        self.latest_sample_unix_ns = Some(time_unix_ns);
        self.lag_ms = Some(status::ms_between(time_unix_ns, now_unix_ns));
    }

    fn note_backlog(&mut self, received: Instant, now: Instant) {
        let behind = now.saturating_duration_since(received) >= self.settings.resync_after;
        self.behind = behind.then(|| (self.behind.map_or(now, |(since, _)| since), now));
    }

    /// Drops the backlog when samples had to be dropped, or have been diagnosed too late for a
    /// while: what is diagnosed must be the present. A process that was frozen finds an old sample and a
    /// gap behind it: what the publisher still has is waited for.
    fn resynchronise(&mut self, overflown: bool, context: &mut ProcessContext<'_, Q>) {
        let now = context.now.at;
        let behind = !self.sequencer.is_owed()
            && self.behind.is_some_and(|(since, latest)| latest - since >= BEHIND_FOR);
        if !overflown && !behind {
            return;
        }
        let thrown = self.sequencer.clear(now);
        context.effects.push(ProcessEffect::DropQueuedSamples);
        self.behind = None;
        self.intake.dropped += thrown as u64;
        self.intake.resynchronised += 1;
        if let Some(times) = self.resynchronised.note(now) {
            let problem =
                "backlog of samples dropped: they arrive faster than they can be diagnosed";
            tracing::warn!(thrown, times, "{problem}");
        }
    }

    /// Divergences, corrected readings and progress, when they are due and have subscribers.
    fn publish_routinely(&mut self, changed: bool, context: &mut ProcessContext<'_, Q>) {
        let (Some(run), Some(step)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        let now_unix_ns = context.now.unix_ns;
        let due_now = changed || due(step, self.settings.divergence_every_steps);
        if due_now && context.surroundings.is_subscribed(&Topic::Divergence) {
            let message = self.speaker.divergences((run, step), &self.diagnoser, now_unix_ns);
            context.effects.push(ProcessEffect::Routine(Routine::Divergences(message)));
        }
        if context.surroundings.is_subscribed(&Topic::Corrected) {
            let message = self.speaker.corrected((run, step), &self.diagnoser, now_unix_ns);
            context.effects.push(ProcessEffect::Routine(Routine::Corrected(message)));
        }
        if due(step.plus(1), self.settings.progress_every_steps) {
            self.send_progress(context);
        }
    }

    /// A peer asks.
    pub fn question(
        &mut self,
        question: StateQuestion,
        query: Q,
        context: &mut ProcessContext<'_, Q>,
    ) {
        if self.staleness.is_stale() && Some(question.as_of) > self.diagnoser.last_step() {
            let reason = self.reason(ModulePhase::Stale, context);
            self.refuse(query, reason, context);
            return;
        }
        let token = self.pending.put_question(query, context.now.at);
        self.handle(Event::Asked { token, question }, context);
    }

    /// The whole state of the diagnoser, with the input that gives it: between two inputs, so that state and number of
    /// inputs fit.
    pub fn state(&mut self, now_unix_ns: u64) -> (Input, vocabulary::StatePart) {
        let (head, mut state) = self.numbering.state(&self.diagnoser, now_unix_ns);
        state.sample_time_unix_ns = self.latest_sample_unix_ns;
        (head, state)
    }

    /// An operator's order.
    pub fn order(
        &mut self,
        kind: OrderKind,
        order: &Order,
        query: Q,
        context: &mut ProcessContext<'_, Q>,
    ) {
        let components = match self.concerned(kind, order, context) {
            Ok(components) => components,
            Err(reason) => return self.refuse_order(query, reason, context),
        };
        let (now, is_of_module) = (context.now.unix_ns, kind.is_of_module());
        let awaited = self.pending.put_order(PendingOrder { query, is_of_module });
        let mut left = components.len();
        for component in components {
            left -= 1;
            // The reply comes after the last.
            let token = if left == 0 { awaited } else { UNAWAITED };
            let order = order.clone().given(kind, now);
            self.handle(Event::Ordered { token, component, order }, context);
        }
        self.note_conditions(context);
        self.status_is_due = true;
        self.tell_phase(context);
    }

    /// The components that an order is about; or why it is refused.
    fn concerned(
        &self,
        kind: OrderKind,
        order: &Order,
        context: &ProcessContext<'_, Q>,
    ) -> Result<Vec<Component>, String> {
        let Some(mention) = &order.component else {
            return self.concerned_of_module(kind);
        };
        let own = self.speaker.path(&mention.component);
        if !mention.may_be(&own) {
            let module = &own.module;
            return Err(format!("`{mention}` is not a component of module `{module}`"));
        }
        if kind == OrderKind::ShutOff {
            let own = self.cylinders(context.store);
            context.surroundings.may_shut_off(&own, context.now.at)?;
        }
        if kind == OrderKind::Reset && !order.force && self.staleness.is_stale() {
            let why = self.reason(ModulePhase::Stale, context);
            return Err(format!("state of `{mention}` unknown: {why}"));
        }
        Ok(vec![mention.component.clone()])
    }

    /// The components that an order about the whole module concerns.
    fn concerned_of_module(&self, kind: OrderKind) -> Result<Vec<Component>, String> {
        if kind != OrderKind::Unsuppress {
            return Ok(self.diagnoser.components().to_vec());
        }
        let suppressed: Vec<Component> = self.diagnoser.suppressed().cloned().collect();
        if suppressed.is_empty() {
            return Err(format!("no component of `{}` is suppressed", self.diagnoser.module()));
        }
        Ok(suppressed)
    }

    /// Shelvings and suppressions expire, whether samples come or not.
    fn end_shelvings(&mut self, context: &mut ProcessContext<'_, Q>) {
        for (component, order) in self.diagnoser.lapses(context.now.unix_ns) {
            self.handle(Event::Ordered { token: UNAWAITED, component, order }, context);
            self.status_is_due = true;
        }
    }

    /// A peer's answer, that none comes, or that a peer is back.
    pub fn answer(&mut self, event: Event, context: &mut ProcessContext<'_, Q>) {
        let ended = match &event {
            Event::Answered(answer) => Some((answer.module.clone(), true)),
            Event::Unanswered { peer, .. } => Some((peer.clone(), false)),
            _ => None,
        };
        if let Some((peer, _)) = &ended {
            // Before what comes of it: a query that follows pauses the samples anew.
            self.query_pause.end(peer);
        }
        self.handle(event, context);
        if let Some((peer, answered)) = ended {
            self.note_conditions(context);
            self.retries.note(&peer, answered, context.now.at);
        }
    }

    /// Peers that did not answer are queried again, whether samples come or not.
    fn ask_again(&mut self, context: &mut ProcessContext<'_, Q>) {
        for peer in self.retries.over(context.now.at) {
            self.handle(Event::Returned { peer }, context);
        }
    }

    /// Time has passed. `overflown`: a sample was dropped outside since the last time.
    pub fn tick(&mut self, overflown: bool, context: &mut ProcessContext<'_, Q>) {
        let now = context.now;
        self.resynchronise(overflown, context);
        if self.staleness.look(now.at, now.unix_ns) {
            self.intake.silences += 1;
            self.end_freeze_frames(context);
        }
        self.tell_phase(context);
        self.tell_monitored(context);
        context.store.components.readings(self.diagnoser.replaced_readings());
        if self.settings.shuts_off_by_itself {
            self.shut_off_by_itself(context);
        }
        self.end_shelvings(context);
        self.ask_again(context);
        self.give_up_questions(context);
        self.repeat_progress(context);
        self.note_watch(context);
        let every = self.settings.status_every;
        let due = self.last_status.is_none_or(|last| now.at.duration_since(last) >= every);
        if due || std::mem::take(&mut self.status_is_due) {
            self.send_status(context);
            self.last_status = Some(now.at);
        }
        self.tell_capability(due, context);
    }

    /// No input follows.
    pub fn finish(&mut self, context: &mut ProcessContext<'_, Q>) {
        self.end_freeze_frames(context);
        self.send_status(context);
    }

    /// Publishes the phase when it changes.
    fn tell_phase(&mut self, context: &mut ProcessContext<'_, Q>) {
        let phase = self.phase();
        let Some(before) = self.staleness.change_to(phase) else { return };
        let reason = self.reason(phase, context);
        context.store.components.monitored(phase, reason.clone(), context.now.unix_ns);
        let moment = self.moment(context.now);
        self.publish_phase(before, BTreeMap::new(), reason, moment, context);
    }

    /// Publishes which components cannot be monitored when that changes.
    fn tell_monitored(&mut self, context: &mut ProcessContext<'_, Q>) {
        if self.phase() != ModulePhase::InService {
            return;
        }
        let lost = context.store.components.not_monitored();
        let moment = self.moment(context.now);
        let Some(since) = self.staleness.change_of_monitored(&lost, moment) else { return };
        let reason = self.staleness.monitored_in_words(self.diagnoser.components().len());
        let not_monitored = self.staleness.not_monitored();
        self.publish_phase(Some(ModulePhase::InService), not_monitored, reason, since, context);
    }

    fn moment(&self, now: Now) -> ClockReading {
        let step = self.diagnoser.last_step();
        ClockReading { at: now.at, time_unix_ns: now.unix_ns, step }
    }

    fn publish_phase(
        &mut self,
        before: Option<ModulePhase>,
        not_monitored: BTreeMap<ComponentPath, String>,
        reason: String,
        since: ClockReading,
        context: &mut ProcessContext<'_, Q>,
    ) {
        let phase = self.phase();
        let ClockReading { step, time_unix_ns, .. } = since;
        tracing::info!(phase = phase.as_str(), step = ?step.map(|step| step.0), "{reason}");
        let Speaker { structure, module, .. } = self.speaker.clone();
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
        publish(Outgoing::Phase(Box::new(change)), context);
        self.status_is_due = true;
    }

    /// What the cylinders can do.
    fn cylinders(&self, store: &StoreState) -> Vec<CylinderCapability> {
        let ends_in_s = |one: &Component, kind| self.diagnoser.leak_ends_in_s(one, kind);
        store.components.capability(ends_in_s).collect()
    }

    /// Shuts off what is known to be hard over, unless an operator has put it back.
    fn shut_off_by_itself(&mut self, context: &mut ProcessContext<'_, Q>) {
        for cylinder in self.cylinders(context.store) {
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
            let own = self.cylinders(context.store);
            if let Err(why) = context.surroundings.may_shut_off(&own, context.now.at) {
                if let Some(times) = self.not_shut_off.note(context.now.at) {
                    tracing::warn!(%component, times, "hard over, but not shut off: {why}");
                }
                continue;
            }
            let kind = GivenOrderKind::ShutOff { since_unix_ns: context.now.unix_ns };
            let order = GivenOrder::by_itself(kind, Some("hard over".to_owned()));
            tracing::warn!(%component, "hard over: shut off");
            self.handle(Event::Ordered { token: UNAWAITED, component, order }, context);
            self.status_is_due = true;
        }
    }

    /// Publishes what cylinders can do when that changes, or when it is due.
    fn tell_capability(&mut self, due: bool, context: &mut ProcessContext<'_, Q>) {
        let cylinders = self.cylinders(context.store);
        if cylinders == self.last_capability && !due {
            return;
        }
        self.last_capability.clone_from(&cylinders);
        let Speaker { structure, module, .. } = self.speaker.clone();
        let time_unix_ns = context.now.unix_ns;
        let message = Capability { structure, module, cylinders, time_unix_ns };
        context.effects.push(ProcessEffect::Routine(Routine::Capability(message)));
    }

    /// Expired queries are refused; all of them if samples have stopped.
    fn give_up_questions(&mut self, context: &mut ProcessContext<'_, Q>) {
        let stale = self.staleness.is_stale();
        let hold = self.pending.hold();
        for token in self.pending.expired(context.now.at, stale) {
            self.handle(Event::Withdrawn { token }, context);
            let reason = if stale {
                self.reason(ModulePhase::Stale, context)
            } else {
                format!("step not reached within {} ms", hold.as_millis())
            };
            if let Some(query) = self.pending.take_question(token) {
                self.refuse(query, reason, context);
            }
        }
    }

    /// A plant in lock step must receive the last step even if it is not a multiple of the interval, or if the message
    /// was dropped.
    fn repeat_progress(&mut self, context: &mut ProcessContext<'_, Q>) {
        let now = context.now.at;
        let stale = match (&self.last_progress, self.diagnoser.last_step()) {
            (_, None) => false,
            (None, Some(_)) => true,
            (Some((progress, at)), Some(step)) => {
                progress.step != step || now.duration_since(*at) >= 10 * TICK
            }
        };
        if stale {
            self.send_progress(context);
        }
    }

    fn send_progress(&mut self, context: &mut ProcessContext<'_, Q>) {
        let (Some(run), Some(step)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        if !context.surroundings.is_subscribed(&Topic::Progress) {
            return;
        }
        let progress = Progress { run, step };
        self.last_progress = Some((progress, context.now.at));
        context.effects.push(ProcessEffect::Routine(Routine::Progress(progress)));
    }

    /// Remembers how far every channel was watched. Changes of the last few steps are not in the journal
    /// yet, so these steps do not count.
    fn note_watch(&mut self, context: &mut ProcessContext<'_, Q>) {
        let (Some(run), Some(last)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        let until = last.minus(self.settings.tie_steps + 1);
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
        context.store.watched(watch, context.now.at);
        self.last_watch = Some(watch);
    }

    fn send_status(&self, context: &mut ProcessContext<'_, Q>) {
        let phase = self.phase();
        let reason = self.reason(phase, context);
        // For replies, which name the reason as long as the module is not in service.
        context.store.components.monitored(phase, reason.clone(), context.now.unix_ns);
        context.effects.push(ProcessEffect::Status { reason });
    }
}

/// Stores an event and has it published. Both in one order.
fn publish<Q>(event: Outgoing<Q>, context: &mut ProcessContext<'_, Q>) {
    let queued = context.store.enter(event, context.now.at);
    context.effects.extend(queued.map(ProcessEffect::Publish));
}

fn due(step: Step, every: u64) -> bool {
    step.0.is_multiple_of(every)
}
