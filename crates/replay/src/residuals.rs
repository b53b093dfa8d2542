//! Residuals and divergences at every step, whether published or not.

use diagnosis::messages::Speaker;
use diagnosis::{Action, Diagnoser, Measurements, ModuleSetup};
use vocabulary::{Divergences, StructureName};

use crate::shortfall::Shortfall;

/// A threshold that no divergence reaches, so that there are no verdicts and no queries to peers.
const OUT_OF_REACH: f64 = f64::MAX;

/// A diagnoser of which only residuals and divergences are used.
pub struct ResidualReplay {
    diagnoser: Diagnoser,
    speaker: Speaker,
    actions: Vec<Action>,
}

impl ResidualReplay {
    /// Starts before the first sample. Thresholds and reference in `setup` are ignored.
    ///
    /// # Errors
    /// The setup is invalid.
    pub fn new(structure: StructureName, setup: &ModuleSetup) -> Result<Self, Shortfall> {
        let mut setup = ModuleSetup { reference: None, ..setup.clone() };
        let speaker = Speaker::of(structure, setup.module.clone());
        let channels = setup.components().len();
        setup.thresholds = vec![OUT_OF_REACH; channels];
        let diagnoser = Diagnoser::new(setup).map_err(|problems| Shortfall::of_setup(&problems))?;
        Ok(Self { diagnoser, speaker, actions: Vec::new() })
    }

    /// Processes the next sample, and returns the divergences that would be published; `None` if the diagnoser rejects it.
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
