//! Converts events to lines. Changes that affect a verdict are shown one by one; repetitive ones are summarised in one
//! line for each cause.

use std::collections::BTreeMap;

use diagnosis::identification::IdentificationResult;
use diagnosis::{ActuatorFault, Change, Rule, StateQuestion, Verdict};
use vocabulary::{ComponentPath, ModuleName, Step};

use super::account::{Account, ChangeFate, Changed};
use super::words::{StepClock, counted, list, often, times};
use super::{LineKind, StoryLine, outcome, reason};
use crate::group::RigEvent;
use crate::rig::TimedFault;
use crate::scenarios::GageReading;

/// Most changes of an answer, or channels of a summary, that are listed.
const SHOWN: usize = 4;

/// Converts the events of a run to lines.
pub(super) struct CaseStory<'a> {
    account: &'a Account<'a>,
    clock: StepClock,
    /// Which of the account's changes are shown one by one.
    shown: Vec<bool>,
    lines: Vec<StoryLine>,
}

impl<'a> CaseStory<'a> {
    pub(super) fn new(account: &'a Account<'a>) -> Self {
        Self { account, clock: account.clock(), shown: choose(account), lines: Vec::new() }
    }

    /// All lines, in the order of their steps.
    pub(super) fn render(mut self) -> Vec<StoryLine> {
        self.setting();
        self.faults();
        self.gaps();
        for (step, component, condition) in &self.account.conditions {
            self.add(*step, LineKind::Condition, format!("{component} {condition}"));
        }
        for (step, occurrence) in &self.account.moments {
            match occurrence {
                RigEvent::Identified { module, identification } => {
                    self.identified(*step, module, identification);
                }
                RigEvent::Change { module, change } => {
                    self.change(*step, &path(module, &change.component), change.step);
                }
                RigEvent::Question { asker, peer, question, .. } => {
                    if self.is_needed(asker, question) {
                        self.question(*step, asker, peer, question);
                        self.answer(*step, occurrence);
                    }
                }
                RigEvent::Transition { module, transition } => {
                    let component = path(module, &transition.component);
                    self.verdict(*step, &component, transition.detection, &transition.verdict);
                }
            }
        }
        // A stable sort keeps the order of events in the same step.
        self.lines.sort_by_key(|line| line.step);
        for (kind, text) in outcome::render(self.account) {
            self.add(self.account.end, kind, text);
        }
        self.lines
    }

    fn add(&mut self, step: Step, kind: LineKind, text: String) {
        self.lines.push(StoryLine { time_s: self.clock.seconds(step), step, kind, text });
    }

    fn setting(&mut self) {
        let Account { system, number, kind, seed, end, .. } = self.account;
        let rule = match system.setups.first().map(|setup| setup.isolation.rule) {
            Some(Rule::Paper) => "the paper's rule",
            Some(Rule::FirstChange) | None => "the first change names the fault",
        };
        let text = format!(
            "number {number} of seed {}, {kind}: {} in a wind of {:.1} m/s, plant seed {seed}; {rule}",
            system.seed,
            self.clock.time(*end),
            self.account.base_speed_m_per_s,
        );
        self.add(Step(0), LineKind::Setting, text);
        if let Some(since) = self.account.watching_since {
            self.add(since, LineKind::Watching, "every channel is watched from here on".to_owned());
        }
    }

    fn faults(&mut self) {
        for TimedFault { at, until, component, fault } in &self.account.faults {
            let mut faulty = self.account.faulty.iter();
            let first = faulty.find(|of| of.first.component == *component && of.first.at == *at);
            let reading = first.and_then(|of| of.reading.as_ref()).map(GageReading::over_noise);
            let reading = reading.map_or_else(String::new, |reading| {
                format!("; right before, it read {} its noise", times(reading))
            });
            if *at < self.account.end {
                self.add(*at, LineKind::Injected, format!("{component}: {fault}{reading}"));
            }
            if let Some(until) = until.filter(|until| *until < self.account.end) {
                self.add(until, LineKind::Repaired, component.to_string());
            }
        }
    }

    fn gaps(&mut self) {
        for gap in &self.account.gaps {
            let module = &self.account.system.setups[gap.place].module;
            let lost = gap.until.since(gap.from);
            if lost > 0 {
                let text = format!("{module} gets no sample for {}", self.clock.span(lost));
                self.add(gap.from, LineKind::Gap, text);
            }
            if gap.restarted {
                self.add(gap.until, LineKind::Gap, format!("{module} is restarted"));
            }
        }
    }

    fn identified(&mut self, step: Step, module: &ModuleName, found: &IdentificationResult) {
        let candidates = found.candidates.iter().take(SHOWN).map(|of| {
            let percent = 100.0 * of.probability;
            format!("{} {percent:.0} %", of.kind.words())
        });
        let candidates: Vec<String> = candidates.collect();
        let component = path(module, &found.component);
        self.add(step, LineKind::Identified, format!("{component}: {}", candidates.join(", ")));
    }

    fn change(&mut self, step: Step, component: &ComponentPath, at: Step) {
        let mut changes = self.account.changes.iter();
        let Some(place) = changes.position(|c| c.step == at && c.component == *component) else {
            return;
        };
        if self.shown[place] {
            let text = self.change_text(&self.account.changes[place]);
            self.add(step, LineKind::Change, text);
        } else if let Some(text) = self.summary(place) {
            self.add(step, LineKind::More, text);
        }
    }

    fn change_text(&self, changed: &Changed) -> String {
        let Changed { component, step, rising_since, ratio, .. } = changed;
        let rising = match step.since(*rising_since) {
            0 => "at once".to_owned(),
            steps => format!("within {}", self.clock.span(steps)),
        };
        let since = self.account.faulty_since(component, *step);
        let faulty = match since.map(|since| step.since(since)) {
            None => String::new(),
            Some(0) => ", in the same step as the fault".to_owned(),
            Some(steps) => format!(", {} after the fault began", self.clock.span(steps)),
        };
        format!("{component} rose {rising} to {} its threshold{faulty}", times(*ratio))
    }

    /// The summarised changes with the same cause as this one, if it is the last of them.
    fn summary(&self, place: usize) -> Option<String> {
        let changed = &self.account.changes[place];
        let alike = |p: &usize| !self.shown[*p] && is_alike(&self.account.changes[*p], changed);
        let places: Vec<usize> = (0..self.account.changes.len()).filter(alike).collect();
        if places.last() != Some(&place) {
            return None;
        }
        let first = self.account.changes[*places.first()?].step;
        let since = match places.len() {
            1 => String::new(),
            _ => format!(" from {} on", self.clock.time(first)),
        };
        match &changed.fate {
            ChangeFate::Known { .. } => {
                let (component, again) = (&changed.component, often(places.len()));
                Some(format!("{component}, named already, changed again {again}{since}"))
            }
            ChangeFate::Explained { by, .. } => {
                let count = counted(places.len(), "further change");
                let were = if places.len() == 1 { "was" } else { "were" };
                let channels = self.channels(&places);
                let asked = match self.questions_for(&places) {
                    0 => String::new(),
                    questions => format!("; {} asked", counted(questions, "more question")),
                };
                Some(format!("{count}{since} {were} explained by {by} too: {channels}{asked}"))
            }
            ChangeFate::Fault { .. } | ChangeFate::Open => None,
        }
    }

    /// The channels of these changes, each with how often it changed.
    fn channels(&self, places: &[usize]) -> String {
        let mut channels: BTreeMap<&ComponentPath, usize> = BTreeMap::new();
        for &place in places {
            *channels.entry(&self.account.changes[place].component).or_default() += 1;
        }
        let mut channels: Vec<_> = channels.into_iter().collect();
        channels.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        let named = channels.into_iter().map(|(channel, count)| match count {
            1 => channel.to_string(),
            count => format!("{channel} {}", often(count)),
        });
        list(&named.collect::<Vec<_>>(), SHOWN)
    }

    /// The number of queries, not shown themselves, caused by these changes.
    fn questions_for(&self, places: &[usize]) -> usize {
        let about = |asker: &ModuleName, question: &StateQuestion| {
            places.iter().any(|&place| {
                let changed = &self.account.changes[place];
                changed.component.module == *asker && changed.decided() == Some(question.as_of)
            })
        };
        let hidden = self.account.moments.iter().filter(|(_, occurrence)| match occurrence {
            RigEvent::Question { asker, question, .. } => {
                about(asker, question) && !self.is_needed(asker, question)
            }
            _ => false,
        });
        hidden.count()
    }

    /// Does a verdict that is shown rest on this question?
    fn is_needed(&self, asker: &ModuleName, question: &StateQuestion) -> bool {
        self.account.changes.iter().zip(&self.shown).any(|(changed, shown)| {
            let waits = match &changed.fate {
                ChangeFate::Fault { decided } | ChangeFate::Explained { decided, .. } => {
                    *decided == question.as_of
                }
                ChangeFate::Open => changed.step <= question.as_of,
                ChangeFate::Known { .. } => false,
            };
            *shown && waits && changed.component.module == *asker
        })
    }

    fn question(&mut self, step: Step, asker: &ModuleName, peer: &ModuleName, q: &StateQuestion) {
        let (from, as_of) = (self.clock.time(q.from), self.clock.time(q.as_of));
        let text = match q.from {
            Step(0) => format!("{asker} asked {peer} for all its changes as of {as_of}"),
            _ => format!("{asker} asked {peer} for its changes from {from} as of {as_of}"),
        };
        self.add(step, LineKind::Asked, text);
    }

    fn answer(&mut self, step: Step, occurrence: &RigEvent) {
        let RigEvent::Question { asker, peer, changes, actuator_faults, .. } = occurrence else {
            return;
        };
        let changed = self.changes_text(peer, changes);
        let held = self.faults_text(peer, actuator_faults);
        // The changes by which the querying module judges come first.
        let text = match (self.account.rule(asker), held) {
            (Rule::FirstChange, None) => changed,
            (Rule::FirstChange, Some(held)) => format!("{changed}; {held}"),
            (Rule::Paper, None) => format!("no actuator is declared faulty; {changed}"),
            (Rule::Paper, Some(held)) => format!("{held}; {changed}"),
        };
        self.add(step, LineKind::Answered, format!("{peer}: {text}"));
    }

    fn changes_text(&self, peer: &ModuleName, changes: &[Change]) -> String {
        let texts = changes.iter().map(|change| {
            let (at, ratio) = (self.clock.time(change.step), times(change.ratio));
            format!("{peer}/{} changed at {at} ({ratio})", change.component)
        });
        match changes {
            [] => "no change in that time".to_owned(),
            _ => list(&texts.collect::<Vec<_>>(), SHOWN),
        }
    }

    fn faults_text(&self, peer: &ModuleName, faults: &[ActuatorFault]) -> Option<String> {
        let texts = faults.iter().map(|fault| {
            format!("{peer}/actuator/{} since {}", fault.actuator, self.clock.time(fault.step))
        });
        let texts: Vec<String> = texts.collect();
        (!texts.is_empty()).then(|| format!("declared faulty: {}", list(&texts, SHOWN)))
    }

    fn verdict(&mut self, step: Step, component: &ComponentPath, at: Step, verdict: &Verdict) {
        let mut changes = self.account.changes.iter().zip(&self.shown);
        let found = changes.find(|(c, shown)| **shown && c.step == at && c.component == *component);
        let Some((changed, _)) = found else { return };
        match verdict {
            Verdict::Latched => {
                let why = reason::of_fault(self.account, changed);
                self.add(step, LineKind::Fault, format!("{component}: {why}"));
            }
            Verdict::Explained { by, since } => {
                let why = reason::of_explanation(self.account, changed, by, *since);
                self.add(step, LineKind::Explained, format!("{component}: {why}"));
            }
            Verdict::Unconfirmed { doubt } => {
                self.add(step, LineKind::Unconfirmed, format!("{component}: {doubt}"));
            }
            Verdict::Normal | Verdict::Tentative | Verdict::Unknown | Verdict::Acknowledged => {}
        }
    }
}

/// Whether two changes need not both be shown: because their component had been named before, or because the same
/// change explains them.
fn is_alike(one: &Changed, other: &Changed) -> bool {
    match (&one.fate, &other.fate) {
        (ChangeFate::Known { .. }, ChangeFate::Known { .. }) => one.component == other.component,
        (
            ChangeFate::Explained { by, since, .. },
            ChangeFate::Explained { by: other, since: at, .. },
        ) => (by, since) == (other, at),
        _ => false,
    }
}

/// Chooses the changes shown one by one: faults, changes that were not judged, the first change of each faulty
/// component, and of the explained changes the first of each module for each root cause and its ties.
fn choose(account: &Account) -> Vec<bool> {
    let mut seen: Vec<(&ModuleName, &ComponentPath, Step)> = Vec::new();
    let mut faulty_shown: Vec<&ComponentPath> = Vec::new();
    let mut shown = Vec::with_capacity(account.changes.len());
    for changed in &account.changes {
        let faulty = account.faulty_since(&changed.component, changed.step).is_some();
        let first_faulty = faulty && !faulty_shown.contains(&&changed.component);
        if first_faulty {
            faulty_shown.push(&changed.component);
        }
        shown.push(match &changed.fate {
            ChangeFate::Fault { .. } | ChangeFate::Open => true,
            ChangeFate::Known { .. } => first_faulty,
            ChangeFate::Explained { by, since, .. } => {
                let root = (&changed.component.module, by, *since);
                let first = !seen.contains(&root);
                if first {
                    seen.push(root);
                }
                let tie = reason::is_tie(account, changed);
                first || first_faulty || tie
            }
        });
    }
    shown
}

fn path(module: &ModuleName, component: &vocabulary::Component) -> ComponentPath {
    ComponentPath { module: module.clone(), component: component.clone() }
}
