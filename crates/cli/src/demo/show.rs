//! Turns observed events into reported ones, and decides when the demo ends. No clock: time is the plant's.

use std::collections::BTreeMap;

use observer::{DetectionFacts, EventLine, News, ObservedEvent, Scene, StateRow};
use vocabulary::{
    Candidate, ComponentPath, FaultState, FaultTransition, Identification, ModuleName, ModulePhase,
    Step,
};

use super::report::{DiagnosedFault, Entry, InjectedFault, Summary};
use super::story::{Act, Pace};

/// What is known of a module: as of which step, and how many of its components agree with their references.
#[derive(Debug, Clone, Copy, Default)]
struct Module {
    step: Step,
    in_service: bool,
    verified: u64,
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
    /// Whether it was reported how many of them agree with their references.
    compared: bool,
    /// Processes that have not appeared.
    missing: Vec<String>,
    /// The faults that were named, each as it was named first.
    named: BTreeMap<ComponentPath, DetectionFacts>,
    /// Their kinds.
    kinds: BTreeMap<ComponentPath, Candidate>,
    now: Step,
}

impl Show {
    pub(super) fn new(pace: Pace, acts: Vec<Act>, modules: &[ModuleName], components: u64) -> Show {
        let mut cues: Vec<_> = acts.iter().flat_map(cues).collect();
        cues.sort_by_key(|(step, _)| std::cmp::Reverse(*step));
        let mut missing: Vec<_> = modules.iter().map(ModuleName::to_string).collect();
        missing.push(vocabulary::keys::PLANT.to_owned());
        let modules = modules.iter().map(|module| (module.clone(), Module::default())).collect();
        let (compared, now) = (false, Step(0));
        let (named, kinds) = Default::default();
        Show { pace, acts, cues, modules, components, compared, missing, named, kinds, now }
    }

    /// Processes that have not appeared yet.
    pub(super) fn missing(&self) -> &[String] {
        &self.missing
    }

    /// How far the modules are known to be.
    pub(super) fn now(&self) -> Step {
        self.now
    }

    /// Every module has seen the last story through.
    pub(super) fn is_over(&self) -> bool {
        let end = self.acts.last().map_or(Step(0), |act| act.over);
        self.modules.values().all(|module| module.step >= end)
    }

    /// Takes an event; what is to be reported goes to `entries`.
    pub(super) fn on_event(&mut self, event: &ObservedEvent, entries: &mut Vec<Entry>) {
        match &event.news {
            News::Fault(transition) => self.transition(transition, entries),
            News::Identification(found) => self.identification(found, entries),
            News::Phase(change) => {
                let Some(module) = self.modules.get_mut(&change.module) else { return };
                let is_in_service = change.phase == ModulePhase::InService;
                if is_in_service && !module.in_service {
                    let since_step = change.step.unwrap_or(module.step);
                    let module = change.module.clone();
                    entries.push(Entry::InService { module, since_step });
                }
                module.in_service = is_in_service;
            }
            News::Presence { who, there: true, .. } => {
                if let Some(place) = self.missing.iter().position(|missing| missing == who) {
                    self.missing.remove(place);
                    entries.push(Entry::Ready { process: who.clone() });
                }
            }
            News::Presence { .. }
            | News::SeveralProcesses { .. }
            | News::Missed { .. }
            | News::Unreadable { .. }
            | News::Lost { .. } => {
                let EventLine { who, what, why, .. } = EventLine::of(event);
                entries
                    .push(Entry::Trouble { text: format!("{who} {what} {why}").trim().to_owned() });
            }
        }
    }

    /// Looks at what the modules report of themselves.
    pub(super) fn on_scene(&mut self, scene: &Scene, entries: &mut Vec<Entry>) {
        for view in &scene.modules {
            let (Some(status), Some(known)) = (&view.status, self.modules.get_mut(&view.module))
            else {
                continue;
            };
            known.step = known.step.max(status.step.unwrap_or_default());
            known.verified = status.verified;
        }
        let now = self.modules.values().map(|module| module.step).max();
        self.time_is(now.unwrap_or_default(), entries);
        self.look_at_comparisons(entries);
    }

    /// Advances the time and reports what has come due.
    fn time_is(&mut self, step: Step, entries: &mut Vec<Entry>) {
        let seconds = |step: Step| (step.0 as f64 * self.pace.step_s) as u64;
        let of_step = Step(self.pace.warm_up);
        let before = self.now;
        self.now = self.now.max(step);
        if seconds(self.now) > seconds(before) && self.now < of_step {
            entries.push(Entry::WarmingUp { step: self.now, of_step });
        }
        while let Some((_, cue)) = self.cues.pop_if(|(due, _)| *due <= self.now) {
            entries.push(cue);
        }
    }

    /// Reports once how many components agree with their references, when every module has compared some and nothing is
    /// wrong yet.
    fn look_at_comparisons(&mut self, entries: &mut Vec<Entry>) {
        let modules = || self.modules.values();
        if self.compared || modules().any(|module| !module.in_service || module.verified == 0) {
            return;
        }
        self.compared = true;
        if self.acts.first().is_none_or(|act| act.injected > self.now) {
            let agree = modules().map(|module| module.verified).sum();
            entries.push(Entry::Compared { step: self.now, agree, of: self.components });
        }
    }

    fn transition(&mut self, transition: &FaultTransition, entries: &mut Vec<Entry>) {
        let measured = StateRow::of_component(transition).measured;
        let step = measured.decided_step.unwrap_or(self.now);
        self.time_is(step, entries);
        if transition.state() == FaultState::Latched {
            self.named.entry(transition.component.clone()).or_insert(measured);
        }
        // A return to normal is not reported.
        if transition.state() != FaultState::Normal {
            entries.push(Entry::Verdict { step, transition: Box::new(transition.clone()) });
        }
    }

    /// A kind counts, and is reported, if it was decided while the fault was there and is another one than before.
    fn identification(&mut self, found: &Identification, entries: &mut Vec<Entry>) {
        let step = found.as_of_step;
        self.time_is(step, entries);
        let act = self.acts.iter().find(|act| act.story.component == found.component);
        let Some(kind) = found.kind().filter(|_| act.is_some_and(|act| step < act.repaired)) else {
            return;
        };
        let before = self.kinds.insert(found.component.clone(), kind.clone());
        if before.is_none_or(|before| before.kind != kind.kind) {
            let identification = Box::new(found.clone());
            entries.push(Entry::Identified { step, identification });
        }
    }

    /// What was injected against what was named.
    pub(super) fn summary(&self, pids: Vec<u32>) -> Summary {
        let injected = |act: &Act| InjectedFault {
            component: act.story.component.clone(),
            fault: act.story.fault,
            step: act.injected,
            repaired_step: act.repaired,
        };
        let mut diagnosed: Vec<DiagnosedFault> =
            self.named.iter().map(|(component, named)| self.diagnosed(component, named)).collect();
        diagnosed.sort_by_key(|fault| fault.detection_step);
        let is_named_in_time = |act: &Act| {
            let named = self.named.get(&act.story.component);
            let detected = named.and_then(|named| named.detection_step);
            detected.is_some_and(|step| (act.injected..act.repaired).contains(&step))
        };
        let exact = self.named.len() == self.acts.len() && self.acts.iter().all(is_named_in_time);
        Summary { injected: self.acts.iter().map(injected).collect(), diagnosed, exact, pids }
    }

    fn diagnosed(&self, component: &ComponentPath, named: &DetectionFacts) -> DiagnosedFault {
        let act = self.acts.iter().find(|act| act.story.component == *component);
        let delay_ms = |step: Option<Step>| {
            let (step, injected) = (step?, act?.injected);
            // Rounded to the microsecond: steps are whole milliseconds, their product is not quite.
            let ms = step.0.checked_sub(injected.0)? as f64 * self.pace.step_s * 1e3;
            Some((ms * 1e3).round() / 1e3)
        };
        DiagnosedFault {
            component: component.clone(),
            onset_step: named.onset_step,
            detection_step: named.detection_step,
            decided_step: named.decided_step,
            delay_ms: delay_ms(named.detection_step),
            verdict_delay_ms: delay_ms(named.decided_step),
            identified: self.kinds.get(component).cloned(),
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
    use crate::demo::story::Story;
    use crate::faults::testing::{identification, scene};
    use observer::ModuleView;
    use vocabulary::fault::Fault;

    const PACE: Pace = Pace { step_s: 1e-3, warm_up: 50, effects: 25, interval: 20 };

    fn show() -> Show {
        let act = |path: &str, fault, injected| Act {
            story: Story { title: "t", component: path.parse().unwrap(), fault, lasts_s: 0.015 },
            injected: Step(injected),
            repaired: Step(injected + 15),
            over: Step(injected + 900),
        };
        let acts = vec![
            act("m1/sensor/g1", Fault::ZeroOutput {}, 100),
            act("m2/actuator/a1", Fault::HardOver {}, 1000),
        ];
        Show::new(PACE, acts, &["m1".parse().unwrap(), "m2".parse().unwrap()], 12)
    }

    fn shown(show: &mut Show, news: News) -> Vec<Entry> {
        let mut entries = Vec::new();
        show.on_event(&ObservedEvent { number: 1, time_unix_ns: 0, news }, &mut entries);
        entries
    }

    /// The modules report these steps and numbers of components that agree.
    fn seen(show: &mut Show, modules: &[(&str, u64, u64)]) -> Vec<Entry> {
        let module = |(name, step, verified): &(&str, u64, u64)| {
            let mut module: ModuleView =
                crate::faults::testing::module(name, ModulePhase::InService, Vec::new());
            let status = module.status.as_mut().unwrap();
            (status.step, status.verified) = (Some(Step(*step)), *verified);
            module
        };
        let mut entries = Vec::new();
        show.on_scene(&scene(modules.iter().map(module).collect()), &mut entries);
        entries
    }

    fn verdict(component: &str, state: FaultState, detected: u64) -> News {
        let component: ComponentPath = component.parse().unwrap();
        News::Fault(Box::new(FaultTransition {
            verdict: vocabulary::Verdict::example(state),
            sequence: 1,
            detection_step: Some(Step(detected)),
            decided_step: Some(Step(detected)),
            ..FaultTransition::untouched("t".parse().unwrap(), component, 0)
        }))
    }

    fn in_service(module: &str) -> News {
        News::Phase(vocabulary::PhaseChange {
            structure: "t".parse().unwrap(),
            module: module.parse().unwrap(),
            phase: ModulePhase::InService,
            before: None,
            run: None,
            step: Some(Step(50)),
            reason: String::new(),
            time_unix_ns: 0,
        })
    }

    #[test]
    fn an_injection_is_reported_before_what_follows_from_it() {
        let entries = shown(&mut show(), verdict("m1/sensor/g1", FaultState::Latched, 104));
        assert!(matches!(entries[0], Entry::Injected { step: Step(100), .. }), "{entries:?}");
        assert!(matches!(entries[1], Entry::Verdict { step: Step(104), .. }), "{entries:?}");
        assert_eq!(entries.len(), 2);
        let over = shown(&mut show(), verdict("m1/sensor/g1", FaultState::Normal, 9));
        assert_eq!(over, []);
    }

    #[test]
    fn the_show_is_over_when_the_slowest_module_is_through() {
        let mut show = show();
        seen(&mut show, &[("m1", 1900, 0), ("m2", 1899, 0)]);
        assert!(!show.is_over());
        seen(&mut show, &[("m2", 1900, 0)]);
        assert!(show.is_over());
    }

    #[test]
    fn processes_are_reported_once_each_and_missed_until_then() {
        let mut show = show();
        let token = |who: &str, there| News::Presence {
            structure: "t".parse().unwrap(),
            who: who.to_owned(),
            there,
        };
        assert_eq!(shown(&mut show, token("m2", true)), [Entry::Ready { process: "m2".into() }]);
        assert_eq!(shown(&mut show, token("m2", true)), []);
        assert_eq!(show.missing(), ["m1", "plant"]);
        let gone = shown(&mut show, token("m2", false));
        assert_eq!(gone, [Entry::Trouble { text: "m2 GONE".to_owned() }]);
    }

    #[test]
    fn that_components_agree_is_reported_once_every_module_has_compared_them() {
        let mut show = show();
        for module in ["m1", "m2"] {
            assert_eq!(shown(&mut show, in_service(module)).len(), 1);
            assert_eq!(shown(&mut show, in_service(module)), [], "it is reported once");
        }
        assert_eq!(seen(&mut show, &[("m1", 60, 6), ("m2", 60, 0)]), []);
        let compared = Entry::Compared { step: Step(60), agree: 11, of: 12 };
        assert_eq!(seen(&mut show, &[("m2", 60, 5)]), [compared]);
        assert_eq!(seen(&mut show, &[("m2", 60, 6)]), []);
    }

    fn exact(verdicts: &[(&str, u64)]) -> bool {
        let mut show = show();
        for &(component, step) in verdicts {
            shown(&mut show, verdict(component, FaultState::Latched, step));
        }
        show.summary(vec![1]).exact
    }

    #[test]
    fn exact_is_every_fault_in_its_time_and_nothing_else() {
        assert!(exact(&[("m1/sensor/g1", 105), ("m2/actuator/a1", 1000)]));
        for wrong in [
            &[][..],
            &[("m1/sensor/g1", 105)],
            &[("m1/sensor/g1", 99), ("m2/actuator/a1", 1000)],
            &[("m1/sensor/g1", 115), ("m2/actuator/a1", 1000)],
            &[("m1/sensor/g1", 105), ("m2/actuator/a2", 1000)],
            &[("m1/sensor/g1", 105), ("m2/actuator/a1", 1000), ("m1/sensor/g2", 1200)],
        ] {
            assert!(!exact(wrong), "{wrong:?}");
        }
    }

    #[test]
    fn a_kind_counts_if_it_was_decided_before_the_repair_and_is_reported_once() {
        let mut show = show();
        shown(&mut show, verdict("m1/sensor/g1", FaultState::Latched, 105));
        let mut news = |kind: &str, step, decided| {
            let found = Identification {
                as_of_step: Step(step),
                component: "m1/sensor/g1".parse().unwrap(),
                ..identification(decided, &[kind])
            };
            let entries = shown(&mut show, News::Identification(Box::new(found)));
            entries.iter().any(|entry| matches!(entry, Entry::Identified { .. }))
        };
        assert!(!news("bias", 104, false));
        assert!(news("bias", 105, true));
        assert!(!news("bias", 106, true));
        assert!(news("zero_output", 110, true));
        assert!(!news("intermittent", 115, true));
        let summary = show.summary(vec![]);
        let kind = summary.diagnosed[0].identified.as_ref().map(|found| found.kind.as_str());
        assert_eq!(kind, Some("zero_output"));
    }

    #[test]
    fn only_the_first_latching_counts_and_other_states_do_not() {
        let mut show = show();
        shown(&mut show, verdict("m1/sensor/g2", FaultState::Explained, 100));
        shown(&mut show, verdict("m1/sensor/g1", FaultState::Latched, 103));
        shown(&mut show, verdict("m1/sensor/g1", FaultState::Latched, 900));
        let summary = show.summary(vec![]);
        assert_eq!(summary.diagnosed.len(), 1);
        assert_eq!(summary.diagnosed[0].delay_ms, Some(3.0));
    }
}
