//! What goes out of a process, and onto its disk.

use super::*;

impl World<'_> {
    /// Publishes events whose records the disk has, or has not had for too long.
    pub(super) fn publish(&mut self, of: usize) {
        loop {
            let life = self.computers[of].life;
            let now = self.instant(self.now);
            let Some(running) = self.computers[of].process.as_mut() else { return };
            let Some((front, _)) = running.outlet.front() else { return };
            let Some(durable) = running.store.writes.answer(front.ticket, now) else {
                let left = running.store.writes.left(now).as_nanos() as u64;
                self.after(left.max(1), Happening::OutletWakes { of, life });
                return;
            };
            let ticket = front.ticket;
            let hangs = running.store.writes.note_hang(ticket).is_some();
            let Some((mut queued, _)) = running.outlet.pop_front() else { return };
            queued.event.set_durable(durable);
            if hangs {
                self.coverage.reach("a fault published although the disk hangs");
            }
            self.published(of, queued.event);
        }
    }

    pub(super) fn published(&mut self, of: usize, event: Outgoing<QueryId>) {
        match event {
            Outgoing::Fault(transition) => {
                self.check_synced(of, &transition);
                let (component, state) = (&transition.component, transition.state());
                let words = match transition.verdict.explained_by() {
                    Some(by) => format!("{state} by {by}"),
                    None => state.to_string(),
                };
                let number = transition.sequence;
                let durable = if transition.durable { "" } else { ", not on disk" };
                let line = format_args!("{component}: {words}, number {number}{durable}");
                self.trace.note(self.now, line);
                self.note_transition(of, &transition);
                self.tell_view(of, Incoming::Transition(transition.clone()));
                self.comes_to(of, KillMoment::Publishing, MS);
                if self.watcher.transition(self.now, of, &transition) {
                    self.coverage.reach("a number given again after a loss of power");
                }
            }
            Outgoing::Phase(change) => {
                let (module, phase) = (&change.module, change.phase);
                let line = format_args!("{module}: {}: {}", phase.as_str(), change.reason);
                self.trace.note(self.now, line);
                self.tell_view(of, Incoming::Phase((*change).clone()));
                if phase == ModulePhase::InService && change.before == Some(ModulePhase::Stale) {
                    self.coverage.reach("a module in service again");
                }
            }
            Outgoing::Obeyed { query, obeyed } => {
                self.reply(of, query, QueryReply::Obeyed(obeyed.state))
            }
            Outgoing::Identification(found) => {
                self.coverage.reach("a fault identified");
                self.tell_view(of, Incoming::Identification(found.clone()));
                if found.decided {
                    self.coverage.reach("an identification decided");
                }
                let kind = found.candidates.first().map(|candidate| candidate.kind.to_string());
                let kind = kind.unwrap_or_else(|| "nothing known".to_owned());
                let before = self.kinds.insert(found.component.clone(), kind.clone());
                if before.is_some_and(|before| before != kind) {
                    self.coverage.reach("an identification changed");
                }
                self.trace.note(self.now, format_args!("{} may be: {kind}", found.component));
            }
            Outgoing::Input(input) => {
                if matches!(input.taken, vocabulary::Taken::RunBegan { .. }) && input.number > 2 {
                    self.coverage.reach("a new run began");
                }
            }
            Outgoing::Change(_) => {}
        }
    }

    /// Checks that what is said to be on the disk would survive a loss of power.
    pub(crate) fn check_synced(&mut self, of: usize, transition: &FaultTransition) {
        let is_said = transition.durable && transition.sequence > 0;
        if is_said && !self.computers[of].disk.has_synced(transition) {
            let (component, number) = (&transition.component, transition.sequence);
            let what = format!("{component}: number {number} is said to be on disk, and is not");
            self.watcher.violated(self.now, what);
        }
    }

    pub(super) fn identified(&mut self, of: usize, found: IdentificationResult) {
        let now = self.clocks(of);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let message = running.module.speaker().identification(found, now.unix_ns);
        let event = Outgoing::Identification(Box::new(message));
        if let Some(queued) = running.store.enter(event, now.at) {
            running.outlet.push_back((queued, self.now));
        }
        self.write(of);
        self.publish(of);
    }

    /// Has the disk write what waits, unless it is busy.
    pub(super) fn write(&mut self, of: usize) {
        let (now, life) = (self.instant(self.now), self.computers[of].life);
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let retries = running.keeper.retry().is_some() && running.retries_now(now);
        if running.writing.is_some() || (running.store.writes.is_empty() && !retries) {
            return;
        }
        let hangs = self.scenario.disturbances.iter().filter(|one| {
            one.what == DisturbanceKind::HungDisk(of) && self.is_now(one.from_ms, one.until_ms)
        });
        let hangs_until = hangs.map(|one| one.until_ms * MS).max();
        let slow = self.active.iter().filter_map(|one| match *one {
            DisturbanceKind::SlowDisk(module, ms) if module == of => Some(ms * MS),
            _ => None,
        });
        let slow = slow.max();
        let computer = &mut self.computers[of];
        let Some(running) = computer.process.as_mut() else { return };
        let batch = running.keeper.take(&mut running.store, &computer.disk, now);
        let has_records = !batch.0.records.is_empty();
        if batch.1.is_some() {
            self.coverage.reach("a new file of the journal");
            if !computer.disk.older.is_empty() {
                self.coverage.reach("a journal's third file");
            }
        }
        running.writing = Some(batch);
        let takes = slow.unwrap_or_else(|| self.draw.random_range(DISK));
        let at = hangs_until.unwrap_or(self.now) + takes;
        self.at(at, Happening::DiskAnswers { of, life });
        if has_records {
            self.comes_to(of, KillMoment::Writing, at - self.now);
        }
    }

    pub(super) fn written(&mut self, of: usize) {
        let (now, life) = (self.instant(self.now), self.computers[of].life);
        let is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        let computer = &mut self.computers[of];
        computer.disk.is_full = is_full;
        let Some(running) = computer.process.as_mut() else { return };
        let Some(batch) = running.writing.take() else { return };
        let had_problem = running.keeper.status.problem.is_some();
        let durable = running.keeper.write(batch, &mut computer.disk);
        let status = running.keeper.status.clone();
        running.store.writes.settle(durable, status, now);
        if durable && had_problem {
            self.coverage.reach("a record written after the disk came back");
        }
        if let Some(retry) = running.keeper.retry() {
            running.retry_at = Some(now + retry);
            self.after(retry.as_nanos() as u64, Happening::DiskWakes { of, life });
        }
        self.publish(of);
        self.write(of);
    }
}
