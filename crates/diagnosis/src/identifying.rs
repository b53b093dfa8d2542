//! When the fault of a component is identified, and from what.

use std::sync::Arc;

use vocabulary::{RunId, Step};

use crate::channels::{ChannelLayout, Channels};
use crate::comparing::Comparing;
use crate::event::{Action, Handling};
use crate::identification::{
    CylinderSeries, CylinderStep, Excerpt, FaultOnset, GageSeries, GageStep, MeasuredSeries, Prior,
};
use crate::learned_channels::LearnedChannels;
use crate::ledger::Ledger;
use crate::recent::Row;
use crate::residual::NominalHydraulics;
use crate::settings::{ModuleSetup, Sampling, always_shared, shared};
use crate::state::{Gaussian, Reference};
use crate::verdict::Transition;
use vocabulary::{Condition, Symptom};

/// After the onset \[s\]; then every second.
const STAGES_S: [f64; 6] = [0.007, 0.01, 0.02, 0.05, 0.2, 1.0];
/// What counts step by step before and after the onset \[s\].
const BEFORE_S: f64 = 1.5;
const AFTER_S: f64 = 2.0;
/// The same of a fault that no change shows, before and after its detection.
const BEFORE_DETECTION_S: f64 = 3.5;
/// How the gages move together is learnt from what is before that, no longer than this before the onset \[s\]: by the same
/// steps a gage would follow from the others better than it does.
const LEARN_S: f64 = 4.5;
/// Largest flow through a closed valve, as a share of an open valve's flow.
const NULL_FLOW: f64 = 0.02;
/// So long every second, then every ten \[s\].
const EVERY_SECOND_FOR_S: f64 = 60.0;
/// Where nothing is known of the gages, so many steps before the onset tell how they move together.
const LEAST_LEARNT: usize = 200;
/// How much of the reference's covariance is added to that of the seconds before the onset: what does not move in these
/// may move because of the fault.
const OF_REFERENCE: f64 = 0.1;

/// A faulty component.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct FaultyComponent {
    sequence: u64,
    seen: FaultOnset,
    /// If not, there is nothing more to be learnt.
    has_signal: bool,
    /// The next step at which it is identified; `None` if nothing more is to be learnt.
    due: Option<Step>,
    /// Its steps around the onset, once they are complete.
    steps: Option<Kept>,
    /// How its gages moved together before the onset.
    learnt: Option<Gaussian>,
    #[serde(with = "shared")]
    predictor: Option<Arc<Predictor>>,
    /// What is later does not count: another gage failed, and what followed from that one no longer does.
    until: Option<Step>,
}

#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
enum Kept {
    #[serde(with = "always_shared")]
    Gage(Arc<[GageStep]>),
    #[serde(with = "always_shared")]
    Cylinder(Arc<[CylinderStep]>),
}

/// How a gage's residual follows from the others and the forces.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
struct Predictor {
    /// By which the values less their means are multiplied; one for the gage itself.
    weights: Vec<f64>,
    means: Vec<f64>,
    level_m: Prior,
    /// Which gages were left out.
    without: Vec<bool>,
}

/// What is identified.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Identifying {
    faulty: Vec<Option<FaultyComponent>>,
    /// The number of the transition that each channel's fault is identified for, or is not.
    known: Vec<u64>,
    layout: ChannelLayout,
    step_s: f64,
    sampling: Sampling,
    /// None in a module without actuators.
    hydraulics: Option<NominalHydraulics>,
    noise_m: Vec<f64>,
    #[serde(with = "shared")]
    reference: Option<Arc<Reference>>,
}

impl Identifying {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        let layout = ChannelLayout::of(setup);
        let noise = setup.prior_scatters().iter().map(|variance| variance.sqrt()).collect();
        let channels = layout.channels();
        Self {
            faulty: vec![None; channels],
            known: vec![0; channels],
            layout,
            step_s: setup.step_s,
            sampling: setup.sampling(),
            hydraulics: setup.hydraulics,
            noise_m: noise,
            reference: setup.reference.clone(),
        }
    }

    /// What was faulty before a restart is not identified anew: nothing is known of its onset.
    pub(crate) fn recall(&mut self, ledger: &Ledger) {
        for (channel, known) in self.known.iter_mut().enumerate() {
            *known = ledger.judged(channel);
        }
    }

    /// A run begins: what was measured in the one before is gone.
    pub(crate) fn restart(&mut self) {
        self.faulty.fill(None);
    }

    /// Starts tracking components that became faulty, stops tracking those that are not faulty any more, and requests
    /// the identifications that are due, unless the fault has gone.
    pub(crate) fn follow(
        &mut self,
        ledger: &Ledger,
        comparing: &Comparing,
        handling: &mut Handling<'_>,
    ) {
        let Handling { run, now, channels, .. } = *handling;
        for channel in 0..self.faulty.len() {
            if !ledger.verdict(channel).is_latched() {
                self.faulty[channel] = None;
                continue;
            }
            if self.faulty[channel].is_none() {
                self.begin(channel, run, channels, ledger);
            }
            let due = self.faulty[channel].as_ref().and_then(|fault| fault.due);
            if let Some(due) = due.filter(|due| *due <= now) {
                let until = self.shown_until(channel, due, comparing.condition(channel));
                // The steps around the onset are kept in any case.
                // A learned module's windows are whole, and none is taken in which the fault may have gone.
                let shown = until.filter(|_| channels.learned().is_none());
                let ends = (due, shown.unwrap_or(due));
                let excerpt = self.excerpt(channel, run, ends, channels, ledger);
                let excerpt = excerpt.filter(|_| until.is_some());
                handling.actions.extend(excerpt.map(|excerpt| Action::Identify(Box::new(excerpt))));
                self.postpone(channel, due, until, channels);
            }
        }
    }

    fn begin(&mut self, channel: usize, run: RunId, channels: &Channels, ledger: &Ledger) {
        let Some(latest) = ledger.latest(&channels.components()[channel]) else { return };
        let sequence = ledger.judged(channel);
        let is_new = latest.run == run && sequence > self.known[channel];
        if !is_new || latest.command().is_some() {
            return;
        }
        self.known[channel] = sequence;
        let seen = seen(latest);
        let due = match seen {
            FaultOnset::Change { onset, .. } => {
                let stages = STAGES_S.map(|stage| onset.plus(self.sampling.steps(stage)));
                stages.into_iter().find(|stage| *stage >= latest.decided)
            }
            FaultOnset::Departure { .. } => None,
        };
        self.faulty[channel] = Some(FaultyComponent {
            sequence,
            seen,
            has_signal: latest.symptom != Symptom::NoSignal,
            due: Some(due.unwrap_or(latest.decided)),
            steps: None,
            learnt: self.learnt(seen, channels).filter(|_| self.layout.gage(channel).is_some()),
            predictor: None,
            until: None,
        });
    }

    /// Until when what is measured shows the fault: not of one that has gone since, and of the windows in which it
    /// departs all but the latest, in which it may have gone. `None` if nothing more is to be learnt at present.
    fn shown_until(&self, channel: usize, due: Step, condition: &Condition) -> Option<Step> {
        let fault = self.faulty[channel].as_ref()?;
        let second = self.sampling.steps(1.0);
        let stages_end = begun(fault.seen).plus(second);
        match *condition {
            Condition::Agrees { from, .. } if from > fault.seen.detection() => None,
            Condition::Departed { as_of }
            | Condition::Doubtful { as_of }
            | Condition::OneOf { as_of, .. }
                if due > stages_end =>
            {
                Some(due.min(stages_end.max(as_of.minus(second))))
            }
            _ => Some(due),
        }
    }

    fn postpone(&mut self, channel: usize, due: Step, until: Option<Step>, channels: &Channels) {
        // Of a learned module nothing more is known before the next window, however long it is.
        let window = channels.learned().map_or(0, LearnedChannels::window_steps);
        let second = self.sampling.steps(1.0).max(window);
        let soon = self.sampling.steps(EVERY_SECOND_FOR_S).max(EVERY_SECOND_FOR_S as u64 * window);
        let stages = STAGES_S.map(|stage| self.sampling.steps(stage));
        let is_cylinder = self.layout.gage(channel).is_none();
        let Some(seen) = self.faulty[channel].as_ref().map(|fault| fault.seen) else { return };
        let has_all = until.is_some_and(|until| self.is_complete(seen, until));
        let Some(fault) = &mut self.faulty[channel] else { return };
        // Of a cylinder only the steps around the onset count.
        let is_over = !fault.has_signal || is_cylinder && has_all;
        let begun = begun(fault.seen);
        let age = due.since(begun);
        let next = match fault.seen {
            FaultOnset::Change { .. } => stages.into_iter().find(|stage| *stage > age),
            FaultOnset::Departure { .. } => None,
        };
        let next = match next {
            Some(stage) => begun.plus(stage),
            None if age < soon => due.plus(second),
            None => due.plus(10 * second),
        };
        fault.due = (!is_over).then_some(next);
    }

    fn excerpt(
        &mut self,
        channel: usize,
        run: RunId,
        (as_of, until): (Step, Step),
        channels: &Channels,
        ledger: &Ledger,
    ) -> Option<Excerpt> {
        let has_signal = self.faulty[channel].as_ref()?.has_signal;
        let measured = match (channels.learned(), self.layout.gage(channel)) {
            _ if !has_signal => MeasuredSeries::Nothing,
            (Some(learned), _) => MeasuredSeries::Displaced(learned.displaced(channel)?),
            (None, None) => self.cylinder(channel, (as_of, until), channels)?,
            (None, Some(gage)) => self.gage((channel, gage), (as_of, until), channels, ledger)?,
        };
        let fault = self.faulty[channel].as_ref()?;
        Some(Excerpt {
            run,
            sequence: fault.sequence,
            component: channels.components()[channel].clone(),
            as_of: until,
            step_s: self.step_s,
            seen: fault.seen,
            measured,
        })
    }

    /// From and until when single steps count.
    fn span(&self, seen: FaultOnset, as_of: Step) -> (Step, Step) {
        match seen {
            FaultOnset::Change { onset, .. } => {
                let until = onset.plus(self.sampling.steps(AFTER_S));
                (onset.minus(self.sampling.steps(BEFORE_S)), until.min(as_of))
            }
            FaultOnset::Departure { detection } => {
                let until = detection.plus(self.sampling.steps(AFTER_S));
                (detection.minus(self.sampling.steps(BEFORE_DETECTION_S)), until.min(as_of))
            }
        }
    }

    fn is_complete(&self, seen: FaultOnset, as_of: Step) -> bool {
        begun(seen).plus(self.sampling.steps(AFTER_S)) <= as_of
    }

    fn cylinder(
        &mut self,
        channel: usize,
        (as_of, shown_until): (Step, Step),
        channels: &Channels,
    ) -> Option<MeasuredSeries> {
        let hydraulics = self.hydraulics?;
        let fault = self.faulty[channel].as_ref()?;
        let seen = fault.seen;
        let steps: Arc<[CylinderStep]> = match &fault.steps {
            Some(Kept::Cylinder(steps)) => Arc::clone(steps),
            _ => {
                let (from, until) = self.span(seen, as_of);
                let step = |row: Row<'_>| {
                    let step = CylinderStep {
                        step: row.step,
                        demand_n: row.demand_n(channel),
                        pressures_pa: row.pressures_pa(channel),
                    };
                    step.if_usable()
                };
                channels.recent().rows(from, until).filter_map(step).collect()
            }
        };
        if self.is_complete(seen, as_of) {
            let kept = Kept::Cylinder(Arc::clone(&steps));
            self.faulty[channel].as_mut()?.steps = Some(kept);
        }
        let steps = steps.iter().filter(|step| step.step <= shown_until).copied().collect();
        let null_flow = Prior::about_zero(NULL_FLOW * hydraulics.valve_flow_m3_per_s);
        Some(MeasuredSeries::Cylinder(CylinderSeries { steps, hydraulics, null_flow }))
    }

    fn gage(
        &mut self,
        (channel, gage): (usize, usize),
        (as_of, shown_until): (Step, Step),
        channels: &Channels,
        ledger: &Ledger,
    ) -> Option<MeasuredSeries> {
        let without = self.left_out(channel, as_of, channels, ledger);
        let predictor = self.predictor(channel, gage, &without)?;
        let fault = self.faulty[channel].as_mut()?;
        if predictor.without != without {
            let failed = without.iter().zip(&predictor.without).position(|(now, then)| now != then);
            let failed =
                failed.map(|gage| &channels.components()[self.layout.channel_of_gage(gage)]);
            let begun = failed.and_then(|failed| ledger.latest(failed)).map(|latest| latest.onset);
            fault.until.get_or_insert(begun.unwrap_or(as_of));
        }
        let (seen, until) = (fault.seen, fault.until.unwrap_or(as_of));
        let kept = fault.steps.clone();
        let steps: Arc<[GageStep]> = match kept {
            Some(Kept::Gage(steps)) => steps,
            _ => {
                let (from, until) = self.span(seen, as_of);
                let step = |row: Row<'_>| {
                    let step = GageStep {
                        step: row.step,
                        off_m: predictor.off_m(&row),
                        reading_m: row.readings_m()[gage],
                    };
                    step.if_usable()
                };
                channels.recent().rows(from, until).filter_map(step).collect()
            }
        };
        let second = |(until, row): (Step, Row<'_>)| GageStep {
            step: until,
            off_m: predictor.off_m(&row),
            reading_m: row.readings_m()[gage],
        };
        let seconds = channels.recent().seconds(until.min(shown_until)).map(second);
        let seconds = seconds.filter(|mean| mean.off_m.is_finite()).collect();
        if self.is_complete(seen, as_of) {
            let kept = Kept::Gage(Arc::clone(&steps));
            self.faulty[channel].as_mut()?.steps = Some(kept);
        }
        let steps = steps.iter().filter(|step| step.step <= shown_until).copied().collect();
        let (level_m, noise_m) = (predictor.level_m, self.noise_m[channel]);
        Some(MeasuredSeries::Gage(GageSeries { steps, seconds, level_m, noise_m }))
    }

    /// How a gage follows from the others, without those that are known to be faulty; once its steps are complete, as then.
    fn predictor(
        &mut self,
        channel: usize,
        gage: usize,
        without: &[bool],
    ) -> Option<Arc<Predictor>> {
        let fault = self.faulty[channel].as_ref()?;
        let known = fault.predictor.as_ref();
        if let Some(known) = known.filter(|p| fault.steps.is_some() || p.without == without) {
            return Some(Arc::clone(known));
        }
        let without = without.to_vec();
        let predictor = match (&self.reference, fault.learnt.clone()) {
            (Some(reference), Some(mut learnt)) => {
                learnt.widen(&reference.short.means, &reference.own_places(), OF_REFERENCE);
                Predictor::new(&learnt, (0..learnt.mean.len()).collect(), gage, without)
            }
            (Some(reference), None) => {
                Predictor::new(&reference.short.means, reference.own_places(), gage, without)
            }
            (None, Some(learnt)) => {
                Predictor::new(&learnt, (0..learnt.mean.len()).collect(), gage, without)
            }
            (None, None) => None,
        }?;
        let predictor = Arc::new(predictor);
        self.faulty[channel].as_mut()?.predictor = Some(Arc::clone(&predictor));
        Some(predictor)
    }

    /// The other gages that were known to be faulty by then.
    fn left_out(
        &self,
        channel: usize,
        as_of: Step,
        channels: &Channels,
        ledger: &Ledger,
    ) -> Vec<bool> {
        let faulty = |other: usize| {
            let latest = ledger.latest(&channels.components()[other]);
            other != channel
                && ledger.verdict(other).is_latched()
                && latest.is_some_and(|latest| latest.decided <= as_of)
        };
        (self.layout.actuators..self.faulty.len()).map(faulty).collect()
    }

    /// How the gages moved together before the onset.
    fn learnt(&self, seen: FaultOnset, channels: &Channels) -> Option<Gaussian> {
        let FaultOnset::Change { onset, .. } = seen else { return None };
        if channels.learned().is_some() {
            return None;
        }
        let from = onset.minus(self.sampling.steps(LEARN_S));
        let before = onset.minus(self.sampling.steps(BEFORE_S));
        let most = before.since(from) as usize + 1;
        let mut values = Vec::with_capacity(most * self.layout.channels());
        let mut rows = 0;
        for row in channels.recent().rows(from, before) {
            let of_row = [row.residuals_m(), row.forces_n()];
            if of_row.iter().all(|some| some.iter().all(|value| value.is_finite())) {
                of_row.iter().for_each(|some| values.extend_from_slice(some));
                rows += 1;
            }
        }
        if rows < LEAST_LEARNT {
            return None;
        }
        let of_gages = self.noise_m[self.layout.actuators..].iter();
        let least: Vec<f64> =
            of_gages.chain(&self.noise_m[..self.layout.actuators]).copied().collect();
        Some(Gaussian::of_rows(values.chunks_exact(least.len()), &least))
    }
}

impl Predictor {
    fn new(
        gaussian: &Gaussian,
        places: Vec<usize>,
        gage: usize,
        without: Vec<bool>,
    ) -> Option<Self> {
        let kept: Vec<usize> =
            (0..places.len()).filter(|k| !without.get(*k).copied().unwrap_or(false)).collect();
        let of_kept: Vec<usize> = kept.iter().map(|k| places[*k]).collect();
        let own = kept.iter().position(|k| *k == gage)?;
        let (of_weights, deviation) = gaussian.regression(&of_kept, own)?;
        let mut weights = vec![0.0; places.len()];
        let mut means = vec![0.0; places.len()];
        for (k, (place, weight)) in kept.iter().zip(of_kept.iter().zip(of_weights)) {
            weights[*k] = weight;
            means[*k] = gaussian.mean[*place];
        }
        Some(Self { weights, means, level_m: Prior::about_zero(deviation), without })
    }

    fn off_m(&self, row: &Row<'_>) -> f64 {
        let values = row.residuals_m().iter().chain(row.forces_n());
        let terms = values.zip(self.weights.iter().zip(&self.means));
        terms
            .filter(|(_, (weight, _))| **weight != 0.0)
            .map(|(value, (weight, mean))| weight * (value - mean))
            .sum()
    }
}

/// From where stages are counted.
fn begun(seen: FaultOnset) -> Step {
    let (FaultOnset::Change { onset: begun, .. } | FaultOnset::Departure { detection: begun }) =
        seen;
    begun
}

fn seen(latest: &Transition) -> FaultOnset {
    let Transition { onset, detection, .. } = *latest;
    match latest.symptom {
        Symptom::Change | Symptom::NoSignal => FaultOnset::Change { onset, detection },
        Symptom::Departure | Symptom::OilContent | Symptom::Scatter | Symptom::Reading => {
            FaultOnset::Departure { detection }
        }
    }
}
