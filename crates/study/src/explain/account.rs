//! Collects the events of a run: every change with its verdict.

use diagnosis::state::{Condition, WindowLength};
use diagnosis::{
    Diagnoser, FirstChange, KnownChange, ModuleSetup, Reason, Rule, Transition, Verdict,
};
use vocabulary::{ComponentPath, ModuleName, Step};

use super::words::StepClock;
use crate::campaign::Campaign;
use crate::case::{CaseRun, SampleGap};
use crate::engine::{Engine, prepare};
use crate::error::StudyError;
use crate::group::{Diagnosed, RigEvent};
use crate::rig::{Rig, TimedFault};
use crate::scenarios::GageReading;
use crate::system::System;

/// The outcome of a change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ChangeFate {
    /// Its component was named as faulty.
    Fault { decided: Step },
    /// Another component's change, at the step `since`, explains it.
    Explained { by: ComponentPath, since: Step, decided: Step },
    /// Its component had been named before, because of the change at this step, so this change was not judged.
    Known { since: Step },
    /// The run ended before it was judged.
    Open,
}

/// One change of one channel.
#[derive(Debug, Clone)]
pub(super) struct Changed {
    pub(super) component: ComponentPath,
    pub(super) step: Step,
    /// Since when the divergence had been rising.
    pub(super) rising_since: Step,
    /// D/γ at the change.
    pub(super) ratio: f64,
    /// The largest D/γ until the end of the tie window, which decides ties.
    pub(super) peak: f64,
    /// The last step with D at γ or above.
    pub(super) until: Step,
    pub(super) fate: ChangeFate,
}

impl Changed {
    /// A change that is not judged yet.
    fn of(occurrence: &RigEvent) -> Option<Self> {
        let (component, change) = occurrence.change()?;
        Some(Self {
            component,
            step: change.step,
            rising_since: change.onset,
            ratio: change.ratio,
            peak: change.ratio,
            until: change.step,
            fate: ChangeFate::Open,
        })
    }

    /// The step as of which it was judged.
    pub(super) fn decided(&self) -> Option<Step> {
        match self.fate {
            ChangeFate::Fault { decided } | ChangeFate::Explained { decided, .. } => Some(decided),
            ChangeFate::Known { .. } | ChangeFate::Open => None,
        }
    }

    fn known(&self) -> KnownChange {
        let (path, until) = (self.component.clone(), Some(self.until));
        let onset = self.rising_since;
        KnownChange { path, onset, step: self.step, ratio: self.peak, until }
    }
}

/// A component that became faulty.
pub(super) struct FaultyChannel {
    /// Its first fault.
    pub(super) first: TimedFault,
    /// For a gage: its reading right before the fault.
    pub(super) reading: Option<GageReading>,
    /// The step and value of the channel's largest D/γ since the fault began.
    pub(super) peak: Option<(Step, f64)>,
}

/// The events of a run.
pub(super) struct Account<'a> {
    pub(super) system: &'a System,
    pub(super) number: u64,
    /// Its kind.
    pub(super) kind: String,
    pub(super) seed: u64,
    pub(super) faults: Vec<TimedFault>,
    pub(super) gaps: Vec<SampleGap>,
    /// Its faulty components, in the order of onset.
    pub(super) faulty: Vec<FaultyChannel>,
    /// The components declared faulty, in order.
    pub(super) diagnosed: Vec<Diagnosed>,
    /// The step after its last one.
    pub(super) end: Step,
    pub(super) base_speed_m_per_s: f64,
    /// All events with their steps, in order.
    pub(super) moments: Vec<(Step, RigEvent)>,
    /// Conditions of components that changed, in order.
    pub(super) conditions: Vec<(Step, ComponentPath, String)>,
    /// All changes, in the order of their steps.
    pub(super) changes: Vec<Changed>,
    /// The same changes as a module judges them.
    known: Vec<KnownChange>,
    /// The step from which on every channel was watched.
    pub(super) watching_since: Option<Step>,
}

impl<'a> Account<'a> {
    /// Runs a case and collects its events.
    pub(super) fn take<C: Campaign>(
        campaign: &'a C,
        number: u64,
        engine: &Engine,
    ) -> Result<(Self, C::Row), StudyError> {
        let system = &campaign.systems()[campaign.plant_of(number).0];
        let plants = engine.commission(campaign, &[number])?;
        let (case, rig) = prepare(campaign, number, &plants)?;
        let mut account = Account {
            system,
            number,
            kind: case.kind.to_string(),
            seed: case.seed,
            faults: case.faults.clone(),
            gaps: case.gaps.clone(),
            faulty: Vec::new(),
            diagnosed: Vec::new(),
            end: Step(0),
            base_speed_m_per_s: 0.0,
            moments: Vec::new(),
            conditions: Vec::new(),
            changes: Vec::new(),
            known: Vec::new(),
            watching_since: None,
        };
        for first in &case.faults {
            if account.faulty.iter().all(|known| known.first.component != first.component) {
                let reading = GageReading::new(system, first);
                account.faulty.push(FaultyChannel { first: first.clone(), reading, peak: None });
            }
        }
        let mut watch = |rig: &Rig, occurrences: &[RigEvent]| {
            account.look(rig, occurrences);
            Ok(())
        };
        let mut run = CaseRun::new(&case, rig, &mut watch);
        let row = campaign.judge(&case, &mut run)?;
        let diagnosed = run.diagnosed();
        account.diagnosed = diagnosed;
        judge(&mut account.changes, &account.moments);
        account.known = account.changes.iter().map(Changed::known).collect();
        Ok((account, row))
    }

    /// The onset of a component's fault, if it was faulty at this step.
    pub(super) fn faulty_since(&self, component: &ComponentPath, step: Step) -> Option<Step> {
        let of = |fault: &&TimedFault| fault.component == *component && fault.at <= step;
        self.faults.iter().filter(of).map(|fault| fault.at).max()
    }

    /// The verdict on a faulty component, if it was named after its first fault had begun.
    pub(super) fn named(&self, faulty: &FaultyChannel) -> Option<&Diagnosed> {
        let TimedFault { component, at, .. } = &faulty.first;
        self.diagnosed.iter().find(|d| d.component == *component && d.detection >= *at)
    }

    /// Components that were named but had never been faulty when they changed.
    pub(super) fn wrong(&self) -> impl Iterator<Item = &Diagnosed> {
        let is_wrong = |d: &&Diagnosed| self.faulty_since(&d.component, d.detection).is_none();
        self.diagnosed.iter().filter(is_wrong)
    }

    pub(super) fn clock(&self) -> StepClock {
        StepClock { step_s: self.system.parameters.step_s }
    }

    fn setup(&self, module: &ModuleName) -> Option<&'a ModuleSetup> {
        self.system.setups.iter().find(|setup| setup.module == *module)
    }

    /// The rule by which a module judges.
    pub(super) fn rule(&self, module: &ModuleName) -> Rule {
        self.setup(module).map_or(Rule::default(), |setup| setup.isolation.rule)
    }

    /// The number of steps within which a module treats changes as a tie.
    pub(super) fn tie_steps(&self, module: &ModuleName) -> u64 {
        self.setup(module).map_or(0, |setup| setup.isolation.tie_steps)
    }

    /// Why the rule of the first change judges a change as it does, by its module's settings.
    pub(super) fn reason(&self, changed: &Changed) -> Option<Reason> {
        let setup = self.setup(&changed.component.module)?;
        let rule = FirstChange::new(&setup.isolation, &setup.detection.divergence);
        rule.reason(&self.known, &changed.component, changed.step)
    }

    /// The change of a component at a step.
    pub(super) fn change(&self, component: &ComponentPath, step: Step) -> Option<&Changed> {
        self.changes.iter().find(|c| c.step == step && c.component == *component)
    }

    /// Processes the latest step of the run.
    fn look(&mut self, rig: &Rig, occurrences: &[RigEvent]) {
        let Some(step) = rig.samples().first().map(|sample| sample.step) else { return };
        (self.end, self.base_speed_m_per_s) =
            (step.plus(1), rig.plant().conditions().base_speed_m_per_s);
        self.changes.extend(occurrences.iter().filter_map(Changed::of));
        self.moments.extend(occurrences.iter().map(|occurrence| (step, occurrence.clone())));
        if self.watching_since.is_none() && is_watching(rig) {
            self.watching_since = Some(step);
        }
        let tie = self.system.setups.iter().map(|setup| setup.isolation.tie_steps).max();
        let tie = tie.unwrap_or_default();
        for change in self.changes.iter_mut().rev().take_while(|c| step.since(c.step) <= tie) {
            change.peak = change.peak.max(excess(rig, &change.component));
        }
        self.prolong(rig, step);
        self.look_at_conditions(rig, step);
        for faulty in &mut self.faulty {
            if let Some(reading) = &mut faulty.reading {
                reading.follow(rig);
            }
            if step >= faulty.first.at {
                let ratio = ratio(rig, &faulty.first.component);
                if faulty.peak.is_none_or(|(_, largest)| ratio > largest) {
                    faulty.peak = Some((step, ratio));
                }
            }
        }
    }

    /// Records changed conditions after a window has ended; initial agreement is not recorded.
    fn look_at_conditions(&mut self, rig: &Rig, step: Step) {
        let ended = |diagnoser: &&Diagnoser| diagnoser.window(WindowLength::Long).is_some();
        for diagnoser in rig.diagnosers().iter().filter(ended) {
            for (component, condition) in diagnoser.components().iter().zip(diagnoser.conditions())
            {
                let (module, component) = (diagnoser.module().clone(), component.clone());
                let path = ComponentPath { module, component };
                let now = in_words(condition);
                let mut before = self.conditions.iter().rev().filter(|(_, of, _)| *of == path);
                if before.next().map_or(AGREES, |(.., words)| words.as_str()) != now {
                    self.conditions.push((step, path, now));
                }
            }
        }
    }
}

/// The condition of a component in agreement with its reference.
const AGREES: &str = "agrees with its reference";

fn in_words(condition: &Condition) -> String {
    match condition {
        Condition::NotVerified | Condition::NotCompared | Condition::Agrees { .. } => {
            AGREES.to_owned()
        }
        Condition::Doubtful { .. } => "departed once".to_owned(),
        Condition::Departed { .. } => "has departed from its reference".to_owned(),
        Condition::OneOf { components, .. } => {
            let names: Vec<String> = components.iter().map(ToString::to_string).collect();
            format!("is one of {}", names.join(", "))
        }
        Condition::CannotTell { obstacle } => format!("cannot be compared: {obstacle}"),
    }
}

impl Account<'_> {
    /// The latest change of a channel lasts as long as D is at γ or above.
    fn prolong(&mut self, rig: &Rig, step: Step) {
        let mut seen: Vec<&ComponentPath> = Vec::new();
        for change in self.changes.iter_mut().rev() {
            if seen.contains(&&change.component) {
                continue;
            }
            if ratio(rig, &change.component) >= 1.0 {
                change.until = step;
            }
            seen.push(&change.component);
        }
    }
}

fn is_watching(rig: &Rig) -> bool {
    let in_service = |d: &diagnosis::Diagnoser| d.phase() == vocabulary::ModulePhase::InService;
    rig.diagnosers().iter().all(in_service)
}

/// D/γ of a component at the latest step.
fn ratio(rig: &Rig, path: &ComponentPath) -> f64 {
    let evidence =
        channel(rig, path).and_then(|(diagnoser, place)| diagnoser.evidence().get(place));
    evidence.map_or(0.0, diagnosis::Evidence::ratio)
}

/// Likewise, reduced by the part that a cylinder's demand explains.
fn excess(rig: &Rig, path: &ComponentPath) -> f64 {
    channel(rig, path).map_or(0.0, |(diagnoser, place)| diagnoser.excess(place))
}

fn channel<'a>(rig: &'a Rig, path: &ComponentPath) -> Option<(&'a Diagnoser, usize)> {
    let diagnoser = rig.diagnosers().iter().find(|d| *d.module() == path.module)?;
    let place = diagnoser.components().iter().position(|c| *c == path.component)?;
    Some((diagnoser, place))
}

/// Determines the outcome of every change.
fn judge(changes: &mut [Changed], moments: &[(Step, RigEvent)]) {
    let transitions: Vec<_> = moments.iter().filter_map(|(_, o)| o.transition()).collect();
    for changed in changes {
        for (path, transition) in &transitions {
            if *path == changed.component {
                changed.take(transition);
            }
        }
    }
}

impl Changed {
    /// Applies a transition of its component.
    fn take(&mut self, transition: &Transition) {
        let Transition { detection, decided, .. } = *transition;
        if detection == self.step {
            self.rising_since = transition.onset;
        }
        match &transition.verdict {
            Verdict::Latched if detection == self.step => self.fate = ChangeFate::Fault { decided },
            Verdict::Latched if detection < self.step => {
                self.fate = ChangeFate::Known { since: detection };
            }
            Verdict::Explained { by, since } if detection == self.step => {
                self.fate = ChangeFate::Explained { by: by.clone(), since: *since, decided };
            }
            _ => {}
        }
    }
}
