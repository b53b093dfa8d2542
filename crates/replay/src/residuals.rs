//! Residuals and divergences at every step, also where none were published.

use diagnosis::messages::Speaker;
use diagnosis::{Action, Diagnoser, Measurements, ModuleSetup};
use vocabulary::{Divergences, StructureName};

use crate::shortfall::Shortfall;

/// A threshold that no divergence reaches, so that nothing is judged and no peer is queried.
const OUT_OF_REACH: f64 = f64::MAX;

/// A diagnoser that takes samples and has only its residuals and divergences read.
pub struct ResidualReplay {
    diagnoser: Diagnoser,
    speaker: Speaker,
    actions: Vec<Action>,
}

impl ResidualReplay {
    /// Starts before the first sample. Thresholds and reference in `setup` are ignored.
    ///
    /// # Errors
    /// A setup that no diagnoser can be made of.
    pub fn new(structure: StructureName, setup: &ModuleSetup) -> Result<Self, Shortfall> {
        let mut setup = ModuleSetup { reference: None, ..setup.clone() };
        let speaker = Speaker::of(structure, setup.module.clone());
        let channels = setup.components().len();
        setup.thresholds = vec![OUT_OF_REACH; channels];
        let diagnoser = Diagnoser::new(setup).map_err(|problems| Shortfall::of_setup(&problems))?;
        Ok(Self { diagnoser, speaker, actions: Vec::new() })
    }

    /// Takes the next sample, and returns what would be published of its step: nothing if the diagnoser refuses the
    /// sample.
    pub fn take(&mut self, sample: &Measurements) -> Option<Divergences> {
        let used = self.diagnoser.counters().samples;
        self.diagnoser.take_sample(sample, &mut self.actions);
        self.actions.clear();
        if self.diagnoser.counters().samples == used {
            return None;
        }
        Some(self.speaker.divergences((sample.run, sample.step), &self.diagnoser, 0))
    }
}
