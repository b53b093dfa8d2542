//! A period as an owner files it: how long each component was watched and healthy, its faults, and how soon people
//! acknowledged them.

use std::collections::{BTreeMap, BTreeSet};

use vocabulary::{ComponentPath, FaultState, FaultTransition, ModulePhase, StructureName};

use super::journal::{JournalEntry, Journals, ModuleHistory};
use super::module::ModuleView;
use super::news::News;
use super::scene::{NetworkState, Scene};

/// A fault of a component, from its verdict to its reset.
#[derive(Debug, Clone, PartialEq)]
pub struct PastFault {
    /// The structure.
    pub structure: StructureName,
    /// The component.
    pub component: ComponentPath,
    /// The transition that latched it.
    pub latched: FaultTransition,
    /// What it was identified as, if it was: the latest word.
    pub kind: String,
    /// The time of its acknowledgement, and the operator.
    pub acknowledged: Option<(u64, String)>,
    /// When it ended \[ns since 1970\]; `None` if it has not.
    pub ended_unix_ns: Option<u64>,
}

impl PastFault {
    /// The number of its incident, as of a present fault: `STRUCTURE/COMPONENT@RUN-STEP`.
    #[must_use]
    pub fn incident(&self) -> Option<String> {
        super::component::incident(&self.latched)
    }

    /// How long it took to acknowledge it \[ns\].
    #[must_use]
    pub fn acknowledged_after_ns(&self) -> Option<u64> {
        let (at, _) = self.acknowledged.as_ref()?;
        Some(at.saturating_sub(self.latched.time_unix_ns))
    }
}

/// What a component was during a period \[ns\]. The three add up to the period.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Times {
    /// Watched, and no fault was known.
    pub healthy_ns: u64,
    /// A fault was known.
    pub faulty_ns: u64,
    /// Nothing was known: its module was not heard or not in service, or it could not be judged.
    pub unknown_ns: u64,
}

impl Times {
    /// The share of the period in which it was healthy, for all that is known.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a share")]
    pub fn availability(&self) -> f64 {
        let all = self.healthy_ns + self.faulty_ns + self.unknown_ns;
        if all == 0 { 0.0 } else { self.healthy_ns as f64 / all as f64 }
    }
}

/// A module's part of a period.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PeriodReport {
    /// Each component that was heard of.
    pub components: Vec<(ComponentPath, Times)>,
    /// Faults that were present in the period, by the time of their verdicts.
    pub faults: Vec<PastFault>,
    /// When its components were not monitored: from, until \[ns since 1970\], for which reasons one after the other.
    pub gaps: Vec<(u64, u64, Vec<&'static str>)>,
}

/// What is known of a module's monitoring.
#[derive(Debug, Clone)]
struct Monitoring {
    is_heard: bool,
    is_connected: bool,
    phase: Option<ModulePhase>,
    /// Components that it cannot monitor although it is in service.
    not_monitored: BTreeSet<ComponentPath>,
}

impl Monitoring {
    /// Why its components are not monitored, if they are not.
    fn gap(&self) -> Option<&'static str> {
        match self {
            Self { is_connected: false, .. } => Some("this page was not running, or cut off"),
            Self { is_heard: false, .. } => Some("its diagnoser was not heard"),
            Self { phase: Some(ModulePhase::InService), .. } => None,
            Self { phase: None, .. } => Some("nothing was heard of its diagnoser"),
            Self { phase: Some(_), .. } => Some("its diagnoser was not in service"),
        }
    }
}

impl PeriodReport {
    /// Of what was heard of a module and its components since the beginning, from one time to another \[ns since 1970\].
    #[must_use]
    pub fn of(
        history: &ModuleHistory,
        components: impl IntoIterator<Item = ComponentPath>,
        (from, until): (u64, u64),
    ) -> Self {
        let mut report = Self::default();
        let mut monitoring = Monitoring {
            is_heard: false,
            is_connected: true,
            phase: None,
            not_monitored: BTreeSet::new(),
        };
        let normal = |component| (component, FaultState::Normal);
        let mut states: Vec<(ComponentPath, FaultState)> =
            components.into_iter().map(normal).collect();
        let mut before = from;
        for entry in Journals::merge([history]).entries {
            let time = entry.time_unix_ns();
            if time > until {
                break;
            }
            report.pass(&monitoring, &states, (before, time.max(from)));
            before = time.max(from);
            report.take(&entry, &mut monitoring, &mut states);
        }
        report.pass(&monitoring, &states, (before, until));
        report.components.sort_by(|(a, _), (b, _)| a.cmp(b));
        report.faults.retain(|fault| fault.ended_unix_ns.is_none_or(|ended| ended >= from));
        report
    }

    fn take(
        &mut self,
        entry: &JournalEntry<'_>,
        monitoring: &mut Monitoring,
        states: &mut Vec<(ComponentPath, FaultState)>,
    ) {
        match entry {
            JournalEntry::Transition(transition) => {
                // A diagnoser that publishes is there.
                monitoring.is_heard = true;
                let path = &transition.component;
                match states.iter_mut().find(|(known, _)| known == path) {
                    Some((_, state)) => *state = transition.state(),
                    None => states.push((path.clone(), transition.state())),
                }
                self.take_fault(transition);
            }
            JournalEntry::Identification(found) => {
                let fault = self.open_fault(&found.component);
                if let (Some(fault), Some(likeliest)) = (fault, found.candidates.first()) {
                    fault.kind = vocabulary::words::candidate(likeliest);
                }
            }
            JournalEntry::Phase(change) => {
                monitoring.is_heard = true;
                monitoring.phase = Some(change.phase);
                monitoring.not_monitored = change.not_monitored.keys().cloned().collect();
            }
            JournalEntry::Observed(_, event) => match event.news {
                News::Presence { there, .. } => monitoring.is_heard = there,
                News::Connection { connected } => monitoring.is_connected = connected,
                _ => {}
            },
        }
    }

    fn open_fault(&mut self, component: &ComponentPath) -> Option<&mut PastFault> {
        let open =
            |fault: &&mut PastFault| fault.component == *component && fault.ended_unix_ns.is_none();
        self.faults.iter_mut().rev().find(open)
    }

    fn take_fault(&mut self, transition: &FaultTransition) {
        let is_fault = transition.state().is_fault();
        match self.open_fault(&transition.component) {
            Some(fault) if is_fault => {
                let is_acknowledged = transition.state() == FaultState::Acknowledged;
                let by = transition
                    .order
                    .as_ref()
                    .map(|order| order.on_behalf_of.as_ref().unwrap_or(&order.by).clone());
                let seen =
                    is_acknowledged.then(|| (transition.time_unix_ns, by.unwrap_or_default()));
                fault.acknowledged = fault.acknowledged.take().or(seen);
            }
            Some(fault) => fault.ended_unix_ns = Some(transition.time_unix_ns),
            None if is_fault => self.faults.push(PastFault {
                structure: transition.structure.clone(),
                component: transition.component.clone(),
                latched: transition.clone(),
                kind: String::new(),
                acknowledged: None,
                ended_unix_ns: None,
            }),
            None => {}
        }
    }

    /// Adds a time in which nothing happened.
    fn pass(
        &mut self,
        monitoring: &Monitoring,
        states: &[(ComponentPath, FaultState)],
        (from, until): (u64, u64),
    ) {
        if until <= from {
            return;
        }
        let gap = monitoring.gap();
        for (path, state) in states {
            let known = self.components.iter().position(|(known, _)| known == path);
            let place = known.unwrap_or_else(|| {
                // Before its first transition nothing of it was kept; its module's gaps say whether it was watched.
                self.components.push((path.clone(), Times::default()));
                self.components.len() - 1
            });
            let times = &mut self.components[place].1;
            let counter = match (state, gap) {
                (state, _) if state.is_fault() => &mut times.faulty_ns,
                (_, Some(_)) | (FaultState::Unknown | FaultState::Unconfirmed, None) => {
                    &mut times.unknown_ns
                }
                _ if monitoring.not_monitored.contains(path) => &mut times.unknown_ns,
                (_, None) => &mut times.healthy_ns,
            };
            *counter += until - from;
        }
        let Some(why) = gap else { return };
        match self.gaps.last_mut() {
            Some((_, end, reasons)) if *end == from => {
                *end = until;
                if reasons.last() != Some(&why) {
                    reasons.push(why);
                }
            }
            _ => self.gaps.push((from, until, vec![why])),
        }
    }
}

/// The scene as it was at a time \[ns since 1970\], from what was heard of each module and its components until then. How
/// components compared with their references is not kept.
pub fn scene_at<'a>(
    heard: impl IntoIterator<Item = (&'a ModuleHistory, &'a [ComponentPath])>,
    time_unix_ns: u64,
) -> Scene {
    let modules =
        heard.into_iter().map(|(history, components)| module_at(history, components, time_unix_ns));
    let (modules, network) = (modules.collect(), NetworkState::Open);
    Scene { time_unix_ns, network, modules, ..Scene::default() }
}

fn module_at(
    history: &ModuleHistory,
    components: &[ComponentPath],
    time_unix_ns: u64,
) -> ModuleView {
    let mut view = ModuleView::new(Some(history.structure.clone()), history.module.clone());
    let untouched = |path: &ComponentPath| {
        (path.clone(), FaultTransition::untouched(history.structure.clone(), path.clone(), 0))
    };
    let mut states: BTreeMap<ComponentPath, FaultTransition> =
        components.iter().map(untouched).collect();
    let mut is_connected = true;
    for entry in Journals::merge([history]).entries {
        if entry.time_unix_ns() > time_unix_ns {
            break;
        }
        match &entry {
            JournalEntry::Transition(transition) => {
                states.insert(transition.component.clone(), (*transition).clone());
            }
            JournalEntry::Identification(found) => {
                if let Some(state) = states.get_mut(&found.component) {
                    state.identification = Some(Box::new((*found).clone()));
                }
            }
            JournalEntry::Phase(change) => view.phase_change = Some((*change).clone()),
            JournalEntry::Observed(_, event) => {
                match event.news {
                    News::Presence { there, .. } => view.present = there,
                    News::Connection { connected } => is_connected = connected,
                    _ => {}
                }
                continue;
            }
        }
        view.present = true;
        view.heard_unix_ns = entry.time_unix_ns();
    }
    view.is_cut_off = !is_connected;
    view.is_silent = !view.present || !is_connected;
    view.components = states.into_values().collect();
    view.doubt();
    view
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;
    use crate::view::ObservedEvent;
    use vocabulary::{GivenOrder, GivenOrderKind, PhaseChange, Verdict};

    const SECOND: u64 = 1_000_000_000;

    fn path(name: &str) -> ComponentPath {
        name.parse().unwrap()
    }

    fn at(second: u64, sequence: u64, verdict: Verdict, by: Option<&str>) -> News {
        let order = by.map(|person| GivenOrder {
            kind: GivenOrderKind::Acknowledge,
            by: "web".to_owned(),
            on_behalf_of: Some(person.to_owned()),
            note: None,
        });
        let untouched = FaultTransition::untouched(
            "tower".parse().unwrap(),
            path("m1/sensor/g1"),
            second * SECOND,
        );
        News::Fault(Box::new(FaultTransition { sequence, verdict, order, ..untouched }))
    }

    fn phase(second: u64, phase: ModulePhase) -> News {
        let change = testing::phase_change(phase, second * SECOND);
        let module = "m1".parse().unwrap();
        News::Phase(PhaseChange { module, number: second, ..change })
    }

    fn presence(there: bool) -> News {
        let (structure, who) = ("tower".parse().unwrap(), "m1".to_owned());
        News::Presence { structure, who, there, at_start: false }
    }

    fn heard(events: Vec<(u64, News)>) -> ModuleHistory {
        let numbered = (1..).zip(events).map(|(number, (second, news))| ObservedEvent {
            number,
            time_unix_ns: second * SECOND,
            news,
        });
        let (structure, module) = ("tower".parse().unwrap(), "m1".parse().unwrap());
        ModuleHistory::heard(&structure, &module, numbered)
    }

    fn components() -> [ComponentPath; 2] {
        ["m1/sensor/g1", "m1/sensor/g2"].map(path)
    }

    fn report(events: Vec<(u64, News)>, (from, until): (u64, u64)) -> PeriodReport {
        PeriodReport::of(&heard(events), components(), (from * SECOND, until * SECOND))
    }

    #[test]
    fn each_second_of_a_period_is_healthy_faulty_or_unknown_and_a_gap_says_why() {
        let report = report(
            vec![
                (10, phase(10, ModulePhase::InService)),
                (30, at(30, 1, Verdict::Latched, None)),
                (45, at(45, 2, Verdict::Acknowledged, Some("Ada"))),
                (60, at(60, 3, Verdict::Normal, None)),
                (70, presence(false)),
                (75, presence(true)),
                (75, phase(75, ModulePhase::InService)),
                (80, News::Connection { connected: false }),
                (90, News::Connection { connected: true }),
            ],
            (20, 100),
        );
        let times = |healthy, faulty, unknown| Times {
            healthy_ns: healthy * SECOND,
            faulty_ns: faulty * SECOND,
            unknown_ns: unknown * SECOND,
        };
        let expected =
            [(path("m1/sensor/g1"), times(35, 30, 15)), (path("m1/sensor/g2"), times(65, 0, 15))];
        assert_eq!(report.components, expected);
        assert_eq!(report.components[0].1.availability(), 35.0 / 80.0);
        let gaps: Vec<_> = report.gaps.iter().map(|(a, b, _)| (a / SECOND, b / SECOND)).collect();
        assert_eq!(gaps, [(70, 75), (80, 90)]);
        let [fault] = &report.faults[..] else { panic!("{:?}", report.faults) };
        assert_eq!(fault.acknowledged_after_ns(), Some(15 * SECOND));
        assert_eq!(fault.acknowledged.as_ref().unwrap().1, "Ada");
        assert_eq!(fault.ended_unix_ns, Some(60 * SECOND));
    }

    #[test]
    fn of_a_module_that_was_not_heard_nothing_is_called_healthy() {
        let report = report(Vec::new(), (20, 100));
        assert!(report.components.iter().all(|(_, times)| times.unknown_ns == 80 * SECOND));
        assert_eq!(report.gaps.len(), 1);
    }

    #[test]
    fn a_fault_that_ended_before_the_period_is_not_in_it_and_one_that_lasts_is() {
        let events = || {
            vec![
                (10, phase(10, ModulePhase::InService)),
                (30, at(30, 1, Verdict::Latched, None)),
                (60, at(60, 2, Verdict::Normal, None)),
            ]
        };
        assert_eq!(report(events(), (70, 100)).faults, []);
        assert_eq!(report(events(), (50, 100)).faults.len(), 1);
        assert_eq!(report(events()[..2].to_vec(), (50, 100)).faults[0].ended_unix_ns, None);
    }

    #[test]
    fn a_scene_of_the_past_is_what_was_known_then() {
        use FaultState::{Latched, Normal, Unknown};
        let events = vec![
            (10, phase(10, ModulePhase::InService)),
            (30, at(30, 1, Verdict::Latched, None)),
            (60, at(60, 2, Verdict::Normal, None)),
            (70, presence(false)),
        ];
        let (history, components) = (heard(events), components());
        let states = |second: u64| -> Vec<FaultState> {
            let scene = scene_at([(&history, &components[..])], second * SECOND);
            scene.components().map(FaultTransition::state).collect()
        };
        assert_eq!(states(5), [Unknown, Unknown], "nothing was heard yet");
        assert_eq!(states(20), [Normal, Normal]);
        assert_eq!(states(31), [Latched, Normal]);
        assert_eq!(states(61), [Normal, Normal]);
        assert_eq!(states(71), [Unknown, Unknown], "its diagnoser was gone");
    }
}
