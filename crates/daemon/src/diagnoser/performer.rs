//! Carries out the actions of the diagnoser. Nothing here waits for the network or the disk.

use std::sync::Arc;

use diagnosis::{Action, Diagnoser, Doubt, Event, SampleRejection, Transition};
use shell::clock;
use shell::occurrences::Occurrences;
use vocabulary::{Input, Obeyed, Step};
use zenoh::query::Query;

use super::freeze_frames::FreezeFrames;
use super::identification::Identifier;
use super::inputs::Register;
use super::inquiry;
use super::intake::Refusals;
use super::outgoing::{Outbox, Outgoing, Routine};
use super::peers::{PeerQueries, QueryPause};
use super::pending_replies::{PendingOrder, PendingReplies};
use super::state::Record;
use diagnosis::messages::Speaker;

/// Everything that actions reach.
#[derive(Debug)]
pub(crate) struct Performer {
    pub(crate) speaker: Speaker,
    pub(crate) outbox: Outbox,
    pub(crate) identifier: Identifier,
    register: Register,
    pub(crate) freeze_frames: FreezeFrames,
    pub(crate) peers: PeerQueries,
    pub(crate) pending: PendingReplies,
    pub(crate) query_pause: QueryPause,
    pub(crate) inquiries: Arc<inquiry::InquiryTally>,
    pub(crate) refusals: Arc<Refusals>,
    /// The phase changed: a status is due.
    pub(crate) status_is_due: bool,
    rejections: [Occurrences; 2],
    gaps: Occurrences,
}

impl Performer {
    pub(crate) fn new(
        speaker: Speaker,
        (outbox, identifier, register, freeze_frames): (Outbox, Identifier, Register, FreezeFrames),
        peers: PeerQueries,
        pending: PendingReplies,
        query_pause: QueryPause,
        inquiries: Arc<inquiry::InquiryTally>,
        refusals: Arc<Refusals>,
    ) -> Self {
        Self {
            speaker,
            outbox,
            identifier,
            register,
            freeze_frames,
            peers,
            pending,
            query_pause,
            inquiries,
            refusals,
            status_is_due: true,
            rejections: Default::default(),
            gaps: Occurrences::default(),
        }
    }

    /// Notes an event that the diagnoser is about to handle, before what comes of it.
    pub(crate) fn note_event(&mut self, event: &Event, diagnoser: &Diagnoser) {
        let input = self.register.event(event, diagnoser);
        self.tell_input(input);
    }

    /// Carries out one action of the diagnoser.
    pub(crate) fn carry_out(&mut self, action: Action, diagnoser: &Diagnoser) {
        let input = self.register.action(&action, diagnoser);
        self.tell_input(input);
        match action {
            Action::Report { run, change, evidence } => {
                let change = self.speaker.change(run, &change, &evidence, clock::unix_ns());
                self.outbox.event(Outgoing::Change(Box::new(change)));
            }
            Action::Settled { run, change } => {
                self.outbox.record(Record::Change { run, change });
            }
            Action::Publish(transition) => self.publish(transition),
            Action::Identify(excerpt) => self.identifier.identify(excerpt),
            Action::Freeze(frame) => self.freeze_frames.keep(frame),
            Action::Ask { peer, question } => {
                self.query_pause.begin(&peer);
                self.peers.ask(peer, question);
            }
            Action::Answer { token, answer } => {
                if let Some(query) = self.pending.take_question(token) {
                    let answer = self.speaker.answer(answer);
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
            Action::Phase(_) => self.status_is_due = true,
            Action::Rejected { step, rejection } => self.note_rejection(step, rejection),
            Action::SignalLost { component, signal, since } => {
                tracing::warn!(%component, %signal, %since, "no usable signal");
            }
            Action::Gap { from, missing } => {
                if let Some(times) = self.gaps.note(std::time::Instant::now()) {
                    tracing::warn!(%from, missing, times, "samples missing");
                }
            }
            Action::AnswerRejected { peer, failure } => {
                tracing::warn!(%peer, "answer not used: {failure}");
                self.peers.note_rejection(&peer, failure.to_string());
            }
            Action::WordBroken { component, by } => {
                tracing::warn!(%component, %by, "disputed: {by} explained this, but {} does not \
                    raise the alarm for it", by.module);
                self.peers.note_dispute(&by.module);
            }
            Action::Restarted { component, violation } => {
                let step = diagnoser.last_step().unwrap_or_default();
                tracing::warn!(%component, %step, "channel restarted: {violation}");
            }
            Action::RunEnded => self.outbox.record(Record::RunEnded),
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
        self.inquiries.refused();
        self.outbox.routine(Routine::Refusal { query, reason });
    }

    /// Does not carry out an order.
    pub(crate) fn refuse_order(&self, query: Query, reason: String) {
        self.inquiries.order_refused();
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
        self.inquiries.order_obeyed();
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
        let now = std::time::Instant::now();
        if let Some(times) = occurrences.note(now) {
            tracing::warn!(%step, times, "sample not used: {rejection}");
        }
        self.refusals.note(rejection.to_string(), now);
    }
}
