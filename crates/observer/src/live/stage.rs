//! What is known, and the scene that follows from it. A plain value: messages and the time go in.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use names::{ModuleName, StructureName};
use wire::keys::PLANT;
use wire::{FaultTransition, ModuleStatus, Unknown};
use zenoh::session::ZenohId;

use super::scene::{Event, LiveModule, NetworkState, Scene};
use crate::attendance::Member;
use crate::feed::News;
use crate::picture::{ModulePicture, UnreadableState};

/// A status comes once a second; after this time without any sign a module is silent.
const SILENT_AFTER: Duration = Duration::from_secs(3);
/// Events and problems that are kept.
const EVENTS: usize = 500;
const PROBLEMS: usize = 20;

type Whose = (Option<StructureName>, ModuleName);

/// What is known of a module.
#[derive(Debug)]
struct Known {
    picture: ModulePicture,
    heard_unix_ns: u64,
}

/// Everything that is known.
#[derive(Debug, Default)]
pub(super) struct Stage {
    modules: BTreeMap<Whose, Known>,
    events: VecDeque<Arc<Event>>,
    problems: VecDeque<String>,
    next_event: u64,
    network: NetworkState,
}

impl Stage {
    /// Modules that should be there stay in the scene, heard or not.
    pub(super) fn new(structure: Option<&StructureName>, expected: Vec<ModuleName>) -> Self {
        let mut stage = Self::default();
        for module in expected {
            let mut member = Member::new(structure.cloned(), module.clone());
            member.expected = true;
            let known = Known { picture: ModulePicture::of(member), heard_unix_ns: 0 };
            stage.modules.insert((structure.cloned(), module), known);
        }
        stage
    }

    pub(super) fn network(&mut self, state: NetworkState) {
        self.network = state;
    }

    /// Takes an event of the feed.
    pub(super) fn news(&mut self, news: News, now_unix_ns: u64) {
        match &news {
            News::Fault(transition) => self.state((**transition).clone(), None, now_unix_ns),
            News::Identification(found) => {
                let module = self.module(&found.structure, &found.module);
                let own = |known: &&mut FaultTransition| known.component == found.component;
                if let Some(known) = module.picture.components.iter_mut().find(own) {
                    known.identification = Some(found.clone());
                }
            }
            News::Phase(change) => {
                let module = self.module(&change.structure, &change.module);
                module.picture.member.phase_change = Some(change.clone());
                module.heard_unix_ns = now_unix_ns;
            }
            News::Presence { structure, who, there } => {
                // The plant has a token too, and is no module.
                if let Ok(module) = who.parse::<ModuleName>()
                    && who != PLANT
                {
                    self.module(structure, &module).picture.member.present = *there;
                }
            }
            News::Unreadable { problem, state } => {
                keep(&mut self.problems, problem.clone(), PROBLEMS);
                if let Some(state) = state {
                    self.unreadable(state, now_unix_ns);
                }
            }
            News::SeveralProcesses { .. } | News::Missed { .. } | News::Lost(_) => {}
        }
        self.next_event += 1;
        let event = Event { number: self.next_event, time_unix_ns: now_unix_ns, news };
        keep(&mut self.events, Arc::new(event), EVENTS);
    }

    /// Takes a status.
    pub(super) fn status(&mut self, status: ModuleStatus, now_unix_ns: u64) {
        for peer in &status.peers {
            let named = self.module(&status.structure, &peer.module);
            named.picture.member.peer_of.insert(status.module.clone());
        }
        let module = self.module(&status.structure, &status.module);
        module.heard_unix_ns = now_unix_ns;
        module.picture.member.status = Some(status);
    }

    /// Takes the state of a component, as it was published or answered. What is older than what is known is passed over.
    pub(super) fn state(
        &mut self,
        transition: FaultTransition,
        process: Option<ZenohId>,
        now_unix_ns: u64,
    ) {
        let module = self.module(&transition.structure, &transition.module);
        module.heard_unix_ns = now_unix_ns;
        module.picture.processes.extend(process);
        let components = &mut module.picture.components;
        match components.binary_search_by(|known| known.component.cmp(&transition.component)) {
            Ok(place) if components[place].place() <= transition.place() => {
                components[place] = transition;
            }
            Ok(_) => {}
            Err(place) => components.insert(place, transition),
        }
    }

    /// Takes note of a message on the state of a component that cannot be read.
    pub(super) fn unreadable(&mut self, state: &UnreadableState, now_unix_ns: u64) {
        let module = self.module(&state.structure, &state.component.module);
        module.picture.unreadable(state, now_unix_ns);
    }

    /// A round of questions begins: who answers now counts.
    pub(super) fn forget_processes(&mut self) {
        self.modules.values_mut().for_each(|known| known.picture.processes.clear());
    }

    fn module(&mut self, structure: &StructureName, module: &ModuleName) -> &mut Known {
        // An expected module of no certain structure is this one.
        if let Some(known) = self.modules.remove(&(None, module.clone())) {
            let mut picture = known.picture;
            picture.member.structure = Some(structure.clone());
            let known = Known { picture, ..known };
            self.modules.insert((Some(structure.clone()), module.clone()), known);
        }
        let whose = (Some(structure.clone()), module.clone());
        self.modules.entry(whose).or_insert_with_key(|(structure, module)| Known {
            picture: ModulePicture::of(Member::new(structure.clone(), module.clone())),
            heard_unix_ns: 0,
        })
    }

    /// What there is to see.
    pub(super) fn scene(&self, number: u64, now_unix_ns: u64) -> Scene {
        Scene {
            number,
            time_unix_ns: now_unix_ns,
            network: self.network.clone(),
            modules: self.modules.values().map(|known| known.seen(now_unix_ns)).collect(),
            events: self.events.clone(),
            problems: self.problems.clone(),
        }
    }
}

impl Known {
    fn seen(&self, now_unix_ns: u64) -> LiveModule {
        let silent =
            u128::from(now_unix_ns.saturating_sub(self.heard_unix_ns)) >= SILENT_AFTER.as_nanos();
        let mut picture = self.picture.clone();
        if silent {
            let since_unix_ns = self.heard_unix_ns;
            let reason = "its diagnoser is not heard".to_owned();
            let unknown = Unknown { since_unix_ns, reason };
            for component in &mut picture.components {
                *component = component.clone().while_unknown(unknown.clone());
            }
        } else {
            picture.doubt();
        }
        let silent_since_unix_ns = silent.then_some(self.heard_unix_ns);
        LiveModule { picture, silent_since_unix_ns }
    }
}

fn keep<T>(kept: &mut VecDeque<T>, item: T, most: usize) {
    if kept.len() == most {
        kept.pop_front();
    }
    kept.push_back(item);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use wire::{Agreement, Condition, FaultState};

    const SECOND: u64 = 1_000_000_000;

    fn transition(sequence: u64, state: FaultState) -> FaultTransition {
        let component = "m1/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("tower".parse().unwrap(), component, 5);
        let condition = Condition { agreement: Agreement::Agrees, as_of_step: None, reason: None };
        FaultTransition {
            sequence,
            verdict: wire::Verdict::example(state),
            condition: Some(condition),
            ..untouched
        }
    }

    fn state(scene: &Scene) -> FaultState {
        scene.modules[0].picture.components[0].state()
    }

    #[test]
    fn what_is_not_heard_any_more_is_not_called_normal_and_a_fault_stays_one() {
        for (known, later) in
            [(FaultState::Normal, FaultState::Unknown), (FaultState::Latched, FaultState::Latched)]
        {
            let mut stage = Stage::default();
            stage.status(testing::status("m1", &[]), 7 * SECOND);
            stage.state(transition(1, known), None, 7 * SECOND);
            let scene = stage.scene(1, 8 * SECOND);
            assert_eq!((state(&scene), scene.modules[0].silent_since_unix_ns), (known, None));
            let scene = stage.scene(2, 10 * SECOND);
            let silent_since = scene.modules[0].silent_since_unix_ns;
            assert_eq!((state(&scene), silent_since), (later, Some(7 * SECOND)));
            stage.status(testing::status("m1", &[]), 11 * SECOND);
            assert_eq!(state(&stage.scene(3, 11 * SECOND)), known);
        }
    }

    #[test]
    fn what_cannot_be_read_is_not_called_normal_until_a_state_follows_that_can() {
        let mut stage = Stage::default();
        stage.status(testing::status("m1", &[]), SECOND);
        stage.state(transition(1, FaultState::Normal), None, SECOND);
        let unreadable = |stage: &mut Stage| {
            let state = UnreadableState::on("trusswatch/tower/m1/fault/sensor/g1", "unknown word");
            let problem = "unknown word".to_owned();
            stage.news(News::Unreadable { problem, state }, SECOND);
        };
        unreadable(&mut stage);
        assert_eq!(state(&stage.scene(1, SECOND)), FaultState::Unknown);
        stage.state(transition(1, FaultState::Normal), None, SECOND);
        assert_eq!(state(&stage.scene(2, SECOND)), FaultState::Normal);
        stage.state(transition(2, FaultState::Latched), None, SECOND);
        unreadable(&mut stage);
        assert_eq!(state(&stage.scene(3, SECOND)), FaultState::Latched);
    }

    #[test]
    fn the_plant_is_no_module_of_the_scene() {
        let mut stage = Stage::default();
        for who in ["plant", "m1"] {
            let (structure, who) = ("tower".parse().unwrap(), who.to_owned());
            stage.news(News::Presence { structure, who, there: true }, SECOND);
        }
        let scene = stage.scene(1, SECOND);
        let modules = scene.modules.iter().map(|module| module.picture.member.module.as_str());
        assert_eq!((modules.collect::<Vec<_>>(), scene.events.len()), (vec!["m1"], 2));
    }

    #[test]
    fn an_answer_that_was_overtaken_changes_nothing() {
        let mut stage = Stage::default();
        stage.status(testing::status("m1", &[]), SECOND);
        let latched = News::Fault(Box::new(transition(2, FaultState::Latched)));
        stage.news(latched, SECOND);
        stage.state(transition(1, FaultState::Normal), None, SECOND);
        let scene = stage.scene(1, SECOND);
        assert_eq!(state(&scene), FaultState::Latched);
        assert_eq!(scene.events.iter().map(|event| event.number).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn expected_modules_and_named_peers_stand_in_the_scene_though_they_are_never_heard() {
        let mut stage = Stage::new(None, vec!["m1".parse().unwrap(), "m9".parse().unwrap()]);
        let silent = |scene: &Scene| -> Vec<(String, bool)> {
            let silent = scene.modules.iter().map(|module| {
                let name = module.picture.member.module.to_string();
                (name, module.silent_since_unix_ns.is_some())
            });
            silent.collect()
        };
        let both = [("m1".to_owned(), true), ("m9".to_owned(), true)];
        assert_eq!(silent(&stage.scene(1, 9 * SECOND)), both);
        stage.status(testing::status("m1", &["m2"]), 9 * SECOND);
        let all = [("m9".to_owned(), true), ("m1".to_owned(), false), ("m2".to_owned(), true)];
        assert_eq!(silent(&stage.scene(2, 9 * SECOND)), all);
    }
}
