//! The task that owns the diagnoser: takes samples, questions and answers one at a time and carries
//! out the actions that follow. Nothing here waits for the network.
//!
//! While a peer is being asked, the next sample stays in the queue for a moment. If the answer comes
//! by then, as it does in microseconds, the diagnoser gets it at the step at which it asked, just as
//! in a single process, and every transition is the same. Peers cannot wait for each other in a
//! circle: whoever asks has processed the step that it asks about, and questions are answered
//! meanwhile.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use diagnosis::{Action, Diagnoser, Event, Question, QuestionToken, SampleRejection, Transition};
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval, sleep_until};
use truss::ids::Step;
use wire::Progress;
use zenoh::query::Query;

use super::outbox::{Outbox, Outgoing};
use super::peer_query::PeerQueries;
use super::sample_intake::{Arrival, Counters};
use super::state_queryable::Inquiry;
use super::status::{self, Surroundings};
use crate::clock;
use crate::config::{DiagnoserConfig, PublishSettings};
use crate::convert::Speaker;
use crate::occurrences::Occurrences;
use crate::shutdown::Shutdown;

/// How often held questions and the last step's progress are looked after.
const TICK: Duration = Duration::from_millis(50);

/// What the loop takes from.
#[derive(Debug)]
pub(crate) struct Queues {
    pub(crate) samples: mpsc::Receiver<Arrival>,
    pub(crate) inquiries: mpsc::Receiver<Inquiry>,
    pub(crate) answers: mpsc::Receiver<Event>,
}

/// The diagnoser with everything around it.
#[derive(Debug)]
pub(crate) struct DiagnosisLoop {
    diagnoser: Diagnoser,
    actions: Vec<Action>,
    speaker: Speaker,
    outbox: Outbox,
    peers: PeerQueries,
    held: HashMap<QuestionToken, Held>,
    hold: Duration,
    next_token: u64,
    asking: Asking,
    publish: PublishSettings,
    thresholds: String,
    intake: Arc<Counters>,
    lag_ms: Option<f64>,
    last_status: Option<Instant>,
    last_progress: Option<(Progress, Instant)>,
    rejections: [Occurrences; 3],
    gaps: Occurrences,
}

/// This module's own questions under way.
#[derive(Debug)]
struct Asking {
    under_way: usize,
    /// Samples wait until then.
    until: Option<Instant>,
    pause: Duration,
}

impl Asking {
    fn begin(&mut self) {
        if self.under_way == 0 {
            self.until = Some(Instant::now() + self.pause);
        }
        self.under_way += 1;
    }

    fn end(&mut self) {
        self.under_way = self.under_way.saturating_sub(1);
        if self.under_way == 0 {
            self.until = None;
        }
    }
}

/// A peer's question whose answer is still to come.
#[derive(Debug)]
struct Held {
    query: Query,
    until: Instant,
}

impl DiagnosisLoop {
    pub(crate) fn new(
        diagnoser: Diagnoser,
        speaker: Speaker,
        config: &DiagnoserConfig,
        outbox: Outbox,
        peers: PeerQueries,
        intake: Arc<Counters>,
    ) -> Self {
        Self {
            diagnoser,
            actions: Vec::new(),
            speaker,
            outbox,
            peers,
            held: HashMap::new(),
            hold: config.queries.hold(),
            next_token: 0,
            asking: Asking { under_way: 0, until: None, pause: config.queries.pause() },
            publish: config.publish,
            thresholds: config.thresholds.clone(),
            intake,
            lag_ms: None,
            last_status: None,
            last_progress: None,
            rejections: Default::default(),
            gaps: Occurrences::default(),
        }
    }

    /// Runs until the end is asked for.
    pub(crate) async fn run(mut self, mut queues: Queues, mut shutdown: Shutdown) {
        let mut ticks = interval(TICK);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let pause = self.asking.until;
            // Whoever sends into a queue lives as long as the loop, so none of them ever closes.
            tokio::select! {
                () = shutdown.requested() => break,
                Some(inquiry) = queues.inquiries.recv() => self.inquire(inquiry),
                Some(event) = queues.answers.recv() => {
                    self.handle(event);
                    self.asking.end();
                }
                Some(arrival) = queues.samples.recv(), if pause.is_none() => {
                    self.take_sample(arrival);
                }
                () = sleep_until(pause.unwrap_or_else(Instant::now)), if pause.is_some() => {
                    self.asking.until = None;
                }
                now = ticks.tick() => self.tick(now, queues.samples.len()),
            }
        }
        self.send_status(queues.samples.len());
    }

    fn take_sample(&mut self, arrival: Arrival) {
        let Arrival { sample, time_unix_ns } = arrival;
        let used_before = self.diagnoser.counters().samples;
        let changes_before = self.diagnoser.counters().changes;
        self.handle(Event::Sample(sample));
        if self.diagnoser.counters().samples == used_before {
            return;
        }
        let lag_ns = i128::from(clock::unix_ns()) - i128::from(time_unix_ns);
        // Lags are small; nothing of interest is lost here.
        #[expect(clippy::cast_precision_loss, reason = "a display value")]
        let lag_ms = lag_ns as f64 / 1e6;
        self.lag_ms = Some(lag_ms);
        let changed = self.diagnoser.counters().changes != changes_before;
        self.publish_routinely(changed);
    }

    /// Divergences and progress, when they are due.
    fn publish_routinely(&mut self, changed: bool) {
        let (Some(run), Some(step)) = (self.diagnoser.run(), self.diagnoser.last_step()) else {
            return;
        };
        if changed || due(step, self.publish.divergence_every_steps) {
            let channels = (self.diagnoser.components(), self.diagnoser.evidence());
            let message = self.speaker.divergences(run, step, channels, clock::unix_ns());
            self.outbox.routine(Outgoing::Divergences(message));
        }
        if due(step.plus(1), self.publish.progress_every_steps) {
            self.send_progress(Instant::now());
        }
    }

    fn inquire(&mut self, inquiry: Inquiry) {
        let Inquiry { question, query } = inquiry;
        let Some(run) = question.run.or(self.diagnoser.run()) else {
            let reason = diagnosis::Refusal::NoSample.to_string();
            self.outbox.routine(Outgoing::Refusal { query, reason });
            return;
        };
        let token = QuestionToken(self.next_token);
        self.next_token += 1;
        self.held.insert(token, Held { query, until: Instant::now() + self.hold });
        let question = Question { run, from: question.from, as_of: question.step };
        self.handle(Event::Asked { token, question });
    }

    fn handle(&mut self, event: Event) {
        let mut actions = std::mem::take(&mut self.actions);
        self.diagnoser.handle(event, &mut actions);
        for action in actions.drain(..) {
            self.carry_out(action);
        }
        self.actions = actions;
    }

    fn carry_out(&mut self, action: Action) {
        match action {
            Action::Report { run, change, evidence } => {
                let change = self.speaker.change(run, &change, &evidence, clock::unix_ns());
                self.outbox.event(Outgoing::Change(Box::new(change)));
            }
            Action::Publish(transition) => self.publish(transition),
            Action::Ask { peer, question } => {
                self.asking.begin();
                self.peers.ask(peer, question);
            }
            Action::Answer { token, answer } => {
                if let Some(Held { query, .. }) = self.held.remove(&token) {
                    let answer = self.speaker.answer(answer);
                    self.outbox.routine(Outgoing::Answer { query, answer });
                }
            }
            Action::Refuse { token, refusal } => self.refuse(token, refusal.to_string()),
            Action::Phase(phase) => {
                tracing::info!(phase = phase.as_str(), step = %self.step(), "phase");
                self.last_status = None;
            }
            Action::Rejected { step, rejection } => self.note_rejection(step, rejection),
            Action::Gap { from, missing } => {
                if let Some(times) = self.gaps.note() {
                    tracing::warn!(%from, missing, times, "samples missing");
                }
            }
            Action::Restarted { component, violation } => {
                tracing::warn!(%component, step = %self.step(), "channel started anew: {violation}");
            }
            Action::RunStarted(run) => tracing::info!(%run, "new run"),
        }
    }

    fn publish(&self, transition: Transition) {
        let message = self.speaker.transition(transition, clock::unix_ns());
        tracing::info!(
            component = %message.component,
            state = %message.state,
            detection = ?message.detection_step.map(|step| step.0),
            explained_by = ?message.explained_by.as_ref().map(ToString::to_string),
            "verdict"
        );
        self.outbox.event(Outgoing::Fault(Box::new(message)));
    }

    fn refuse(&mut self, token: QuestionToken, reason: String) {
        if let Some(Held { query, .. }) = self.held.remove(&token) {
            self.outbox.routine(Outgoing::Refusal { query, reason });
        }
    }

    fn note_rejection(&mut self, step: Step, rejection: SampleRejection) {
        let [lengths, values, repeats] = &mut self.rejections;
        let occurrences = match rejection {
            SampleRejection::WrongLength => lengths,
            SampleRejection::NonFinite => values,
            SampleRejection::Repeated | SampleRejection::FarAhead => repeats,
        };
        if let Some(times) = occurrences.note() {
            tracing::warn!(%step, times, "sample not used: {rejection}");
        }
    }

    fn tick(&mut self, now: Instant, queued_samples: usize) {
        self.give_up_questions(now);
        self.repeat_progress(now);
        let every = Duration::from_millis(self.publish.status_every_ms);
        if self.last_status.is_none_or(|last| now.duration_since(last) >= every) {
            self.send_status(queued_samples);
            self.last_status = Some(now);
        }
    }

    /// The askers of old questions no longer wait.
    fn give_up_questions(&mut self, now: Instant) {
        let expired: Vec<QuestionToken> = self
            .held
            .iter()
            .filter(|(_, held)| held.until <= now)
            .map(|(token, _)| *token)
            .collect();
        for token in expired {
            self.diagnoser.handle(Event::Withdrawn { token }, &mut self.actions);
            self.refuse(token, format!("step not reached within {} ms", self.hold.as_millis()));
        }
    }

    /// A plant that waits must hear of the last step even if it is no round one, or if the message
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
        let progress = Progress { run, step };
        self.last_progress = Some((progress, now));
        self.outbox.routine(Outgoing::Progress(progress));
    }

    fn send_status(&self, queued_samples: usize) {
        let around = Surroundings {
            speaker: &self.speaker,
            thresholds: &self.thresholds,
            lag_ms: self.lag_ms,
            queued_samples,
            intake: self.intake.read(),
            publisher: self.outbox.counters(),
        };
        let status = status::compile(&self.diagnoser, around);
        self.outbox.routine(Outgoing::Status(Box::new(status)));
    }

    fn step(&self) -> Step {
        self.diagnoser.last_step().unwrap_or_default()
    }
}

fn due(step: Step, every: u64) -> bool {
    step.0.is_multiple_of(every)
}
