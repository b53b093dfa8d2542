//! Pressure sensors with noise and slow drift. They never fail (first assumption of section 2 of the paper).

use rand_chacha::ChaCha8Rng;

use crate::course::{DayCourse, SlowClock};
use crate::gage::normal;
use crate::hydraulics::HydraulicParameters;
use crate::streams::Stream;

/// The pressure sensors of all actuators.
#[derive(Debug, Clone)]
pub(crate) struct PressureSensors {
    noise_pa: f64,
    noise: Vec<ChaCha8Rng>,
    drift_pa: f64,
    courses: Vec<[DayCourse; 2]>,
    /// The present error of each sensor \[Pa\].
    offsets_pa: Vec<[f64; 2]>,
    clock: SlowClock,
}

impl PressureSensors {
    pub(crate) fn new(
        parameters: &HydraulicParameters,
        actuators: usize,
        step_s: f64,
        seed: u64,
    ) -> Self {
        let noise = (0..actuators).map(|channel| Stream::PressureNoise(channel).generator(seed));
        let course = |sensor| DayCourse::draw(Stream::PressureDrift(sensor), seed);
        let courses =
            (0..actuators).map(|actuator| [course(2 * actuator), course(2 * actuator + 1)]);
        let mut sensors = Self {
            noise_pa: parameters.pressure_noise_pa,
            noise: noise.collect(),
            drift_pa: parameters.pressure_drift_pa,
            courses: courses.collect(),
            offsets_pa: vec![[0.0; 2]; actuators],
            clock: SlowClock::new(step_s),
        };
        sensors.drift(0.0);
        sensors
    }

    fn drift(&mut self, time_s: f64) {
        for (offsets, courses) in self.offsets_pa.iter_mut().zip(&self.courses) {
            *offsets = courses.map(|course| self.drift_pa * course.at(time_s));
        }
    }

    /// Writes the measurements of both chambers' pressures \[Pa\].
    pub(crate) fn read(&mut self, true_pa: &[[f64; 2]], measured_pa: &mut [[f64; 2]]) {
        let pressures = measured_pa.iter_mut().zip(true_pa);
        for (generator, (measured, pressures)) in self.noise.iter_mut().zip(pressures) {
            *measured = pressures.map(|pressure| pressure + self.noise_pa * normal(generator));
        }
        if self.drift_pa > 0.0 {
            self.add_drift(measured_pa);
        }
    }

    fn add_drift(&mut self, measured_pa: &mut [[f64; 2]]) {
        for (measured, offsets) in measured_pa.iter_mut().zip(&self.offsets_pa) {
            for (pressure, offset) in measured.iter_mut().zip(offsets) {
                *pressure += offset;
            }
        }
        if let Some(time_s) = self.clock.tick() {
            self.drift(time_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_deviation_and_is_independent_between_chambers() {
        let parameters = HydraulicParameters::default();
        let mut sensors = PressureSensors::new(&parameters, 2, 1e-3, 3);
        let (mut squares, mut products) = ([0.0; 4], 0.0);
        let count = 50_000;
        for _ in 0..count {
            let mut measured = [[0.0; 2]; 2];
            sensors.read(&[[7e6, 9e6], [7e6, 9e6]], &mut measured);
            let errors = [
                measured[0][0] - 7e6,
                measured[0][1] - 9e6,
                measured[1][0] - 7e6,
                measured[1][1] - 9e6,
            ];
            for (square, error) in squares.iter_mut().zip(errors) {
                *square += error * error / f64::from(count);
            }
            products += errors[0] * errors[1] / f64::from(count);
        }
        for square in squares {
            assert!((square.sqrt() / 1e4 - 1.0).abs() < 0.015, "{square}");
        }
        assert!((products / 1e8).abs() < 0.02);
    }

    #[test]
    fn each_sensor_drifts_slowly_within_its_bound() {
        let parameters = HydraulicParameters {
            pressure_drift_pa: 2e4,
            pressure_noise_pa: 0.0,
            ..HydraulicParameters::default()
        };
        // An hour in steps of 10 ms.
        let mut sensors = PressureSensors::new(&parameters, 1, 1e-2, 3);
        let mut read = || {
            let mut measured = [[0.0; 2]];
            sensors.read(&[[7e6, 9e6]], &mut measured);
            let [[a, b]] = measured;
            [a - 7e6, b - 9e6]
        };
        let (mut before, mut least, mut most) = (read(), [f64::MAX; 2], [f64::MIN; 2]);
        for _ in 0..360_000 {
            let now = read();
            for chamber in 0..2 {
                assert!((now[chamber] - before[chamber]).abs() < 10.0 && now[chamber].abs() <= 2e4);
                least[chamber] = least[chamber].min(now[chamber]);
                most[chamber] = most[chamber].max(now[chamber]);
            }
            before = now;
        }
        assert!(most[0] - least[0] > 5e3 && most[0] != most[1], "{least:?} {most:?}");
    }
}
