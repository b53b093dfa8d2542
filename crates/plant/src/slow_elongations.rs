//! The effect on the gages of live loads and temperature, which change so slowly that the structure follows in
//! equilibrium.

use crate::course::SlowClock;
use crate::live_loads::LiveLoads;
use crate::temperature::Temperature;

/// The elongations in equilibrium, step by step.
#[derive(Debug, Clone)]
pub(crate) struct SlowElongations {
    elongations_m: Vec<f64>,
    /// `None` if nothing changes.
    changing: Option<Changing>,
}

/// The quantities that change the elongations in equilibrium.
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
    /// Starts with the elongations `elongations_m` under the initial live loads.
    pub(crate) fn new(mut elongations_m: Vec<f64>, mut changing: Option<Changing>) -> Self {
        if let Some(changing) = &mut changing {
            changing.evaluate(&mut elongations_m, 0.0);
        }
        Self { elongations_m, changing }
    }

    /// The elongations of all gages at this step \[m\].
    pub(crate) fn elongations_m(&self) -> &[f64] {
        &self.elongations_m
    }

    /// Advances by one step. Allocates nothing.
    pub(crate) fn step(&mut self) {
        let Some(changing) = &mut self.changing else { return };
        if let Some(time_s) = changing.clock.tick() {
            changing.evaluate(&mut self.elongations_m, time_s);
        }
    }
}
