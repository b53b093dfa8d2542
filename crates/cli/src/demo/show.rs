//! From messages to entries: what is reported, and when the show is over. No clock: time is the plant's.

use std::collections::{BTreeMap, BTreeSet};

use names::{ComponentPath, ModuleName, Step};
use wire::{
    ChangeReport, FaultState, FaultTransition, Identification, ModulePhase, ModuleStatus,
    PlantStatus, Symptom,
};

use super::entry::{Departure, Entry, Summary, Verdict};
use super::ledger::Ledger;
use super::news::News;
use super::story::{Act, Pace};
use wording::ordered;

/// What is known of a module.
#[derive(Debug, Clone, Copy, Default)]
struct Module {
    step: Step,
    in_service: bool,
    /// Components that agree with their reference, and as of which step.
    verified: (u64, Step),
    unanswered: u64,
}

/// The show.
#[derive(Debug)]
pub(super) struct Show {
    pace: Pace,
    acts: Vec<Act>,
    /// Injections and repairs that have not been reported.
    cues: Vec<(Step, Entry)>,
    modules: BTreeMap<ModuleName, Module>,
    /// How many components they have together.
    components: u64,
    /// Whether it was reported how many of them agree with their reference.
    compared: bool,
    /// Those that have changed since the latest injection.
    changed: BTreeSet<ComponentPath>,
    /// Processes that have not appeared.
    missing: Vec<String>,
    ledger: Ledger,
    now: Step,
    /// Samples that the plant could not send.
    unsent: u64,
}

impl Show {
    pub(super) fn new(pace: Pace, acts: Vec<Act>, modules: &[ModuleName], components: u64) -> Show {
        let mut cues: Vec<_> = acts.iter().flat_map(cues).collect();
        cues.sort_by_key(|(step, _)| std::cmp::Reverse(*step));
        let mut missing: Vec<_> = modules.iter().map(ModuleName::to_string).collect();
        missing.push(wire::keys::PLANT.to_owned());
        let modules = modules.iter().map(|module| (module.clone(), Module::default())).collect();
        Show {
            pace,
            acts,
            cues,
            modules,
            components,
            compared: false,
            changed: BTreeSet::new(),
            missing,
            ledger: Ledger::default(),
            now: Step(0),
            unsent: 0,
        }
    }

    /// Processes that have not appeared yet.
    pub(super) fn missing(&self) -> &[String] {
        &self.missing
    }

    /// How far the plant is known to be.
    pub(super) fn now(&self) -> Step {
        self.now
    }

    /// Every module has seen the last story through.
    pub(super) fn is_over(&self) -> bool {
        let end = self.acts.last().map_or(Step(0), |act| act.over);
        self.modules.values().all(|module| module.step >= end)
    }

    /// What came of it.
    pub(super) fn summary(&self, pids: Vec<u32>) -> Summary {
        self.ledger.summary(&self.acts, self.pace.step_s, pids)
    }

    /// Takes a message; what is to be reported goes to `entries`.
    pub(super) fn take(&mut self, news: News, entries: &mut Vec<Entry>) {
        match news {
            News::Alive { process, there } => self.token(process, there, entries),
            News::Progress(module, progress) => self.module_is_at(&module, progress.step, entries),
            News::Plant(status) => self.plant(&status, entries),
            News::Module(status) => self.status(&status, entries),
            News::Change(change) => self.change(change, entries),
            News::Transition(transition) => self.transition(transition, entries),
            News::Identification(found) => self.identification(&found, entries),
            News::Unreadable(text) => entries.push(Entry::Trouble { text }),
        }
    }

    fn token(&mut self, process: String, there: bool, entries: &mut Vec<Entry>) {
        if !there {
            entries.push(Entry::Trouble { text: format!("{process} is gone") });
        } else if let Some(place) = self.missing.iter().position(|missing| *missing == process) {
            self.missing.remove(place);
            entries.push(Entry::Ready { process });
        }
    }

    fn module_is_at(&mut self, module: &ModuleName, step: Step, entries: &mut Vec<Entry>) {
        if let Some(module) = self.modules.get_mut(module) {
            module.step = module.step.max(step);
        }
        self.time_is(step, entries);
    }

    /// Advances the time and reports what has come due.
    fn time_is(&mut self, step: Step, entries: &mut Vec<Entry>) {
        let before = self.seconds(self.now);
        self.now = self.now.max(step);
        let of_step = Step(self.pace.warm_up);
        if self.seconds(self.now) > before && self.now < of_step {
            entries.push(Entry::WarmingUp { step: self.now, of_step });
        }
        while let Some((_, cue)) = self.cues.pop_if(|(due, _)| *due <= self.now) {
            if matches!(cue, Entry::Injected { .. }) {
                self.changed.clear();
            }
            entries.push(cue);
        }
    }

    fn seconds(&self, step: Step) -> u64 {
        (step.0 as f64 * self.pace.step_s) as u64
    }

    fn plant(&mut self, status: &PlantStatus, entries: &mut Vec<Entry>) {
        self.time_is(status.next_step.minus(1), entries);
        if status.samples_unsent > self.unsent {
            self.unsent = status.samples_unsent;
            let text = format!("the plant could not send {} samples", status.samples_unsent);
            entries.push(Entry::Trouble { text });
        }
    }

    fn status(&mut self, status: &ModuleStatus, entries: &mut Vec<Entry>) {
        if let Some(step) = status.step {
            self.module_is_at(&status.module, step, entries);
        }
        let Some(known) = self.modules.get_mut(&status.module) else { return };
        let module = status.module.clone();
        if status.phase == ModulePhase::InService && !known.in_service {
            known.in_service = true;
            let since_step = status.in_service_since_step.unwrap_or(known.step);
            entries.push(Entry::InService { module: module.clone(), since_step });
        }
        let unanswered = status.diagnosis.questions_unanswered;
        if unanswered > known.unanswered {
            let questions = unanswered - known.unanswered;
            entries.push(Entry::Unanswered { step: known.step, module, questions });
        }
        known.unanswered = unanswered;
        known.verified = (status.verified, status.step.unwrap_or_default());
        self.look_at_comparisons(entries);
    }

    /// Reports once how many components agree with their reference, when every module has compared some and nothing is
    /// wrong yet.
    fn look_at_comparisons(&mut self, entries: &mut Vec<Entry>) {
        let modules = || self.modules.values();
        if self.compared || modules().any(|module| !module.in_service || module.verified.0 == 0) {
            return;
        }
        let agree = modules().map(|module| module.verified.0).sum();
        let step = modules().map(|module| module.verified.1).max().unwrap_or_default();
        self.compared = true;
        if self.acts.first().is_some_and(|act| act.injected <= step) {
            return;
        }
        entries.push(Entry::Compared { step, agree, of: self.components });
    }

    fn change(&mut self, change: ChangeReport, entries: &mut Vec<Entry>) {
        self.time_is(change.step, entries);
        let (component, ratio) = (change.component, change.evidence.ratio());
        self.changed.insert(component.clone());
        entries.push(Entry::Change { step: change.step, component, ratio });
    }

    fn transition(&mut self, transition: FaultTransition, entries: &mut Vec<Entry>) {
        if let Some(order) =
            transition.order.as_ref().filter(|order| !order.kind.is_about_verdict())
        {
            let (step, component, what) = (self.now, transition.component, ordered(order));
            entries.push(Entry::SetAside { step, component, what });
            return;
        }
        let step = transition.decided_step.unwrap_or(self.now);
        self.time_is(step, entries);
        self.ledger.take(&transition);
        // The change was reported already, and that it is over is no finding.
        if matches!(transition.state(), FaultState::Tentative | FaultState::Normal) {
            return;
        }
        let departure = self.departure(&transition);
        entries.push(Entry::Verdict(Verdict {
            step,
            departure,
            symptom: transition.symptom,
            component: transition.component,
            verdict: transition.verdict,
            detection_step: transition.detection_step,
        }));
    }

    /// The kind that was decided before the repair is reported when it is another one than before.
    fn identification(&mut self, found: &Identification, entries: &mut Vec<Entry>) {
        self.time_is(found.as_of_step, entries);
        if let Some(kind) = self.ledger.identified(found, &self.acts) {
            let (step, component) = (found.as_of_step, found.component.clone());
            entries.push(Entry::Identified { step, component, found: kind });
        }
    }

    /// How it departs from its reference, if that is what the transition rests on.
    fn departure(&self, transition: &FaultTransition) -> Option<Departure> {
        let evidence = transition.evidence.as_ref()?;
        let changed = self.changed.contains(&transition.component);
        match transition.symptom {
            Symptom::Change | Symptom::NoSignal => None,
            Symptom::Departure | Symptom::OilContent | Symptom::Scatter => {
                Some(Departure { measured: evidence.residual, expected: evidence.level, changed })
            }
        }
    }
}

/// The injection and the repair of an act.
fn cues(act: &Act) -> [(Step, Entry); 2] {
    let component = act.story.component.clone();
    let injected = Entry::Injected {
        step: act.injected,
        component: component.clone(),
        fault: act.story.fault,
        story: act.story.title,
    };
    [(act.injected, injected), (act.repaired, Entry::Repaired { step: act.repaired, component })]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::testing::{PACE, acts, transition};
    use crate::faults;
    use names::RunId;
    use wire::{Evidence, Progress};

    fn show() -> Show {
        Show::new(PACE, acts(), &["m1".parse().unwrap(), "m2".parse().unwrap()], 12)
    }

    fn progress(module: &str, step: u64) -> News {
        News::Progress(module.parse().unwrap(), Progress { run: RunId(1), step: Step(step) })
    }

    fn evidence(residual: f64, level: f64) -> Evidence {
        let (step, divergence, threshold) = (Step(0), Some(9.0), 6.0);
        Evidence { step, residual, level, divergence, threshold }
    }

    fn shown(show: &mut Show, news: News) -> Vec<Entry> {
        let mut entries = Vec::new();
        show.take(news, &mut entries);
        entries
    }

    #[test]
    fn an_injection_is_reported_before_what_follows_from_it() {
        let entries = shown(
            &mut show(),
            News::Transition(transition("m1/sensor/g1", FaultState::Latched, 104)),
        );
        assert!(matches!(entries[0], Entry::Injected { step: Step(100), .. }), "{entries:?}");
        let latched = |found: &Verdict| found.verdict == wire::Verdict::Latched;
        assert!(matches!(&entries[1], Entry::Verdict(verdict) if latched(verdict)));
        assert_eq!(entries.len(), 2);
    }

    #[test]
    fn the_show_is_over_when_the_slowest_module_is_through() {
        let mut show = show();
        shown(&mut show, progress("m1", 99_999));
        assert!(!show.is_over());
        shown(&mut show, progress("m2", acts()[1].over.0));
        assert!(show.is_over());
    }

    #[test]
    fn processes_are_missed_until_they_appear() {
        let mut show = show();
        assert_eq!(show.missing(), ["m1", "m2", "plant"]);
        for process in ["plant", "m2", "m1"] {
            shown(&mut show, News::Alive { process: process.into(), there: true });
        }
        assert!(show.missing().is_empty());
        let gone = shown(&mut show, News::Alive { process: "m1".into(), there: false });
        assert_eq!(gone, [Entry::Trouble { text: "m1 is gone".into() }]);
    }

    #[test]
    fn what_is_only_tentative_is_no_verdict() {
        let mut show = show();
        for state in [FaultState::Tentative, FaultState::Normal] {
            assert!(
                shown(&mut show, News::Transition(transition("m1/sensor/g1", state, 5))).is_empty()
            );
        }
    }

    #[test]
    fn a_departure_has_its_figures_and_says_whether_a_change_showed() {
        let component = || "m1/sensor/g1".parse().unwrap();
        let change = |step| ChangeReport {
            structure: "t".parse().unwrap(),
            run: RunId(1),
            step: Step(step),
            component: component(),
            evidence: evidence(0.0, 0.0),
            time_unix_ns: 0,
        };
        let departs = |show: &mut Show| {
            let found = FaultTransition {
                symptom: Symptom::Departure,
                evidence: Some(evidence(9e-5, 1e-6)),
                ..transition("m1/sensor/g1", FaultState::Latched, 104)
            };
            let entries = shown(show, News::Transition(found));
            let Some(Entry::Verdict(verdict)) = entries.last() else { panic!("{entries:?}") };
            verdict.departure
        };
        let departure = |changed| Some(Departure { measured: 9e-5, expected: 1e-6, changed });
        let mut show = show();
        // Before the injection: it belongs to another story.
        shown(&mut show, News::Change(change(99)));
        assert_eq!(departs(&mut show), departure(false));
        shown(&mut show, News::Change(change(101)));
        assert_eq!(departs(&mut show), departure(true));
    }

    #[test]
    fn that_components_agree_is_reported_once_every_module_has_compared_them() {
        let mut show = show();
        let mut status = |module: &str, verified| {
            let status = ModuleStatus {
                step: Some(Step(60)),
                verified,
                ..faults::testing::status(module, ModulePhase::InService)
            };
            let entries = shown(&mut show, News::Module(status)).into_iter();
            let compared = |entry: &Entry| matches!(entry, Entry::Compared { .. });
            entries.filter(compared).collect::<Vec<_>>()
        };
        assert_eq!(status("m1", 6), []);
        assert_eq!(status("m2", 0), []);
        let compared = Entry::Compared { step: Step(60), agree: 11, of: 12 };
        assert_eq!(status("m2", 5), [compared]);
        assert_eq!(status("m2", 6), []);
    }
}
