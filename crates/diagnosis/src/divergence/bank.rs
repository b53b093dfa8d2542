//! Any number of channels that are sampled together.

use super::DivergenceOutcome;
use super::estimator::EstimatorGroup;
use super::lanes::{LANES, splat};
use super::settings::{DivergenceSettings, SettingsError};

/// Running divergences of the channels of one module.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct DivergenceBank {
    groups: Vec<EstimatorGroup>,
    outcomes: Vec<DivergenceOutcome>,
}

impl DivergenceBank {
    /// A bank without data, with one channel for each of `prior_scatters` (ε, in squared units of
    /// that channel's residual).
    ///
    /// # Errors
    /// Settings out of range.
    pub fn new(
        settings: DivergenceSettings,
        prior_scatters: &[f64],
    ) -> Result<Self, SettingsError> {
        settings.check()?;
        for &prior_scatter in prior_scatters {
            SettingsError::check_prior_scatter(prior_scatter)?;
        }
        let groups = prior_scatters.chunks(LANES).map(|chunk| {
            let mut lane = splat(1.0);
            lane[..chunk.len()].copy_from_slice(chunk);
            EstimatorGroup::new(settings, lane)
        });
        let groups = groups.collect();
        Ok(Self { groups, outcomes: vec![DivergenceOutcome::Undefined; prior_scatters.len()] })
    }

    /// Number of channels.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.outcomes.len()
    }

    /// What the latest samples led to.
    #[must_use]
    pub fn outcomes(&self) -> &[DivergenceOutcome] {
        &self.outcomes
    }

    /// Forgets all data.
    pub fn restart(&mut self) {
        self.groups.iter_mut().for_each(EstimatorGroup::restart);
    }

    /// Forgets the data of one channel; the others go on.
    pub fn restart_channel(&mut self, channel: usize) {
        if let Some(group) = self.groups.get_mut(channel / LANES) {
            group.restart_lane(channel % LANES);
        }
    }

    /// Notes that samples are missing before the next ones: no window is formed across the gap.
    pub fn gap(&mut self) {
        self.groups.iter_mut().for_each(EstimatorGroup::gap);
    }

    /// Leaves the next sample of every channel out: it counts as a gap.
    pub fn skip(&mut self) -> &[DivergenceOutcome] {
        self.gap();
        self.outcomes.fill(DivergenceOutcome::Undefined);
        &self.outcomes
    }

    /// How much of a channel's latest divergence comes of the vectors that came within the lag, and how much of those that
    /// left the interval meanwhile.
    #[must_use]
    pub fn parts(&self, channel: usize) -> [f64; 2] {
        let parts = self.groups.get(channel / LANES).map(|group| group.parts(channel % LANES));
        parts.unwrap_or_default()
    }

    /// Takes the next sample of every channel. If any is not finite or the number of samples is not
    /// that of the channels, all count as a gap.
    pub fn push(&mut self, samples: &[f64]) -> &[DivergenceOutcome] {
        if samples.len() != self.channels() || !samples.iter().all(|x| x.is_finite()) {
            return self.skip();
        }
        let chunks = samples.chunks(LANES).zip(self.outcomes.chunks_mut(LANES));
        for (group, (chunk, outcomes)) in self.groups.iter_mut().zip(chunks) {
            let mut lane = splat(0.0);
            lane[..chunk.len()].copy_from_slice(chunk);
            outcomes.copy_from_slice(&group.push(lane)[..chunk.len()]);
        }
        &self.outcomes
    }
}
