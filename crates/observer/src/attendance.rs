//! Every module there is or should be, with its latest status and phase. A missing
//! module stays on the list: silence is never taken for health.

use std::collections::BTreeSet;
use std::time::Duration;

use names::{ModuleName, StructureName};
use tokio::sync::mpsc::{UnboundedSender, unbounded_channel};
use tokio::time::{Instant, timeout_at};
use wire::keys::Watched;
use wire::{DecodeError, Key, Message, ModulePhase, ModuleStatus, PhaseChange, Topic};
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::sample::{Sample, SampleKind};

use super::presence::AttendanceError;

/// A status comes once a second; how long after the first message one may take.
const STATUS_WITHIN: Duration = Duration::from_millis(1300);
/// How long after the first message modules are waited for that no other names.
const OTHERS_WITHIN: Duration = Duration::from_millis(200);
/// Complaints about unreadable messages that are kept.
const COMPLAINTS: usize = 20;

/// What is known of a module.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// The structure; `None` if the module was only expected and it is not clear where.
    pub structure: Option<StructureName>,
    /// The module.
    pub module: ModuleName,
    /// Whether its liveliness token is there.
    pub present: bool,
    /// Its latest status.
    pub status: Option<ModuleStatus>,
    /// Its latest change of phase.
    pub phase_change: Option<PhaseChange>,
    /// Whether the caller expects it.
    pub expected: bool,
    /// Modules that name it as their peer.
    pub peer_of: BTreeSet<ModuleName>,
}

impl Member {
    pub(super) fn new(structure: Option<StructureName>, module: ModuleName) -> Self {
        Self {
            structure,
            module,
            present: false,
            status: None,
            phase_change: None,
            expected: false,
            peer_of: BTreeSet::new(),
        }
    }

    /// Its phase, by whichever message is the later one.
    #[must_use]
    pub fn phase(&self) -> Option<ModulePhase> {
        let reported = self.status.as_ref().map(|status| (status.time_unix_ns, status.phase));
        let changed = self.phase_change.as_ref().map(|change| (change.time_unix_ns, change.phase));
        reported.into_iter().chain(changed).max_by_key(|(time, _)| *time).map(|(_, phase)| phase)
    }
}

/// Who is there and who should be.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attendance {
    /// The modules, by structure and name.
    pub members: Vec<Member>,
    /// What is wrong with messages that could not be read, each with its key.
    pub unreadable: Vec<String>,
}

/// Something heard of a module.
#[derive(Debug)]
enum Sign {
    Token { structure: StructureName, module: ModuleName, there: bool },
    Status(Box<ModuleStatus>),
    Phase(PhaseChange),
    Unreadable(String),
}

/// Collects the modules of one structure, or of all. `expected` are modules that should be there; so are
/// those that another module names as its peer.
///
/// Returns as soon as every known module has sent its status, and soon after a second from the first
/// message at the latest; in no case later than after `timeout`.
///
/// # Errors
/// The network refuses.
pub async fn attendance(
    session: &Session,
    structure: Option<&StructureName>,
    expected: &[ModuleName],
    timeout: Duration,
) -> Result<Attendance, AttendanceError> {
    let refused = |error: zenoh::Error| AttendanceError::Network(error.to_string());
    let watched = Watched { structure, module: None };
    // Memory is bounded all the same: it ends within a few seconds.
    let (outbox, mut inbox) = unbounded_channel();
    let _tokens = session
        .liveliness()
        .declare_subscriber(watched.tokens())
        .history(true)
        .callback(hand_to(outbox.clone()))
        .await
        .map_err(refused)?;
    let _statuses = session
        .declare_subscriber(watched.statuses())
        .callback(hand_to(outbox.clone()))
        .await
        .map_err(refused)?;
    let _phases = session
        .declare_subscriber(watched.phases())
        .callback(hand_to(outbox.clone()))
        .await
        .map_err(refused)?;
    let hand = hand_to(outbox);
    session
        .get(watched.phases())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .callback(move |reply: Reply| reply.into_result().into_iter().for_each(&hand))
        .await
        .map_err(refused)?;

    let mut collection = Collection::new(structure.cloned(), expected);
    let end = Instant::now() + timeout;
    let (mut until, mut first_sign) = (end, None);
    while let Ok(Some(sign)) = timeout_at(until, inbox.recv()).await {
        collection.take(sign);
        let since = *first_sign.get_or_insert_with(Instant::now);
        let hold = if collection.is_complete() { OTHERS_WITHIN } else { STATUS_WITHIN };
        until = end.min(since + hold);
    }
    Ok(collection.close())
}

/// Passes samples on. A callback must not wait, and this one does not.
fn hand_to(outbox: UnboundedSender<Sign>) -> impl Fn(Sample) + Send + Sync + 'static {
    move |sample| {
        if let Some(sign) = read(&sample) {
            // The receiver is gone when the collection is closed.
            let _ = outbox.send(sign);
        }
    }
}

/// Decodes a sample; `None` if it is not about a module, or about nothing of interest.
fn read(sample: &Sample) -> Option<Sign> {
    let key = sample.key_expr().as_str();
    let Ok(Key::Module { structure, module, topic }) = key.parse::<Key>() else { return None };
    let bytes = sample.payload().to_bytes();
    let sign = match topic {
        Topic::Alive => {
            let there = sample.kind() == SampleKind::Put;
            return Some(Sign::Token { structure, module, there });
        }
        Topic::Status => decode(&bytes, |status: ModuleStatus| {
            (status.structure == structure && status.module == module)
                .then(|| Sign::Status(Box::new(status)))
        }),
        Topic::Phase => decode(&bytes, |change: PhaseChange| {
            (change.structure == structure && change.module == module)
                .then_some(Sign::Phase(change))
        }),
        _ => return None,
    };
    Some(sign.unwrap_or_else(|problem| Sign::Unreadable(format!("{key}: {problem}"))))
}

fn decode<M: Message>(
    bytes: &[u8],
    accept: impl FnOnce(M) -> Option<Sign>,
) -> Result<Sign, String> {
    let message = wire::decode(bytes).map_err(|error: DecodeError| error.to_string())?;
    accept(message).ok_or_else(|| format!("the {} names another module than its key", M::WHAT))
}

/// The list while it grows.
#[derive(Debug, Default)]
struct Collection {
    structure: Option<StructureName>,
    expected: Vec<ModuleName>,
    list: Attendance,
}

impl Collection {
    fn new(structure: Option<StructureName>, expected: &[ModuleName]) -> Self {
        let expected = expected.to_vec();
        Self { structure, expected, list: Attendance::default() }
    }

    fn take(&mut self, sign: Sign) {
        match sign {
            Sign::Token { structure, module, there } => {
                self.member(&structure, &module).present = there;
            }
            Sign::Status(status) => self.status(*status),
            Sign::Phase(change) => {
                let member = self.member(&change.structure, &change.module);
                let latest = member.phase_change.as_ref().map_or(0, |c| c.time_unix_ns);
                if change.time_unix_ns >= latest {
                    member.phase_change = Some(change);
                }
            }
            Sign::Unreadable(text) => {
                if self.list.unreadable.len() < COMPLAINTS && !self.list.unreadable.contains(&text)
                {
                    self.list.unreadable.push(text);
                }
            }
        }
    }

    fn status(&mut self, status: ModuleStatus) {
        for peer in &status.peers {
            let named = self.member(&status.structure, &peer.module);
            named.peer_of.insert(status.module.clone());
        }
        let (structure, module) = (status.structure.clone(), status.module.clone());
        self.member(&structure, &module).status = Some(status);
    }

    fn member(&mut self, structure: &StructureName, module: &ModuleName) -> &mut Member {
        let members = &mut self.list.members;
        let known = members
            .iter()
            .position(|m| m.structure.as_ref() == Some(structure) && m.module == *module);
        let place = known.unwrap_or_else(|| {
            members.push(Member::new(Some(structure.clone()), module.clone()));
            members.len() - 1
        });
        &mut members[place]
    }

    /// Every known or expected module has sent its status.
    fn is_complete(&self) -> bool {
        let reported = |member: &Member| member.status.is_some();
        let all_seen = self
            .expected
            .iter()
            .all(|module| self.list.members.iter().any(|member| member.module == *module));
        all_seen && !self.list.members.is_empty() && self.list.members.iter().all(reported)
    }

    fn close(mut self) -> Attendance {
        let structures: BTreeSet<StructureName> =
            self.list.members.iter().filter_map(|member| member.structure.clone()).collect();
        let only = if structures.len() == 1 { structures.first().cloned() } else { None };
        let home = self.structure.or(only);
        for module in self.expected {
            let mut known = false;
            for member in self.list.members.iter_mut().filter(|m| m.module == module) {
                (member.expected, known) = (true, true);
            }
            if !known {
                let mut missing = Member::new(home.clone(), module);
                missing.expected = true;
                self.list.members.push(missing);
            }
        }
        self.list.members.sort_by(|a, b| (&a.structure, &a.module).cmp(&(&b.structure, &b.module)));
        self.list
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    fn name(text: &str) -> ModuleName {
        text.parse().unwrap()
    }

    fn status(module: &str, peers: &[&str]) -> Sign {
        Sign::Status(Box::new(testing::status(module, peers)))
    }

    fn token(module: &str, there: bool) -> Sign {
        Sign::Token { structure: "tower".parse().unwrap(), module: name(module), there }
    }

    fn phase(module: &str, phase: ModulePhase, time_unix_ns: u64) -> Sign {
        Sign::Phase(PhaseChange {
            structure: "tower".parse().unwrap(),
            module: name(module),
            phase,
            before: None,
            run: None,
            step: None,
            reason: String::new(),
            time_unix_ns,
        })
    }

    #[test]
    fn it_is_complete_when_every_known_module_has_sent_its_status() {
        let mut collection = Collection::new(None, &[name("m1")]);
        assert!(!collection.is_complete());
        collection.take(token("m1", true));
        assert!(!collection.is_complete());
        collection.take(status("m1", &["m2"]));
        assert!(!collection.is_complete(), "a peer was named");
        collection.take(status("m2", &["m1"]));
        assert!(collection.is_complete());
        let mut collection = Collection::new(None, &[name("m1"), name("m9")]);
        collection.take(status("m1", &[]));
        assert!(!collection.is_complete(), "m9 is expected");
    }

    #[test]
    fn an_expected_module_stays_on_the_list() {
        let mut collection = Collection::new(None, &[name("m9")]);
        collection.take(status("m1", &["m2"]));
        let list = collection.close();
        let names: Vec<&str> = list.members.iter().map(|member| member.module.as_str()).collect();
        assert_eq!(names, ["m1", "m2", "m9"]);
        assert!(list.members[1].peer_of.contains(&name("m1")) && !list.members[1].present);
        assert!(list.members[2].expected && list.members[2].structure.is_some());
    }

    #[test]
    fn the_later_message_on_the_phase_counts_and_a_token_can_go() {
        let mut collection = Collection::new(None, &[]);
        collection.take(token("m1", true));
        collection.take(phase("m1", ModulePhase::Waiting, 3));
        collection.take(status("m1", &[]));
        collection.take(phase("m1", ModulePhase::Initialising, 2));
        collection.take(token("m1", false));
        let member = collection.close().members.remove(0);
        assert_eq!(member.phase(), Some(ModulePhase::InService));
        assert!(!member.present);
        let mut collection = Collection::new(None, &[]);
        collection.take(status("m1", &[]));
        collection.take(phase("m1", ModulePhase::Stale, 7));
        assert_eq!(collection.close().members[0].phase(), Some(ModulePhase::Stale));
    }
}
