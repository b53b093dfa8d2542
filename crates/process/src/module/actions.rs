//! What comes of the diagnoser's actions.

use diagnosis::{Action, Diagnoser, Doubt, Event, OrderToken, SampleRejection, Transition};
use vocabulary::{Input, Obeyed, Step};

use super::{ModuleProcess, ProcessContext, ProcessEffect, publish};
use crate::outgoing::{Outgoing, Routine};
use crate::pending_replies::PendingOrder;
use crate::record::JournalRecord;

impl<Q> ModuleProcess<Q> {
    pub(super) fn handle(&mut self, event: Event, context: &mut ProcessContext<'_, Q>) {
        // Before what comes of it.
        let input = self.numbering.event(&event, &self.diagnoser, context.now.unix_ns);
        tell_input(input, context);
        self.act(|diagnoser, actions| diagnoser.handle(event, actions), context);
    }

    /// No sample follows for now.
    pub(super) fn end_freeze_frames(&mut self, context: &mut ProcessContext<'_, Q>) {
        self.act(Diagnoser::end_freeze_frames, context);
    }

    fn act(
        &mut self,
        act: impl FnOnce(&mut Diagnoser, &mut Vec<Action>),
        context: &mut ProcessContext<'_, Q>,
    ) {
        let mut actions = std::mem::take(&mut self.actions);
        act(&mut self.diagnoser, &mut actions);
        for action in actions.drain(..) {
            self.carry_out(action, context);
        }
        self.actions = actions;
    }

    fn carry_out(&mut self, action: Action, context: &mut ProcessContext<'_, Q>) {
        let now = context.now;
        let input = self.numbering.action(&action, &self.diagnoser, now.unix_ns);
        tell_input(input, context);
        match action {
            Action::Report { run, change, evidence } => {
                let change = self.speaker.change(run, &change, &evidence, now.unix_ns);
                publish(Outgoing::Change(Box::new(change)), context);
            }
            Action::Settled { run, change } => {
                context.store.record(JournalRecord::Change { run, change }, now.at);
            }
            Action::Publish(transition) => self.transition(transition, context),
            Action::Identify(excerpt) => context.effects.push(ProcessEffect::Identify(excerpt)),
            Action::Freeze { component, signals } => {
                context.effects.push(ProcessEffect::Freeze { component, signals });
            }
            Action::Ask { peer, question } => {
                self.query_pause.begin(&peer, now.at);
                context.effects.push(ProcessEffect::Ask { peer, question });
            }
            Action::Answer { token, answer } => {
                if let Some(query) = self.pending.take_question(token) {
                    context.effects.push(ProcessEffect::Routine(Routine::Answer { query, answer }));
                }
            }
            Action::Refuse { token, refusal } => {
                if let Some(query) = self.pending.take_question(token) {
                    self.refuse(query, refusal.to_string(), context);
                }
            }
            Action::Obeyed { token, sequence } => self.obeyed(token, sequence, context),
            Action::OrderRefused { token, refusal } => {
                if let Some(pending) = self.pending.take_order(token) {
                    self.refuse_order(pending.query, refusal.to_string(), context);
                }
            }
            Action::Phase { .. } => self.status_is_due = true,
            Action::Rejected { step, rejection } => self.note_rejection(step, rejection, context),
            Action::SignalLost { component, signal, since } => {
                tracing::warn!(%component, %signal, %since, "no usable signal");
            }
            Action::Gap { from, missing } => {
                if let Some(times) = self.gaps.note(now.at) {
                    tracing::warn!(%from, missing, times, "samples missing");
                }
            }
            Action::AnswerRejected { peer, failure } => {
                tracing::warn!(%peer, "answer not used: {failure}");
                let reason = failure.to_string();
                context.effects.push(ProcessEffect::AnswerRejected { peer, reason });
            }
            Action::WordBroken { component, by } => {
                tracing::warn!(%component, %by, "disputed: explained by {by}, but {} raises no alarm \
                    for it", by.module);
                context.effects.push(ProcessEffect::WordBroken(by.module));
            }
            Action::Restarted { component, violation } => {
                let step = self.diagnoser.last_step().unwrap_or_default();
                tracing::warn!(%component, %step, "channel restarted: {violation}");
            }
            Action::RunEnded => context.store.record(JournalRecord::RunEnded, now.at),
            Action::RunStarted(run) => tracing::info!(%run, "new run"),
        }
    }

    /// Does not answer a question.
    pub(super) fn refuse(&mut self, query: Q, reason: String, context: &mut ProcessContext<'_, Q>) {
        self.inquiries.refused += 1;
        context.effects.push(ProcessEffect::Routine(Routine::Refusal { query, reason }));
    }

    /// Does not carry out an order.
    pub(super) fn refuse_order(
        &mut self,
        query: Q,
        reason: String,
        context: &mut ProcessContext<'_, Q>,
    ) {
        // An order refused is a question refused.
        self.inquiries.orders_refused += 1;
        self.refuse(query, reason, context);
    }

    fn transition(&self, transition: Transition, context: &mut ProcessContext<'_, Q>) {
        let mut message = self.speaker.transition(transition, context.now.unix_ns);
        if let Some(Doubt::Silent(peers)) = message.verdict.doubt() {
            let why = peers.iter().map(|peer| context.surroundings.why_silent(peer));
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
        publish(Outgoing::Fault(Box::new(message)), context);
    }

    /// The reply goes the way of the transition, which learns whether the journal has it.
    fn obeyed(&mut self, token: OrderToken, sequence: u64, context: &mut ProcessContext<'_, Q>) {
        let Some(PendingOrder { query, is_of_module }) = self.pending.take_order(token) else {
            return;
        };
        // The question is answered when the reply is sent.
        self.inquiries.orders_obeyed += 1;
        let mut latest = self.diagnoser.last_transitions();
        let Some(transition) = latest.find(|latest| latest.sequence == sequence) else { return };
        let state = transition.verdict.state();
        let component = (!is_of_module).then(|| transition.component.clone());
        let obeyed = Obeyed { component, state, sequence, durable: false };
        publish(Outgoing::Obeyed { query, obeyed }, context);
    }

    fn note_rejection(
        &mut self,
        step: Step,
        rejection: SampleRejection,
        context: &mut ProcessContext<'_, Q>,
    ) {
        let [lengths, steps] = &self.rejections;
        let occurrences = match rejection {
            SampleRejection::WrongLength => lengths,
            SampleRejection::Repeated | SampleRejection::Late | SampleRejection::FarAhead => steps,
        };
        if let Some(times) = occurrences.note(context.now.at) {
            tracing::warn!(%step, times, "sample not used: {rejection}");
        }
        context.effects.push(ProcessEffect::SampleRefused(rejection.to_string()));
    }
}

/// Its number shows whether one is lost.
fn tell_input<Q>(input: Option<Input>, context: &mut ProcessContext<'_, Q>) {
    if let Some(input) = input {
        publish(Outgoing::Input(Box::new(input)), context);
    }
}
