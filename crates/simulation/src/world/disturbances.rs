//! What goes wrong, and what has to be so at the end.

use super::*;

impl World<'_> {
    pub(super) fn is_now(&self, from_ms: u64, until_ms: u64) -> bool {
        (from_ms * MS..until_ms * MS).contains(&self.now)
    }

    pub(super) fn begin(&mut self, place: usize) -> Result<(), SimulationError> {
        let one = &self.scenario.disturbances[place];
        let (what, until) = (one.what, one.until_ms * MS);
        self.trace.note(self.now, format_args!("begins: {what}"));
        self.active.push(what);
        match what {
            DisturbanceKind::Kill(of) => self.kill(of, false),
            DisturbanceKind::PowerLoss(of) => self.kill(of, true),
            DisturbanceKind::Freeze(of) => {
                let computer = &mut self.computers[of];
                if computer.process.is_some() {
                    computer.frozen_until = computer.frozen_until.max(until);
                }
            }
            DisturbanceKind::WrongClock(of, s) => {
                self.computers[of].clock_ns += (s * 1e9) as i64;
            }
            DisturbanceKind::NoValue(..) => self.note_loss(one),
            DisturbanceKind::RestartedPublisher => {
                let (RunId(run), _) = self.run;
                self.run = (RunId(run + 1), self.plant.next_step());
                self.kept.clear();
            }
            DisturbanceKind::SecondPublisher if self.other.is_none() => {
                self.other = Some(self.setup.plant(self.scenario.seed ^ 1)?);
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn finish(&mut self, place: usize) {
        let what = self.scenario.disturbances[place].what;
        self.trace.note(self.now, format_args!("ends: {what}"));
        if let Some(known) = self.active.iter().position(|one| *one == what) {
            self.active.remove(known);
        }
        match what {
            DisturbanceKind::Kill(of) | DisturbanceKind::PowerLoss(of) => {
                let is_down = |one: &DisturbanceKind| matches!(*one, DisturbanceKind::Kill(m) | DisturbanceKind::PowerLoss(m) if m == of);
                if !self.active.iter().any(is_down) {
                    self.after(0, Happening::Starts { of });
                }
            }
            DisturbanceKind::WrongClock(of, s) => {
                self.computers[of].clock_ns -= (s * 1e9) as i64;
            }
            DisturbanceKind::SecondPublisher => {
                let others = self.active.contains(&DisturbanceKind::SecondPublisher);
                self.other = self.other.take().filter(|_| others);
            }
            _ => {}
        }
    }

    pub(super) fn kill(&mut self, of: usize, power: bool) {
        self.note_kill(of, power);
        self.tell_presence(of, false);
        let is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        // The kernel may have what the disk was writing.
        let kernel_has = self.draw.random_bool(0.5);
        let computer = &mut self.computers[of];
        computer.disk.is_full = is_full;
        if let Some(mut running) = computer.end()
            && let Some(batch) = running.writing.take().filter(|_| kernel_has && !power)
        {
            running.keeper.write(batch, &mut computer.disk);
            computer.disk.process_ended();
        }
        if power {
            computer.disk.lose_power();
        }
        let records = self.computers[of].disk.records();
        self.watcher.killed(self.now, of, &records);
    }

    pub(crate) fn place_of(&self, module: &ModuleName) -> usize {
        self.setup.module_names().position(|name| name == module).unwrap_or(0)
    }

    pub(super) fn end(&mut self) {
        let last = self.plant.next_step().minus(self.run.1.0);
        for place in 0..self.computers.len() {
            let name = self.name(place);
            let Some(running) = self.computers[place].process.as_ref() else {
                self.watcher.violated(self.now, format!("{name} is down"));
                continue;
            };
            let diagnoser = running.module.diagnoser();
            let mut problems = Vec::new();
            if running.module.phase() != ModulePhase::InService {
                problems.push(format!("is {}", running.module.phase().as_str()));
            }
            let behind = last.since(diagnoser.last_step().unwrap_or(Step(0)));
            if behind > 4 {
                problems.push(format!("is {behind} steps behind"));
            }
            if diagnoser.waiting_questions() > 0 {
                problems.push(format!("holds {} questions", diagnoser.waiting_questions()));
            }
            if let Some(front) = running.outlet.front() {
                problems.push(format!("has not published {:?}", front.ticket));
            }
            let present = running.store.components.present();
            let latest: Vec<_> = present.filter_map(|one| one.latest.cloned()).collect();
            let status = &running.keeper.status;
            if status.unsaved > 0 || status.problem.is_some() {
                problems.push(format!("has {} records that no disk has", status.unsaved));
            }
            let missed = diagnoser.counters().samples_missing;
            if missed > 0 && !running.may_miss_samples && self.scenario.is_of_one_run() {
                problems.push(format!("missed {missed} samples that the publisher has"));
            }
            for problem in problems {
                self.watcher.violated(self.now, format!("{name} {problem} at the end"));
            }
            for latest in &latest {
                self.watcher.knows(self.now, latest);
            }
        }
        self.check_view();
        self.watcher.check_shut_off(self.now);
    }
}
