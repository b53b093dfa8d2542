//! The plant's thread: commands and agenda, one step, its samples out, and again.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};

use plant::{Plant, Tolerance};
use tokio::sync::mpsc;
use vocabulary::{PresentFault, Step};

use super::agenda::Agenda;
use super::commands::{self, CommandReply, PendingCommand};
use super::source::{PRESENCE_EVERY, PacedSource};
use super::status::SharedStatus;
use super::tolerance::Heard;

/// Everything that the thread owns beside the source of samples.
pub(crate) struct SimulationLoop {
    pub(crate) plant: Plant,
    pub(crate) agenda: Agenda,
    pub(crate) commands: Receiver<PendingCommand>,
    pub(crate) replies: mpsc::Sender<CommandReply>,
    pub(crate) tolerance: Tolerance,
    /// What modules say of their components.
    pub(crate) news: Receiver<Heard>,
    pub(crate) steps: Option<u64>,
}

impl SimulationLoop {
    /// Runs to the last step, or until the end is asked for.
    pub(crate) fn run(mut self, mut source: PacedSource) {
        // Commands are carried out meanwhile: they concern step 0 or a later one.
        let status = Arc::clone(&source.status);
        source.wait_for_diagnosers(|| match self.commands.recv_timeout(PRESENCE_EVERY) {
            Ok(command) => self.carry_out(command, &status),
            Err(RecvTimeoutError::Timeout) => {}
            // Without the queryable there are no more commands; the wait goes on.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(PRESENCE_EVERY),
        });
        while !source.is_to_end() && !self.is_done() {
            while let Ok(command) = self.commands.try_recv() {
                self.carry_out(command, &source.status);
            }
            let step = self.plant.next_step();
            if commands::catch_up(&mut self.agenda, &mut self.plant, step) {
                self.show_faults(&source.status);
            }
            let now = std::time::Instant::now();
            if self.tolerance.follow(self.news.try_iter(), &mut self.plant, now) {
                source.status.update(|status| {
                    status.done_without = self.tolerance.done_without().cloned().collect();
                    status.messages_refused = self.tolerance.refused();
                });
            }
            self.step(&mut source);
            source.advance_to(self.plant.next_step());
        }
        let next_step = self.plant.next_step();
        source.finish(Some(next_step));
        tracing::info!(steps = %next_step, late = source.late_steps(), "done");
    }

    fn is_done(&self) -> bool {
        self.steps.is_some_and(|steps| self.plant.next_step() >= Step(steps))
    }

    fn carry_out(&mut self, pending: PendingCommand, status: &SharedStatus) {
        let PendingCommand { command, query } = pending;
        let component = command.component().clone();
        let outcome = command.carry_out(&mut self.plant, &mut self.agenda);
        if let Err(reason) = &outcome {
            tracing::warn!(%component, "command refused: {reason}");
        }
        self.show_faults(status);
        // A full queue leaves the command without a reply; it was carried out all the same.
        let _ = self.replies.try_send(CommandReply { outcome, query });
    }

    fn show_faults(&self, status: &SharedStatus) {
        let faults = self.plant.faults().iter();
        let present = faults
            .map(|(component, fault)| PresentFault { component: component.clone(), fault: *fault });
        status.update(|status| status.faults = present.collect());
    }

    /// Computes and publishes one step.
    fn step(&mut self, source: &mut PacedSource) {
        let signals = self.plant.advance();
        source.wait_for_step(signals.step);
        for (place, module) in signals.modules.iter().enumerate() {
            let (demands, pressures) = (&module.demands_n, &module.pressures_pa);
            source.publish(place, signals.step, demands, pressures, &module.elongations_m);
        }
    }
}
