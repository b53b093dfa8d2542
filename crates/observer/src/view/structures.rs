//! Builds a [`Scene`] from events, messages and the time.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::time::Duration;

use vocabulary::{
    ComponentPath, FaultState, FaultTransition, Key, ModuleName, ModulePhase, ModuleStatus,
    StructureName, Topic, Unknown, keys::PLANT,
};

use super::component::{self, COMPONENTS};
use super::line::EventLine;
use super::module::ModuleView;
use super::news::{News, ObservedEvent};
use super::scene::{NetworkState, Scene};

/// A status arrives every second; a module without any message for this long is silent.
const SILENT_AFTER: Duration = Duration::from_secs(3);
/// Events and problems kept for the scene.
const EVENTS: usize = 500;
const PROBLEMS: usize = 20;
/// Maximum number of modules, because on an open network any client can invent names; messages of further modules are only counted.
const MODULES: usize = 1024;
/// A module that is neither present nor awaited is forgotten when nothing was heard of it for this long.
const FORGOTTEN_AFTER: Duration = Duration::from_secs(600);
/// The same for a module with a fault or a possible one, which no operator can acknowledge any more.
const ALARM_FORGOTTEN_AFTER: Duration = Duration::from_secs(7 * 86_400);

/// After so many answers of a module without a component, a minute's, the component is forgotten.
const COMPONENT_FORGOTTEN_AFTER: u32 = 30;

/// Structure and name of a module.
type ModuleKey = (Option<StructureName>, ModuleName);

/// Which components a module reports.
#[derive(Debug, Default)]
struct ReportedComponents {
    /// Those in its messages since the query before.
    named: BTreeSet<ComponentPath>,
    /// In how many of its answers in a row each of the others has been missing.
    missing: BTreeMap<ComponentPath, u32>,
}

impl ReportedComponents {
    /// Removes components that a module has not reported in [`COMPONENT_FORGOTTEN_AFTER`] complete answers: they were
    /// removed from its configuration, or never existed. A single answer may lack components whose replies come late.
    fn answered(&mut self, components: &mut Vec<FaultTransition>) {
        let named = std::mem::take(&mut self.named);
        components.retain(|state| {
            if named.contains(&state.component) {
                self.missing.remove(&state.component);
                return true;
            }
            let times = self.missing.entry(state.component.clone()).or_default();
            *times += 1;
            *times < COMPONENT_FORGOTTEN_AFTER
        });
        self.missing.retain(|_, times| *times < COMPONENT_FORGOTTEN_AFTER);
    }
}

/// Everything known about the observed structures.
#[derive(Debug, Default)]
pub struct Structures {
    modules: BTreeMap<ModuleKey, ModuleView>,
    reported: BTreeMap<ModuleKey, ReportedComponents>,
    events: VecDeque<Arc<ObservedEvent>>,
    problems: VecDeque<String>,
    last_event: u64,
    network: NetworkState,
    /// Since when the network has been open \[ns since 1970\].
    open_unix_ns: u64,
    is_asking: bool,
    /// Messages of modules beyond [`MODULES`], or of components beyond [`COMPONENTS`].
    ignored: u64,
}

impl Structures {
    /// Starts without messages. Expected modules stay in the scene whether or not they are running.
    #[must_use]
    pub fn new(structure: Option<&StructureName>, expected: Vec<ModuleName>) -> Self {
        let mut structures = Self::default();
        for module in expected {
            let view = ModuleView::new(structure.cloned(), module.clone());
            let view = ModuleView { expected: true, ..view };
            structures.modules.insert((structure.cloned(), module), view);
        }
        structures
    }

    /// Records the state of the network connection.
    pub fn network(&mut self, state: NetworkState, now_unix_ns: u64) {
        if state == NetworkState::Open && self.network != NetworkState::Open {
            self.open_unix_ns = now_unix_ns;
            self.modules.values_mut().for_each(|view| component::outdate(&mut view.components));
        }
        self.network = state;
    }

    /// Records an event; returns it with its number and time.
    pub fn news(&mut self, news: News, now_unix_ns: u64) -> Arc<ObservedEvent> {
        match &news {
            News::Fault(state) | News::Present(state) => {
                self.state((**state).clone(), None, now_unix_ns);
            }
            News::Identification(found) => {
                if let Some(module) = self.module(&found.structure, &found.module) {
                    component::identify(&mut module.components, found);
                }
            }
            News::Phase(change) => {
                if let Some(view) = self.module(&change.structure, &change.module) {
                    (view.phase_change, view.heard_unix_ns) = (Some(change.clone()), now_unix_ns);
                    if change.phase != ModulePhase::InService {
                        component::outdate(&mut view.components);
                    }
                }
            }
            News::Presence { structure, who, there, .. } => {
                // The plant has a liveliness token but is not a module.
                if let Ok(module) = who.parse::<ModuleName>()
                    && who != PLANT
                    && let Some(view) = self.known_or_new(structure, &module)
                {
                    (view.present, view.left_unix_ns) =
                        (*there, if *there { 0 } else { now_unix_ns });
                }
            }
            News::Unreadable { key, problem } => {
                self.problem(format!("{key}: {problem}"));
                self.unreadable(key, problem, now_unix_ns);
            }
            News::SeveralProcesses { .. }
            | News::Missed { .. }
            | News::Connection { .. }
            | News::Lost { .. } => {}
        }
        let is_shown = news.is_shown();
        self.last_event += u64::from(is_shown);
        let event = ObservedEvent { number: self.last_event, time_unix_ns: now_unix_ns, news };
        let event = Arc::new(event);
        if is_shown {
            self.list(event.clone());
        }
        event
    }

    /// Lists an event. What was so before the network was open came as answers, in any order, and is sorted by time.
    fn list(&mut self, event: Arc<ObservedEvent>) {
        let time = |event: &ObservedEvent| EventLine::of(event).time_unix_ns;
        let of_event = time(&event);
        keep(&mut self.events, event, EVENTS);
        if of_event >= self.open_unix_ns {
            return;
        }
        let mut place = self.events.len() - 1;
        while place > 0 && time(&self.events[place - 1]) > of_event {
            self.events.swap(place - 1, place);
            place -= 1;
        }
    }

    /// Records a status.
    pub fn status(&mut self, status: ModuleStatus, now_unix_ns: u64) {
        self.forget_peers(&status);
        for peer in &status.peers {
            if let Some(named) = self.module(&status.structure, &peer.module) {
                named.peer_of.insert(status.module.clone());
            }
        }
        if let Some(view) = self.module(&status.structure, &status.module) {
            (view.heard_unix_ns, view.status) = (now_unix_ns, Some(status));
        }
    }

    /// Modules that its latest status named and this one does not are not its peers any more.
    fn forget_peers(&mut self, status: &ModuleStatus) {
        let key = |module: &ModuleName| (Some(status.structure.clone()), module.clone());
        let before = self.modules.get(&key(&status.module)).and_then(|view| view.status.as_ref());
        let before: Vec<_> = before
            .into_iter()
            .flat_map(|before| &before.peers)
            .filter(|peer| !status.peers.iter().any(|named| named.module == peer.module))
            .map(|peer| key(&peer.module))
            .collect();
        for peer in before {
            if let Some(view) = self.modules.get_mut(&peer) {
                view.peer_of.remove(&status.module);
            }
        }
    }

    /// Records the state of a component, from a published transition or a process's answer. A state older than the
    /// recorded one is ignored.
    pub fn state(&mut self, state: FaultTransition, process: Option<String>, now_unix_ns: u64) {
        let Some(module) = self.module(&state.structure, &state.module) else { return };
        module.heard_unix_ns = now_unix_ns;
        module.answering.extend(process);
        let key = (Some(state.structure.clone()), state.module.clone());
        let component = state.component.clone();
        let is_known = component::enter(&mut module.components, state);
        self.reported(key, component, is_known);
    }

    /// Records a message or an answer that could not be read. If it is about the state of a component, that component
    /// is unknown until a readable one follows.
    pub fn unreadable(&mut self, key: &str, problem: &str, now_unix_ns: u64) {
        if let Ok(Key::Module { structure, module, topic: Topic::Fault(component) }) = key.parse() {
            let reason = format!("its state cannot be read: {problem}");
            let unknown = Unknown { since_unix_ns: now_unix_ns, reason };
            let Some(view) = self.module(&structure, &module) else { return };
            view.heard_unix_ns = now_unix_ns;
            let component = ComponentPath { module, component };
            let key = (Some(structure.clone()), component.module.clone());
            let is_known =
                component::unreadable(&mut view.components, structure, component.clone(), unknown);
            self.reported(key, component, is_known);
        }
    }

    /// A module has sent a message on a component, which is one of its first [`COMPONENTS`] or is ignored.
    fn reported(&mut self, key: ModuleKey, component: ComponentPath, is_known: bool) {
        if is_known {
            self.reported.entry(key).or_default().named.insert(component);
        } else {
            self.ignored += 1;
        }
    }

    /// Records a refusal or a message that could not be read.
    pub fn problem(&mut self, problem: String) {
        if !self.problems.contains(&problem) {
            keep(&mut self.problems, problem, PROBLEMS);
        }
    }

    /// A query for the states of all components was sent.
    pub fn asked(&mut self) {
        self.is_asking = true;
    }

    /// No more answers to that query will arrive.
    pub fn answered(&mut self) {
        self.is_asking = false;
        for (key, module) in &mut self.modules {
            module.processes = std::mem::take(&mut module.answering);
            if let Some(reported) = self.reported.get_mut(key)
                && !module.processes.is_empty()
            {
                reported.answered(&mut module.components);
            }
        }
    }

    /// Forgets modules that were made up or removed: not expected, without a liveliness token, not named as a peer by a
    /// module that was heard, and not heard of for ten minutes, with a fault or a possible one for a week. None while cut
    /// off.
    pub fn forget(&mut self, now_unix_ns: u64) {
        if self.network != NetworkState::Open {
            return;
        }
        let open_unix_ns = self.open_unix_ns;
        let is_within = |since_unix_ns: u64, limit: Duration| {
            let age_ns = now_unix_ns.saturating_sub(since_unix_ns.max(open_unix_ns));
            u128::from(age_ns) < limit.as_nanos()
        };
        let heard: BTreeSet<_> = self
            .modules
            .iter()
            .filter(|(_, view)| is_within(view.heard_unix_ns, FORGOTTEN_AFTER))
            .map(|(key, _)| key.clone())
            .collect();
        self.modules.retain(|(structure, _), view| {
            let is_named = || {
                let mut namers = view.peer_of.iter();
                namers.any(|namer| heard.contains(&(structure.clone(), namer.clone())))
            };
            let is_alarm = |state: &FaultTransition| {
                state.state().is_fault() || state.state() == FaultState::Unconfirmed
            };
            let is_alarming = view.components.iter().any(is_alarm);
            let limit = if is_alarming { ALARM_FORGOTTEN_AFTER } else { FORGOTTEN_AFTER };
            let latest = view.heard_unix_ns.max(view.left_unix_ns);
            let is_recent = latest > 0 && is_within(latest, limit);
            view.expected || view.present || is_recent || is_named()
        });
        self.reported.retain(|key, _| self.modules.contains_key(key));
    }

    /// The module of a message. Beyond [`MODULES`], it takes the place of one of which only a token was seen.
    fn module(
        &mut self,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Option<&mut ModuleView> {
        let key = (Some(structure.clone()), module.clone());
        if self.modules.len() >= MODULES && !self.modules.contains_key(&key) {
            let is_only_seen = |view: &ModuleView| {
                view.heard_unix_ns == 0 && !view.expected && view.peer_of.is_empty()
            };
            let only_seen = self.modules.iter().find(|(_, view)| is_only_seen(view));
            if let Some(key) = only_seen.map(|(key, _)| key.clone()) {
                self.modules.remove(&key);
                self.ignored += 1;
            }
        }
        self.known_or_new(structure, module)
    }

    /// The module, unless it is a new one beyond [`MODULES`].
    fn known_or_new(
        &mut self,
        structure: &StructureName,
        module: &ModuleName,
    ) -> Option<&mut ModuleView> {
        // An expected module whose structure was not known turned out to be this one.
        if let Some(mut known) = self.modules.remove(&(None, module.clone())) {
            known.structure = Some(structure.clone());
            self.modules.insert((Some(structure.clone()), module.clone()), known);
        }
        let key = (Some(structure.clone()), module.clone());
        if self.modules.len() >= MODULES && !self.modules.contains_key(&key) {
            self.ignored += 1;
            return None;
        }
        Some(self.modules.entry(key).or_insert_with_key(|(structure, module)| {
            ModuleView::new(structure.clone(), module.clone())
        }))
    }

    /// The scene at this moment.
    #[must_use]
    pub fn scene(&self, number: u64, now_unix_ns: u64) -> Scene {
        let structures: BTreeSet<_> =
            self.modules.keys().filter_map(|(structure, _)| structure.as_ref()).collect();
        let view = |known: &ModuleView| {
            let mut view = known.clone();
            let is_over = |since_unix_ns: u64| {
                u128::from(now_unix_ns.saturating_sub(since_unix_ns)) >= SILENT_AFTER.as_nanos()
            };
            let heard = view.heard_unix_ns;
            view.is_cut_off = match self.network {
                NetworkState::CutOff(_) | NetworkState::Failed(_) | NetworkState::Closed => true,
                NetworkState::Opening => heard == 0,
                // Only a running module that does not answer now has not answered since the connection is back.
                NetworkState::Open => {
                    (1..self.open_unix_ns).contains(&heard) && !is_over(self.open_unix_ns)
                }
            };
            let has_left = view.left_unix_ns > 0 && heard <= view.left_unix_ns;
            view.is_silent = view.is_cut_off || has_left || is_over(heard);
            view.doubt();
            // A module that was not seen is assigned to the only structure.
            if view.structure.is_none() && structures.len() == 1 {
                view.structure = structures.first().copied().cloned();
            }
            view
        };
        let mut modules: Vec<ModuleView> = self.modules.values().map(view).collect();
        modules.sort_by(|a, b| (&a.structure, &a.module).cmp(&(&b.structure, &b.module)));
        let mut problems = self.problems.clone();
        if self.ignored > 0 {
            let ignored = self.ignored;
            let problem = format!(
                "{MODULES} modules, or {COMPONENTS} components of one, are known; {ignored} messages of others were ignored",
            );
            keep(&mut problems, problem, PROBLEMS);
        }
        Scene {
            number,
            time_unix_ns: now_unix_ns,
            network: self.network.clone(),
            is_asking: self.is_asking,
            modules,
            events: self.events.clone(),
            problems,
        }
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
    use vocabulary::{Condition, Obstacle, Step};

    const SECOND: u64 = 1_000_000_000;

    fn transition(incarnation: u64, sequence: u64, state: FaultState) -> FaultTransition {
        let component = "m1/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("tower".parse().unwrap(), component, 5);
        let condition = Condition::Agrees { from: Step(1), as_of: Step(9) };
        let verdict = vocabulary::Verdict::example(state);
        FaultTransition { incarnation, sequence, verdict, condition: Some(condition), ..untouched }
    }

    fn token(module: &str, there: bool) -> News {
        let (structure, who) = ("tower".parse().unwrap(), module.to_owned());
        News::Presence { structure, who, there, at_start: false }
    }

    fn phase(phase: ModulePhase, time_unix_ns: u64) -> News {
        News::Phase(testing::phase_change(phase, time_unix_ns))
    }

    fn state(scene: &Scene) -> FaultState {
        scene.modules[0].components[0].state()
    }

    fn silent(scene: &Scene) -> Vec<(&str, bool)> {
        scene.modules.iter().map(|module| (module.module.as_str(), module.is_silent)).collect()
    }

    #[test]
    fn what_is_not_heard_any_more_is_not_called_normal_and_a_fault_stays_one() {
        for (known, later) in
            [(FaultState::Normal, FaultState::Unknown), (FaultState::Latched, FaultState::Latched)]
        {
            let mut structures = Structures::default();
            structures.status(testing::status("m1", &[]), 7 * SECOND);
            structures.state(transition(7, 1, known), None, 7 * SECOND);
            let scene = structures.scene(1, 8 * SECOND);
            assert_eq!((state(&scene), scene.modules[0].is_silent), (known, false));
            let scene = structures.scene(2, 10 * SECOND);
            assert_eq!((state(&scene), scene.modules[0].is_silent), (later, true));
            assert_eq!(scene.modules[0].components[0].condition, None, "nor whether it agrees");
            assert_eq!(scene.modules[0].heard_unix_ns, 7 * SECOND);
            structures.status(testing::status("m1", &[]), 11 * SECOND);
            assert_eq!(state(&structures.scene(3, 11 * SECOND)), known);
        }
    }

    #[test]
    fn a_component_whose_state_cannot_be_read_is_not_called_normal() {
        let mut structures = Structures::default();
        structures.status(testing::status("m1", &[]), SECOND);
        let unreadable = |structures: &mut Structures| {
            let key = "trusswatch/tower/m1/fault/sensor/g1".to_owned();
            structures.news(News::Unreadable { key, problem: "unknown word".to_owned() }, SECOND);
        };
        unreadable(&mut structures);
        assert_eq!(state(&structures.scene(1, SECOND)), FaultState::Unknown);
        structures.state(transition(7, 1, FaultState::Normal), None, SECOND);
        assert_eq!(state(&structures.scene(2, SECOND)), FaultState::Normal);
        unreadable(&mut structures);
        assert_eq!(state(&structures.scene(3, SECOND)), FaultState::Unknown);
        structures.state(transition(7, 2, FaultState::Latched), None, SECOND);
        unreadable(&mut structures);
        assert_eq!(state(&structures.scene(4, SECOND)), FaultState::Latched);
    }

    #[test]
    fn a_condition_that_does_not_allow_normal_is_not_shown_as_normal() {
        let shown = |condition: Condition| {
            let mut structures = Structures::default();
            structures.status(testing::status("m1", &[]), SECOND);
            let condition = Some(condition);
            let told = FaultTransition { condition, ..transition(7, 1, FaultState::Normal) };
            structures.state(told, None, SECOND);
            state(&structures.scene(1, SECOND))
        };
        assert_eq!(shown(Condition::Agrees { from: Step(1), as_of: Step(9) }), FaultState::Normal);
        assert_eq!(shown(Condition::NotVerified), FaultState::Normal);
        for condition in [
            Condition::NotCompared,
            Condition::Doubtful { as_of: Step(9) },
            Condition::Departed { as_of: Step(9) },
            Condition::OneOf { as_of: Step(9), components: Vec::new() },
            Condition::CannotTell { obstacle: Obstacle::Swinging },
        ] {
            assert_eq!(shown(condition.clone()), FaultState::Unknown, "{condition:?}");
        }
    }

    /// A transition does not say how its component compares with its reference.
    #[test]
    fn what_is_known_of_the_comparison_holds_until_the_change_or_the_module_leaves_service() {
        let told = |latched: FaultState, from: u64| {
            let mut structures = Structures::default();
            structures.status(testing::status("m1", &[]), SECOND);
            let agrees = Condition::Agrees { from: Step(from), as_of: Step(from + 8) };
            let known =
                FaultTransition { condition: Some(agrees), ..transition(7, 1, FaultState::Normal) };
            structures.state(known, None, SECOND);
            let detection_step = Some(Step(5));
            let news = transition(7, 2, latched);
            let news = FaultTransition { condition: None, detection_step, ..news };
            structures.news(News::Fault(Box::new(news)), SECOND);
            structures
        };
        let condition = |structures: &Structures| {
            structures.scene(1, SECOND).modules[0].components[0].condition.clone()
        };
        assert_eq!(condition(&told(FaultState::Latched, 1)), Some(Condition::NotCompared));
        let agrees = Condition::Agrees { from: Step(6), as_of: Step(14) };
        assert_eq!(condition(&told(FaultState::Latched, 6)), Some(agrees.clone()));
        let mut structures = told(FaultState::Normal, 6);
        assert_eq!(condition(&structures), Some(agrees));
        assert_eq!(state(&structures.scene(1, SECOND)), FaultState::Normal);
        structures.news(phase(ModulePhase::Stale, 7), SECOND);
        structures.news(phase(ModulePhase::InService, 8), SECOND);
        assert_eq!(state(&structures.scene(1, SECOND)), FaultState::Unknown);
    }

    /// It published transitions that its disk never had, and lost its power.
    #[test]
    fn a_process_that_gives_numbers_again_is_followed_and_what_comes_late_is_not() {
        let at = |second: u64, sequence, state| FaultTransition {
            time_unix_ns: second * SECOND,
            ..transition(7, sequence, state)
        };
        let mut structures = Structures::default();
        structures.status(testing::status("m1", &[]), SECOND);
        structures.state(at(3, 3, FaultState::Acknowledged), None, 3 * SECOND);
        structures.state(at(2, 2, FaultState::Latched), None, 4 * SECOND);
        assert_eq!(state(&structures.scene(1, SECOND)), FaultState::Acknowledged, "it comes late");
        structures.state(at(5, 2, FaultState::Latched), None, 5 * SECOND);
        assert_eq!(state(&structures.scene(2, SECOND)), FaultState::Latched, "it counts again");
    }

    #[test]
    fn the_plant_is_no_module_of_the_scene() {
        let mut structures = Structures::default();
        for who in ["plant", "m1"] {
            structures.news(token(who, true), SECOND);
        }
        let scene = structures.scene(1, SECOND);
        let modules = scene.modules.iter().map(|module| module.module.as_str());
        assert_eq!((modules.collect::<Vec<_>>(), scene.events.len()), (vec!["m1"], 2));
    }

    #[test]
    fn what_was_so_before_the_view_connected_is_listed_by_time() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, 10 * SECOND);
        structures.news(token("m1", true), 10 * SECOND);
        let fault = |sequence, time_unix_ns| FaultTransition {
            time_unix_ns,
            since_unix_ns: time_unix_ns,
            ..transition(7, sequence, FaultState::Latched)
        };
        for present in [fault(2, 8 * SECOND), fault(1, 3 * SECOND)] {
            structures.news(News::Present(Box::new(present)), 10 * SECOND);
        }
        let found = vocabulary::Identification {
            since_unix_ns: Some(5 * SECOND),
            time_unix_ns: 9 * SECOND,
            ..testing::identification(true, &["bias"])
        };
        structures.news(News::Identification(Box::new(found)), 10 * SECOND);
        structures.news(phase(ModulePhase::InService, SECOND), 10 * SECOND);
        // Later events are listed as they come, whatever their clocks say.
        structures.news(phase(ModulePhase::Stale, 12 * SECOND), 12 * SECOND);
        structures.news(phase(ModulePhase::Stale, 11 * SECOND), 12 * SECOND);
        let scene = structures.scene(1, SECOND);
        let times = scene.events.iter().map(|event| EventLine::of(event).time_unix_ns / SECOND);
        assert_eq!(times.collect::<Vec<_>>(), [1, 3, 5, 8, 10, 12, 11]);
    }

    #[test]
    fn an_answer_that_was_overtaken_changes_nothing() {
        let mut structures = Structures::default();
        structures.status(testing::status("m1", &[]), SECOND);
        let latched = News::Fault(Box::new(transition(7, 2, FaultState::Latched)));
        structures.news(latched, SECOND);
        structures.state(transition(7, 1, FaultState::Normal), None, SECOND);
        let scene = structures.scene(1, SECOND);
        assert_eq!(state(&scene), FaultState::Latched);
        assert_eq!(scene.events.iter().map(|event| event.number).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn the_later_of_two_transitions_counts_and_a_wiped_state_is_later_than_any_before() {
        let mut structures = Structures::default();
        let mut present = |incarnation, sequence| {
            structures.state(transition(incarnation, sequence, FaultState::Normal), None, SECOND);
            structures.scene(1, SECOND).modules[0].components[0].place()
        };
        assert_eq!(present(7, 7), (7, 7));
        assert_eq!(present(7, 6), (7, 7));
        assert_eq!(present(100, 2), (100, 2));
        assert_eq!(present(7, 8), (100, 2));
        assert_eq!(present(200, 0), (200, 0));
    }

    #[test]
    fn expected_modules_and_named_peers_stand_in_the_scene_though_they_are_never_heard() {
        let expected = vec!["m1".parse().unwrap(), "m9".parse().unwrap()];
        let mut structures = Structures::new(None, expected);
        assert_eq!(silent(&structures.scene(1, 9 * SECOND)), [("m1", true), ("m9", true)]);
        structures.status(testing::status("m1", &["m2"]), 9 * SECOND);
        let scene = structures.scene(2, 9 * SECOND);
        assert_eq!(silent(&scene), [("m1", false), ("m2", true), ("m9", true)]);
        assert!(scene.modules[1].peer_of.contains(&"m1".parse().unwrap()));
        assert!(scene.modules[2].expected && scene.modules[2].structure.is_some());
    }

    #[test]
    fn the_later_message_on_the_phase_counts_and_a_token_can_go() {
        let mut structures = Structures::default();
        structures.news(token("m1", true), SECOND);
        structures.news(phase(ModulePhase::Waiting, 3), SECOND);
        structures.status(testing::status("m1", &[]), SECOND);
        structures.news(token("m1", false), SECOND);
        let module = structures.scene(1, SECOND).modules.remove(0);
        assert_eq!((module.phase(), module.present), (Some(ModulePhase::InService), false));
        structures.news(phase(ModulePhase::Stale, 7), SECOND);
        assert_eq!(structures.scene(1, SECOND).modules[0].phase(), Some(ModulePhase::Stale));
    }

    #[test]
    fn the_processes_that_answered_one_question_are_counted() {
        let mut structures = Structures::default();
        let mut answered = |processes: &[&str]| {
            structures.asked();
            for process in processes {
                let state = transition(7, 1, FaultState::Normal);
                structures.state(state, Some((*process).to_owned()), SECOND);
            }
            structures.answered();
            structures.scene(1, SECOND).modules[0].processes.len()
        };
        assert_eq!([answered(&["a", "b"]), answered(&["a"])], [2, 1]);
    }

    #[test]
    fn no_module_is_blamed_while_the_observer_itself_is_cut_off() {
        let mut structures = Structures::default();
        let seen = |structures: &Structures, at_s| {
            let module = structures.scene(1, at_s * SECOND).modules.remove(0);
            let words = format!("{}: {}", module.condition(), module.remarks());
            (words, module.components[0].state())
        };
        structures.network(NetworkState::Open, SECOND);
        structures.news(token("m1", true), SECOND);
        structures.status(testing::status("m1", &[]), 7 * SECOND);
        structures.state(transition(7, 1, FaultState::Normal), None, 7 * SECOND);
        assert_eq!(seen(&structures, 8), ("in service: ".to_owned(), FaultState::Normal));
        structures.network(NetworkState::CutOff(8 * SECOND), 8 * SECOND);
        for at_s in [9, 99] {
            let (words, state) = seen(&structures, at_s);
            let expected = "NOT KNOWN: this view is cut off from the network; last heard ";
            assert!(words.starts_with(expected), "{words}");
            assert_eq!(state, FaultState::Unknown);
        }
        // Back, a module has as long to be heard as it always has.
        structures.network(NetworkState::Open, 100 * SECOND);
        assert!(seen(&structures, 102).0.starts_with("NOT KNOWN"));
        assert!(seen(&structures, 103).0.starts_with("NOT ANSWERING: nothing heard since "));
        structures.status(testing::status("m1", &[]), 104 * SECOND);
        assert_eq!(seen(&structures, 104), ("in service: ".to_owned(), FaultState::Unknown));
        structures.state(transition(7, 1, FaultState::Normal), None, 104 * SECOND);
        assert_eq!(seen(&structures, 104), ("in service: ".to_owned(), FaultState::Normal));
    }

    #[test]
    fn an_unexpected_module_is_forgotten_when_it_falls_silent() {
        const LATER: u64 = 601 * SECOND;
        let mut structures = Structures::new(None, vec!["expected".parse().unwrap()]);
        structures.network(NetworkState::Open, SECOND);
        let status = |structures: &mut Structures, module: &str, peers: &[&str], at| {
            structures.status(testing::status(module, peers), at);
        };
        status(&mut structures, "namer", &["named"], SECOND);
        status(&mut structures, "ghost", &["ghosts-peer"], SECOND);
        structures.news(token("present", true), SECOND);
        structures.news(token("left", true), SECOND);
        structures.news(token("left", false), 2 * SECOND);
        structures.state(transition(7, 1, FaultState::Latched), None, SECOND);
        let known = |structures: &Structures| {
            let scene = structures.scene(1, LATER);
            let names = scene.modules.iter().map(|module| module.module.to_string());
            names.collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>().join(" ")
        };
        let all = "expected ghost ghosts-peer left m1 named namer present";
        structures.forget(600 * SECOND);
        assert_eq!(known(&structures), all);
        // Nobody is heard while the observer is cut off.
        structures.network(NetworkState::CutOff(600 * SECOND), 600 * SECOND);
        structures.forget(LATER);
        assert_eq!(known(&structures), all);
        structures.network(NetworkState::Open, LATER);
        structures.forget(LATER + 599 * SECOND);
        assert_eq!(known(&structures), all);
        status(&mut structures, "namer", &["named"], LATER + 599 * SECOND);
        structures.forget(LATER + 600 * SECOND);
        assert_eq!(known(&structures), "expected m1 named namer present");
    }

    #[test]
    fn a_module_that_no_peer_names_any_more_is_forgotten() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        structures.status(testing::status("m1", &["m2", "removed"]), SECOND);
        structures.status(testing::status("m1", &["m2"]), 9 * SECOND);
        structures.forget(9 * SECOND);
        let scene = structures.scene(1, 9 * SECOND);
        assert_eq!(silent(&scene), [("m1", false), ("m2", true)]);
    }

    #[test]
    fn a_silent_module_is_kept_for_its_faults_and_not_for_what_is_unknown() {
        let kept = |known: FaultState, at_s: u64| {
            let mut structures = Structures::default();
            structures.network(NetworkState::Open, SECOND);
            structures.state(transition(7, 1, known), None, SECOND);
            structures.forget(at_s * SECOND);
            !structures.scene(1, at_s * SECOND).modules.is_empty()
        };
        for harmless in [FaultState::Unknown, FaultState::Explained, FaultState::Tentative] {
            assert!(!kept(harmless, 700), "{harmless}");
        }
        for fault in [FaultState::Latched, FaultState::Acknowledged, FaultState::Unconfirmed] {
            assert!(kept(fault, 700) && kept(fault, 6 * 86_400), "{fault}");
            assert!(!kept(fault, 8 * 86_400), "{fault}");
        }
    }

    #[test]
    fn a_component_that_its_module_does_not_report_any_more_is_forgotten() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        structures.status(testing::status("m1", &[]), SECOND);
        let other = |component: &str| FaultTransition {
            component: component.parse().unwrap(),
            ..transition(7, 1, FaultState::Latched)
        };
        structures.state(other("m1/sensor/g2"), None, SECOND);
        structures.state(other("m1/sensor/g3"), None, SECOND);
        let round = |structures: &mut Structures, named: &[&str]| {
            structures.asked();
            for component in named {
                structures.state(other(component), Some("a".to_owned()), SECOND);
            }
            structures.answered();
            structures.scene(1, SECOND).modules[0].components.len()
        };
        // An answer may lack some, and none at all says nothing of the components.
        for _ in 0..20 {
            assert_eq!(round(&mut structures, &["m1/sensor/g1"]), 3);
            assert_eq!(round(&mut structures, &[]), 3);
        }
        assert_eq!(round(&mut structures, &["m1/sensor/g1", "m1/sensor/g2"]), 3);
        for _ in 0..30 {
            round(&mut structures, &["m1/sensor/g1"]);
        }
        let left = structures.scene(1, SECOND).modules.remove(0).components;
        let left: Vec<String> = left.iter().map(|state| state.component.to_string()).collect();
        assert_eq!(left, ["m1/sensor/g1"]);
    }

    #[test]
    fn made_up_components_are_bounded() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        for number in 0..3000 {
            let component = format!("m1/sensor/g{number}").parse().unwrap();
            let made_up = FaultTransition { component, ..transition(7, 1, FaultState::Latched) };
            structures.state(made_up, None, SECOND);
        }
        assert_eq!(structures.scene(1, SECOND).modules[0].components.len(), 1024);
    }

    #[test]
    fn a_module_whose_messages_cannot_be_read_was_heard() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        structures.unreadable("trusswatch/tower/m1/fault/sensor/g1", "unknown word", 9 * SECOND);
        let shown = structures.scene(1, 99 * SECOND);
        let unknown = shown.modules[0].components[0].unknown.clone().unwrap();
        assert_eq!(unknown.since_unix_ns, 9 * SECOND, "and not since 1970");
    }

    #[test]
    fn before_the_first_connection_no_module_is_said_not_to_answer() {
        let structures = Structures::new(None, vec!["m1".parse().unwrap()]);
        let scene = structures.scene(1, 9 * SECOND);
        assert_eq!(scene.modules[0].condition(), "NOT KNOWN");
        assert_eq!(scene.summary(), "not connected yet; all components unknown");
    }

    #[test]
    fn made_up_modules_are_bounded_and_those_beyond_are_counted() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        structures.status(testing::status("m1", &[]), SECOND);
        for number in 0..3000 {
            structures.news(token(&format!("ghost{number}"), true), SECOND);
        }
        structures.status(testing::status("m1", &["another"]), 2 * SECOND);
        structures.status(testing::status("m2", &[]), 2 * SECOND);
        let scene = structures.scene(1, 2 * SECOND);
        assert_eq!(scene.modules.len(), MODULES);
        let heard = scene.modules.iter().filter(|module| module.heard_unix_ns > 0);
        let heard: Vec<_> = heard.map(|module| module.module.to_string()).collect();
        assert_eq!(heard, ["m1", "m2"], "known or new, one that is heard has a place");
        let problem = scene.problems.back().unwrap();
        assert_eq!(
            problem,
            "1024 modules, or 1024 components of one, are known; 1979 messages of others were ignored"
        );
    }

    #[test]
    fn a_module_that_left_is_not_in_service_from_then_on() {
        let mut structures = Structures::default();
        structures.network(NetworkState::Open, SECOND);
        structures.news(token("m1", true), SECOND);
        structures.status(testing::status("m1", &[]), 7 * SECOND);
        structures.state(transition(7, 1, FaultState::Normal), None, 7 * SECOND);
        structures.news(token("m1", false), 8 * SECOND);
        let scene = structures.scene(1, 8 * SECOND);
        let module = &scene.modules[0];
        assert_eq!((module.is_in_service(), state(&scene)), (false, FaultState::Unknown));
        assert!(module.remarks().starts_with("left the network "), "{}", module.remarks());
        structures.status(testing::status("m1", &[]), 8 * SECOND + 1);
        assert!(
            structures.scene(2, 9 * SECOND).modules[0].is_in_service(),
            "it is heard after all"
        );
    }
}
