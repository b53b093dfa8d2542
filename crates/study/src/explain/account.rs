//! What happened in a run, sorted out: every change with its verdict.

use diagnosis::{
    Diagnoser, FirstChange, IsolationSettings, KnownChange, Reason, Transition, Verdict,
};
use names::{ComponentPath, ModuleName, Step};

use super::words::Clock;
use crate::campaign::Campaign;
use crate::error::StudyError;
use crate::record::ScenarioRecord;
use crate::rig::{Occurrence, Rig};

/// A change that explains others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Root {
    pub(super) component: ComponentPath,
    pub(super) step: Step,
}

/// What became of a change.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fate {
    /// Its component was named as faulty.
    Fault { decided: Step },
    /// Another component's change explains it.
    Explained { root: Root, decided: Step },
    /// Its component was named before, by the change at this step: it was not judged any more.
    Known { since: Step },
    /// It was not judged before the run ended.
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
    /// The largest D/γ until the tie window was over: this decides ties.
    pub(super) peak: f64,
    /// The last step with D at γ or above.
    pub(super) until: Step,
    pub(super) fate: Fate,
}

impl Changed {
    /// As of which step it was judged.
    pub(super) fn decided(&self) -> Option<Step> {
        match self.fate {
            Fate::Fault { decided } | Fate::Explained { decided, .. } => Some(decided),
            Fate::Known { .. } | Fate::Open => None,
        }
    }

    fn known(&self) -> KnownChange {
        let (path, until) = (self.component.clone(), Some(self.until));
        let onset = self.rising_since;
        KnownChange { path, onset, step: self.step, ratio: self.peak, until }
    }
}

/// A run, sorted out.
pub(super) struct Account<'a> {
    pub(super) campaign: &'a Campaign,
    pub(super) record: ScenarioRecord,
    /// All that happened, with its step, in order.
    pub(super) moments: Vec<(Step, Occurrence)>,
    /// All changes, in the order of their steps.
    pub(super) changes: Vec<Changed>,
    /// The same, as a module judges them.
    known: Vec<KnownChange>,
    /// From when on every channel was watched.
    pub(super) watching_since: Option<Step>,
    /// When the faulty channel's D/γ was largest since the fault began, and how large.
    pub(super) faulty_peak: Option<(Step, f64)>,
}

impl<'a> Account<'a> {
    /// Runs a scenario and sorts out what happens.
    pub(super) fn take(campaign: &'a Campaign, number: u64) -> Result<Self, StudyError> {
        let mut observer = Observer::new(campaign, campaign.scenario(number)?.injection.component);
        let onset = campaign.scenario(number)?.injection.at;
        let record = campaign.follow_scenario(number, |rig, occurrences| {
            observer.look(rig, occurrences, onset);
            Ok(())
        })?;
        let Observer { moments, mut changes, watching_since, faulty_peak, .. } = observer;
        judge(&mut changes, &moments);
        let known = changes.iter().map(Changed::known).collect();
        Ok(Account { campaign, record, moments, changes, known, watching_since, faulty_peak })
    }

    pub(super) fn clock(&self) -> Clock {
        Clock { step_s: self.campaign.parameters.step_s }
    }

    /// How a module judges.
    pub(super) fn isolation(&self, module: &ModuleName) -> Option<&IsolationSettings> {
        let mut setups = self.campaign.setups.iter();
        setups.find(|setup| setup.module == *module).map(|setup| &setup.isolation)
    }

    /// Why the rule of the first change judges a change as it does, by its module's settings.
    pub(super) fn reason(&self, changed: &Changed) -> Option<Reason> {
        let mut setups = self.campaign.setups.iter();
        let setup = setups.find(|setup| setup.module == changed.component.module)?;
        let rule = FirstChange::new(&setup.isolation, &setup.detection.divergence);
        rule.reason(&self.known, &changed.component, changed.step)
    }

    /// The change of a component at a step.
    pub(super) fn change(&self, component: &ComponentPath, step: Step) -> Option<&Changed> {
        self.changes.iter().find(|c| c.step == step && c.component == *component)
    }
}

/// Looks at every step of a run.
struct Observer {
    faulty: ComponentPath,
    longest_tie: u64,
    moments: Vec<(Step, Occurrence)>,
    changes: Vec<Changed>,
    watching_since: Option<Step>,
    faulty_peak: Option<(Step, f64)>,
}

impl Observer {
    fn new(campaign: &Campaign, faulty: ComponentPath) -> Self {
        let longest_tie = campaign.setups.iter().map(|setup| setup.isolation.tie_steps).max();
        Self {
            faulty,
            longest_tie: longest_tie.unwrap_or_default(),
            moments: Vec::new(),
            changes: Vec::new(),
            watching_since: None,
            faulty_peak: None,
        }
    }

    fn look(&mut self, rig: &Rig, occurrences: &[Occurrence], onset: Step) {
        let Some(step) = rig.samples().first().map(|sample| sample.step) else { return };
        self.changes.extend(occurrences.iter().filter_map(changed));
        self.moments.extend(occurrences.iter().map(|occurrence| (step, occurrence.clone())));
        if self.watching_since.is_none() && is_watching(rig) {
            self.watching_since = Some(step);
        }
        let tie = self.longest_tie;
        for change in self.changes.iter_mut().rev().take_while(|c| step.since(c.step) <= tie) {
            change.peak = change.peak.max(excess(rig, &change.component));
        }
        self.prolong(rig, step);
        if step >= onset {
            let ratio = ratio(rig, &self.faulty);
            if self.faulty_peak.is_none_or(|(_, largest)| ratio > largest) {
                self.faulty_peak = Some((step, ratio));
            }
        }
    }
}

impl Observer {
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

fn changed(occurrence: &Occurrence) -> Option<Changed> {
    let Occurrence::Change { module, change } = occurrence else { return None };
    Some(Changed {
        component: ComponentPath { module: module.clone(), component: change.component.clone() },
        step: change.step,
        rising_since: change.onset,
        ratio: change.ratio,
        peak: change.ratio,
        until: change.step,
        fate: Fate::Open,
    })
}

fn is_watching(rig: &Rig) -> bool {
    let in_service =
        |d: &diagnosis::Diagnoser| matches!(d.phase(), diagnosis::Phase::InService { .. });
    rig.diagnosers().iter().all(in_service)
}

/// D/γ of a component at the latest step.
fn ratio(rig: &Rig, path: &ComponentPath) -> f64 {
    let evidence =
        channel(rig, path).and_then(|(diagnoser, place)| diagnoser.evidence().get(place));
    evidence.map_or(0.0, diagnosis::Evidence::ratio)
}

/// The same, less what a cylinder's demand explains of it.
fn excess(rig: &Rig, path: &ComponentPath) -> f64 {
    channel(rig, path).map_or(0.0, |(diagnoser, place)| diagnoser.excess(place))
}

fn channel<'a>(rig: &'a Rig, path: &ComponentPath) -> Option<(&'a Diagnoser, usize)> {
    let diagnoser = rig.diagnosers().iter().find(|d| *d.module() == path.module)?;
    let place = diagnoser.components().iter().position(|c| *c == path.component)?;
    Some((diagnoser, place))
}

/// Finds out what became of every change.
fn judge(changes: &mut [Changed], moments: &[(Step, Occurrence)]) {
    let transitions: Vec<_> = moments.iter().filter_map(|(_, o)| transition(o)).collect();
    for changed in changes {
        for (path, transition) in &transitions {
            if *path == changed.component {
                changed.take(transition);
            }
        }
    }
}

fn transition(occurrence: &Occurrence) -> Option<(ComponentPath, &Transition)> {
    let Occurrence::Transition { module, transition } = occurrence else { return None };
    let component = transition.component.clone();
    Some((ComponentPath { module: module.clone(), component }, transition))
}

impl Changed {
    /// Takes a transition of its component into account.
    fn take(&mut self, transition: &Transition) {
        let Transition { detection, decided, .. } = *transition;
        if detection == self.step {
            self.rising_since = transition.onset;
        }
        match &transition.verdict {
            Verdict::Latched if detection == self.step => self.fate = Fate::Fault { decided },
            Verdict::Latched if detection < self.step => {
                self.fate = Fate::Known { since: detection };
            }
            Verdict::Explained { by, since } if detection == self.step => {
                let root = Root { component: by.clone(), step: *since };
                self.fate = Fate::Explained { root, decided };
            }
            _ => {}
        }
    }
}
