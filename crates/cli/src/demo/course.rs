//! Converts observed events to reported ones, and decides when the demo ends. Uses the plant's time instead of a clock.

use std::collections::BTreeMap;

use observer::{DetectionFacts, EventLine, News, ObservedEvent, Scene, StateRow};
use vocabulary::{
    Candidate, ComponentPath, FaultState, FaultTransition, Identification, ModuleName, ModulePhase,
    PlantStatus, Step,
};

use super::report::{DemoEvent, DemoSummary, DiagnosedFault};
use super::story::{Act, DemoTiming};

/// The progress of a module: its latest known step, and the number of components that agree with their references.
#[derive(Debug, Clone, Copy, Default)]
struct DemoModule {
    step: Step,
    in_service: bool,
    verified: u64,
}

/// The progress of the demo, and the diagnosed faults.
#[derive(Debug)]
pub(super) struct DemoCourse {
    timing: DemoTiming,
    acts: Vec<Act>,
    /// Injections and repairs not reported yet.
    cues: Vec<(Step, DemoEvent)>,
    modules: BTreeMap<ModuleName, DemoModule>,
    /// The number of components of all modules.
    components: u64,
    /// Whether the number of components that agree with their references was reported.
    compared: bool,
    /// Processes that have not appeared.
    missing: Vec<String>,
    /// The named faults, with the facts of their first naming.
    named: BTreeMap<ComponentPath, DetectionFacts>,
    /// Their kinds.
    kinds: BTreeMap<ComponentPath, Candidate>,
    now: Step,
    /// Samples that the plant could not send.
    unsent: u64,
}

impl DemoCourse {
    pub(super) fn new(
        timing: DemoTiming,
        acts: Vec<Act>,
        modules: &[ModuleName],
        components: u64,
    ) -> DemoCourse {
        let mut cues: Vec<_> = acts.iter().flat_map(cues).collect();
        cues.sort_by_key(|(step, _)| std::cmp::Reverse(*step));
        let mut missing: Vec<_> = modules.iter().map(ModuleName::to_string).collect();
        missing.push(vocabulary::keys::PLANT.to_owned());
        let modules =
            modules.iter().map(|module| (module.clone(), DemoModule::default())).collect();
        let (named, kinds, compared, now, unsent) = Default::default();
        DemoCourse {
            timing,
            acts,
            cues,
            modules,
            components,
            compared,
            missing,
            named,
            kinds,
            now,
            unsent,
        }
    }

    /// Processes that have not appeared yet.
    pub(super) fn missing(&self) -> &[String] {
        &self.missing
    }

    /// The step that all modules have reached.
    pub(super) fn now(&self) -> Step {
        self.now
    }

    /// Whether every module has passed the end of the last story.
    pub(super) fn has_ended(&self) -> bool {
        let end = self.acts.last().map_or(Step(0), |act| act.over);
        self.modules.values().all(|module| module.step >= end)
    }

    /// Handles an event; appends what is to be reported to `events`.
    pub(super) fn on_event(&mut self, event: &ObservedEvent, events: &mut Vec<DemoEvent>) {
        match &event.news {
            News::Fault(transition) | News::Present(transition) => {
                self.transition(transition, events);
            }
            News::Identification(found) => self.identification(found, events),
            News::Phase(change) => {
                let Some(module) = self.modules.get_mut(&change.module) else { return };
                let is_in_service = change.phase == ModulePhase::InService;
                if is_in_service && !module.in_service {
                    let since_step = change.step.unwrap_or(module.step);
                    let module = change.module.clone();
                    events.push(DemoEvent::InService { module, since_step });
                }
                module.in_service = is_in_service;
            }
            News::Presence { who, there: true, .. } => {
                if let Some(place) = self.missing.iter().position(|missing| missing == who) {
                    self.missing.remove(place);
                    events.push(DemoEvent::Ready { process: who.clone() });
                }
            }
            News::Presence { .. }
            | News::SeveralProcesses { .. }
            | News::Missed { .. }
            | News::Unreadable { .. }
            | News::Connection { .. }
            | News::Lost { .. } => {
                let EventLine { who, what, why, .. } = EventLine::of(event);
                events.push(DemoEvent::Trouble {
                    text: format!("{who} {what} {why}").trim().to_owned(),
                });
            }
        }
    }

    /// Handles the modules' reports about themselves.
    pub(super) fn on_scene(&mut self, scene: &Scene, events: &mut Vec<DemoEvent>) {
        for view in &scene.modules {
            let (Some(status), Some(known)) = (&view.status, self.modules.get_mut(&view.module))
            else {
                continue;
            };
            known.step = known.step.max(status.step.unwrap_or_default());
            known.verified = status.verified;
        }
        let now = self.modules.values().map(|module| module.step).max();
        self.advance(now.unwrap_or_default(), events);
        self.report_comparison(events);
    }

    /// Handles the plant's status.
    pub(super) fn on_plant(&mut self, status: &PlantStatus, events: &mut Vec<DemoEvent>) {
        if status.samples_unsent > self.unsent {
            self.unsent = status.samples_unsent;
            let text = format!("the plant could not send {} samples", self.unsent);
            events.push(DemoEvent::Trouble { text });
        }
    }

    /// Advances the time and reports the injections and repairs that are due.
    fn advance(&mut self, step: Step, events: &mut Vec<DemoEvent>) {
        let seconds = |step: Step| (step.0 as f64 * self.timing.step_s) as u64;
        let of_step = Step(self.timing.warm_up);
        let before = self.now;
        self.now = self.now.max(step);
        if seconds(self.now) > seconds(before) && self.now < of_step {
            events.push(DemoEvent::WarmingUp { step: self.now, of_step });
        }
        while let Some((_, cue)) = self.cues.pop_if(|(due, _)| *due <= self.now) {
            events.push(cue);
        }
    }

    /// Reports once how many components agree with their references, after every module has compared some and before
    /// any fault.
    fn report_comparison(&mut self, events: &mut Vec<DemoEvent>) {
        let modules = || self.modules.values();
        if self.compared || modules().any(|module| !module.in_service || module.verified == 0) {
            return;
        }
        self.compared = true;
        if self.acts.first().is_none_or(|act| act.injected > self.now) {
            let agree = modules().map(|module| module.verified).sum();
            events.push(DemoEvent::Compared { step: self.now, agree, of: self.components });
        }
    }

    fn transition(&mut self, transition: &FaultTransition, events: &mut Vec<DemoEvent>) {
        let step = transition.decided_step.unwrap_or(self.now);
        self.advance(step, events);
        if transition.state() == FaultState::Latched {
            let measured = StateRow::of_component(transition).measured;
            self.named.entry(transition.component.clone()).or_insert(measured);
        }
        // A return to normal is not reported.
        if transition.state() != FaultState::Normal {
            events.push(DemoEvent::Verdict { step, transition: Box::new(transition.clone()) });
        }
    }

    /// A kind counts, and is reported, if it was decided while the fault was present and differs from the previous one.
    fn identification(&mut self, found: &Identification, events: &mut Vec<DemoEvent>) {
        let step = found.as_of_step;
        self.advance(step, events);
        let act = self.acts.iter().find(|act| act.component == found.component);
        let Some(kind) = found.kind().filter(|_| act.is_some_and(|act| step < act.repaired)) else {
            return;
        };
        let before = self.kinds.insert(found.component.clone(), *kind);
        if before.is_none_or(|before| before.kind != kind.kind) {
            let identification = Box::new(found.clone());
            events.push(DemoEvent::Identified { step, identification });
        }
    }

    /// Compares injected with named faults.
    pub(super) fn summary(&self, pids: Vec<u32>) -> DemoSummary {
        let mut diagnosed: Vec<DiagnosedFault> =
            self.named.iter().map(|(component, named)| self.diagnosed(component, named)).collect();
        diagnosed.sort_by_key(|fault| fault.detection_step);
        let is_named_in_time = |act: &Act| {
            let named = self.named.get(&act.component);
            let detected = named.and_then(|named| named.detection_step);
            detected.is_some_and(|step| (act.injected..act.repaired).contains(&step))
        };
        let exact = self.named.len() == self.acts.len() && self.acts.iter().all(is_named_in_time);
        DemoSummary { injected: self.acts.clone(), diagnosed, exact, pids }
    }

    fn diagnosed(&self, component: &ComponentPath, named: &DetectionFacts) -> DiagnosedFault {
        let act = self.acts.iter().find(|act| act.component == *component);
        let delay_ms = |step: Option<Step>| {
            let (step, injected) = (step?, act?.injected);
            // Rounded to the microsecond: steps are whole milliseconds, but their product is not exact.
            let ms = step.0.checked_sub(injected.0)? as f64 * self.timing.step_s * 1e3;
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
fn cues(act: &Act) -> [(Step, DemoEvent); 2] {
    let component = act.component.clone();
    let injected = DemoEvent::Injected {
        step: act.injected,
        component: component.clone(),
        fault: act.fault,
        story: act.title,
    };
    [
        (act.injected, injected),
        (act.repaired, DemoEvent::Repaired { step: act.repaired, component }),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use observer::testing::{self, identification, scene};
    use vocabulary::fault::Fault;

    const TIMING: DemoTiming = DemoTiming { step_s: 1e-3, warm_up: 50, effects: 25, interval: 20 };

    fn course() -> DemoCourse {
        let act = |path: &str, fault, injected| Act {
            title: "t",
            component: path.parse().unwrap(),
            fault,
            injected: Step(injected),
            repaired: Step(injected + 15),
            over: Step(injected + 900),
        };
        let acts = vec![
            act("m1/sensor/g1", Fault::ZeroOutput {}, 100),
            act("m2/actuator/a1", Fault::HardOver {}, 1000),
        ];
        DemoCourse::new(TIMING, acts, &["m1".parse().unwrap(), "m2".parse().unwrap()], 12)
    }

    fn shown(course: &mut DemoCourse, news: News) -> Vec<DemoEvent> {
        let mut events = Vec::new();
        course.on_event(&ObservedEvent { number: 1, time_unix_ns: 0, news }, &mut events);
        events
    }

    /// The modules report these steps and numbers of components that agree.
    fn seen(course: &mut DemoCourse, modules: &[(&str, u64, u64)]) -> Vec<DemoEvent> {
        let module = |(name, step, verified): &(&str, u64, u64)| {
            let mut module = testing::module(name, ModulePhase::InService, Vec::new());
            let status = module.status.as_mut().unwrap();
            (status.step, status.verified) = (Some(Step(*step)), *verified);
            module
        };
        let mut events = Vec::new();
        course.on_scene(&scene(modules.iter().map(module).collect()), &mut events);
        events
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
            number: 1,
            not_monitored: std::collections::BTreeMap::new(),
            before: None,
            run: None,
            step: Some(Step(50)),
            reason: String::new(),
            time_unix_ns: 0,
        })
    }

    #[test]
    fn an_injection_is_reported_before_what_follows_from_it() {
        let events = shown(&mut course(), verdict("m1/sensor/g1", FaultState::Latched, 104));
        assert!(matches!(events[0], DemoEvent::Injected { step: Step(100), .. }), "{events:?}");
        assert!(matches!(events[1], DemoEvent::Verdict { step: Step(104), .. }), "{events:?}");
        assert_eq!(events.len(), 2);
        let over = shown(&mut course(), verdict("m1/sensor/g1", FaultState::Normal, 9));
        assert_eq!(over, []);
    }

    #[test]
    fn the_demo_ends_after_the_slowest_module() {
        let mut course = course();
        seen(&mut course, &[("m1", 1900, 0), ("m2", 1899, 0)]);
        assert!(!course.has_ended());
        seen(&mut course, &[("m2", 1900, 0)]);
        assert!(course.has_ended());
    }

    #[test]
    fn processes_are_reported_once_each_and_missed_until_then() {
        let mut course = course();
        let token = |who: &str, there| News::Presence {
            structure: "t".parse().unwrap(),
            who: who.to_owned(),
            there,
            at_start: false,
        };
        assert_eq!(
            shown(&mut course, token("m2", true)),
            [DemoEvent::Ready { process: "m2".into() }]
        );
        assert_eq!(shown(&mut course, token("m2", true)), []);
        assert_eq!(course.missing(), ["m1", "plant"]);
        let gone = shown(&mut course, token("m2", false));
        assert_eq!(gone, [DemoEvent::Trouble { text: "m2 GONE".to_owned() }]);
    }

    #[test]
    fn that_components_agree_is_reported_once_every_module_has_compared_them() {
        let mut course = course();
        for module in ["m1", "m2"] {
            assert_eq!(shown(&mut course, in_service(module)).len(), 1);
            assert_eq!(shown(&mut course, in_service(module)), [], "it is reported once");
        }
        assert_eq!(seen(&mut course, &[("m1", 60, 6), ("m2", 60, 0)]), []);
        let compared = DemoEvent::Compared { step: Step(60), agree: 11, of: 12 };
        assert_eq!(seen(&mut course, &[("m2", 60, 5)]), [compared]);
        assert_eq!(seen(&mut course, &[("m2", 60, 6)]), []);
    }

    fn exact(verdicts: &[(&str, u64)]) -> bool {
        let mut course = course();
        for &(component, step) in verdicts {
            shown(&mut course, verdict(component, FaultState::Latched, step));
        }
        course.summary(vec![1]).exact
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
        let mut course = course();
        shown(&mut course, verdict("m1/sensor/g1", FaultState::Latched, 105));
        let mut news = |kind: &str, step, decided| {
            let found = Identification {
                as_of_step: Step(step),
                component: "m1/sensor/g1".parse().unwrap(),
                ..identification(decided, &[kind])
            };
            let events = shown(&mut course, News::Identification(Box::new(found)));
            events.iter().any(|entry| matches!(entry, DemoEvent::Identified { .. }))
        };
        assert!(!news("bias", 104, false));
        assert!(news("bias", 105, true));
        assert!(!news("bias", 106, true));
        assert!(news("zero_output", 110, true));
        assert!(!news("intermittent", 115, true));
        let summary = course.summary(vec![]);
        let kind = summary.diagnosed[0].identified.as_ref().map(|found| found.kind.as_str());
        assert_eq!(kind, Some("zero_output"));
    }

    #[test]
    fn only_the_first_latching_counts_and_other_states_do_not() {
        let mut course = course();
        shown(&mut course, verdict("m1/sensor/g2", FaultState::Explained, 100));
        shown(&mut course, verdict("m1/sensor/g1", FaultState::Latched, 103));
        shown(&mut course, verdict("m1/sensor/g1", FaultState::Latched, 900));
        let summary = course.summary(vec![]);
        assert_eq!(summary.diagnosed.len(), 1);
        assert_eq!(summary.diagnosed[0].delay_ms, Some(3.0));
    }
}
