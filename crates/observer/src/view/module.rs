//! A module as every view shows it.

use std::collections::BTreeSet;

use vocabulary::words::{Tone, age, phase_in_words, phase_tone, printable, span, until, utc};
use vocabulary::{
    FaultTransition, JournalStatus, ModuleName, ModulePhase, ModuleStatus, PhaseChange, Shelving,
    StructureName, Unknown,
};

use super::component::{self, Counts};
use super::id::ModuleId;
use super::line::sign;
use super::row::{Belonging, DetectionFacts, RowGroup, StateRow, Urgency};
use crate::ShownCertificate;

/// Why a module cannot be heard although nothing is wrong with it.
const CUT_OFF: &str = "this view is cut off from the network";

/// What is known of a module. Anything in doubt is shown as unknown, never as normal.
#[derive(Debug, Clone, PartialEq)]
pub struct ModuleView {
    /// The structure; `None` if the module is only expected and its structure is not known.
    pub structure: Option<StructureName>,
    /// The module.
    pub module: ModuleName,
    /// Whether its liveliness token exists.
    pub present: bool,
    /// Whether the caller expects it.
    pub expected: bool,
    /// Modules that list it as their peer.
    pub peer_of: BTreeSet<ModuleName>,
    /// Its latest status.
    pub status: Option<ModuleStatus>,
    /// Its latest change of phase.
    pub phase_change: Option<PhaseChange>,
    /// The latest transition of each of its components, by name.
    pub components: Vec<FaultTransition>,
    /// The processes that answered the latest query: more than one if several run as this module.
    pub processes: BTreeSet<String>,
    /// Those that answered the query in progress.
    pub answering: BTreeSet<String>,
    /// When its latest message arrived, by the local clock \[ns since 1970\]; 0 without any.
    pub heard_unix_ns: u64,
    /// When its liveliness token disappeared, by the local clock \[ns since 1970\]; 0 while it exists.
    pub left_unix_ns: u64,
    /// Whether it is not heard: it left, has sent no message for longer than a running module ever pauses, or cannot be
    /// heard.
    pub is_silent: bool,
    /// Whether it cannot be heard, because the observer itself has no connection or has just got one again.
    pub is_cut_off: bool,
}

impl ModuleView {
    /// A module that has not been heard yet.
    #[must_use]
    pub fn new(structure: Option<StructureName>, module: ModuleName) -> Self {
        Self {
            structure,
            module,
            present: false,
            expected: false,
            peer_of: BTreeSet::new(),
            status: None,
            phase_change: None,
            components: Vec::new(),
            processes: BTreeSet::new(),
            answering: BTreeSet::new(),
            heard_unix_ns: 0,
            left_unix_ns: 0,
            is_silent: false,
            is_cut_off: false,
        }
    }

    /// Its structure and name.
    #[must_use]
    pub fn id(&self) -> ModuleId {
        ModuleId { structure: self.structure.clone(), module: self.module.clone() }
    }

    /// Whether it reports the states of its components. Otherwise they are unknown.
    #[must_use]
    pub fn answers(&self) -> bool {
        !self.is_silent && !self.components.is_empty()
    }

    /// When it was last heard: now, so long ago, never.
    #[must_use]
    pub fn heard(&self, now_unix_ns: u64) -> String {
        match (self.heard_unix_ns, self.is_silent) {
            (0, _) => "never".to_owned(),
            (_, false) => "now".to_owned(),
            (since, true) => format!("{} ago", age(since, now_unix_ns)),
        }
    }

    /// Why it is not heard, if so.
    #[must_use]
    pub fn why_unheard(&self) -> Option<&'static str> {
        let why = if self.is_cut_off { CUT_OFF } else { "its diagnoser is not heard" };
        self.is_silent.then_some(why)
    }

    /// Its phase according to its latest message.
    #[must_use]
    pub fn phase(&self) -> Option<ModulePhase> {
        let reported = self.status.as_ref().map(|status| (status.time_unix_ns, status.phase));
        let changed = self.phase_change.as_ref().map(|change| (change.time_unix_ns, change.phase));
        reported.into_iter().chain(changed).max_by_key(|(time, _)| *time).map(|(_, phase)| phase)
    }

    /// The change that led to its present phase, if known.
    #[must_use]
    pub fn latest_phase_change(&self) -> Option<&PhaseChange> {
        self.phase_change.as_ref().filter(|change| Some(change.phase) == self.phase())
    }

    /// Whether the states that it reports are valid now.
    #[must_use]
    pub fn is_in_service(&self) -> bool {
        self.answers() && self.phase() == Some(ModulePhase::InService)
    }

    /// Whether several processes run as this module: several answered, or one of them reported another.
    #[must_use]
    pub fn has_several_processes(&self) -> bool {
        self.processes.len() > 1
            || self.status.as_ref().is_some_and(|status| status.another_process)
    }

    /// Counts its components by state.
    #[must_use]
    pub fn counts(&self) -> Counts {
        Counts::of(&self.components)
    }

    /// If the alarms of all its components are suppressed for maintenance, the suppression that ends first.
    #[must_use]
    pub fn suppression(&self) -> Option<&Shelving> {
        component::suppression(&self.components)
    }

    /// Its phase in words, or that it does not answer.
    #[must_use]
    pub fn condition(&self) -> &'static str {
        match self.phase() {
            _ if self.is_cut_off => "NOT KNOWN",
            _ if !self.answers() => "NOT ANSWERING",
            Some(phase) => phase_in_words(phase),
            None => "unknown phase",
        }
    }

    /// The colour of its condition.
    #[must_use]
    pub fn tone(&self) -> Tone {
        if self.is_cut_off {
            return Tone::Doubt;
        }
        let is_written = self.journal().is_none_or(|journal| !journal.is_failing);
        if !self.answers() || self.has_several_processes() || !is_written {
            return Tone::Alarm;
        }
        self.phase().map_or(Tone::Doubt, phase_tone)
    }

    /// Its latest status, unless that is outdated.
    #[must_use]
    pub fn present_status(&self) -> Option<&ModuleStatus> {
        self.status.as_ref().filter(|_| !self.is_silent)
    }

    /// In words, that its certificate expires soon or has expired, by its own clock.
    #[must_use]
    pub fn expiring_certificate(&self) -> Option<String> {
        let status = self.present_status()?;
        let until_unix_s = status.certificate_until_unix_s?;
        let shown = ShownCertificate { name: self.module.to_string(), until_unix_s };
        let words = shown.expiring(status.time_unix_ns / 1_000_000_000)?;
        Some(format!("its certificate {words}"))
    }

    /// The delay from the publishing of a sample to its diagnosis; `None` if the clocks of publisher and diagnoser
    /// differ.
    #[must_use]
    pub fn lag(&self) -> Option<String> {
        self.timed().and_then(|status| status.lag_ms).map(span)
    }

    /// The age of its latest sample; `None` under the same condition.
    #[must_use]
    pub fn sample_age(&self) -> Option<String> {
        self.timed().and_then(|status| status.sample_age_ms).map(span)
    }

    fn timed(&self) -> Option<&ModuleStatus> {
        self.present_status().filter(|status| status.clock_difference().is_none())
    }

    /// The health of its journal, if reported.
    #[must_use]
    pub fn journal(&self) -> Option<JournalHealth> {
        self.present_status().map(|status| JournalHealth::of(&status.journal))
    }

    /// Remarks beyond its condition and its journal.
    #[must_use]
    pub fn remarks(&self) -> String {
        let mut remarks = Vec::new();
        if self.answers() {
            let change = self.latest_phase_change().filter(|_| !self.is_in_service());
            remarks.extend(change.map(|change| printable(&change.reason)));
            remarks.retain(|reason| !reason.is_empty());
        } else {
            remarks.extend(self.why_missed());
        }
        if self.has_several_processes() {
            let what = "duplicate diagnosers for this module, and a command may reach only one: stop the others";
            remarks.push(what.to_owned());
        }
        if self.answers() {
            if self.status.is_none() {
                remarks.push("publishes no status".to_owned());
            }
            if !self.present {
                remarks.push("no liveliness token".to_owned());
            }
            let shelved = self.counts().set_aside;
            match self.suppression() {
                Some(shelving) => remarks.push(format!("suppressed {}", until(shelving))),
                None if shelved > 0 => remarks.push(format!("{shelved} shelved")),
                None => {}
            }
            remarks.extend(self.expiring_certificate());
            let difference = self.present_status().and_then(ModuleStatus::clock_difference);
            remarks.extend(difference.map(|difference| difference.to_string()));
        }
        remarks.join("; ")
    }

    /// Since when it has not answered, or why it should be running.
    fn why_missed(&self) -> Option<String> {
        let namers: Vec<&str> = self.peer_of.iter().map(ModuleName::as_str).collect();
        if self.is_cut_off {
            let heard = match self.heard_unix_ns {
                0 => "never heard".to_owned(),
                heard => format!("last heard {}", utc(heard)),
            };
            Some(format!("{CUT_OFF}; {heard}"))
        } else if self.left_unix_ns > 0 && self.is_silent {
            Some(format!("left the network {}", utc(self.left_unix_ns)))
        } else if self.is_silent && self.heard_unix_ns > 0 {
            Some(format!("nothing heard since {}", utc(self.heard_unix_ns)))
        } else if self.present {
            Some("is present, but does not report its components".to_owned())
        } else if self.expected {
            Some("expected".to_owned())
        } else if !namers.is_empty() {
            Some(format!("peer of {}", namers.join(", ")))
        } else {
            None
        }
    }

    /// The row of a module whose verdicts are missing or unreliable.
    #[must_use]
    pub fn row(&self) -> Option<StateRow> {
        let is_failing = |journal: &JournalHealth| journal.is_failing;
        let journal = self.journal().filter(is_failing).map(|journal| journal.to_string());
        if self.is_in_service() && !self.has_several_processes() && journal.is_none() {
            return None;
        }
        let is_maintained = self.suppression().is_some()
            && self.answers()
            && !self.has_several_processes()
            && journal.is_none();
        let tone = self.tone();
        let urgency = match tone {
            _ if is_maintained => Urgency::SetAside,
            Tone::Alarm => Urgency::Unreliable,
            _ => Urgency::Unknown,
        };
        let change = self.latest_phase_change().map(|change| change.time_unix_ns);
        let since = match (self.is_silent, self.is_in_service()) {
            (true, _) => Some(self.heard_unix_ns).filter(|heard| *heard > 0),
            (false, true) => None,
            // Its phase does not tell since when it has not answered.
            (false, false) => change.filter(|_| self.answers()),
        };
        let unknown = self.components.iter().filter(|state| self.covers(state));
        let components: Vec<_> = unknown.map(|state| state.component.clone()).collect();
        let unknown = RowGroup { belonging: Belonging::NotMonitored, components };
        let kind = match (self.components.len(), unknown.components.len()) {
            (0, _) => "its components are unknown".to_owned(),
            (_, 0) => String::new(),
            _ => unknown.words(),
        };
        let words =
            [self.remarks(), journal.map_or_else(String::new, |words| format!("journal: {words}"))];
        let words: Vec<String> = words.into_iter().filter(|words| !words.is_empty()).collect();
        Some(StateRow {
            is_set_aside: is_maintained,
            since_unix_ns: since,
            kind,
            why: words.join("; "),
            groups: Some(unknown)
                .filter(|group| !group.components.is_empty())
                .into_iter()
                .collect(),
            ..self.row_of(urgency, tone)
        })
    }

    /// A row about the module, without details.
    pub(super) fn row_of(&self, urgency: Urgency, tone: Tone) -> StateRow {
        StateRow {
            structure: self.structure.clone(),
            module: self.module.clone(),
            component: None,
            urgency,
            tone,
            sign: sign(tone),
            state: self.condition().to_owned(),
            is_set_aside: false,
            is_covered: false,
            since_unix_ns: None,
            kind: String::new(),
            why: String::new(),
            groups: Vec::new(),
            incident: None,
            measured: DetectionFacts::default(),
        }
    }

    /// Whether this component is unknown because the module is out of service.
    pub(super) fn covers(&self, state: &FaultTransition) -> bool {
        !self.is_in_service() && component::is_unmonitored(state)
    }

    /// Marks components in doubt as unknown.
    pub(super) fn doubt(&mut self) {
        if let Some(reason) = self.why_unheard() {
            let unknown = Unknown { since_unix_ns: self.heard_unix_ns, reason: reason.to_owned() };
            for state in &mut self.components {
                component::silence(state, &unknown);
                // How it compares with its reference is not known either.
                state.condition = None;
            }
            return;
        }
        let lack = self.lack();
        self.components.iter_mut().for_each(|state| component::doubt(state, lack.as_ref()));
    }

    /// Since when and why it does not monitor its components, according to its own reports.
    fn lack(&self) -> Option<Unknown> {
        let phase = self.phase().filter(|phase| *phase != ModulePhase::InService)?;
        let change = self.latest_phase_change();
        let status = self.status.as_ref().map_or(0, |status| status.time_unix_ns);
        Some(Unknown {
            since_unix_ns: change.map_or(status, |change| change.time_unix_ns),
            reason: change
                .map_or_else(|| phase.as_str().to_owned(), |change| change.reason.clone()),
        })
    }
}

/// Whether a module's journal is reliable. Displayed as `ok`, `none` or the problems.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JournalHealth {
    /// Whether the module keeps a journal.
    pub is_kept: bool,
    /// Whether writing fails at present.
    pub is_failing: bool,
    /// All problems, in words.
    pub problems: Vec<String>,
}

impl JournalHealth {
    /// Evaluates a reported status.
    #[must_use]
    pub fn of(journal: &JournalStatus) -> Self {
        let counts =
            [(journal.unsaved, "not saved"), (journal.lost, "lost"), (journal.damaged, "damaged")];
        let counts = counts.into_iter().filter(|(count, _)| *count > 0);
        let problem = journal.problem.as_ref().map(|problem| printable(problem));
        let problems =
            problem.into_iter().chain(counts.map(|(count, what)| format!("{count} {what}")));
        Self {
            is_kept: journal.directory.is_some(),
            is_failing: journal.problem.is_some(),
            problems: problems.collect(),
        }
    }

    /// Whether there are no problems.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.problems.is_empty()
    }
}

impl std::fmt::Display for JournalHealth {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (&self.problems[..], self.is_kept) {
            ([], true) => f.write_str("ok"),
            ([], false) => f.write_str("none"),
            (problems, _) => f.write_str(&problems.join(", ")),
        }
    }
}
