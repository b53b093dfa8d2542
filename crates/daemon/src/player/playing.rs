//! The thread that publishes recorded samples.

use std::sync::Arc;

use shell::occurrences::Occurrences;
use shell::shutdown::Shutdown;
use shell::supervision::Supervisor;
use vocabulary::PlantPhase;

use super::Programme;
use crate::plant::attendance::Attendance;
use crate::plant::awaited::Awaited;
use crate::plant::pacing::Pacing;
use crate::plant::progress::ProgressEar;
use crate::plant::sample_publisher::{SamplePublisher, Signals};
use crate::plant::simulation::{LAST_SAMPLES, PRESENCE_EVERY, answer_last_questions, comes_round};
use crate::plant::status::Board;

/// Everything that the thread owns.
pub(super) struct Playing {
    pub(super) programme: Programme,
    /// In the order of the programme's modules.
    pub(super) publishers: Vec<SamplePublisher>,
    pub(super) attendance: Arc<Attendance>,
    pub(super) progress: ProgressEar,
    pub(super) pacing: Pacing,
    pub(super) awaited: Awaited,
    pub(super) board: Arc<Board>,
    pub(super) supervisor: Arc<Supervisor>,
    pub(super) shutdown: Shutdown,
}

impl Playing {
    /// Publishes all samples, or until the end is asked for: how many.
    pub(super) fn run(mut self) -> u64 {
        if self.pacing.is_lock_step() {
            self.progress.listen();
        }
        self.wait_for_diagnosers();
        self.board.phase(PlantPhase::Running);
        let published = self.publish_all();
        self.board.phase(PlantPhase::Done);
        self.progress.listen();
        if let Some((_, last)) = self.programme.steps() {
            let is_to_end = || self.is_to_end();
            self.attendance.wait_until_done(last.plus(1), LAST_SAMPLES, is_to_end);
        }
        answer_last_questions(&self.publishers, || self.is_to_end());
        published
    }

    fn is_to_end(&self) -> bool {
        comes_round(&self.supervisor, &self.shutdown)
    }

    fn wait_for_diagnosers(&mut self) {
        while !self.awaited.are_there(&self.attendance, &self.board) && !self.is_to_end() {
            std::thread::sleep(PRESENCE_EVERY);
        }
    }

    fn publish_all(&mut self) -> u64 {
        let unsent = Occurrences::default();
        let (mut published, mut failed) = (0, 0);
        let mut next = self.programme.steps().map(|(first, _)| first);
        while let Some(step) = next.filter(|_| !self.is_to_end()) {
            let (supervisor, shutdown) = (&self.supervisor, &self.shutdown);
            self.pacing.wait(step, || comes_round(supervisor, shutdown));
            for (place, sample) in self.programme.at(step) {
                let signals = Signals {
                    demands_n: &sample.demands_n,
                    pressures_pa: &sample.pressures_pa,
                    elongations_m: &sample.elongations_m,
                };
                let Some(publisher) = self.publishers.get_mut(place) else { continue };
                match publisher.publish(step, signals) {
                    Ok(()) => published += 1,
                    Err(error) => {
                        failed += 1;
                        if let Some(times) = unsent.note(std::time::Instant::now()) {
                            tracing::warn!(times, "sample not sent: {error}");
                        }
                    }
                }
            }
            self.attendance.advance_to(step.plus(1));
            self.board.step(step.plus(1), self.pacing.lateness(), failed);
            next = self.programme.after(step);
        }
        published
    }
}
