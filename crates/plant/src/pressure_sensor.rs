//! Pressure sensors with noise. They are always healthy (first assumption of section 2 of the
//! paper).

use rand_chacha::ChaCha8Rng;

use crate::gage::normal;
use crate::hydraulics::HydraulicParameters;
use crate::streams::Stream;

/// The pressure sensors of all actuators.
#[derive(Debug, Clone)]
pub(crate) struct PressureSensors {
    noise_pa: f64,
    noise: Vec<ChaCha8Rng>,
}

impl PressureSensors {
    pub(crate) fn new(parameters: &HydraulicParameters, actuators: usize, seed: u64) -> Self {
        let noise = (0..actuators).map(|channel| Stream::PressureNoise(channel).generator(seed));
        Self { noise_pa: parameters.pressure_noise_pa, noise: noise.collect() }
    }

    /// Writes the measurements of both chambers' pressures \[Pa\].
    pub(crate) fn read(&mut self, true_pa: &[[f64; 2]], measured_pa: &mut [[f64; 2]]) {
        let pressures = measured_pa.iter_mut().zip(true_pa);
        for (generator, (measured, pressures)) in self.noise.iter_mut().zip(pressures) {
            *measured = pressures.map(|pressure| pressure + self.noise_pa * normal(generator));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_deviation_and_is_independent_between_chambers() {
        let parameters = HydraulicParameters::default();
        let mut sensors = PressureSensors::new(&parameters, 2, 3);
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
}
