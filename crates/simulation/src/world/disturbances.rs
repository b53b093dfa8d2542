//! What goes wrong, and what has to be so at the end.

use super::*;
use crate::scenario::DisturbanceKind as Kind;

impl World<'_> {
    pub(super) fn is_now(&self, from_ms: u64, until_ms: u64) -> bool {
        (from_ms * MS..until_ms * MS).contains(&self.now)
    }

    pub(super) fn begin(&mut self, place: usize) -> Result<(), SimulationError> {
        let one = &self.scenario.disturbances[place];
        let (what, until) = (one.what, one.until_ms * MS);
        self.trace.note(self.now, format_args!("begins: {one}"));
        if let (Some(moment), Kind::Kill(of) | Kind::PowerLoss(of)) = (one.waits_for, what) {
            self.computers[of].doom.push((moment, matches!(what, Kind::PowerLoss(_)), until));
            return Ok(());
        }
        self.active.push(what);
        match what {
            Kind::Kill(of) => self.kill(of, false),
            Kind::PowerLoss(of) => self.kill(of, true),
            Kind::Freeze(of) => {
                let computer = &mut self.computers[of];
                if let Some(running) = &mut computer.process {
                    computer.frozen_until = computer.frozen_until.max(until);
                    // Then the samples that wait for a peer are old when it moves again, and gaps between them are left.
                    running.may_miss_samples |= running.module.pause().is_some();
                }
            }
            Kind::WrongClock(of, s) => {
                self.computers[of].clock_ns += (s * 1e9) as i64;
            }
            Kind::NoValue(..) => self.note_loss(what),
            Kind::RestartedPublisher => {
                let (RunId(run), _) = self.run;
                self.run = (RunId(run + 1), self.plant.next_step());
                self.kept.clear();
            }
            Kind::SecondPublisher if self.other.is_none() => {
                self.other = Some(self.setup.plant(self.scenario.seed ^ 1)?);
            }
            _ => {}
        }
        Ok(())
    }

    pub(super) fn finish(&mut self, place: usize) {
        let one = &self.scenario.disturbances[place];
        let what = one.what;
        self.trace.note(self.now, format_args!("ends: {one}"));
        if let Some(known) = self.active.iter().position(|one| *one == what) {
            self.active.remove(known);
        }
        match what {
            Kind::Kill(of) | Kind::PowerLoss(of) => {
                let now = self.now;
                self.computers[of].doom.retain(|(.., until)| now < *until);
                let is_down =
                    |one: &Kind| matches!(*one, Kind::Kill(m) | Kind::PowerLoss(m) if m == of);
                if !self.active.iter().any(is_down) {
                    self.after(0, Happening::Starts { of });
                }
            }
            Kind::WrongClock(of, s) => {
                self.computers[of].clock_ns -= (s * 1e9) as i64;
            }
            Kind::SecondPublisher => {
                let others = self.active.contains(&Kind::SecondPublisher);
                self.other = self.other.take().filter(|_| others);
            }
            _ => {}
        }
    }

    /// The process does what its end was to wait for, which comes in less than this time.
    pub(super) fn comes_to(&mut self, of: usize, moment: KillMoment, within_ns: u64) {
        let computer = &mut self.computers[of];
        let Some(place) = computer.doom.iter().position(|(other, ..)| *other == moment) else {
            return;
        };
        let ((_, power, until), life) = (computer.doom.remove(place), computer.life);
        let at = self.now + self.draw.random_range(0..within_ns);
        if at < until {
            self.at(at, Happening::Dies { of, life, power });
        }
    }

    pub(super) fn kill(&mut self, of: usize, power: bool) {
        self.note_kill(of, power);
        self.tell_presence(of, false);
        let is_full = self.active.contains(&Kind::FullDisk(of));
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

    /// By how many steps a process is behind the publisher.
    pub(crate) fn steps_behind(&self, of: usize) -> u64 {
        let last = self.plant.next_step().minus(self.run.1.0);
        let running = self.computers[of].process.as_ref();
        let known = running.and_then(|running| running.module.diagnoser().last_step());
        last.since(known.unwrap_or(Step(0)))
    }

    pub(super) fn end(&mut self) {
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
            let behind = self.steps_behind(place);
            if behind > 4 {
                problems.push(format!("is {behind} steps behind"));
            }
            if diagnoser.waiting_questions() > 0 {
                problems.push(format!("holds {} questions", diagnoser.waiting_questions()));
            }
            if let Some((front, _)) = running.outlet.front() {
                problems.push(format!("has not published {:?}", front.ticket));
            }
            let present = running.store.components.present();
            let latest: Vec<_> = present.filter_map(|one| one.latest.cloned()).collect();
            let status = &running.keeper.status;
            if status.unsaved > 0 || status.problem.is_some() {
                problems.push(format!("has {} records that no disk has", status.unsaved));
            }
            let missed = diagnoser.counters().samples_missing;
            let owes = self.scenario.is_of_one_run() && !self.scenario.forgets();
            if missed > 0 && !running.may_miss_samples && owes {
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
        self.watcher.check_shelved(self.now);
    }
}
