//! The channels of a module, one for each component: sample → residuals → divergences → changes, and which
//! steps were watched.

use vocabulary::{Component, ModulePhase, Step};

use crate::coverage::Coverage;
use crate::divergence::{DivergenceBank, DivergenceOutcome, DivergenceSettings, Violation};
use crate::event::Action;
use crate::learned_channels::LearnedChannels;
use crate::monitor::{Monitor, Observation};
use crate::recent::Recent;
use crate::residual::ResidualGenerator;
use crate::sample::{Measurements, Signal};
use crate::settings::{ModuleSetup, SetupError};
use crate::shift::Shifts;
use crate::state::{MeansCollector, MeasuredStep, WindowLength, WindowMeans};
use crate::unseen::Unseen;
use crate::validity::{Supply, Validity};
use vocabulary::Evidence;

/// How a module's channels are counted: its actuators, then its gages, in the order of the description.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) struct ChannelLayout {
    pub(crate) actuators: usize,
    pub(crate) gages: usize,
}

impl ChannelLayout {
    pub(crate) fn of(setup: &ModuleSetup) -> Self {
        if let Some(learned) = &setup.learned {
            return Self { actuators: 0, gages: learned.channels.len() };
        }
        let module = setup.structure.module(&setup.module);
        let (actuators, gages) =
            module.map_or((0, 0), |module| (module.actuators.len(), module.gages.len()));
        Self { actuators, gages }
    }

    pub(crate) fn channels(self) -> usize {
        self.actuators + self.gages
    }

    /// Which gage a channel belongs to; `None` if it belongs to an actuator, whose number is the channel's.
    pub(crate) fn gage(self, channel: usize) -> Option<usize> {
        channel.checked_sub(self.actuators)
    }

    pub(crate) fn channel_of_gage(self, gage: usize) -> usize {
        self.actuators + gage
    }
}

/// What a channel did at a step.
#[derive(Debug, Clone, Copy, serde::Serialize, serde::Deserialize)]
pub(crate) enum Occurrence {
    /// Its Gaussian was lost and restarted.
    Restarted(Violation),
    /// Its divergence rose to its threshold; it may have been rising since.
    Changed { onset: Step },
    /// Its residual is not what it was before a gap, though its divergence may not show it; since `onset`.
    Shifted { onset: Step },
    /// Its divergence has stayed below its threshold for long enough.
    Quiet,
    /// It has had no usable signal for too long.
    SignalLost { signal: Signal, since: Step },
    /// Its reading is not what the other channels of a learned module say, since `onset`.
    Departed { onset: Step, before_service: bool },
}

/// Residuals, divergences and monitors of all channels.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(crate) struct Channels {
    layout: ChannelLayout,
    components: Vec<Component>,
    settings: DivergenceSettings,
    validity: Validity,
    /// None in a learned module.
    generator: Option<ResidualGenerator>,
    /// In place of residuals and divergences.
    learned: Option<LearnedChannels>,
    bank: DivergenceBank,
    monitors: Vec<Monitor>,
    evidence: Vec<Evidence>,
    coverage: Coverage,
    unseen: Unseen,
    shifts: Shifts,
    /// Short ones and long ones; each with: did one end at the latest step?
    windows: [(MeansCollector, bool); 2],
    recent: Recent,
    /// What is subtracted before a comparison with the reference: of a gage \[m\], of an oil content \[Pa\].
    tares: Vec<f64>,
    /// The values for the windows: residuals, forces, oil contents; NaN without a value.
    measured: [Vec<f64>; 3],
    /// What the gages read at the latest sample; NaN where that cannot be used.
    readings_m: Vec<f64>,
    phase: ModulePhase,
    /// The step since which every channel is watched, in service.
    in_service_since: Option<Step>,
    /// Most samples in a row that are filled in when they are lost.
    longest_filled: u64,
    /// Lost samples that are filled in once the next one has come.
    unfilled: u64,
    /// The residuals at the latest step, and one between two of them.
    latest: Vec<f64>,
    between: Vec<f64>,
    /// Channel and occurrence, at the latest step.
    occurrences: Vec<(usize, Occurrence)>,
}

impl Channels {
    /// Channels that have seen nothing yet.
    ///
    /// # Errors
    /// No model can be made of the structure, or a setting is out of range.
    pub(crate) fn new(setup: &ModuleSetup) -> Result<Self, Vec<SetupError>> {
        let layout = ChannelLayout::of(setup);
        let components = setup.components();
        let detection = &setup.detection;
        let learned = setup.learned.as_deref().map(|module| LearnedChannels::new(module, setup));
        let generator = || {
            let residual = detection.actuator_residual;
            ResidualGenerator::new(&setup.structure, setup.hydraulics, residual, setup.step_s)
        };
        let generator = learned.is_none().then(generator).transpose().map_err(|error| {
            vec![SetupError::Model { module: setup.module.clone(), error: error.to_string() }]
        })?;
        let bank = DivergenceBank::new(detection.divergence, &setup.prior_scatters())
            .map_err(|error| vec![error.into()])?;
        let quiet = setup.isolation.quiet_steps;
        let monitor = |&threshold: &f64| Monitor::new(threshold, detection.warm_up_vectors, quiet);
        let monitors: Vec<_> = setup.thresholds.iter().map(monitor).collect();
        Ok(Self {
            evidence: monitors.iter().map(|monitor| *monitor.evidence()).collect(),
            // A channel has at most four occurrences a step.
            occurrences: Vec::with_capacity(4 * components.len()),
            validity: Validity::new(setup, setup.isolation.tie_steps),
            longest_filled: setup.isolation.tie_steps,
            unfilled: 0,
            latest: vec![0.0; components.len()],
            between: vec![0.0; components.len()],
            settings: detection.divergence,
            generator,
            learned,
            bank,
            monitors,
            coverage: Coverage::default(),
            shifts: Shifts::new(&setup.prior_scatters()),
            unseen: Unseen::new((detection.divergence.window + detection.divergence.lag) as u64),
            windows: WindowLength::ALL.map(|length| {
                let steps = setup.sampling().steps(length.seconds());
                (MeansCollector::new(length, steps, layout.actuators, layout.gages), false)
            }),
            recent: Recent::new(layout, setup.sampling()),
            measured: [
                vec![f64::NAN; components.len()],
                vec![f64::NAN; layout.actuators],
                vec![f64::NAN; layout.actuators],
            ],
            tares: vec![0.0; components.len()],
            readings_m: vec![f64::NAN; layout.gages],
            layout,
            components,
            phase: ModulePhase::Waiting,
            in_service_since: None,
        })
    }

    /// Takes up which steps were watched before a restart.
    pub(crate) fn recall(&mut self, coverage: Coverage) {
        self.coverage = coverage;
    }

    /// A run begins.
    pub(crate) fn begin_run(&mut self) -> Action {
        (self.phase, self.in_service_since) = (ModulePhase::Initialising, None);
        Action::Phase { phase: self.phase, in_service_since: None }
    }

    /// Forgets the run.
    pub(crate) fn end_run(&mut self) {
        self.generator.iter_mut().for_each(ResidualGenerator::restart);
        self.learned.iter_mut().for_each(LearnedChannels::restart);
        self.bank.restart();
        self.validity.forget();
        self.monitors.iter_mut().for_each(Monitor::restart);
        self.coverage = Coverage::default();
        self.unseen.forget();
        self.shifts.forget();
        self.windows.iter_mut().for_each(|(windows, _)| windows.restart());
        self.recent.restart();
        self.unfilled = 0;
    }

    /// So many samples are missing after `last`. As many as separate changes that count as simultaneous are
    /// filled in: what happened there shows at the next sample. After a long gap the channels are relearnt:
    /// the structure's oscillation is not known, and what the models do while they settle would look like a
    /// fault.
    pub(crate) fn bridge(&mut self, last: Step, missing: u64) {
        self.learned.iter_mut().for_each(|learned| learned.skip(missing));
        let Some(generator) = &mut self.generator else { return };
        let follows = generator.bridge(missing);
        if missing <= self.longest_filled && follows && generator.is_settled() {
            self.unfilled = missing;
            return;
        }
        if follows {
            self.coverage.cross(last, last.plus(missing + 1));
            self.bank.gap();
            self.unseen.begin(last.plus(1));
            self.shifts.begin(&self.latest);
        } else {
            self.coverage.lose(last);
            self.relearn();
        }
    }

    /// Nothing is to be compared with what was before.
    fn relearn(&mut self) {
        self.unseen.forget();
        self.shifts.forget();
        self.bank.restart();
        self.monitors.iter_mut().for_each(Monitor::relearn);
    }

    /// Gives the bank residuals on a straight line to those of the present step in place of the lost ones.
    fn fill(&mut self) {
        let missing = std::mem::take(&mut self.unfilled);
        let Some(generator) = &self.generator else { return };
        for place in 1..=missing {
            let share = place as f64 / (missing + 1) as f64;
            for (between, (before, now)) in
                self.between.iter_mut().zip(self.latest.iter().zip(generator.residuals()))
            {
                *between = before + share * (now - before);
            }
            let _ = self.bank.push(&self.between);
        }
    }

    /// Takes the next sample.
    pub(crate) fn observe(&mut self, sample: &Measurements) {
        self.occurrences.clear();
        if self.learned.is_some() {
            return self.observe_readings(sample);
        }
        self.complete(sample);
        let Some(generator) = &mut self.generator else { return };
        let settled = generator.is_settled();
        generator.push(self.validity.completed().unwrap_or(sample));
        self.fill();
        let residuals = self.generator.iter().flat_map(ResidualGenerator::residuals);
        for (channel, residual) in residuals.enumerate() {
            if self.validity.supply(channel) == Supply::Good {
                self.latest[channel] = *residual;
            }
        }
        self.measure(sample, settled);
        let outcomes = if settled { self.bank.push(&self.latest) } else { self.bank.skip() };
        let defined = outcomes.iter().any(|outcome| outcome.divergence().is_some());
        self.unseen.observe(sample.step, defined);
        if defined {
            let onset = self.unseen.earliest(sample.step);
            let shifted = self.shifts.end(&self.latest);
            self.occurrences
                .extend(shifted.map(|channel| (channel, Occurrence::Shifted { onset })));
        }
        for (channel, monitor) in self.monitors.iter_mut().enumerate() {
            if self.validity.supply(channel) == Supply::None {
                self.evidence[channel].step = sample.step;
                self.evidence[channel].divergence = None;
                continue;
            }
            let outcome = outcomes[channel];
            if let DivergenceOutcome::Restarted(violation) = outcome {
                self.occurrences.push((channel, Occurrence::Restarted(violation)));
            }
            let occurrence = match monitor.observe(sample.step, self.latest[channel], outcome) {
                Observation::Nothing => None,
                Observation::Changed { onset } => {
                    let onset = self.unseen.earliest(onset);
                    Some(Occurrence::Changed { onset })
                }
                Observation::Quiet => Some(Occurrence::Quiet),
            };
            self.evidence[channel] = *monitor.evidence();
            self.occurrences.extend(occurrence.map(|occurrence| (channel, occurrence)));
        }
        let divergences = self.evidence.iter().map(|channel| channel.divergence);
        self.recent.take_divergences(divergences.map(|known| known.unwrap_or(f64::NAN)));
    }

    /// Takes the next sample of a learned module.
    fn observe_readings(&mut self, sample: &Measurements) {
        let Self { learned, evidence, occurrences, recent, measured: [residuals, ..], .. } = self;
        let Some(learned) = learned else { return };
        learned.take(sample, evidence, occurrences);
        for (residual, evidence) in residuals.iter_mut().zip(evidence.iter()) {
            *residual = evidence.divergence.map_or(f64::NAN, |_| evidence.residual);
        }
        recent.take(sample, residuals, &[]);
        recent.take_divergences(evidence.iter().map(|one| one.divergence.unwrap_or(f64::NAN)));
    }

    /// Takes the sample into the windows, as far as it can be believed.
    fn measure(&mut self, sample: &Measurements, settled: bool) {
        let Some(generator) = &self.generator else { return };
        let [residuals, forces_n, contents_pa] = &mut self.measured;
        let forces_known = self.validity.force_is_assumed().is_none();
        for (channel, value) in residuals.iter_mut().enumerate() {
            let good = settled && self.validity.supply(channel) == Supply::Good;
            let of_gage = self.layout.gage(channel).is_some();
            let usable = good && (forces_known || !of_gage);
            let tare = if of_gage { self.tares[channel] } else { 0.0 };
            *value = if usable { self.latest[channel] - tare } else { f64::NAN };
        }
        let readings = self.readings_m.iter_mut().zip(&sample.elongations_m);
        for (gage, (reading, measured)) in readings.enumerate() {
            let good = self.validity.supply(self.layout.channel_of_gage(gage)) == Supply::Good;
            *reading = if good { *measured } else { f64::NAN };
        }
        let observed = generator.forces_n().iter().zip(generator.contents_pa());
        let kept = forces_n.iter_mut().zip(contents_pa.iter_mut());
        for (channel, ((force, content), (observed_n, observed_pa))) in
            kept.zip(observed).enumerate()
        {
            let good = self.validity.supply(channel) == Supply::Good;
            *force = if good { *observed_n } else { f64::NAN };
            *content = if good { *observed_pa - self.tares[channel] } else { f64::NAN };
        }
        let measured = MeasuredStep { residuals, forces_n, contents_pa };
        for (windows, ended) in &mut self.windows {
            *ended = windows.take(sample.step, measured);
        }
        self.recent.take(sample, residuals, forces_n);
    }

    /// What a gage, or a cylinder's oil content, measures too much counts no more from now on: the tare, all in all.
    pub(crate) fn shift_tare(&mut self, channel: usize, off: f64) -> f64 {
        self.tares[channel] += off;
        self.tares[channel]
    }

    /// What was measured lately.
    pub(crate) fn recent(&self) -> &Recent {
        &self.recent
    }

    /// The windows of this length that are still kept, the latest first.
    pub(crate) fn windows_latest_first(
        &self,
        length: WindowLength,
    ) -> impl Iterator<Item = &WindowMeans> {
        self.windows[length as usize].0.latest_first()
    }

    /// What the local model says that the gages read, at the latest sample \[m\]; none in a learned module, or while the
    /// models settle.
    pub(crate) fn modelled_m(&self) -> Option<&[f64]> {
        self.generator.as_ref().filter(|one| one.is_settled()).map(ResidualGenerator::modelled_m)
    }

    /// What the gages read at the latest sample \[m\]; NaN where that cannot be used.
    pub(crate) fn readings_m(&self) -> &[f64] {
        &self.readings_m
    }

    /// The residuals at the latest sample, tares subtracted, a gage's only while its module's forces are known; and the
    /// observed forces \[N\]. NaN without a value.
    pub(crate) fn measured(&self) -> (&[f64], &[f64]) {
        let [residuals, forces_n, _] = &self.measured;
        (residuals, forces_n)
    }

    /// The window of this length that ended at a step, if it is still kept.
    pub(crate) fn window_ended_at(&self, length: WindowLength, step: Step) -> Option<&WindowMeans> {
        self.windows[length as usize].0.ended_at(step)
    }

    /// The window of this length that ended at the latest step, if one did.
    pub(crate) fn window(&self, length: WindowLength) -> Option<&WindowMeans> {
        let (windows, ended) = &self.windows[length as usize];
        windows.latest().filter(|_| *ended)
    }

    /// Replaces what the sample lacks. A channel that has had a value again after a while is relearnt; after a
    /// pressure, every channel is, because an unknown force moved the structure.
    fn complete(&mut self, sample: &Measurements) {
        let Self { validity, generator, occurrences, bank, monitors, .. } = self;
        let Some(generator) = generator else { return };
        for (channel, monitor) in monitors.iter_mut().enumerate() {
            if validity.supply(channel) == Supply::None {
                // Until it has a value, it is as one that begins.
                bank.restart_channel(channel);
                monitor.relearn();
            }
        }
        validity.take(
            sample,
            |actuator| generator.expected_pressures_pa(actuator),
            |channel, signal, since| {
                occurrences.push((channel, Occurrence::SignalLost { signal, since }));
            },
        );
        if validity.pressure_is_back() {
            generator.restart();
            self.relearn();
        }
    }

    /// D/γ of a channel, reduced by the part that the demand's motion explains, but not below 1: D grows with the
    /// fourth power of the residual's deviation.
    pub(crate) fn excess(&self, channel: usize) -> f64 {
        let evidence = &self.evidence[channel];
        let margin = self.generator.as_ref().map_or(0.0, |one| one.margin_n(channel));
        let ratio = evidence.ratio();
        if ratio <= 1.0 || margin == 0.0 {
            return ratio;
        }
        let off = (evidence.residual - evidence.level).abs();
        let left = if off > margin { 1.0 - margin / off } else { 0.0 };
        (ratio * left.powi(4)).max(1.0)
    }

    /// Whether the present residual may result from model errors due to the latest gap, if it began there. A gage's
    /// residual cannot, because the structure is slow.
    pub(crate) fn may_come_of_gap(&self, channel: usize) -> bool {
        let evidence = &self.evidence[channel];
        let swing_n = || self.generator.as_ref().map_or(0.0, |one| one.swing_n(channel));
        self.layout.gage(channel).is_none()
            && (evidence.residual - evidence.level).abs() <= swing_n()
    }

    /// Lacks the latest sample any value?
    pub(crate) fn is_incomplete(&self) -> bool {
        let learned = self.learned.as_ref().is_some_and(LearnedChannels::is_incomplete);
        learned || self.validity.is_incomplete()
    }

    /// The actuator without a signal whose force a gage's residual rests on all the same.
    pub(crate) fn assumes_force_of(&self, channel: usize) -> Option<usize> {
        self.layout.gage(channel).and_then(|_| self.validity.force_is_assumed())
    }

    /// A channel's missing values are forgotten.
    pub(crate) fn forgive(&mut self, channel: usize) {
        self.validity.forgive(channel);
        self.learned.iter_mut().for_each(|learned| learned.forgive(channel));
    }

    /// What the channels did at the latest step, in their order.
    pub(crate) fn occurrences(&self) -> &[(usize, Occurrence)] {
        &self.occurrences
    }

    /// Notes whether every channel was watched at this step; the phase, if it changed.
    pub(crate) fn update_phase(&mut self, step: Step) -> Option<Action> {
        // For a while after a gap the divergence is undefined, and changes cannot be detected.
        let sees = |(channel, monitor): (usize, &Monitor)| {
            let has_divergence = self.evidence[channel].divergence.is_some();
            // One that is known to be faulty is not waited for.
            self.validity.is_lost(channel) || monitor.is_watched() && has_divergence
        };
        let watches = match &self.learned {
            Some(learned) => learned.is_watching(),
            None => self.monitors.iter().enumerate().all(sees),
        };
        if watches {
            self.coverage.watch(step);
        } else {
            self.coverage.lose(step.minus(1));
        }
        let in_service_since = self.coverage.watched_since();
        let phase = match in_service_since {
            Some(_) => ModulePhase::InService,
            None => ModulePhase::Initialising,
        };
        let before = (self.phase, self.in_service_since);
        (self.phase, self.in_service_since) = (phase, in_service_since);
        let is_another = before != (phase, in_service_since);
        is_another.then_some(Action::Phase { phase, in_service_since })
    }

    /// Relearns a channel.
    pub(crate) fn restart(&mut self, channel: usize) {
        self.bank.restart_channel(channel);
        self.monitors[channel].restart();
    }

    /// Steps until a channel's Gaussian holds nothing of its latest change; `None` if it never forgets.
    pub(crate) fn interval_to_pass(&self, channel: usize, now: Step) -> Option<u64> {
        let vectors = self.settings.interval.vectors()?;
        let memory = (vectors + self.settings.window + self.settings.lag) as u64;
        let changed = self.monitors[channel].changed_until();
        let since = changed.map(|until| now.since(until));
        Some(since.map_or(0, |since| memory.saturating_sub(since)))
    }

    /// The channel of a component.
    pub(crate) fn position(&self, component: &Component) -> Option<usize> {
        self.components.iter().position(|own| own == component)
    }

    pub(crate) fn components(&self) -> &[Component] {
        &self.components
    }

    pub(crate) fn evidence(&self) -> &[Evidence] {
        &self.evidence
    }

    /// What a learned module has in place of divergences.
    pub(crate) fn learned(&self) -> Option<&LearnedChannels> {
        self.learned.as_ref()
    }

    pub(crate) fn monitor(&self, channel: usize) -> &Monitor {
        &self.monitors[channel]
    }

    pub(crate) fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    pub(crate) fn phase(&self) -> ModulePhase {
        self.phase
    }

    pub(crate) fn in_service_since(&self) -> Option<Step> {
        self.in_service_since
    }
}
