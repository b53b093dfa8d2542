//! A module's process: what it takes, and what comes of its effects.

use super::*;

impl World<'_> {
    pub(super) fn start(&mut self, of: usize) -> Result<(), SimulationError> {
        let now = self.clocks(of);
        let computer = &mut self.computers[of];
        computer.disk.is_full = self.active.contains(&DisturbanceKind::FullDisk(of));
        computer.start(self.setup, self.scenario, now).map_err(|problems| {
            let problems: Vec<String> = problems.iter().map(ToString::to_string).collect();
            SimulationError::Setup(problems.join("; "))
        })?;
        let life = computer.life;
        self.trace.note(self.now, format_args!("{} starts", self.setup.modules[of].setup.module));
        if life > 1 {
            self.note_restart(of);
        }
        self.repeat(of);
        self.tell_presence(of, true);
        self.after(0, Happening::Tick { of, life });
        self.after(0, Happening::DiskWakes { of, life });
        for peer in (0..self.computers.len()).filter(|peer| *peer != of && life > 1) {
            let life = self.computers[peer].life;
            if let Some(delay) = self.way(Some(of), Some(peer)) {
                self.after(delay, Happening::PeerReturned { to: peer, life, peer: of });
            }
        }
        Ok(())
    }

    /// Publishes again what was published before the restart.
    fn repeat(&mut self, of: usize) {
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let (transitions, found) = running.store.components.published();
        let next = running.module.diagnoser().next_sequence();
        let incarnation = running.store.components.incarnation();
        self.watcher.restarted(of, incarnation, next.saturating_sub(1));
        for transition in transitions {
            self.tell_view(of, Incoming::Transition(Box::new(transition)));
        }
        for found in found {
            self.tell_view(of, Incoming::Identification(Box::new(found)));
        }
    }

    /// Gives a process an input, and carries out its effects.
    pub(super) fn take<T>(
        &mut self,
        of: usize,
        input: impl FnOnce(&mut process::ModuleProcess<QueryId>, &mut ProcessContext<'_, QueryId>) -> T,
    ) -> Option<T> {
        let now = self.clocks(of);
        let mut effects = Vec::new();
        let output = {
            let RunningProcess { module, store, around, diagnosed_at, .. } =
                self.computers[of].process.as_mut()?;
            let mut context =
                ProcessContext { now, store, surroundings: around, effects: &mut effects };
            let before = module.diagnoser().last_step();
            let output = input(module, &mut context);
            if module.diagnoser().last_step() != before {
                *diagnosed_at = self.now;
            }
            output
        };
        effects.into_iter().for_each(|effect| self.carry_out(of, effect));
        self.write(of);
        self.publish(of);
        Some(output)
    }

    pub(super) fn receive(
        &mut self,
        to: usize,
        source: SampleSource,
        sample: Measurements,
        time_unix_ns: u64,
    ) {
        let received = self.instant(self.now);
        let room = self.setup.modules[to].settings.sample_queue;
        let Some(running) = self.computers[to].process.as_mut() else { return };
        let arrival = ReceivedSample { sample, time_unix_ns, received };
        let before = running.present();
        running.heard[number_of(source.run)] = Some(self.now);
        match running.receive(source, arrival, room) {
            SampleFate::Queued => {}
            SampleFate::PutAside => self.coverage.reach("another publisher's samples put aside"),
            SampleFate::TakenOver => self.taken_over(to, before),
            SampleFate::Dropped => {
                if let Some(running) = self.computers[to].process.as_mut() {
                    running.may_miss_samples = true;
                }
                self.coverage.reach("samples dropped because too many waited");
            }
        }
        self.pump(to);
    }

    /// Another publisher has been taken over from this one.
    fn taken_over(&mut self, of: usize, left: Option<SampleSource>) {
        self.coverage.reach("another publisher taken over");
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let publisher = running.present().map(|present| present.publisher);
        let left = left.filter(|left| Some(left.publisher) != publisher);
        let heard = left.and_then(|left| running.heard[number_of(left.run)]);
        if heard.is_some_and(|at| self.now - at < INCUMBENT.as_nanos() as u64 / 2) {
            let what = format!("{} left a publisher that it heard", self.name(of));
            self.watcher.violated(self.now, what);
        }
    }

    /// Diagnoses what there is to be diagnosed.
    pub(super) fn pump(&mut self, of: usize) {
        let step_takes = self.step_takes(of);
        loop {
            if self.computers[of].busy_until > self.now {
                return;
            }
            let Some(running) = self.computers[of].process.as_mut() else { return };
            if running.module.pause().is_none()
                && let Some(arrival) = running.inbox.pop_front()
            {
                running.module.sample(arrival);
            }
            running.around.corrects = running.module.diagnoser().replaces_any();
            let before = self.steps_diagnosed(of);
            while self.take(of, process::ModuleProcess::advance) == Some(true) {
                if step_takes.is_some() {
                    break;
                }
            }
            let steps = self.steps_diagnosed(of) - before;
            if let Some(takes) = step_takes.map(|takes| takes * steps).filter(|takes| *takes > 0) {
                let is_late = self.steps_behind(of) * self.setup.step_ns() > HURRY;
                let computer = &mut self.computers[of];
                computer.busy_until = self.now + takes;
                let life = computer.life;
                if let Some(running) = computer.process.as_mut() {
                    running.may_miss_samples |= is_late;
                }
                return self.after(takes, Happening::StepDone { of, life });
            }
            let Some(running) = self.computers[of].process.as_mut() else { return };
            if let Some(until) = running.module.pause() {
                let ends = u64::try_from(until.duration_since(self.origin).as_nanos());
                let ends = ends.unwrap_or(u64::MAX);
                if running.pause_ends != Some(ends) {
                    running.pause_ends = Some(ends);
                    let life = self.computers[of].life;
                    self.coverage.reach("samples waited for a peer's answer");
                    self.at(ends, Happening::PauseEnds { of, life });
                }
                return;
            }
            running.pause_ends = None;
            if running.inbox.is_empty() {
                return;
            }
        }
    }

    fn steps_diagnosed(&self, of: usize) -> u64 {
        let running = self.computers[of].process.as_ref();
        running.map_or(0, |running| running.module.diagnoser().counters().samples)
    }

    /// How long a step takes the process, if that is slow \[ns\].
    fn step_takes(&self, of: usize) -> Option<u64> {
        let slow = self.active.iter().filter_map(|one| match *one {
            DisturbanceKind::SlowProcess(module, us) if module == of => Some(1_000 * us),
            _ => None,
        });
        slow.max()
    }

    pub(super) fn end_pause(&mut self, of: usize) {
        let now = self.instant(self.now);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        if running.module.pause().is_some_and(|until| until <= now) {
            running.module.end_pause();
            self.coverage.reach("the wait for a peer's answer expired");
        }
        self.pump(of);
    }

    pub(super) fn tick(&mut self, of: usize, life: u64) {
        let now = self.instant(self.now);
        let room = self.setup.modules[of].settings.sample_queue;
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let before = running.present();
        if running.promote(now, room) {
            self.taken_over(of, before);
        }
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let overflown = std::mem::take(&mut running.overflown);
        self.take(of, |module, context| module.tick(overflown, context));
        self.pump(of);
        self.check_times(of);
        self.after(TICK.as_nanos() as u64, Happening::Tick { of, life });
    }

    /// Checks that no held question and no pause outlives its deadline. The pause of a frozen process ends once it thaws.
    fn check_times(&mut self, of: usize) {
        let (now, name) = (self.now, self.name(of));
        let moves_since = self.computers[of].frozen_until;
        let Some(running) = self.computers[of].process.as_ref() else { return };
        if let Some((_, since)) = running.outlet.front() {
            let until = (since + DISK_DEADLINE).max(moves_since);
            self.watcher.lasts(now, name, "the wait for the disk", until);
        }
        if let Some(until) = running.held.values().min() {
            self.watcher.lasts(now, name, "the time to hold a question", *until);
        }
        if let Some(until) = running.module.pause() {
            let until = until.duration_since(self.origin).as_nanos() as u64;
            self.watcher.lasts(now, name, "a pause", until.max(moves_since));
        }
    }

    pub(super) fn carry_out(&mut self, of: usize, effect: ProcessEffect<QueryId>) {
        let life = self.computers[of].life;
        let module = self.name(of);
        match effect {
            ProcessEffect::Publish(event) => {
                let Some(running) = self.computers[of].process.as_mut() else { return };
                running.outlet.push_back((event, self.now));
            }
            ProcessEffect::Routine(Routine::Answer { query, answer }) => {
                self.no_longer_held(of, query);
                self.answer(of, query, answer)
            }
            ProcessEffect::Routine(Routine::Refusal { query, reason }) => {
                self.no_longer_held(of, query);
                self.reply(of, query, QueryReply::Refused(reason));
            }
            ProcessEffect::Routine(Routine::Capability(said)) => self.tell_capability(of, said),
            ProcessEffect::Routine(Routine::Corrected(said)) => {
                if let Some(delay) = self.way(Some(of), None) {
                    let said = Box::new(ModuleMessage::Readings(said));
                    self.after(delay, Happening::PlantHears(said));
                }
            }
            ProcessEffect::Routine(_) => {}
            ProcessEffect::Fetch(question) => {
                let SampleQuestion { from, to, .. } = question;
                self.trace.note(self.now, format_args!("{module} fetches {from} to {to}"));
                if to.since(from) > 1000 {
                    self.coverage.reach("a fetch of more than a thousand samples");
                }
                let until = self.now + FETCHED_FOR;
                self.after(0, Happening::Fetch { of, life, question, until });
            }
            ProcessEffect::Ask { peer, question } => self.ask(of, &peer, question),
            ProcessEffect::Identify(excerpt) if self.scenario.identifies => {
                let found = Box::new(identify(&excerpt, None));
                let takes = self.draw.random_range(IDENTIFYING);
                self.after(takes, Happening::Identified { of, life, found });
            }
            ProcessEffect::Identify(_)
            | ProcessEffect::Freeze { .. }
            | ProcessEffect::SampleRefused(_) => {}
            ProcessEffect::Status { .. } => self.status(of),
            ProcessEffect::DropQueuedSamples => {
                self.coverage.reach("a backlog dropped");
                self.trace.note(self.now, format_args!("{module} drops its backlog"));
                if let Some(running) = self.computers[of].process.as_mut() {
                    running.inbox.clear();
                    running.may_miss_samples = true;
                }
            }
            ProcessEffect::AnswerRejected { peer, reason } => {
                self.watcher.rejects(self.now, module, &peer);
                let line = format_args!("{module} rejects what {peer} says: {reason}");
                self.trace.note(self.now, line);
            }
            ProcessEffect::WordBroken(peer) => {
                self.coverage.reach("a peer that broke its word");
                self.trace.note(self.now, format_args!("{module}: {peer} broke its word"));
            }
        }
    }

    fn no_longer_held(&mut self, of: usize, query: QueryId) {
        if let Some(running) = self.computers[of].process.as_mut() {
            running.held.remove(&query);
        }
    }

    pub(super) fn tell_capability(&mut self, of: usize, said: Capability) {
        for to in (0..self.computers.len()).filter(|to| *to != of) {
            if let Some(delay) = self.way(Some(of), Some(to)) {
                let (life, said) = (self.computers[to].life, Box::new(said.clone()));
                self.after(delay, Happening::PeerHears { to, life, said });
            }
        }
        if let Some(delay) = self.way(Some(of), None) {
            self.after(delay, Happening::PlantHears(Box::new(ModuleMessage::Cylinders(said))));
        }
    }

    pub(super) fn status(&mut self, of: usize) {
        let (now, moves_since) = (self.clocks(of), self.computers[of].frozen_until);
        let Some(running) = self.computers[of].process.as_mut() else { return };
        let stale_after = self.setup.modules[of].settings.stale_after + 3 * TICK;
        let fresh_until = running.diagnosed_at.max(moves_since) + stale_after.as_nanos() as u64;
        let around = StatusSurroundings {
            queued_samples: running.inbox.len(),
            ..StatusSurroundings::default()
        };
        let status = running.module.status(&running.store, around, now);
        if self.step_takes(of).is_some() && self.steps_behind(of) > BEHIND {
            self.coverage.reach("a process two seconds behind");
        }
        if status.phase == ModulePhase::InService && self.now > fresh_until {
            let what = format!("{} says in service without samples", status.module);
            self.watcher.violated(self.now, what);
        }
        if status.phase == ModulePhase::Stale {
            self.coverage.reach("a module stale");
        }
        self.watcher.status(self.now, &status);
        self.tell_view(of, Incoming::Status(Box::new(status)));
    }
}

/// Place of a publisher, by its run.
fn number_of(run: RunId) -> usize {
    usize::from(run == OTHER_RUN)
}
