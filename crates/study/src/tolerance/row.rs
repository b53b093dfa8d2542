//! The result of a case: what the fault cost with each measure, and how true the corrected reading was.

use std::collections::{BTreeMap, VecDeque};

use serde::{Deserialize, Serialize};
use vocabulary::{Component, ComponentPath, IdentifiedKind, ReadingSource, Step, fault::FaultKind};

use super::motion::{MotionFollower, RunMotion};
use super::{Measure, ToleranceTask};
use crate::case::{CampaignCase, CaseRun};
use crate::conditions::Situation;
use crate::error::StudyError;
use crate::group::RigEvent;
use crate::rig::Rig;
use crate::system::{System, gage_length_m};

/// The controller's limit of innovations: ten times the noise of a gage.
const LARGEST_INNOVATION: f64 = 3e-6;

/// How true the corrected reading was, from the verdict to the end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CorrectedError {
    /// Root mean square of the error as strain.
    pub rms_strain: f64,
    /// The share of its steps in which what it should have read was within its interval.
    pub covered: f64,
    /// Half the interval's width on average, as strain.
    pub half_width_strain: f64,
    /// The share of steps in which no reading was given.
    pub not_valid: f64,
}

/// Traces are kept of faults that multiply the top's motion by so much.
const TRACED_FROM: f64 = 1.5;

/// The result of a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ToleranceRow {
    /// The kind of fault.
    pub kind: FaultKind,
    /// What else happens.
    pub situation: Situation,
    /// The faulty component.
    pub component: ComponentPath,
    /// The fault in words.
    pub fault: String,
    /// Time from the onset to the verdict \[s\]; `None` if there was none.
    pub named_after_s: Option<f64>,
    /// Healthy components that were named.
    pub wrong: Vec<ComponentPath>,
    /// Healthy components that were named with a measure.
    pub wrong_with: BTreeMap<Measure, Vec<ComponentPath>>,
    /// Largest base wind speed \[m/s\].
    pub wind_m_per_s: f64,
    /// The run without the fault.
    pub without_fault: RunMotion,
    /// The run with each measure, relative to the run without the fault.
    pub relative: BTreeMap<Measure, RunMotion>,
    /// The largest step of a demand at the verdict, with each measure that corrects \[N\].
    pub demand_step_n: BTreeMap<Measure, f64>,
    /// The largest step of a demand when the gage is reset, with each measure that corrects \[N\].
    pub return_step_n: BTreeMap<Measure, f64>,
    /// Time from the onset until something was done about the cylinder \[s\].
    pub acted_after_s: Option<f64>,
    /// How true the corrected reading was, where it was used.
    pub corrected: Option<CorrectedError>,
}

impl ToleranceRow {
    pub(super) fn of(
        case: &CampaignCase<ToleranceTask>,
        run: &mut CaseRun,
        system: &System,
        late_steps: u64,
    ) -> Result<Self, StudyError> {
        let fault = case.faults.first().ok_or(StudyError::NothingToBreak)?;
        let fresh = run.rig.clone();
        let mut rows = BTreeMap::new();
        // A cylinder that is hard over pushes in both.
        let others = &case.faults[1..];
        let second = others.iter().filter(|_| case.kind.situation == Situation::Second);
        let gone = [fault].into_iter().chain(second);
        let healthy =
            gone.fold(fresh.clone(), |rig, fault| rig.without_faults_of(&fault.component));
        let mut without_fault =
            follow(&mut CaseRun::new(case, healthy, &mut |_, _| Ok(())), case, system, |_| Ok(()))?;
        let healthy_named = |run: &CaseRun| {
            let named = run.diagnosed().into_iter().map(|found| found.component);
            let is_healthy =
                |path: &ComponentPath| case.faults.iter().all(|fault| fault.component != *path);
            named.filter(is_healthy).collect::<Vec<_>>()
        };
        let mut wrong_with = BTreeMap::new();
        let (mut demand_step_n, mut return_step_n) = (BTreeMap::new(), BTreeMap::new());
        let mut corrected = None;
        let mut acted = None;
        for measure in Measure::against(fault.component.component.kind()) {
            let measure = *measure;
            let mut rig = fresh.clone();
            if measure.corrects() {
                rig.correct(late_steps);
            }
            if measure.shuts_off() || measure.reallocates() {
                rig.identify(None);
            }
            if measure.limits() {
                rig.limit_innovations(LARGEST_INNOVATION);
            }
            let mut watcher = Watcher::new(&rig, &fault.component);
            let mut watch = |rig: &Rig, _: &[RigEvent]| {
                watcher.take(rig);
                Ok(())
            };
            let mut of_measure = CaseRun::new(case, rig, &mut watch);
            let mut cylinders =
                Cylinders { measure, late_steps, seen: 0, due: VecDeque::new(), acted: None };
            if case.kind.wrong {
                let due = case.kind.from.plus(late_steps);
                cylinders.due.push_back((due, fault.component.clone()));
            }
            let motion = follow(&mut of_measure, case, system, |run| cylinders.act(run))?;
            rows.insert(measure, motion.over(&without_fault));
            acted = acted.or(cylinders.acted);
            let named = healthy_named(&of_measure);
            if !named.is_empty() {
                wrong_with.insert(measure, named);
            }
            if measure.corrects() {
                demand_step_n.insert(measure, watcher.at_verdict.largest_n);
                if watcher.at_return.since.is_some() {
                    return_step_n.insert(measure, watcher.at_return.largest_n);
                }
            }
            if measure == Measure::Corrected {
                corrected = watcher.finish(gage_length_m(&system.structure, &fault.component));
            }
        }
        let nothing_done = follow(run, case, system, |_| Ok(()))?;
        rows.insert(Measure::Nothing, nothing_done.over(&without_fault));
        if rows[&Measure::Nothing].rms_top_m < TRACED_FROM {
            let all = rows.values_mut().chain([&mut without_fault]);
            all.for_each(|motion| motion.top_um.clear());
        }
        let mut transitions = run.occurrences.iter().filter_map(RigEvent::transition);
        // What is named later is named because the fault goes.
        let verdict = transitions.find(|(path, transition)| {
            *path == fault.component
                && transition.verdict.is_latched()
                && transition.decided < case.kind.until
        });
        let step_s = system.parameters.step_s;
        Ok(Self {
            kind: case.kind.kind,
            situation: case.kind.situation,
            component: fault.component.clone(),
            fault: fault.fault.to_string(),
            named_after_s: verdict
                .as_ref()
                .map(|(_, transition)| transition.decided.since(fault.at) as f64 * step_s),
            wrong: healthy_named(run),
            wrong_with,
            wind_m_per_s: run.rig.plant().conditions().base_speed_m_per_s,
            without_fault,
            relative: rows,
            demand_step_n,
            return_step_n,
            acted_after_s: acted.map(|step: Step| step.since(fault.at) as f64 * step_s),
            corrected,
        })
    }
}

/// Runs a case to its end, and measures what happens from the onset on.
fn follow(
    run: &mut CaseRun,
    case: &CampaignCase<ToleranceTask>,
    system: &System,
    mut act: impl FnMut(&mut CaseRun) -> Result<(), StudyError>,
) -> Result<RunMotion, StudyError> {
    let mut follower = MotionFollower::new(system, &case.faults[0].component);
    while run.step()? {
        act(run)?;
        if case.kind.wrong && run.rig.plant().next_step() == case.kind.from {
            run.rig.declare(&case.faults[0].component);
        }
        let next_step = run.rig.plant().next_step();
        if case.kind.resets_at == Some(next_step) {
            run.rig.reset(&case.faults[0].component);
        }
        if next_step > case.kind.from && next_step <= case.kind.until {
            follower.take(&run.rig);
        }
    }
    Ok(follower.finish())
}

/// Acts on cylinders that are hard over, once that is decided.
struct Cylinders {
    measure: Measure,
    late_steps: u64,
    /// So many events of the run.
    seen: usize,
    /// What it is to do, and when.
    due: VecDeque<(Step, ComponentPath)>,
    /// When it acted first.
    acted: Option<Step>,
}

impl Cylinders {
    fn act(&mut self, run: &mut CaseRun) -> Result<(), StudyError> {
        let latest = &run.occurrences[self.seen..];
        self.seen += latest.len();
        for event in latest {
            let RigEvent::Identified { module, identification } = event else { continue };
            let component = identification.component.clone();
            let kind = identification.decided().map(|candidate| candidate.kind);
            if kind != Some(IdentifiedKind::Known(FaultKind::HardOver)) {
                continue;
            }
            let due = run.rig.plant().next_step().plus(self.late_steps);
            self.due.push_back((due, ComponentPath { module: module.clone(), component }));
        }
        let now = run.rig.plant().next_step();
        while let Some((_, cylinder)) = self.due.pop_front_if(|(due, _)| *due <= now) {
            if self.measure.shuts_off() {
                run.rig.shut_off(&cylinder)?;
            }
            if self.measure.reallocates() {
                run.rig.reallocate(&cylinder)?;
            }
            self.acted.get_or_insert(now);
        }
        Ok(())
    }
}

/// Follows the corrected reading of the faulty gage, and the demands.
struct Watcher {
    module: usize,
    gage: usize,
    /// What it multiplies an elongation by while it is healthy: a diagnoser cannot know that error.
    gain: f64,
    steps: f64,
    squares_m2: f64,
    covered: f64,
    half_width_m: f64,
    not_valid: f64,
    demands_n: Vec<f64>,
    at_verdict: Switch,
    at_return: Switch,
}

/// The demands' largest step as the controller gets another reading.
#[derive(Default)]
struct Switch {
    /// Steps since then, once it has come.
    since: Option<u64>,
    largest_n: f64,
}

/// So many steps are due to the switch.
const AT_SWITCH: u64 = 3;

impl Switch {
    fn take(&mut self, largest_n: f64) {
        if self.since.is_some_and(|since| since < AT_SWITCH) {
            self.largest_n = self.largest_n.max(largest_n);
        }
        self.since = self.since.map(|since| since + 1);
    }
}

impl Watcher {
    fn new(rig: &Rig, component: &ComponentPath) -> Self {
        let places = rig.diagnosers().iter().position(|one| *one.module() == component.module);
        let module = places.unwrap_or_default();
        let gages = rig.diagnosers()[module].components().iter();
        let mut gages = gages.filter(|one| matches!(one, Component::Sensor(_)));
        let gage = gages.position(|one| *one == component.component).unwrap_or_default();
        Self {
            module,
            gage,
            gain: rig.plant().gage_gain(component).unwrap_or(1.0),
            steps: 0.0,
            squares_m2: 0.0,
            covered: 0.0,
            half_width_m: 0.0,
            not_valid: 0.0,
            demands_n: Vec::new(),
            at_verdict: Switch::default(),
            at_return: Switch::default(),
        }
    }

    fn take(&mut self, rig: &Rig) {
        let Some(readings) = rig.corrected(self.module) else { return };
        let signals = rig.plant().signals();
        let demands = || signals.modules.iter().flat_map(|module| &module.demands_n);
        let steps = self.demands_n.iter().zip(demands()).map(|(a, b)| (b - a).abs());
        let largest_n = steps.fold(0.0, f64::max);
        self.at_verdict.take(largest_n);
        self.at_return.take(largest_n);
        self.demands_n.clear();
        self.demands_n.extend(demands());
        let entry = |values: &[Option<f64>]| values.get(self.gage).copied().flatten();
        match readings.source.get(self.gage) {
            Some(ReadingSource::Replaced) => {
                self.at_verdict.since.get_or_insert(0);
            }
            Some(ReadingSource::Own) if self.at_verdict.since.is_some() => {
                self.at_return.since.get_or_insert(0);
                return;
            }
            Some(ReadingSource::NotValid) if self.at_verdict.since.is_some() => {
                self.not_valid += 1.0;
                return;
            }
            _ => return,
        }
        let ends = entry(&readings.low_m).zip(entry(&readings.high_m));
        let Some((reading_m, (low_m, high_m))) = entry(&readings.elongations_m).zip(ends) else {
            return;
        };
        let true_m = self.gain * signals.modules[self.module].true_elongations_m[self.gage];
        self.steps += 1.0;
        self.squares_m2 += (reading_m - true_m).powi(2);
        self.covered += f64::from(u8::from((low_m..=high_m).contains(&true_m)));
        self.half_width_m += 0.5 * (high_m - low_m);
    }

    fn finish(&self, length_m: f64) -> Option<CorrectedError> {
        (self.steps > 0.0).then(|| CorrectedError {
            rms_strain: (self.squares_m2 / self.steps).sqrt() / length_m,
            covered: self.covered / self.steps,
            half_width_strain: self.half_width_m / self.steps / length_m,
            not_valid: self.not_valid / (self.steps + self.not_valid),
        })
    }
}
