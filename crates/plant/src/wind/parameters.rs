//! The parameters of the wind. Marks as in the tower's figures: \[N\] norm, \[E\] engineering estimate.

use serde::{Deserialize, Serialize};

use crate::check::Checks;

/// The base wind speed v_b: 10 minutes' mean, 10 m above open country \[m/s\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum BaseSpeed {
    /// Drawn once per run, uniformly.
    Drawn {
        /// Least speed \[m/s\].
        from_m_per_s: f64,
        /// Largest speed \[m/s\].
        to_m_per_s: f64,
    },
    /// The same in every run.
    Fixed {
        /// The speed \[m/s\].
        speed_m_per_s: f64,
    },
    /// Follows a list of (time \[s\], speed \[m/s\]), linear between the points and constant outside,
    /// e.g. a storm. Spectrum and coherence are those of the largest speed; mean and gusts scale.
    Profile {
        /// At least one point, times increasing.
        points: Vec<[f64; 2]>,
    },
}

impl BaseSpeed {
    fn check(&self, checks: &mut Checks) {
        let name = "wind.base_speed";
        let usable = |speed: f64| (0.0..=100.0).contains(&speed);
        match self {
            BaseSpeed::Drawn { from_m_per_s: from, to_m_per_s: to } => checks.require(
                name,
                usable(*from) && usable(*to) && from <= to,
                format_args!("drawn from {from} to {to} m/s"),
                "speeds from 0 to 100 m/s, the lower one first",
            ),
            BaseSpeed::Fixed { speed_m_per_s: speed } => {
                checks.require(name, usable(*speed), speed, "a speed from 0 to 100 m/s");
            }
            BaseSpeed::Profile { points } => {
                let times_increase = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
                let finite = points.iter().all(|[time, speed]| time.is_finite() && usable(*speed));
                checks.require(
                    name,
                    !points.is_empty() && times_increase && finite,
                    format_args!("a profile of {} points", points.len()),
                    "at least one [time_s, speed_m_per_s] with increasing times and speeds from 0 to 100 m/s",
                );
            }
        }
    }
}

/// The wind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindParameters {
    /// Base wind speed; drawn from U(8, 14) m/s \[E\].
    pub base_speed: BaseSpeed,
    /// The direction that the wind blows to, from the x axis towards y \[°\]; drawn uniformly if absent \[E\].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction_deg: Option<f64>,
    /// Roughness length z₀ \[m\]: 0.3, suburban terrain \[N: EN 1991-1-4, category III\].
    pub roughness_length_m: f64,
    /// Below this height the profile is constant \[m\]: 5 \[N: EN 1991-1-4, category III\].
    pub lowest_height_m: f64,
    /// Length of turbulence at 200 m height \[m\]: 300 \[N: EN 1991-1-4, B.1\].
    pub turbulence_length_m: f64,
    /// Exponent of the turbulence length over height: 0.61 \[N: EN 1991-1-4, B.1\].
    pub turbulence_length_exponent: f64,
    /// Factor on the gusts: 1; 0 leaves the mean wind only.
    pub gust_factor: f64,
    /// Power of the lateral gusts over that of the longitudinal ones: 0.5 \[E\].
    pub lateral_power_share: f64,
    /// Decay of the coherence between levels: 10 \[N: Davenport\].
    pub coherence_decay: f64,
    /// Density of air \[kg/m³\]: 1.25 \[N: EN 1991-1-4\].
    pub air_density_kg_per_m3: f64,
    /// Frequency lines of the turbulence: 200 \[E\].
    pub lines: usize,
    /// Lowest frequency \[Hz\]: 0.002; the first line includes the power below it \[E\].
    pub lowest_frequency_hz: f64,
    /// Highest frequency \[Hz\]: 10 \[E\].
    pub highest_frequency_hz: f64,
    /// A run starts in the mean wind; the gusts grow to full strength within this time \[s\]: 2 \[E\].
    pub fade_in_s: f64,
}

impl Default for WindParameters {
    fn default() -> Self {
        Self {
            base_speed: BaseSpeed::Drawn { from_m_per_s: 8.0, to_m_per_s: 14.0 },
            direction_deg: None,
            roughness_length_m: 0.3,
            lowest_height_m: 5.0,
            turbulence_length_m: 300.0,
            turbulence_length_exponent: 0.61,
            gust_factor: 1.0,
            lateral_power_share: 0.5,
            coherence_decay: 10.0,
            air_density_kg_per_m3: 1.25,
            lines: 200,
            lowest_frequency_hz: 0.002,
            highest_frequency_hz: 10.0,
            fade_in_s: 2.0,
        }
    }
}

impl WindParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        self.base_speed.check(checks);
        let direction = self.direction_deg.unwrap_or(0.0);
        checks.require(
            "wind.direction_deg",
            direction.abs() <= 360.0,
            direction,
            "an angle within ±360°",
        );
        checks.within("wind.roughness_length_m", self.roughness_length_m, 1e-6..=100.0, "m");
        checks.require(
            "wind.lowest_height_m",
            self.lowest_height_m > self.roughness_length_m && self.lowest_height_m <= 1e4,
            self.lowest_height_m,
            "a height above the roughness length, up to 1e4 m",
        );
        self.check_turbulence(checks);
        checks.within(
            "wind.air_density_kg_per_m3",
            self.air_density_kg_per_m3,
            1e-3..=2e3,
            "kg/m³",
        );
    }

    fn check_turbulence(&self, checks: &mut Checks) {
        checks.within("wind.turbulence_length_m", self.turbulence_length_m, 0.01..=1e5, "m");
        checks.within(
            "wind.turbulence_length_exponent",
            self.turbulence_length_exponent,
            0.0..=10.0,
            "",
        );
        checks.within("wind.gust_factor", self.gust_factor, 0.0..=1e3, "");
        checks.within("wind.lateral_power_share", self.lateral_power_share, 0.0..=1e3, "");
        checks.within("wind.coherence_decay", self.coherence_decay, 0.0..=1e6, "");
        checks.within("wind.fade_in_s", self.fade_in_s, 0.0..=1e6, "s");
        checks.require(
            "wind.lines",
            (1..=10_000).contains(&self.lines),
            self.lines,
            "1 to 10000 lines",
        );
        checks.within("wind.lowest_frequency_hz", self.lowest_frequency_hz, 1e-6..=10.0, "Hz");
        checks.require(
            "wind.highest_frequency_hz",
            self.highest_frequency_hz > self.lowest_frequency_hz
                && self.highest_frequency_hz <= 10.0,
            self.highest_frequency_hz,
            "a frequency above the lowest one and at most 10 Hz",
        );
    }
}
