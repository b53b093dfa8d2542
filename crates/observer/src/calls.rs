//! Notifications of incidents: what is sent to whom, and when; to each recipient once and in order.
//!
//! A plain value: scenes, times and acknowledged deliveries go in, notifications come out. It is serialised as a whole, so
//! that a restarted process continues where it stopped. A notification is sent when an incident opens, when it is not
//! acknowledged in time, and when it is resolved. Acknowledged, shelved and suppressed incidents are silent.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde::{Deserialize, Serialize};
use vocabulary::words::printable;
use vocabulary::{ComponentPath, FaultState, ModuleName, StructureName};

use crate::{
    ModuleView, NetworkState, Scene, ShownCertificate, StateRow, Urgency, alarms,
    known_identification,
};

const SECOND_NS: u64 = 1_000_000_000;
/// For how long a fault's kind is waited for \[ns\].
const KIND_WITHIN_NS: u64 = SECOND_NS;
/// For how long anything but a fault must last before it is called \[ns\].
const LASTING_NS: u64 = 10 * SECOND_NS;
/// Most calls that wait for one recipient. Beyond them the oldest are dropped, and counted.
const MOST_PENDING: usize = 10_000;
/// Name of the incident that nothing is heard.
const MONITORING: &str = "monitoring";
/// What the keys of certificates that are not a module's begin with.
const CERTIFICATE: &str = "certificate of ";
/// What to do about a certificate that expires.
const RENEW: &str = "renew it: trusswatch pki renew";

/// How grave an incident is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// A fault, or nothing is diagnosed.
    Critical,
    /// A possible fault, or verdicts are unreliable.
    Warning,
}

impl Severity {
    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Critical => "critical",
            Self::Warning => "warning",
        }
    }
}

/// What people are told of an incident.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CalledIncident {
    /// Its number: of a fault the same in every view and message.
    pub id: String,
    /// How grave it is.
    pub severity: Severity,
    /// The structure, if known.
    pub structure: Option<StructureName>,
    /// The module; `None` if nothing is heard, and of certificates of other processes.
    pub module: Option<ModuleName>,
    /// The component; `None` if it is about a module.
    pub component: Option<ComponentPath>,
    /// The component, the module, the holder of a certificate, or `monitoring`.
    pub name: String,
    /// Its state in words.
    pub state: String,
    /// The kind and size of the fault; of a module what is unknown of it. May be empty.
    pub kind: String,
    /// Its effects and what cannot be compared since then; may be empty.
    pub extent: String,
    /// The reason; may be empty.
    pub why: String,
    /// Since when \[ns since 1970\].
    pub since_unix_ns: u64,
}

impl CalledIncident {
    /// In one line: `module1/sensor/g2: bias of +45.1 µm`.
    #[must_use]
    pub fn title(&self) -> String {
        let what = if self.kind.is_empty() { &self.state } else { &self.kind };
        printable(&format!("{}: {what}", self.name))
    }
}

/// Why there is a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Occasion {
    /// It began.
    Opened,
    /// Nobody acknowledged it in time.
    Escalated,
    /// It was acknowledged, shelved or suppressed. Only systems that call people themselves are told.
    Quieted,
    /// It is shelved or suppressed no more.
    Returned,
    /// The fault was reset, or the module answers again.
    Resolved,
}

impl Occasion {
    /// The name in messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Opened => "opened",
            Self::Escalated => "escalated",
            Self::Quieted => "quieted",
            Self::Returned => "returned",
            Self::Resolved => "resolved",
        }
    }
}

/// Something to be told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Call {
    /// Counts the calls from 1.
    pub number: u64,
    /// Why.
    pub occasion: Occasion,
    /// Of what.
    pub incident: CalledIncident,
    /// When that was so \[ns since 1970\].
    pub time_unix_ns: u64,
}

/// An incident that lasts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OpenIncident {
    /// As it was last seen.
    pub incident: CalledIncident,
    seen_unix_ns: u64,
    /// When it was called, if it was.
    called_unix_ns: Option<u64>,
    is_escalated: bool,
    is_identified: bool,
    /// Whether it is acknowledged, shelved or suppressed.
    pub is_quiet: bool,
}

impl OpenIncident {
    /// Whether people were told of it.
    #[must_use]
    pub fn is_called(&self) -> bool {
        self.called_unix_ns.is_some()
    }
}

/// What is open and what waits for whom.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Calls {
    /// The number of the latest call.
    number: u64,
    /// By what they are about, so that an incident of a module keeps its number while it lasts.
    open: BTreeMap<String, OpenIncident>,
    pending: BTreeMap<String, VecDeque<Call>>,
    dropped: u64,
    /// Grows with each change that a restart must know of; what is merely shown of an incident changes more often.
    #[serde(skip)]
    revision: u64,
}

impl Calls {
    /// Those who are told from now on. What waits for others is dropped, and they are returned.
    pub fn tell(&mut self, recipients: &[String]) -> Vec<String> {
        let known: BTreeSet<&String> = recipients.iter().collect();
        let gone: Vec<String> =
            self.pending.keys().filter(|name| !known.contains(name)).cloned().collect();
        self.pending.retain(|name, _| known.contains(name));
        for recipient in recipients {
            self.pending.entry(recipient.clone()).or_default();
        }
        gone
    }

    /// The next call for a recipient.
    #[must_use]
    pub fn next(&self, recipient: &str) -> Option<&Call> {
        self.pending.get(recipient)?.front()
    }

    /// A recipient was told.
    pub fn delivered(&mut self, recipient: &str, number: u64) {
        self.revision += 1;
        if let Some(calls) = self.pending.get_mut(recipient) {
            calls.retain(|call| call.number != number);
        }
    }

    /// How many calls wait for a recipient.
    #[must_use]
    pub fn waiting(&self, recipient: &str) -> usize {
        self.pending.get(recipient).map_or(0, VecDeque::len)
    }

    /// How many calls were dropped because too many waited.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// A number that grows with each change that has to be saved.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The incidents that last.
    pub fn open(&self) -> impl Iterator<Item = &OpenIncident> {
        self.open.values()
    }

    /// Takes a scene. `escalate_after_ns`: after which time without an acknowledgement a fault is called again. Returns
    /// whether there are new calls.
    pub fn observe(&mut self, scene: &Scene, now: u64, escalate_after_ns: Option<u64>) -> bool {
        let before = self.number;
        let is_heard = scene.network == NetworkState::Open && scene.has_heard_a_module();
        if is_heard {
            self.resolve(MONITORING, now);
            self.observe_modules(scene, now);
        } else {
            self.see(MONITORING.to_owned(), monitoring(scene, now), (false, false), now);
        }
        let keys: Vec<String> = self.open.keys().cloned().collect();
        for key in keys {
            self.call_if_due(&key, now, escalate_after_ns);
        }
        self.number > before
    }

    /// Takes the certificates of processes that are no modules: people are told when they expire soon. Call it before
    /// [`Calls::observe`]. Returns whether there are new calls.
    pub fn observe_certificates(&mut self, shown: &[ShownCertificate], now: u64) -> bool {
        let before = self.number;
        let mut present = BTreeSet::new();
        for certificate in shown {
            let Some(words) = certificate.expiring(now / SECOND_NS) else { continue };
            let key = format!("{CERTIFICATE}{}", certificate.name);
            present.insert(key.clone());
            let incident = expiring(certificate, None, format!("certificate {words}"), now);
            self.see(key, incident, (false, false), now);
        }
        let renewed = |key: &&String| key.starts_with(CERTIFICATE) && !present.contains(*key);
        let renewed: Vec<String> = self.open.keys().filter(renewed).cloned().collect();
        for key in renewed {
            self.resolve(&key, now);
        }
        self.number > before
    }

    fn observe_modules(&mut self, scene: &Scene, now: u64) {
        let mut present = BTreeSet::new();
        for row in alarms(&scene.modules) {
            let Some((key, severity, is_quiet)) = called(&row) else { continue };
            let id = row.incident.clone().unwrap_or_else(|| format!("{key}@{}", now / 1_000_000));
            let extent = row.extent();
            let state = row
                .component
                .as_ref()
                .and_then(|path| scene.component(row.structure.as_ref(), path));
            let is_identified =
                state.and_then(known_identification).is_some_and(|found| found.decided);
            let incident = CalledIncident {
                id,
                severity,
                name: row.name(),
                structure: row.structure,
                module: Some(row.module),
                component: row.component,
                state: row.state,
                kind: row.kind,
                extent,
                why: row.why,
                since_unix_ns: row.since_unix_ns.unwrap_or(now),
            };
            present.insert(key.clone());
            self.see(key, incident, (is_quiet, is_identified), now);
        }
        for module in &scene.modules {
            let Some(words) = module.expiring_certificate() else { continue };
            let key = format!("{} certificate", module_name(module));
            let until = module.status.as_ref().and_then(|status| status.certificate_until_unix_s);
            let shown = ShownCertificate {
                name: module_name(module),
                until_unix_s: until.unwrap_or_default(),
            };
            present.insert(key.clone());
            self.see(key, expiring(&shown, Some(module), words, now), (false, false), now);
        }
        let over = |(key, open): (&String, &OpenIncident)| {
            let is_over = !present.contains(key) && is_over(scene, &open.incident);
            is_over.then(|| key.clone())
        };
        let over: Vec<String> = self.open.iter().filter_map(over).collect();
        for key in over {
            self.resolve(&key, now);
        }
    }

    fn see(
        &mut self,
        key: String,
        incident: CalledIncident,
        (is_quiet, is_identified): (bool, bool),
        now: u64,
    ) {
        let is_fault = |incident: &CalledIncident| incident.component.is_some();
        if let Some(known) = self.open.get(&key)
            && is_fault(&known.incident)
            && known.incident.id != incident.id
        {
            // A possible fault has become a certain one, or another fault is there.
            self.resolve(&key, now);
        }
        let Some(known) = self.open.get_mut(&key) else {
            let open = OpenIncident {
                incident,
                seen_unix_ns: now,
                called_unix_ns: None,
                is_escalated: false,
                is_identified,
                is_quiet,
            };
            self.open.insert(key, open);
            self.revision += 1;
            return;
        };
        let (id, since_unix_ns) = (known.incident.id.clone(), known.incident.since_unix_ns);
        known.incident = CalledIncident { id, since_unix_ns, ..incident };
        known.is_identified |= is_identified;
        let was_quiet = std::mem::replace(&mut known.is_quiet, is_quiet);
        self.revision += u64::from(was_quiet != is_quiet);
        if known.called_unix_ns.is_none() || was_quiet == is_quiet {
            return;
        }
        known.is_escalated = false;
        known.called_unix_ns = Some(now);
        let incident = known.incident.clone();
        let occasion = if is_quiet { Occasion::Quieted } else { Occasion::Returned };
        self.call(occasion, incident, now);
    }

    fn call_if_due(&mut self, key: &str, now: u64, escalate_after_ns: Option<u64>) {
        let Some(open) = self.open.get_mut(key).filter(|open| !open.is_quiet) else { return };
        let lasts_ns = now.saturating_sub(open.seen_unix_ns);
        let is_fault =
            open.incident.component.is_some() && open.incident.severity == Severity::Critical;
        let occasion = match open.called_unix_ns {
            None if is_fault && (open.is_identified || lasts_ns >= KIND_WITHIN_NS) => {
                Occasion::Opened
            }
            None if lasts_ns >= LASTING_NS => Occasion::Opened,
            Some(called)
                if !open.is_escalated
                    && escalate_after_ns
                        .is_some_and(|after| now.saturating_sub(called) >= after) =>
            {
                Occasion::Escalated
            }
            _ => return,
        };
        open.is_escalated = occasion == Occasion::Escalated;
        open.called_unix_ns.get_or_insert(now);
        let incident = open.incident.clone();
        self.call(occasion, incident, now);
    }

    fn resolve(&mut self, key: &str, now: u64) {
        let Some(open) = self.open.remove(key) else { return };
        self.revision += 1;
        let is_fault =
            open.incident.component.is_some() && open.incident.severity == Severity::Critical;
        if open.called_unix_ns.is_none() {
            if !is_fault || open.is_quiet {
                return;
            }
            // A fault is told of, however short it was.
            self.call(Occasion::Opened, open.incident.clone(), now);
        }
        self.call(Occasion::Resolved, open.incident, now);
    }

    fn call(&mut self, occasion: Occasion, incident: CalledIncident, time_unix_ns: u64) {
        self.number += 1;
        self.revision += 1;
        let call = Call { number: self.number, occasion, incident, time_unix_ns };
        for calls in self.pending.values_mut() {
            if calls.len() >= MOST_PENDING {
                calls.pop_front();
                self.dropped += 1;
            }
            calls.push_back(call.clone());
        }
    }
}

/// Whether people are called because of a row: its key, how grave it is, and whether it is quiet.
fn called(row: &StateRow) -> Option<(String, Severity, bool)> {
    let structure = row.structure.as_ref().map_or("?", StructureName::as_str);
    let key = format!("{structure}/{}", row.name());
    let is_fault = row.incident.is_some();
    match row.urgency {
        Urgency::Latched => Some((key, Severity::Critical, false)),
        Urgency::Acknowledged => Some((key, Severity::Critical, true)),
        Urgency::SetAside if is_fault => Some((key, Severity::Critical, true)),
        Urgency::Unconfirmed => Some((key, Severity::Warning, false)),
        Urgency::Unreliable => {
            let is_diagnosing = row.groups.is_empty() && row.kind.is_empty();
            let severity = if is_diagnosing { Severity::Warning } else { Severity::Critical };
            Some((key, severity, false))
        }
        _ => None,
    }
}

/// A module with its structure.
fn module_name(module: &ModuleView) -> String {
    let structure = module.structure.as_ref().map_or("?", StructureName::as_str);
    format!("{structure}/{}", module.module)
}

/// Whether an incident is known to be over: what is not known at present is not over.
fn is_over(scene: &Scene, incident: &CalledIncident) -> bool {
    // These have functions of their own.
    let Some(module) = &incident.module else { return false };
    let Some(view) = scene.module(incident.structure.as_ref(), module) else { return false };
    let Some(component) = &incident.component else { return view.answers() };
    if !view.is_in_service() {
        return false;
    }
    view.components.iter().find(|state| state.component == *component).is_some_and(|state| {
        let is_told = state.unknown.is_none() || state.state() != FaultState::Unknown;
        // What is normal but for its comparison is not a fault any more.
        let is_compared = state.condition.is_some();
        !state.state().is_fault() && (is_told || is_compared)
    })
}

/// A certificate expires soon: of a module, or of another process.
fn expiring(
    shown: &ShownCertificate,
    module: Option<&ModuleView>,
    words: String,
    now: u64,
) -> CalledIncident {
    CalledIncident {
        id: format!("{}@certificate-{}", shown.name, shown.until_unix_s),
        severity: Severity::Warning,
        structure: module.and_then(|module| module.structure.clone()),
        module: module.map(|module| module.module.clone()),
        component: None,
        name: module.map_or_else(|| shown.name.clone(), |module| module.module.to_string()),
        state: words,
        kind: String::new(),
        extent: String::new(),
        why: RENEW.to_owned(),
        since_unix_ns: now,
    }
}

/// Nothing is heard.
fn monitoring(scene: &Scene, now: u64) -> CalledIncident {
    let (why, since_unix_ns) = match &scene.network {
        NetworkState::Open => ("no module is heard".to_owned(), now),
        NetworkState::CutOff(since) => ("no entry point answers".to_owned(), *since),
        NetworkState::Opening => ("no entry point has answered yet".to_owned(), now),
        NetworkState::Failed(reason) => (printable(reason), now),
        NetworkState::Closed => ("the session has ended".to_owned(), now),
    };
    CalledIncident {
        id: format!("{MONITORING}@{}", now / 1_000_000),
        severity: Severity::Critical,
        structure: None,
        module: None,
        component: None,
        name: MONITORING.to_owned(),
        state: "nothing is heard".to_owned(),
        kind: String::new(),
        extent: String::new(),
        why,
        since_unix_ns,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{identification, module, mute, scene, shelved, state};
    use vocabulary::{FaultTransition, ModulePhase, RunId, Step, Unknown, Verdict};

    const AFTER: Option<u64> = Some(600 * SECOND_NS);
    const ALL: [&str; 2] = ["mail", "hook"];

    fn calls() -> Calls {
        let mut calls = Calls::default();
        calls.tell(&ALL.map(str::to_owned));
        calls
    }

    fn component(verdict: FaultState) -> FaultTransition {
        FaultTransition {
            run: Some(RunId(4)),
            detection_step: Some(Step(17)),
            ..state("m1/sensor/g2", verdict)
        }
    }

    fn with(component: FaultTransition) -> Scene {
        scene(vec![module("m1", ModulePhase::InService, vec![component])])
    }

    fn identified(verdict: FaultState) -> FaultTransition {
        let identification = Some(Box::new(identification(true, &["bias"])));
        FaultTransition { identification, ..component(verdict) }
    }

    /// Takes everything that waits.
    fn told(calls: &mut Calls) -> Vec<(Occasion, String)> {
        let mut told = Vec::new();
        while let Some(call) = calls.next("mail").cloned() {
            calls.delivered("mail", call.number);
            told.push((call.occasion, call.incident.title()));
        }
        told
    }

    #[test]
    fn a_fault_is_told_once_with_its_kind_and_again_when_it_is_over() {
        let mut calls = calls();
        assert!(
            !calls.observe(&with(component(FaultState::Latched)), 0, AFTER),
            "its kind is waited for"
        );
        assert!(calls.observe(&with(identified(FaultState::Latched)), SECOND_NS / 5, AFTER));
        for second in 1..500 {
            assert!(!calls.observe(
                &with(identified(FaultState::Latched)),
                second * SECOND_NS,
                AFTER
            ));
        }
        let later = 500 * SECOND_NS;
        assert!(calls.observe(&with(identified(FaultState::Acknowledged)), later, AFTER));
        assert!(!calls.observe(&with(identified(FaultState::Acknowledged)), 10 * later, AFTER));
        assert!(calls.observe(&with(component(FaultState::Normal)), 11 * later, AFTER));
        let title = "m1/sensor/g2: bias: 98.7 %".to_owned();
        let occasions: Vec<Occasion> =
            told(&mut calls).into_iter().map(|(occasion, _)| occasion).collect();
        assert_eq!(occasions, [Occasion::Opened, Occasion::Quieted, Occasion::Resolved], "{title}");
        assert_eq!((calls.waiting("mail"), calls.waiting("hook")), (0, 3));
        let id = |call: &Call| call.incident.id.clone();
        assert_eq!(
            calls.pending["hook"].iter().map(id).collect::<Vec<_>>(),
            vec!["tower/m1/sensor/g2@4-17"; 3]
        );
    }

    #[test]
    fn a_kind_that_stays_unknown_holds_nothing_up() {
        let mut calls = calls();
        let latched = with(component(FaultState::Latched));
        assert!(!calls.observe(&latched, 0, None));
        assert!(calls.observe(&latched, KIND_WITHIN_NS, None));
        assert_eq!(told(&mut calls), [(Occasion::Opened, "m1/sensor/g2: latched".to_owned())]);
    }

    #[test]
    fn what_nobody_acknowledges_escalates_once_and_what_is_shelved_does_not() {
        let mut calls = calls();
        let latched = || identified(FaultState::Latched);
        calls.observe(&with(latched()), 0, AFTER);
        calls.observe(&with(latched()), 600 * SECOND_NS, AFTER);
        calls.observe(&with(latched()), 9_000 * SECOND_NS, AFTER);
        calls.observe(&with(shelved(latched())), 9_001 * SECOND_NS, AFTER);
        calls.observe(&with(shelved(latched())), 99_000 * SECOND_NS, AFTER);
        calls.observe(&with(latched()), 99_001 * SECOND_NS, AFTER);
        let occasions: Vec<Occasion> =
            told(&mut calls).into_iter().map(|(occasion, _)| occasion).collect();
        let (opened, again) = (Occasion::Opened, Occasion::Returned);
        assert_eq!(occasions, [opened, Occasion::Escalated, Occasion::Quieted, again]);
    }

    #[test]
    fn a_certificate_that_expires_soon_is_told_of_once_until_it_is_renewed() {
        let now_s = 2_000_000_000;
        let with = |left_days: i64| {
            let normal = component(FaultState::Normal);
            let mut seen = scene(vec![module("m1", ModulePhase::InService, vec![normal])]);
            let mut status = crate::testing::status("m1", &[]);
            status.time_unix_ns = now_s * SECOND_NS;
            let until = i64::try_from(now_s).unwrap() + left_days * 86_400 + 60;
            status.certificate_until_unix_s = u64::try_from(until).ok();
            seen.modules[0].status = Some(status);
            seen
        };
        let mut calls = calls();
        for second in 0..60 {
            calls.observe(&with(22), second * SECOND_NS, None);
        }
        assert_eq!(told(&mut calls), []);
        for second in 60..90 {
            calls.observe(&with(20), second * SECOND_NS, None);
        }
        let title = "m1: its certificate expires in 20 days (2033-06-07T03:34:20.000Z)".to_owned();
        assert_eq!(told(&mut calls), [(Occasion::Opened, title.clone())]);
        calls.observe(&with(365), 90 * SECOND_NS, None);
        assert_eq!(told(&mut calls), [(Occasion::Resolved, title)]);
        let words = |days| with(days).modules[0].expiring_certificate().unwrap();
        assert!(words(1).starts_with("its certificate expires in a day ("), "{}", words(1));
        assert!(words(0).starts_with("its certificate expires within a day ("), "{}", words(0));
        assert!(words(-2).starts_with("its certificate has expired ("), "{}", words(-2));
    }

    #[test]
    fn certificates_of_other_processes_are_told_of_whether_or_not_anything_is_heard() {
        let shown = |days: u64| ShownCertificate {
            name: "router.ground.tower".to_owned(),
            until_unix_s: 2_000_000_060 + days * 86_400,
        };
        let cut_off =
            Scene { network: NetworkState::CutOff(0), ..with(component(FaultState::Normal)) };
        let mut calls = calls();
        let mut observe = |days, second: u64| {
            let now = (2_000_000_000 + second) * SECOND_NS;
            let scene =
                if second < 30 { with(component(FaultState::Normal)) } else { cut_off.clone() };
            let is_news =
                calls.observe_certificates(&[shown(days)], now) | calls.observe(&scene, now, None);
            let told = told(&mut calls);
            assert_eq!(is_news, !told.is_empty());
            told
        };
        let told: Vec<_> = (0..29).flat_map(|second| observe(20, second)).collect();
        let title =
            "router.ground.tower: certificate expires in 20 days (2033-06-07T03:34:20.000Z)";
        assert_eq!(told, [(Occasion::Opened, title.to_owned())]);
        // Being cut off does not resolve it.
        assert_eq!(observe(20, 30), []);
        assert_eq!(observe(365, 31), [(Occasion::Resolved, title.to_owned())]);
    }

    #[test]
    fn what_is_not_known_is_not_over() {
        let mut calls = calls();
        calls.observe(&with(identified(FaultState::Latched)), 0, None);
        told(&mut calls);
        let revision = calls.revision();
        let other_words = FaultTransition { tare: Some(1e-6), ..identified(FaultState::Latched) };
        calls.observe(&with(other_words), SECOND_NS / 2, None);
        assert_eq!(calls.revision(), revision, "nothing to save");
        // Its module stops, restarts without knowing yet, or is gone.
        let unknown = Unknown { since_unix_ns: 1, reason: "starting".to_owned() };
        let silent = component(FaultState::Normal).while_unknown(unknown);
        let starting = scene(vec![module("m1", ModulePhase::Initialising, vec![silent.clone()])]);
        let silent = with(silent);
        let gone = scene(vec![module("m2", ModulePhase::InService, Vec::new())]);
        for scene in [starting, silent, gone] {
            calls.observe(&scene, SECOND_NS, None);
            assert_eq!(told(&mut calls), [], "{scene:?}");
        }
        calls.observe(&with(component(FaultState::Normal)), 2 * SECOND_NS, None);
        assert_eq!(told(&mut calls)[0].0, Occasion::Resolved);
    }

    #[test]
    fn a_module_that_does_not_answer_is_told_of_if_that_lasts() {
        let mut calls = calls();
        let there = || {
            module("m1", ModulePhase::InService, vec![state("m1/sensor/g1", FaultState::Normal)])
        };
        let without = || scene(vec![there(), mute("m2", Some("m1"))]);
        let second = || {
            let gage = state("m2/sensor/g1", FaultState::Normal);
            module("m2", ModulePhase::InService, vec![gage])
        };
        calls.observe(&without(), 0, None);
        calls.observe(&scene(vec![there(), second()]), SECOND_NS, None);
        assert_eq!(told(&mut calls), []);
        calls.observe(&without(), 2 * SECOND_NS, None);
        calls.observe(&without(), 12 * SECOND_NS, None);
        calls.observe(&scene(vec![there(), second()]), 13 * SECOND_NS, None);
        let title = "m2: its components are unknown".to_owned();
        assert_eq!(
            told(&mut calls),
            [(Occasion::Opened, title.clone()), (Occasion::Resolved, title)]
        );
    }

    #[test]
    fn when_nothing_is_heard_that_is_told_and_nothing_else_changes() {
        let mut calls = calls();
        calls.observe(&with(identified(FaultState::Latched)), 0, None);
        told(&mut calls);
        let cut_off = Scene {
            network: NetworkState::CutOff(SECOND_NS),
            ..with(component(FaultState::Latched))
        };
        calls.observe(&cut_off, SECOND_NS, None);
        calls.observe(&cut_off, 11 * SECOND_NS, None);
        let title = "monitoring: nothing is heard".to_owned();
        assert_eq!(told(&mut calls), [(Occasion::Opened, title.clone())]);
        calls.observe(&with(identified(FaultState::Latched)), 12 * SECOND_NS, None);
        assert_eq!(told(&mut calls), [(Occasion::Resolved, title)]);
        assert_eq!(calls.open().count(), 1);
    }

    #[test]
    fn another_fault_of_the_same_component_is_another_incident() {
        let mut calls = calls();
        calls.observe(&with(identified(FaultState::Latched)), 0, None);
        let next =
            FaultTransition { detection_step: Some(Step(99)), ..identified(FaultState::Latched) };
        calls.observe(&with(next), SECOND_NS, None);
        let occasions: Vec<Occasion> =
            told(&mut calls).into_iter().map(|(occasion, _)| occasion).collect();
        assert_eq!(occasions, [Occasion::Opened, Occasion::Resolved, Occasion::Opened]);
    }

    #[test]
    fn a_restart_goes_on_where_it_was() {
        let mut calls = calls();
        calls.observe(&with(identified(FaultState::Latched)), 0, AFTER);
        let text = serde_json::to_string(&calls).unwrap();
        let mut again: Calls = serde_json::from_str(&text).unwrap();
        assert_eq!(serde_json::to_string(&again).unwrap(), text);
        assert_eq!(again.tell(&["hook".to_owned(), "new".to_owned()]), ["mail"]);
        again.observe(&with(identified(FaultState::Latched)), SECOND_NS, AFTER);
        assert_eq!((again.waiting("hook"), again.waiting("new")), (1, 0));
        let effect = Verdict::Explained { by: "m1/actuator/a1".parse().unwrap(), since: Step(3) };
        let explained = FaultTransition { verdict: effect, ..component(FaultState::Normal) };
        assert!(again.observe(&with(explained), 2 * SECOND_NS, AFTER), "its fault was reset");
        assert_eq!(again.waiting("hook"), 2);
    }

    #[test]
    fn beyond_a_limit_the_oldest_calls_are_dropped_and_counted() {
        let mut calls = calls();
        for round in 0..=MOST_PENDING as u64 / 2 {
            let latched = FaultTransition {
                detection_step: Some(Step(round)),
                ..identified(FaultState::Latched)
            };
            calls.observe(&with(latched), round, None);
            calls.observe(&with(component(FaultState::Normal)), round, None);
        }
        assert_eq!((calls.waiting("hook"), calls.dropped()), (MOST_PENDING, 2 * 2));
        assert_eq!(calls.next("hook").unwrap().number, 3);
    }
}
