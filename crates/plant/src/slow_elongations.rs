//! What the gages read beside the structure's motion: the weight of the live loads and temperature, which change so
//! slowly that the structure follows at rest.

use crate::course::SlowClock;
use crate::live_loads::LiveLoads;
use crate::temperature::Temperature;

/// The elongations at rest, step by step.
#[derive(Debug, Clone)]
pub(crate) struct SlowElongations {
    elongations_m: Vec<f64>,
    /// Nothing if nothing ever changes.
    changing: Option<Changing>,
}

/// What changes the elongations at rest.
#[derive(Debug, Clone)]
pub(crate) struct Changing {
    pub(crate) loads: LiveLoads,
    pub(crate) temperature: Temperature,
    pub(crate) clock: SlowClock,
}

impl Changing {
    fn evaluate(&mut self, elongations_m: &mut [f64], time_s: f64) {
        self.loads.advance(time_s);
        elongations_m.fill(0.0);
        self.loads.add_to(elongations_m, time_s);
        self.temperature.add_to(elongations_m, time_s);
    }
}

impl SlowElongations {
    /// `elongations_m` under the live loads of the start.
    pub(crate) fn new(mut elongations_m: Vec<f64>, mut changing: Option<Changing>) -> Self {
        if let Some(changing) = &mut changing {
            changing.evaluate(&mut elongations_m, 0.0);
        }
        Self { elongations_m, changing }
    }

    /// Of each gage at this step \[m\].
    pub(crate) fn elongations_m(&self) -> &[f64] {
        &self.elongations_m
    }

    /// Moves on by one step. Allocates nothing.
    pub(crate) fn step(&mut self) {
        let Some(changing) = &mut self.changing else { return };
        if let Some(time_s) = changing.clock.tick() {
            changing.evaluate(&mut self.elongations_m, time_s);
        }
    }
}
