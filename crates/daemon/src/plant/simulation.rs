//! The plant's thread: orders and agenda, one step, its samples out, and again.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use plant::Plant;
use shell::occurrences::Occurrences;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use tokio::sync::mpsc;
use vocabulary::{PlantPhase, Step};

use super::agenda::Agenda;
use super::attendance::Attendance;
use super::awaited::Awaited;
use super::injection;
use super::order::{Order, OrderReply};
use super::pacing::Pacing;
use super::progress::ProgressEar;
use super::sample_publisher::{SamplePublisher, Signals};
use super::status::Board;

/// How often presence is checked while the plant waits for diagnosers.
pub(crate) const PRESENCE_EVERY: Duration = Duration::from_millis(10);
/// How long the diagnosers may take over the last samples.
pub(crate) const LAST_SAMPLES: Duration = Duration::from_secs(5);

/// After the last sample questions for samples are answered until none has come for so long: a recorder notices half a
/// second later that the last ones did not arrive.
const NO_QUESTION: Duration = Duration::from_millis(1500);
/// But no longer than this.
const LAST_QUESTIONS: Duration = Duration::from_secs(10);

/// Everything that the thread owns.
pub(crate) struct Simulation {
    pub(crate) plant: Plant,
    pub(crate) publishers: Vec<SamplePublisher>,
    pub(crate) agenda: Agenda,
    pub(crate) orders: Receiver<Order>,
    pub(crate) replies: mpsc::Sender<OrderReply>,
    pub(crate) attendance: Arc<Attendance>,
    pub(crate) progress: ProgressEar,
    pub(crate) pacing: Pacing,
    pub(crate) awaited: Awaited,
    pub(crate) steps: Option<u64>,
    pub(crate) board: Arc<Board>,
    pub(crate) supervisor: Arc<Supervisor>,
    pub(crate) shutdown: Shutdown,
}

impl Simulation {
    /// Runs to the last step, or until the end is asked for.
    pub(crate) fn run(mut self) {
        if self.pacing.is_lock_step() {
            self.progress.listen();
        }
        self.wait_for_diagnosers();
        self.board.phase(PlantPhase::Running);
        let unsent = Occurrences::default();
        let mut unsent_count = 0;
        while !self.is_to_end() && !self.is_done() {
            while let Ok(order) = self.orders.try_recv() {
                self.obey(order);
            }
            self.do_what_is_due();
            unsent_count += self.step(&unsent);
            let next_step = self.plant.next_step();
            self.attendance.advance_to(next_step);
            self.board.step(next_step, self.pacing.lateness(), unsent_count);
        }
        self.board.phase(PlantPhase::Done);
        let next_step = self.plant.next_step();
        self.progress.listen();
        self.attendance.wait_until_done(next_step, LAST_SAMPLES, || self.is_to_end());
        answer_last_questions(&self.publishers, || self.is_to_end());
        tracing::info!(steps = %next_step, late = self.pacing.lateness().steps, "done");
    }

    fn is_to_end(&self) -> bool {
        comes_round(&self.supervisor, &self.shutdown)
    }

    fn is_done(&self) -> bool {
        self.steps.is_some_and(|steps| self.plant.next_step() >= Step(steps))
    }

    /// Orders are obeyed meanwhile: they concern step 0 or a later one.
    fn wait_for_diagnosers(&mut self) {
        while !self.awaited.are_there(&self.attendance, &self.board) && !self.is_to_end() {
            match self.orders.recv_timeout(PRESENCE_EVERY) {
                Ok(order) => self.obey(order),
                Err(RecvTimeoutError::Timeout) => {}
                // Without the queryable there are no more orders; the wait goes on.
                Err(RecvTimeoutError::Disconnected) => std::thread::sleep(PRESENCE_EVERY),
            }
        }
    }

    fn obey(&mut self, order: Order) {
        let Order { command, query } = order;
        let component = command.component().clone();
        let outcome = command.obey(&mut self.plant, &mut self.agenda);
        if let Err(reason) = &outcome {
            tracing::warn!(%component, "order refused: {reason}");
        }
        self.board.faults(&self.plant);
        // A full queue leaves the order without a reply; it was obeyed all the same.
        let _ = self.replies.try_send(OrderReply { outcome, query });
    }

    fn do_what_is_due(&mut self) {
        let step = self.plant.next_step();
        if injection::catch_up(&mut self.agenda, &mut self.plant, step) {
            self.board.faults(&self.plant);
        }
    }

    /// Computes and publishes one step; how many samples could not be sent.
    fn step(&mut self, unsent: &Occurrences) -> u64 {
        let (supervisor, shutdown) = (&self.supervisor, &self.shutdown);
        let signals = self.plant.advance();
        self.pacing.wait(signals.step, || comes_round(supervisor, shutdown));
        let mut failed = 0;
        for (publisher, module) in self.publishers.iter_mut().zip(&signals.modules) {
            let measured = Signals {
                demands_n: &module.demands_n,
                pressures_pa: &module.pressures_pa,
                elongations_m: &module.elongations_m,
            };
            if let Err(error) = publisher.publish(signals.step, measured) {
                failed += 1;
                if let Some(times) = unsent.note(std::time::Instant::now()) {
                    tracing::warn!(module = %module.module, times, "sample not sent: {error}");
                }
            }
        }
        failed
    }
}

/// Waits while somebody may still ask for samples. Returns at once when `stop` does.
pub(crate) fn answer_last_questions(publishers: &[SamplePublisher], stop: impl Fn() -> bool) {
    let begun = Instant::now();
    let is_asked =
        |publisher: &SamplePublisher| publisher.recording().was_asked_within(NO_QUESTION);
    while !stop() && begun.elapsed() < LAST_QUESTIONS {
        if begun.elapsed() >= NO_QUESTION && !publishers.iter().any(is_asked) {
            return;
        }
        std::thread::sleep(PRESENCE_EVERY);
    }
}

/// Was the end requested? Every loop of the thread checks this, which shows its progress.
pub(crate) fn comes_round(supervisor: &Supervisor, shutdown: &Shutdown) -> bool {
    supervisor.progress();
    shutdown.is_requested()
}
