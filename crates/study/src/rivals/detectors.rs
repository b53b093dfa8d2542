//! All detectors: what they learn from fault-free runs, and their statistics in a run.

use std::collections::VecDeque;

use nalgebra::DMatrix;
use serde::Serialize;

use rand::Rng;

use super::channelwise::{
    Autoregression, ChannelDetector, ChiSquared, Cusum, Ewma, Glr, OnlineChangePoint, Shewhart,
    Whitened,
};
use super::joint::{Autoencoder, Distance, GaussianProcess, Healthy, PrincipalError};
use crate::error::StudyError;
use crate::rig::Rig;
use crate::system::{System, generator};

/// Random streams of training runs, and of the weights that a network begins with.
const FIRST_TRAINING_STREAM: u64 = 13 << 60;
const WEIGHTS_STREAM: u64 = 14 << 60;
/// Fault-free runs that detectors are trained with, and their length after the warm-up \[s\].
const TRAINING_RUNS: u64 = 16;
const TRAINED_S: f64 = 6.0;
/// Joint detectors learn from every so many steps.
const LEARNED_EVERY: usize = 20;
/// Residuals are standardised by their latest so many seconds, as long as the interval of the shipped divergence.
const INTERVAL_S: f64 = 2.0;

/// A detector.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum DetectorName {
    /// The shipped divergence.
    Divergence,
    /// The divergence of the paper's settings and residuals.
    PaperDivergence,
    /// The standardised residual itself.
    Level,
    /// Cumulative sums.
    Cusum,
    /// Exponentially weighted moving averages.
    Ewma,
    /// Sums of squares.
    ChiSquared,
    /// The generalized likelihood ratio of a jump.
    Glr,
    /// Bayesian online change point detection in the errors of autoregressive prediction.
    Bocpd,
    /// Errors of autoregressive prediction.
    Autoregression,
    /// Hotelling's T² of a module.
    Hotelling,
    /// The multivariate moving average of a module.
    Mewma,
    /// The error of principal components of a module (Q).
    PrincipalError,
    /// Errors of prediction from a module's other channels by a Gaussian process.
    GaussianProcess,
    /// Errors of an autoencoder of a module.
    Autoencoder,
    /// Alarms always.
    AlwaysAlarm,
}

impl DetectorName {
    /// All of them; the first is what the others are compared with.
    pub const ALL: [Self; 15] = [
        Self::Divergence,
        Self::PaperDivergence,
        Self::Level,
        Self::Cusum,
        Self::Ewma,
        Self::ChiSquared,
        Self::Glr,
        Self::Bocpd,
        Self::Autoregression,
        Self::Hotelling,
        Self::Mewma,
        Self::PrincipalError,
        Self::GaussianProcess,
        Self::Autoencoder,
        Self::AlwaysAlarm,
    ];

    /// For people.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Divergence => "KL divergence (shipped)",
            Self::PaperDivergence => "KL divergence (paper)",
            Self::Level => "residual (Shewhart)",
            Self::Cusum => "CUSUM",
            Self::Ewma => "EWMA",
            Self::ChiSquared => "χ²",
            Self::Glr => "GLR",
            Self::Bocpd => "BOCPD",
            Self::Autoregression => "autoregression",
            Self::Hotelling => "T²",
            Self::Mewma => "MEWMA",
            Self::PrincipalError => "PCA (Q)",
            Self::GaussianProcess => "Gaussian process",
            Self::Autoencoder => "autoencoder",
            Self::AlwaysAlarm => "always alarms",
        }
    }

    /// Whether its statistic is one of a module and not of a channel.
    fn is_joint(self) -> bool {
        matches!(self, Self::Hotelling | Self::Mewma | Self::PrincipalError | Self::Autoencoder)
    }
}

/// What detectors have learned from fault-free runs.
pub(super) struct Trained {
    modules: Vec<TrainedModule>,
    /// Steps of the interval by which residuals are standardised.
    interval: usize,
    /// The mean of the largest healthy statistics, by detector and channel.
    scales: Vec<Vec<f64>>,
}

struct TrainedModule {
    channels: Vec<Autoregression>,
    hotelling: Distance,
    mewma: Distance,
    principal: PrincipalError,
    process: GaussianProcess,
    encoder: Autoencoder,
}

impl Trained {
    /// Trains all detectors with fault-free runs of other plants than those of the campaign.
    pub(super) fn new(system: &System, paper: &System) -> Result<Self, StudyError> {
        let interval = system.steps(INTERVAL_S) as usize;
        let from = system.watched_from().max(paper.watched_from());
        let until = from + system.steps(TRAINED_S);
        let counts: Vec<usize> =
            system.setups.iter().map(|setup| setup.components().len()).collect();
        // The residuals of each run, by step.
        let mut runs: Vec<Vec<Vec<f64>>> = Vec::new();
        for run in 0..TRAINING_RUNS {
            let mut rig = training_rig(system, system, run)?;
            let mut standardizer = Standardizer::new(interval);
            let mut residuals = Vec::new();
            for step in 0..until {
                rig.step()?;
                let standardised = standardizer.step(&rig);
                if step >= from {
                    residuals.push(standardised.to_vec());
                }
            }
            runs.push(residuals);
        }
        let mut first = 0;
        let mut modules = Vec::new();
        for (number, count) in (0_u64..).zip(&counts) {
            let mut weights = generator(system.seed, WEIGHTS_STREAM | number);
            modules.push(TrainedModule::fitted(&runs, first..first + count, &mut weights));
            first += count;
        }
        let mut trained =
            Self { modules, interval, scales: vec![vec![1.0; first]; DetectorName::ALL.len()] };
        trained.scales = trained.healthy_peaks(system, paper, from, until, &counts)?;
        Ok(trained)
    }

    /// The mean over the training runs of the largest statistic of each channel; of each module for joint detectors.
    fn healthy_peaks(
        &self,
        system: &System,
        paper: &System,
        from: u64,
        until: u64,
        counts: &[usize],
    ) -> Result<Vec<Vec<f64>>, StudyError> {
        let channels = counts.iter().sum();
        let mut means = vec![vec![0.0; channels]; DetectorName::ALL.len()];
        for run in 0..TRAINING_RUNS {
            let mut rigs = [training_rig(system, system, run)?, training_rig(paper, system, run)?];
            let mut statistics = DetectorBank::new(self);
            let mut peaks = vec![vec![0.0_f64; channels]; DetectorName::ALL.len()];
            for step in 0..until {
                for rig in &mut rigs {
                    rig.step()?;
                }
                statistics.step(&rigs[0], &rigs[1]);
                if step >= from {
                    for (peaks, statistics) in peaks.iter_mut().zip(&statistics.all) {
                        peaks.iter_mut().zip(statistics).for_each(|(peak, s)| *peak = peak.max(*s));
                    }
                }
            }
            for (name, (means, peaks)) in
                DetectorName::ALL.iter().zip(means.iter_mut().zip(&mut peaks))
            {
                if name.is_joint() {
                    share_largest(peaks, counts);
                }
                means
                    .iter_mut()
                    .zip(peaks)
                    .for_each(|(mean, peak)| *mean += *peak / TRAINING_RUNS as f64);
            }
        }
        means.iter_mut().flatten().for_each(|mean| *mean = mean.max(f64::MIN_POSITIVE));
        Ok(means)
    }
}

/// The rig of a training run of one system, with a plant that follows from another one's seed.
fn training_rig(system: &System, seeds: &System, run: u64) -> Result<Rig, StudyError> {
    system.rig(generator(seeds.seed, FIRST_TRAINING_STREAM | run).next_u64(), Vec::new())
}

/// Every channel of a module has the largest of their values.
fn share_largest(values: &mut [f64], counts: &[usize]) {
    let mut rest = values;
    for count in counts {
        let (module, others) = rest.split_at_mut(*count);
        let largest = module.iter().copied().fold(0.0, f64::max);
        module.fill(largest);
        rest = others;
    }
}

impl TrainedModule {
    fn fitted(
        runs: &[Vec<Vec<f64>>],
        places: std::ops::Range<usize>,
        weights: &mut impl Rng,
    ) -> Self {
        let rows: Vec<&Vec<f64>> =
            runs.iter().flat_map(|run| run.iter().step_by(LEARNED_EVERY)).collect();
        let healthy: Healthy = DMatrix::from_fn(rows.len(), places.len(), |row, channel| {
            rows[row][places.start + channel]
        });
        let channels = places.map(|place| {
            let series: Vec<Vec<f64>> =
                runs.iter().map(|run| run.iter().map(|step| step[place]).collect()).collect();
            Autoregression::fitted(series.iter().map(Vec::as_slice))
        });
        Self {
            channels: channels.collect(),
            hotelling: Distance::hotelling(&healthy),
            mewma: Distance::mewma(&healthy),
            principal: PrincipalError::fitted(&healthy),
            process: GaussianProcess::fitted(&healthy),
            encoder: Autoencoder::fitted(&healthy, weights),
        }
    }
}

/// Residuals less the mean of their latest values, in units of the standard deviation of these.
struct Standardizer {
    interval: usize,
    /// By channel: the latest residuals less the very first, that one, their sum, and that of their squares.
    channels: Vec<(VecDeque<f64>, f64, f64, f64)>,
    standardised: Vec<f64>,
}

impl Standardizer {
    fn new(interval: usize) -> Self {
        Self { interval, channels: Vec::new(), standardised: Vec::new() }
    }

    /// The standardised residuals of the rig's latest step, all modules in turn. What comes next has no effect on them.
    fn step(&mut self, rig: &Rig) -> &[f64] {
        self.standardised.clear();
        let residuals = rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.evidence());
        for (place, evidence) in residuals.enumerate() {
            let value = evidence.residual;
            if self.channels.len() == place {
                let first = if value.is_finite() { value } else { 0.0 };
                self.channels.push((VecDeque::new(), first, 0.0, 0.0));
            }
            let (latest, first, sum, squares) = &mut self.channels[place];
            let (value, count) = (value - *first, latest.len() as f64);
            let mean = *sum / count;
            let variance = *squares / count - mean * mean;
            let standardised = (value - mean) / variance.sqrt();
            // The first residual and a missing one cannot be standardised; they count as healthy.
            self.standardised.push(if standardised.is_finite() { standardised } else { 0.0 });
            if value.is_finite() {
                latest.push_back(value);
                (*sum, *squares) = (*sum + value, *squares + value * value);
            }
            if latest.len() > self.interval
                && let Some(old) = latest.pop_front()
            {
                (*sum, *squares) = (*sum - old, *squares - old * old);
            }
        }
        &self.standardised
    }
}

/// The detectors in a run.
pub(super) struct DetectorBank<'a> {
    trained: &'a Trained,
    standardizer: Standardizer,
    channelwise: Vec<[Box<dyn ChannelDetector>; 7]>,
    /// Of each module.
    distances: Vec<[Distance; 2]>,
    /// By detector and channel, of the latest step.
    all: Vec<Vec<f64>>,
    largest: Vec<(f64, usize)>,
}

impl<'a> DetectorBank<'a> {
    /// Before the first step.
    pub(super) fn new(trained: &'a Trained) -> Self {
        let channelwise = trained.modules.iter().flat_map(|module| &module.channels);
        let channelwise = channelwise.map(|autoregression| -> [Box<dyn ChannelDetector>; 7] {
            [
                Box::new(Shewhart),
                Box::new(Cusum::default()),
                Box::new(Ewma::default()),
                Box::new(ChiSquared::default()),
                Box::new(Glr::default()),
                Box::new(Whitened(autoregression.fresh(), OnlineChangePoint::default())),
                Box::new(autoregression.fresh()),
            ]
        });
        let distances = trained.modules.iter();
        Self {
            trained,
            standardizer: Standardizer::new(trained.interval),
            channelwise: channelwise.collect(),
            distances: distances.map(|of| [of.hotelling.clone(), of.mewma.clone()]).collect(),
            all: trained.scales.iter().map(|scales| vec![0.0; scales.len()]).collect(),
            largest: vec![(0.0, 0); DetectorName::ALL.len()],
        }
    }

    /// Processes the latest step of both rigs; for each detector the largest statistic in units of its healthy peak, and
    /// the place of its channel.
    pub(super) fn step(&mut self, shipped: &Rig, paper: &Rig) -> &[(f64, usize)] {
        let [divergence, paper_divergence, rest @ ..] = &mut self.all[..] else {
            return &self.largest;
        };
        for (rig, statistics) in [(shipped, divergence), (paper, paper_divergence)] {
            let evidence = rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.evidence());
            let divergences = evidence.map(|evidence| evidence.divergence.unwrap_or(0.0));
            statistics.iter_mut().zip(divergences).for_each(|(statistic, d)| *statistic = d);
        }
        let residuals = self.standardizer.step(shipped);
        for (place, (detectors, residual)) in self.channelwise.iter_mut().zip(residuals).enumerate()
        {
            for (detector, statistics) in detectors.iter_mut().zip(rest.iter_mut()) {
                statistics[place] = detector.step(*residual);
            }
        }
        if let [.., hotelling, mewma, principal, process, encoder, always] = rest {
            let mut first = 0;
            for (module, [distance, average]) in
                self.trained.modules.iter().zip(&mut self.distances)
            {
                let places = first..first + module.channels.len();
                let residuals = &residuals[places.clone()];
                distance.step(residuals, &mut hotelling[places.clone()]);
                average.step(residuals, &mut mewma[places.clone()]);
                module.principal.step(residuals, &mut principal[places.clone()]);
                module.process.step(residuals, &mut process[places.clone()]);
                module.encoder.step(residuals, &mut encoder[places.clone()]);
                first = places.end;
            }
            always.fill(1.0);
        }
        for ((statistics, scales), largest) in
            self.all.iter().zip(&self.trained.scales).zip(&mut self.largest)
        {
            let ratios = statistics.iter().zip(scales).map(|(statistic, scale)| statistic / scale);
            // Of equal ratios, the first.
            *largest = ratios.enumerate().fold((0.0, 0), |(most, at), (place, ratio)| {
                if ratio > most { (ratio, place) } else { (most, at) }
            });
        }
        &self.largest
    }
}
