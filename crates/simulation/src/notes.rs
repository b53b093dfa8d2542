//! Notes what must sometimes happen.

use vocabulary::{ComponentPath, FaultState, FaultTransition};

use crate::scenario::DisturbanceKind as Kind;
use crate::world::{BEHIND, World};

impl World<'_> {
    pub(crate) fn note_faults(&mut self) {
        let faults = &self.scenario.faults;
        match &faults[..] {
            [] => self.coverage.reach("no fault at all"),
            [first, second, ..] => {
                self.coverage.reach("two faults at once");
                let same = first.component.module == second.component.module;
                let what = if same { "two faults in one module" } else { "faults in two modules" };
                self.coverage.reach(what);
            }
            [_] => {}
        }
    }

    pub(crate) fn note_onset(&mut self, component: &ComponentPath) {
        let place = self.place_of(&component.module);
        let computer = &self.computers[place];
        let reached = [
            (computer.process.is_none(), "a fault began while its module was down"),
            (computer.frozen_until > self.now, "a fault began while its module was frozen"),
            (
                self.is_active(|one| matches!(one, Kind::Deaf(m) | Kind::CutOff(m) if m == place)),
                "a fault began while its module was deaf",
            ),
            (
                self.is_active(|one| one == Kind::SilentPublisher),
                "a fault began while the publisher was silent",
            ),
            (
                self.watcher.states.values().any(|state| *state == FaultState::Unconfirmed),
                "a second fault while the first is unconfirmed",
            ),
        ];
        self.reach_all(&reached);
    }

    fn reach_all(&mut self, reached: &[(bool, &'static str)]) {
        for (_, what) in reached.iter().filter(|(is_so, _)| *is_so) {
            self.coverage.reach(what);
        }
    }

    pub(crate) fn note_transition(&mut self, of: usize, transition: &FaultTransition) {
        let component = &transition.component;
        let before = self.watcher.states.get(component).copied().unwrap_or(FaultState::Normal);
        let state = transition.state();
        let others = |computer: &&crate::module::Computer| computer.place != of;
        let is_cylinder = component.component.kind() == vocabulary::ComponentKind::Actuator;
        let latched = state == FaultState::Latched && !before.is_fault();
        let is = |wanted: fn(Kind, usize) -> bool| self.is_active(|one| wanted(one, of));
        let reached = [
            (latched && !is_cylinder, "a gage latched"),
            (latched && is_cylinder, "a cylinder latched"),
            (
                latched && transition.symptom == vocabulary::Symptom::NoSignal,
                "a gage lost its value",
            ),
            (state == FaultState::Explained, "a change explained by another component's"),
            (state == FaultState::Unconfirmed, "a change unconfirmed"),
            (latched && before == FaultState::Unconfirmed, "an unconfirmed change latched"),
            (state == FaultState::Acknowledged, "a latched fault acknowledged"),
            (before.is_fault() && state == FaultState::Normal, "a fault reset"),
            (state.is_fault() && transition.shelved.is_some() && !latched, "shelved while latched"),
            (latched && transition.shelved.is_some(), "shelved and latched afterwards"),
            (
                !state.is_fault() && transition.order.is_some() && !before.is_fault(),
                "an order obeyed about a healthy component",
            ),
            (
                latched && is(|one, of| one == Kind::Mute(of) || one == Kind::CutOff(of)),
                "latched while cut off",
            ),
            (
                latched && self.computers.iter().filter(others).any(|one| one.process.is_none()),
                "latched while a peer is down",
            ),
            (
                latched && self.computers.iter().filter(others).any(|o| o.frozen_until > self.now),
                "latched while a peer is frozen",
            ),
            (
                latched && is(|one, _| matches!(one, Kind::Loss(_))),
                "latched while messages are lost",
            ),
            (
                latched && is(|one, _| matches!(one, Kind::Late(_))),
                "latched while messages are late",
            ),
            (
                latched && is(|one, _| one == Kind::SecondPublisher),
                "latched while another publisher sends",
            ),
            (latched && is(|one, of| one == Kind::HungDisk(of)), "latched while the disk hangs"),
            (latched && is(|one, of| one == Kind::FullDisk(of)), "latched while the disk is full"),
            (
                latched && is(|one, of| matches!(one, Kind::SlowDisk(m, _) if m == of)),
                "latched while the disk is slow",
            ),
            (latched && self.computers[of].clock_ns != 0, "latched with a wrong clock"),
            (
                latched && is(|one, of| one == Kind::FullDisk(of)) && !transition.durable,
                "a fault published although the disk refuses",
            ),
            (
                latched && self.computers[of].life > 1 && self.is_repaired(component),
                "latched, repaired and restarted",
            ),
        ];
        self.reach_all(&reached);
    }

    pub(crate) fn note_loss(&mut self, what: Kind) {
        let lost = what.valueless(self.setup);
        if lost.is_some_and(|gage| self.watcher.states.get(&gage).is_some_and(|s| s.is_fault())) {
            self.coverage.reach("a gage that is faulty lost its value");
        }
    }

    fn is_repaired(&self, component: &ComponentPath) -> bool {
        let of_it = self.scenario.faults.iter().filter(|fault| fault.component == *component);
        let next = self.plant.next_step();
        of_it.into_iter().any(|fault| fault.until.is_some_and(|until| until < next))
    }

    pub(crate) fn note_restart(&mut self, of: usize) {
        let name = self.name(of).clone();
        let known = self.computers[of].process.as_ref().is_some_and(|running| {
            let mut present = running.store.components.present();
            present.any(|one| one.latest.is_some_and(|latest| latest.verdict.state().is_fault()))
        });
        let repaired = self.watcher.states.iter().any(|(component, state)| {
            component.module == name && state.is_fault() && self.is_repaired(component)
        });
        let reached = [
            (known, "latched before a restart and known after it"),
            (known && repaired, "latched, repaired and restarted"),
            (self.computers[of].disk.is_full, "restarted on a full disk"),
            (
                self.is_active(|one| matches!(one, Kind::CutOff(m) | Kind::Deaf(m) if m == of)),
                "restarted while cut off",
            ),
            (self.computers[of].life > 3, "killed twice"),
        ];
        self.reach_all(&reached);
    }

    pub(crate) fn note_kill(&mut self, of: usize, power: bool) {
        let life = self.computers[of].life;
        let waits = self.queries.values().any(|open| open.from == Some((of, life)));
        let name = self.name(of).clone();
        let tentative = self.watcher.states.iter().any(|(component, state)| {
            component.module == name
                && matches!(state, FaultState::Tentative | FaultState::Unconfirmed)
        });
        let catches_up = self.steps_behind(of) > BEHIND;
        let Some(running) = self.computers[of].process.as_ref() else { return };
        let writing = running.writing.as_ref().is_some_and(|batch| !batch.0.records.is_empty());
        let reached = [
            (writing && !power, "killed while a record was being written"),
            (writing && power, "power lost with records that no disk had"),
            (catches_up, "killed while catching up"),
            (waits, "killed with a question under way"),
            (tentative, "killed between a change and its verdict"),
        ];
        self.reach_all(&reached);
    }
}
