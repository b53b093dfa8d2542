//! The present picture of a whole structure: every module there is or should be, and the state of every
//! component of those that answer.

use std::collections::BTreeSet;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use names::{ComponentPath, ModuleName, StructureName};
use wire::keys::Watched;
use wire::{FaultState, FaultTransition, Key, ModulePhase, Shelving, Topic, Unknown};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::session::ZenohId;

use super::attendance::{Attendance, Member, attendance};
use super::presence::AttendanceError;
use super::request::{QueryError, read};

/// A module and its components.
#[derive(Debug, Clone, PartialEq)]
pub struct ModulePicture {
    /// The module.
    pub member: Member,
    /// The latest transition of each of its components; empty if it does not answer.
    pub components: Vec<FaultTransition>,
    /// The processes that answered: one, unless several run as this module.
    pub processes: BTreeSet<ZenohId>,
}

impl ModulePicture {
    /// Of a module none of whose components is known.
    #[must_use]
    pub fn of(member: Member) -> Self {
        Self { member, components: Vec::new(), processes: BTreeSet::new() }
    }

    /// Whether it reported the state of its components. If not, nothing is known of them.
    #[must_use]
    pub fn answers(&self) -> bool {
        !self.components.is_empty()
    }

    /// Whether several processes run as this module: several answered, or one of them knows of another.
    #[must_use]
    pub fn has_several_processes(&self) -> bool {
        let knows_another = |status: &wire::ModuleStatus| status.another_process;
        self.processes.len() > 1 || self.member.status.as_ref().is_some_and(knows_another)
    }

    /// How many of its components are in this state.
    #[must_use]
    pub fn count(&self, state: FaultState) -> usize {
        self.components.iter().filter(|component| component.state() == state).count()
    }

    /// How many of its normal components agree with their reference.
    #[must_use]
    pub fn verified(&self) -> usize {
        let verified = |component: &&FaultTransition| {
            component.state() == FaultState::Normal && component.is_verified()
        };
        self.components.iter().filter(verified).count()
    }

    /// How many of its components have their alarm set aside.
    #[must_use]
    pub fn set_aside(&self) -> usize {
        self.components.iter().filter(|component| component.aside().is_some()).count()
    }

    /// How many of its components are in this state, and their alarm counts.
    #[must_use]
    pub fn alarms(&self, state: FaultState) -> usize {
        let counts = |component: &&FaultTransition| {
            component.state() == state && component.aside().is_none()
        };
        self.components.iter().filter(counts).count()
    }

    /// If the alarms of all its components are suppressed, since it is maintained: the suppression that ends first.
    #[must_use]
    pub fn suppression(&self) -> Option<&Shelving> {
        let suppressed = self.components.iter().map(|component| component.suppressed.as_ref());
        let suppressed: Option<Vec<&Shelving>> = suppressed.collect();
        suppressed?.into_iter().min_by_key(|shelving| shelving.until_unix_ns)
    }

    /// Since when and why it does not monitor its components, by what it reports of itself.
    fn lack(&self) -> Option<Unknown> {
        let phase = self.member.phase().filter(|phase| *phase != ModulePhase::InService)?;
        let change = self.member.phase_change.as_ref().filter(|change| change.phase == phase);
        let status = self.member.status.as_ref().map_or(0, |status| status.time_unix_ns);
        Some(Unknown {
            since_unix_ns: change.map_or(status, |change| change.time_unix_ns),
            reason: change
                .map_or_else(|| phase.as_str().to_owned(), |change| change.reason.clone()),
        })
    }

    /// Takes note of a message on the state of a component that cannot be read: whether it is normal is unknown until
    /// one that can follows.
    pub(super) fn unreadable(&mut self, state: &UnreadableState, now_unix_ns: u64) {
        let reason = format!("its state cannot be read: {}", state.problem);
        let unknown = Unknown { since_unix_ns: now_unix_ns, reason };
        match self.components.iter_mut().find(|known| known.component == state.component) {
            Some(known) => *known = known.clone().while_unknown(unknown),
            None => {
                let (structure, component) = (state.structure.clone(), state.component.clone());
                let untouched = FaultTransition::untouched(structure, component, now_unix_ns);
                self.components.push(untouched.while_unknown(unknown));
                self.components.sort_by(|a, b| a.component.cmp(&b.component));
            }
        }
    }

    /// No component is called normal as long as its module does not monitor it.
    pub(super) fn doubt(&mut self) {
        let lack = self.lack();
        for component in &mut self.components {
            if component.state() == FaultState::Normal
                && let Some(unknown) = lack.clone()
            {
                *component = component.clone().while_unknown(unknown);
            }
        }
    }
}

/// A message on the state of a component that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnreadableState {
    /// The structure.
    pub structure: StructureName,
    /// The component, as the key names it.
    pub component: ComponentPath,
    /// Why it cannot be read.
    pub problem: String,
}

impl UnreadableState {
    /// Of a message on this key, unless it is not one of a component's state.
    pub(crate) fn on(key: &str, problem: &str) -> Option<Self> {
        match key.parse() {
            Ok(Key::Module { structure, module, topic: Topic::Fault(component) }) => {
                let component = ComponentPath { module, component };
                Some(Self { structure, component, problem: problem.to_owned() })
            }
            _ => None,
        }
    }
}

/// What is known at present.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The modules, by structure and name.
    pub modules: Vec<ModulePicture>,
    /// Refusals, and what is wrong with messages that could not be read.
    pub problems: Vec<String>,
}

impl Picture {
    /// Whether any module sent anything.
    #[must_use]
    pub fn is_of_anybody(&self) -> bool {
        let alive = |m: &ModulePicture| {
            m.answers()
                || m.member.present
                || m.member.status.is_some()
                || m.member.phase_change.is_some()
        };
        self.modules.iter().any(alive)
    }

    fn of(list: Attendance) -> Self {
        let modules = list.members.into_iter().map(ModulePicture::of).collect();
        Self { modules, problems: list.unreadable }
    }

    /// Takes the state of a component. If two processes claim to be the same module, the one that is
    /// further counts, or whose journal began later.
    fn enter(&mut self, transition: FaultTransition, process: Option<ZenohId>) {
        let module = self.module(&transition.structure, &transition.module);
        module.processes.extend(process);
        match module.components.iter_mut().find(|known| known.component == transition.component) {
            Some(known) if known.place() >= transition.place() => {}
            Some(known) => *known = transition,
            None => module.components.push(transition),
        }
    }

    fn module(&mut self, structure: &StructureName, module: &ModuleName) -> &mut ModulePicture {
        let known = self.modules.iter().position(|m| {
            m.member.structure.as_ref() == Some(structure) && m.member.module == *module
        });
        let place = known.unwrap_or_else(|| {
            let member = Member::new(Some(structure.clone()), module.clone());
            self.modules.push(ModulePicture::of(member));
            self.modules.len() - 1
        });
        &mut self.modules[place]
    }

    fn doubt(&mut self) {
        self.modules.iter_mut().for_each(ModulePicture::doubt);
    }

    fn sort(&mut self) {
        let place = |m: &ModulePicture| (m.member.structure.clone(), m.member.module.clone());
        self.modules.sort_by_key(place);
        for module in &mut self.modules {
            module.components.sort_by(|a, b| a.component.cmp(&b.component));
        }
    }
}

/// Looks at a structure, or at all of them: collects the modules, then queries the state of every component.
/// Modules that do not answer within `timeout` are in the picture all the same.
///
/// # Errors
/// The network refuses.
pub async fn present(
    session: &Session,
    structure: Option<&StructureName>,
    expected: &[ModuleName],
    timeout: Duration,
) -> Result<Picture, AttendanceError> {
    let mut picture = Picture::of(attendance(session, structure, expected, timeout).await?);
    for state in states(session, structure, timeout).await? {
        match state {
            StateReply::State(transition, process) => picture.enter(*transition, process),
            StateReply::Unreadable(state) => {
                let module = picture.module(&state.structure, &state.component.module);
                module.unreadable(&state, unix_ns());
            }
            StateReply::Problem(error) => picture.problems.push(error.to_string()),
        }
    }
    picture.doubt();
    picture.sort();
    Ok(picture)
}

/// A reply of a module on the state of a component.
#[derive(Debug)]
pub(super) enum StateReply {
    /// The state, and the process that replied.
    State(Box<FaultTransition>, Option<ZenohId>),
    /// It cannot be read.
    Unreadable(UnreadableState),
    /// Anything else that is wrong with it.
    Problem(QueryError),
}

/// Queries the state of every component. Who does not answer is left out.
///
/// # Errors
/// The network refuses.
pub(super) async fn states(
    session: &Session,
    structure: Option<&StructureName>,
    timeout: Duration,
) -> Result<Vec<StateReply>, AttendanceError> {
    let replies = session
        .get(Watched { structure, module: None }.faults())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .await
        .map_err(|error| AttendanceError::Network(error.to_string()))?;
    let mut states = Vec::new();
    while let Ok(reply) = replies.recv_async().await {
        match state_in(&reply, timeout) {
            Ok(transition) => {
                let process = reply.replier_id().map(|replier| replier.zid());
                states.push(StateReply::State(Box::new(transition), process));
            }
            Err(QueryError::Unanswered(_)) => {}
            Err(error) => {
                let key = reply.result().map_or("", |sample| sample.key_expr().as_str());
                let unreadable = UnreadableState::on(key, &error.to_string());
                states.push(unreadable.map_or(StateReply::Problem(error), StateReply::Unreadable));
            }
        }
    }
    Ok(states)
}

/// The state in a reply, if it came on the key of the component that it is about.
fn state_in(reply: &Reply, timeout: Duration) -> Result<FaultTransition, QueryError> {
    let transition: FaultTransition = read(reply, timeout)?;
    let Ok(sample) = reply.result() else { return Err(QueryError::Unanswered(timeout)) };
    let ComponentPath { module, component } = transition.component.clone();
    let topic = Topic::Fault(component);
    let key = Key::of_module(&transition.structure, &transition.module, topic).to_string();
    if module != transition.module || sample.key_expr().as_str() != key {
        let (component, key) = (&transition.component, sample.key_expr());
        return Err(QueryError::Senseless(format!("a state of `{component}` came on `{key}`")));
    }
    Ok(transition)
}

pub(super) fn unix_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn transition(incarnation: u64, sequence: u64) -> FaultTransition {
        let component = "m1/sensor/g1".parse().unwrap();
        let untouched = FaultTransition::untouched("t".parse().unwrap(), component, 5);
        FaultTransition { incarnation, sequence, ..untouched }
    }

    #[test]
    fn the_later_of_two_transitions_counts_and_a_wiped_state_is_later_than_any_before() {
        let mut picture = Picture::default();
        let mut present = |incarnation, sequence| {
            picture.enter(transition(incarnation, sequence), None);
            picture.modules[0].components[0].place()
        };
        assert_eq!(present(7, 7), (7, 7));
        assert_eq!(present(7, 6), (7, 7));
        assert_eq!(present(100, 2), (100, 2));
        assert_eq!(present(7, 8), (100, 2));
        assert_eq!(present(200, 0), (200, 0));
    }
}
