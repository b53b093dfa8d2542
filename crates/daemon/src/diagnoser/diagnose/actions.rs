//! Carries out the actions of the diagnoser. Nothing here waits for the network or the disk.

use std::time::Instant;

use diagnosis::{Action, Diagnoser, Doubt, Event, SampleRejection, Transition};
use process::{InputNumbering, JournalRecord, PendingOrder, PendingReplies, QueryPause};
use shell::clock;
use shell::occurrences::Occurrences;
use vocabulary::{Input, Obeyed, Step};
use zenoh::query::Query;

use super::super::answer::SharedInquiryCounters;
use super::super::freeze_frames::FreezeFrames;
use super::super::identify::Identifier;
use super::super::input::SampleReceiver;
use super::super::peers::PeerQueries;
use super::super::publish::{ModuleOutbox, Outgoing, Routine};
use super::super::store::ModuleStore;
use diagnosis::messages::Speaker;

/// Everything that actions reach.
#[derive(Debug)]
pub(crate) struct ActionExecutor {
    pub(crate) speaker: Speaker,
    pub(crate) outbox: ModuleOutbox,
    pub(crate) identifier: Identifier,
    store: ModuleStore,
    pub(crate) numbering: InputNumbering,
    pub(crate) freeze_frames: FreezeFrames,
    pub(crate) peers: PeerQueries,
    pub(crate) pending: PendingReplies<Query>,
    pub(crate) query_pause: QueryPause,
    pub(crate) inquiries: SharedInquiryCounters,
    receiver: SampleReceiver,
    /// The phase changed: a status is due.
    pub(crate) status_is_due: bool,
    rejections: [Occurrences; 2],
    gaps: Occurrences,
}

impl ActionExecutor {
    pub(crate) fn new(
        speaker: Speaker,
        (outbox, store, numbering): (ModuleOutbox, ModuleStore, InputNumbering),
        (identifier, freeze_frames, peers): (Identifier, FreezeFrames, PeerQueries),
        (pending, query_pause): (PendingReplies<Query>, QueryPause),
        inquiries: SharedInquiryCounters,
        receiver: SampleReceiver,
    ) -> Self {
        Self {
            speaker,
            outbox,
            identifier,
            store,
            numbering,
            freeze_frames,
            peers,
            pending,
            query_pause,
            inquiries,
            receiver,
            status_is_due: true,
            rejections: Default::default(),
            gaps: Occurrences::default(),
        }
    }

    /// Notes an event that the diagnoser is about to handle, before what comes of it.
    pub(crate) fn note_event(&mut self, event: &Event, diagnoser: &Diagnoser) {
        let input = self.numbering.event(event, diagnoser, clock::unix_ns());
        self.tell_input(input);
    }

    /// Carries out one action of the diagnoser.
    pub(crate) fn carry_out(&mut self, action: Action, diagnoser: &Diagnoser) {
        let input = self.numbering.action(&action, diagnoser, clock::unix_ns());
        self.tell_input(input);
        match action {
            Action::Report { run, change, evidence } => {
                let change = self.speaker.change(run, &change, &evidence, clock::unix_ns());
                self.outbox.event(Outgoing::Change(Box::new(change)));
            }
            Action::Settled { run, change } => {
                self.store.record(JournalRecord::Change { run, change });
            }
            Action::Publish(transition) => self.publish(transition),
            Action::Identify(excerpt) => self.identifier.identify(excerpt),
            Action::Freeze { component, signals } => self.freeze_frames.keep(component, signals),
            Action::Ask { peer, question } => {
                self.query_pause.begin(&peer, Instant::now());
                self.peers.ask(peer, question);
            }
            Action::Answer { token, answer } => {
                if let Some(query) = self.pending.take_question(token) {
                    self.outbox.routine(Routine::Answer { query, answer });
                }
            }
            Action::Refuse { token, refusal } => {
                if let Some(query) = self.pending.take_question(token) {
                    self.refuse(query, refusal.to_string());
                }
            }
            Action::Obeyed { token, sequence } => self.obeyed(token, sequence, diagnoser),
            Action::OrderRefused { token, refusal } => {
                if let Some(pending) = self.pending.take_order(token) {
                    self.refuse_order(pending.query, refusal.to_string());
                }
            }
            Action::Phase { .. } => self.status_is_due = true,
            Action::Rejected { step, rejection } => self.note_rejection(step, rejection),
            Action::SignalLost { component, signal, since } => {
                tracing::warn!(%component, %signal, %since, "no usable signal");
            }
            Action::Gap { from, missing } => {
                if let Some(times) = self.gaps.note(Instant::now()) {
                    tracing::warn!(%from, missing, times, "samples missing");
                }
            }
            Action::AnswerRejected { peer, failure } => {
                tracing::warn!(%peer, "answer not used: {failure}");
                self.peers.note_rejection(&peer, failure.to_string());
            }
            Action::WordBroken { component, by } => {
                tracing::warn!(%component, %by, "disputed: explained by {by}, but {} raises no alarm \
                    for it", by.module);
                self.peers.note_dispute(&by.module);
            }
            Action::Restarted { component, violation } => {
                let step = diagnoser.last_step().unwrap_or_default();
                tracing::warn!(%component, %step, "channel restarted: {violation}");
            }
            Action::RunEnded => self.store.record(JournalRecord::RunEnded),
            Action::RunStarted(run) => tracing::info!(%run, "new run"),
        }
    }

    /// Its number shows whether one is lost.
    fn tell_input(&self, input: Option<Input>) {
        if let Some(input) = input {
            self.outbox.event(Outgoing::Input(Box::new(input)));
        }
    }

    /// Does not answer a question.
    pub(crate) fn refuse(&self, query: Query, reason: String) {
        self.inquiries.count(|counters| counters.refused += 1);
        self.outbox.routine(Routine::Refusal { query, reason });
    }

    /// Does not carry out an order.
    pub(crate) fn refuse_order(&self, query: Query, reason: String) {
        // An order refused is a question refused.
        self.inquiries.count(|counters| {
            counters.orders_refused += 1;
            counters.refused += 1;
        });
        self.outbox.routine(Routine::Refusal { query, reason });
    }

    fn publish(&self, transition: Transition) {
        let mut message = self.speaker.transition(transition, clock::unix_ns());
        if let Some(Doubt::Silent(peers)) = message.verdict.doubt() {
            let why = peers.iter().map(|peer| self.peers.why_silent(peer));
            message.silent_because = why.collect();
        }
        tracing::info!(
            component = %message.component,
            state = %message.state(),
            detection = ?message.detection_step.map(|step| step.0),
            explained_by = ?message.verdict.explained_by().map(ToString::to_string),
            disputed = ?message.disputed.as_ref().map(ToString::to_string),
            silent = %message.silent_because.join("; "),
            by = ?message.order.as_ref().map(|order| &order.by),
            "verdict"
        );
        self.outbox.event(Outgoing::Fault(Box::new(message)));
    }

    /// The reply goes the way of the transition, which learns whether the journal has it.
    fn obeyed(&mut self, token: diagnosis::OrderToken, sequence: u64, diagnoser: &Diagnoser) {
        let Some(PendingOrder { query, is_of_module }) = self.pending.take_order(token) else {
            return;
        };
        // The question is answered when the reply is sent.
        self.inquiries.count(|counters| counters.orders_obeyed += 1);
        let mut latest = diagnoser.last_transitions();
        let Some(transition) = latest.find(|latest| latest.sequence == sequence) else { return };
        let state = transition.verdict.state();
        let component = (!is_of_module).then(|| transition.component.clone());
        let obeyed = Obeyed { component, state, sequence, durable: false };
        self.outbox.event(Outgoing::Obeyed { query, obeyed });
    }

    fn note_rejection(&mut self, step: Step, rejection: SampleRejection) {
        let [lengths, steps] = &self.rejections;
        let occurrences = match rejection {
            SampleRejection::WrongLength => lengths,
            SampleRejection::Repeated | SampleRejection::Late | SampleRejection::FarAhead => steps,
        };
        let now = Instant::now();
        if let Some(times) = occurrences.note(now) {
            tracing::warn!(%step, times, "sample not used: {rejection}");
        }
        self.receiver.note_refusal(rejection.to_string(), now);
    }
}
