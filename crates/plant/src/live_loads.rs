//! Live loads that change over time.
//!
//! Occasionally the load of one level changes to another value within some seconds. The change is slow, so the gages
//! read the structure in equilibrium. The mass that vibrates with a level stays that of the start.

use nalgebra::DMatrix;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};

use crate::loads::LoadParameters;
use crate::streams::Stream;

/// A level's load during its change from one value to the next \[kg\].
#[derive(Debug, Clone, Copy)]
struct Moving {
    from_kg: f64,
    to_kg: f64,
    since_s: f64,
}

/// The live loads of all levels, and their effect on the gages.
#[derive(Debug, Clone)]
pub(crate) struct LiveLoads {
    levels: Vec<Moving>,
    /// Elongation of each gage per load (gages × levels) \[m/kg\].
    response: DMatrix<f64>,
    generator: ChaCha8Rng,
    parameters: LoadParameters,
    next_change_s: f64,
}

impl LiveLoads {
    /// `response`: elongations per load of a level (gages × levels) \[m/kg\].
    pub(crate) fn new(
        loads_kg: &[f64],
        response: DMatrix<f64>,
        parameters: &LoadParameters,
        seed: u64,
    ) -> Self {
        let level = |&load: &f64| Moving { from_kg: load, to_kg: load, since_s: 0.0 };
        let mut loads = Self {
            levels: loads_kg.iter().map(level).collect(),
            response,
            generator: Stream::LiveLoadChanges.generator(seed),
            parameters: parameters.clone(),
            next_change_s: 0.0,
        };
        loads.next_change_s = loads.wait_s();
        loads
    }

    /// Advances the loads to a time.
    pub(crate) fn advance(&mut self, time_s: f64) {
        while time_s >= self.next_change_s && !self.levels.is_empty() {
            let level = self.generator.random_range(0..self.levels.len());
            let to_kg = self.parameters.live_load_max_kg * self.generator.random::<f64>();
            let since_s = self.next_change_s;
            let from_kg = self.load_kg(level, since_s);
            self.levels[level] = Moving { from_kg, to_kg, since_s };
            self.next_change_s += self.wait_s();
        }
    }

    /// Adds the effect of the loads on the gages at a time \[m\]. Allocates nothing.
    pub(crate) fn add_to(&self, elongations_m: &mut [f64], time_s: f64) {
        for level in 0..self.levels.len() {
            let load = self.load_kg(level, time_s);
            for (elongation, per_kg) in
                elongations_m.iter_mut().zip(self.response.column(level).iter())
            {
                *elongation += per_kg * load;
            }
        }
    }

    fn load_kg(&self, level: usize, time_s: f64) -> f64 {
        let Moving { from_kg, to_kg, since_s } = self.levels[level];
        let place = ((time_s - since_s) / self.parameters.live_load_ramp_s).clamp(0.0, 1.0);
        from_kg + (to_kg - from_kg) * place
    }

    /// Time until the next change \[s\].
    fn wait_s(&mut self) -> f64 {
        let share: f64 = Exp1.sample(&mut self.generator);
        3600.0 * share / self.parameters.live_load_changes_per_hour
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loads(per_hour: f64) -> LiveLoads {
        let parameters =
            LoadParameters { live_load_changes_per_hour: per_hour, ..LoadParameters::default() };
        LiveLoads::new(&[100.0, 200.0], DMatrix::identity(2, 2), &parameters, 1)
    }

    fn at(loads: &LiveLoads, time_s: f64) -> [f64; 2] {
        let mut read = [0.0; 2];
        loads.add_to(&mut read, time_s);
        read
    }

    #[test]
    fn loads_change_as_often_as_stated_within_their_bounds_and_without_a_jump() {
        let mut loads = loads(60.0);
        let (mut changes, mut before) = (0, at(&loads, 0.0));
        assert_eq!(before, [100.0, 200.0]);
        let mut next = loads.next_change_s;
        for tenth in 1..=360_000_u32 {
            let time = 0.1 * f64::from(tenth);
            loads.advance(time);
            if loads.next_change_s > next {
                changes += 1;
                next = loads.next_change_s;
            }
            let now = at(&loads, time);
            for (now, before) in now.iter().zip(before) {
                assert!((0.0..=1000.0).contains(now));
                assert!((now - before).abs() <= 1000.0 * 0.1 / 20.0 + 1e-9, "{before} {now}");
            }
            before = now;
        }
        assert!((500..700).contains(&changes), "{changes}");
    }

    #[test]
    fn at_no_rate_nothing_changes() {
        let mut loads = loads(0.0);
        loads.advance(1e9);
        assert_eq!(at(&loads, 1e9), [100.0, 200.0]);
    }
}
