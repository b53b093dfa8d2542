//! The distribution of the gusts' power over frequency, and its coherence between levels.
//!
//! EN 1991-1-4, B.1: n S(n) / σ² = 6.8 f / (1 + 10.2 f)^(5/3) with f = n L / v. Its integral from 0
//! to n has the closed form 1 − (1 + 10.2 f)^(−2/3), so the power of a band needs no quadrature.
//!
//! Davenport's root coherence of two levels Δz apart: exp(−c n Δz / v), v the mean of both speeds.

/// Ratio of the turbulence length to the mean speed \[s\] turns a frequency \[Hz\] into the norm's f.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GustSpectrum {
    /// Turbulence length over mean speed \[s\].
    pub time_scale_s: f64,
}

impl GustSpectrum {
    /// Power density at a frequency \[Hz\], one-sided, as a share of the variance \[1/Hz\].
    #[must_use]
    pub fn density(&self, frequency_hz: f64) -> f64 {
        let base = 1.0 + 10.2 * frequency_hz * self.time_scale_s;
        6.8 * self.time_scale_s / base.powf(5.0 / 3.0)
    }

    /// Share of the variance below a frequency \[Hz\].
    #[must_use]
    pub fn share_below(&self, frequency_hz: f64) -> f64 {
        1.0 - (1.0 + 10.2 * frequency_hz * self.time_scale_s).powf(-2.0 / 3.0)
    }
}

/// Root coherence of two levels \[–\]: `distance_m` apart, at the mean of their speeds \[m/s\].
#[must_use]
pub fn root_coherence(decay: f64, frequency_hz: f64, distance_m: f64, mean_speed: f64) -> f64 {
    (-decay * frequency_hz * distance_m / mean_speed).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_is_the_integral_of_the_density() {
        let spectrum = GustSpectrum { time_scale_s: 6.0 };
        let (from, to, parts) = (0.01_f64, 5.0_f64, 20_000);
        let ratio = (to / from).powf(1.0 / f64::from(parts));
        let mut integral = 0.0;
        let mut left = from;
        for _ in 0..parts {
            let right = left * ratio;
            integral += spectrum.density((left * right).sqrt()) * (right - left);
            left = right;
        }
        let expected = spectrum.share_below(to) - spectrum.share_below(from);
        assert!((integral - expected).abs() < 1e-6, "{integral} {expected}");
    }

    #[test]
    fn all_of_the_variance_lies_below_infinity() {
        let spectrum = GustSpectrum { time_scale_s: 6.0 };
        assert_eq!(spectrum.share_below(0.0), 0.0);
        assert!((spectrum.share_below(1e12) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn coherence_falls_with_distance_and_frequency() {
        assert_eq!(root_coherence(10.0, 1.0, 0.0, 10.0), 1.0);
        let near = root_coherence(10.0, 0.1, 3.0, 10.0);
        assert!((near - (-0.3_f64).exp()).abs() < 1e-15);
        assert!(root_coherence(10.0, 0.2, 3.0, 10.0) < near);
    }
}
