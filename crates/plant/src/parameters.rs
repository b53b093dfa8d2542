//! All parameters of the plant except its structure.

use serde::{Deserialize, Serialize};

use crate::check::{Checks, ParameterErrors};
use crate::gage::GageParameters;
use crate::hydraulics::HydraulicParameters;
use crate::loads::LoadParameters;
use crate::moving_loads::MovingLoad;
use crate::nodal_loads::RecordedLoad;
use crate::temperature::TemperatureParameters;
use crate::wind::{BaseSpeed, WindParameters};

/// The plant's parameters; the defaults are the tower's figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlantParameters {
    /// Sampling step \[s\]: 1e-3.
    pub step_s: f64,
    /// Mean wind and gusts.
    pub wind: WindParameters,
    /// Wind exposure and live loads of the levels.
    pub loads: LoadParameters,
    /// Vehicles and trains; none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moving_loads: Vec<MovingLoad>,
    /// Forces over time on given nodes; none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recorded_loads: Vec<RecordedLoad>,
    /// Temperature differences in the structure.
    pub temperature: TemperatureParameters,
    /// Actuators with their inner force control, and pressure sensors.
    pub hydraulics: HydraulicParameters,
    /// Strain gages.
    pub gages: GageParameters,
    /// Kalman filter and regulator.
    pub controller: ControllerParameters,
}

impl Default for PlantParameters {
    fn default() -> Self {
        Self {
            step_s: 1e-3,
            wind: WindParameters::default(),
            loads: LoadParameters::default(),
            moving_loads: Vec::new(),
            recorded_loads: Vec::new(),
            temperature: TemperatureParameters::default(),
            hydraulics: HydraulicParameters::default(),
            gages: GageParameters::default(),
            controller: ControllerParameters::default(),
        }
    }
}

impl PlantParameters {
    /// Checks that every parameter is in range.
    ///
    /// # Errors
    /// All parameters out of range, each with what is expected.
    pub fn check(&self) -> Result<(), ParameterErrors> {
        let mut checks = Checks::default();
        checks.require(
            "step_s",
            self.step_s >= 1e-5 && self.step_s <= 0.02,
            self.step_s,
            "a step from 1e-5 to 0.02 s",
        );
        self.wind.check(&mut checks);
        self.loads.check(&mut checks);
        for (number, load) in self.moving_loads.iter().enumerate() {
            load.check(number, &mut checks);
        }
        for (number, load) in self.recorded_loads.iter().enumerate() {
            load.check(number, &mut checks);
        }
        self.temperature.check(&mut checks);
        self.hydraulics.check(self.step_s, &mut checks);
        self.gages.check(&mut checks);
        self.controller.check(&mut checks);
        checks.finish()
    }

    /// The loads in words and figures, for comparison with those of another time.
    #[must_use]
    pub fn loads_in_words(&self) -> String {
        let LoadParameters { live_load_max_kg, live_load_changes_per_hour, .. } = self.loads;
        let mut words = vec![match &self.wind.base_speed {
            BaseSpeed::Drawn { from_m_per_s, to_m_per_s } => {
                format!("wind of {from_m_per_s} to {to_m_per_s} m/s")
            }
            BaseSpeed::Fixed { speed_m_per_s } => format!("wind of {speed_m_per_s} m/s"),
            BaseSpeed::Profile { points } => {
                let largest = points.iter().map(|[_, speed]| *speed).fold(0.0, f64::max);
                format!("wind of up to {largest} m/s")
            }
        }];
        let changes = match live_load_changes_per_hour > 0.0 {
            true => format!(", changing {live_load_changes_per_hour} times an hour"),
            false => String::new(),
        };
        words.push(format!("up to {live_load_max_kg} kg on a level{changes}"));
        words.extend(self.moving_loads.iter().map(MovingLoad::in_words));
        words.extend(self.recorded_loads.iter().map(RecordedLoad::in_words));
        words.extend((!self.temperature.is_even()).then(|| "uneven temperature".to_owned()));
        words.join("; ")
    }
}

/// The controller. Marks: \[C\] computed, \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ControllerParameters {
    /// Modes in the controller's model, lowest first: 12 \[E\].
    pub modes: usize,
    /// Weight r of the squared demands, R = r·I \[1/N² against twice the modal energy in J\]: 5e-8 \[C\].
    pub effort_weight: f64,
    /// The filter assumes this multiple of the gages' noise deviation: 5 \[C\].
    pub gage_noise_factor: f64,
    /// Base wind speed that the filter is designed for \[m/s\]: 11, the mean of U(8, 14) \[E\].
    pub base_speed_m_per_s: f64,
}

impl Default for ControllerParameters {
    fn default() -> Self {
        Self { modes: 12, effort_weight: 5e-8, gage_noise_factor: 5.0, base_speed_m_per_s: 11.0 }
    }
}

impl ControllerParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.require(
            "controller.modes",
            (1..=100).contains(&self.modes),
            self.modes,
            "1 to 100 modes",
        );
        checks.within("controller.effort_weight", self.effort_weight, 1e-20..=1e15, "1/N²");
        checks.within("controller.gage_noise_factor", self.gage_noise_factor, 1e-3..=1e6, "");
        checks.within(
            "controller.base_speed_m_per_s",
            self.base_speed_m_per_s,
            0.01..=100.0,
            "m/s",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_towers_figures_are_in_range() {
        PlantParameters::default().check().unwrap();
    }

    #[test]
    fn what_is_left_out_is_the_default_and_the_rest_round_trips() {
        let read = |text: &str| toml::from_str::<PlantParameters>(text);
        assert_eq!(read("").unwrap(), PlantParameters::default());
        let text = toml::to_string(&PlantParameters::default()).unwrap();
        assert_eq!(read(&text).unwrap(), PlantParameters::default());
        let storm = read(
            "wind.base_speed = { kind = \"profile\", points = [[0.0, 8.0], [600.0, 25.0]] }\n\
             hydraulics.substeps = 4",
        )
        .unwrap();
        assert_eq!(storm.hydraulics.substeps, 4);
        storm.check().unwrap();
    }

    #[test]
    fn loads_are_put_into_words_and_a_vehicle_round_trips() {
        let text = "loads.live_load_changes_per_hour = 6.0\ntemperature.sun_k = 4.0\n\
            [[moving_loads]]\npaths = [[\"B0\", \"B1\"]]\naxles_n = [20e3, 40e3]\n\
            axles_behind_m = [0.0, 4.0]\nspeed_m_per_s = [10.0, 25.0]\npause_s = [1.0, 8.0]\n\
            load_factor = [0.5, 1.0]";
        let parameters: PlantParameters = toml::from_str(text).unwrap();
        parameters.check().unwrap();
        assert_eq!(
            parameters.loads_in_words(),
            "wind of 8 to 14 m/s; up to 1000 kg on a level, changing 6 times an hour; \
             30 to 60 kN on 2 axles at 10 to 25 m/s every 1 to 8 s; uneven temperature"
        );
        let written = toml::to_string(&parameters).unwrap();
        assert_eq!(toml::from_str::<PlantParameters>(&written).unwrap(), parameters);
    }

    #[test]
    fn unknown_keys_are_refused() {
        for text in ["wnd = 1", "wind.speed = 3.0", "gages.noise = 1.0", "[hydraulic]"] {
            assert!(toml::from_str::<PlantParameters>(text).is_err(), "{text}");
        }
    }

    #[test]
    fn all_errors_are_reported_at_once() {
        let mut parameters = PlantParameters { step_s: 0.0, ..PlantParameters::default() };
        parameters.wind.air_density_kg_per_m3 = f64::NAN;
        parameters.wind.base_speed =
            crate::wind::BaseSpeed::Profile { points: vec![[1.0, 3.0], [1.0, 4.0]] };
        parameters.loads.drag_coefficient = -1.0;
        parameters.hydraulics.rest_a_pa = 300e5;
        parameters.gages.noise_strain = 0.0;
        parameters.controller.modes = 0;
        let errors = parameters.check().unwrap_err();
        let named: Vec<&str> = errors.0.iter().map(|error| error.parameter.as_str()).collect();
        assert_eq!(
            named,
            [
                "step_s",
                "wind.base_speed",
                "wind.air_density_kg_per_m3",
                "loads.drag_coefficient",
                "hydraulics.rest_a_pa",
                "gages.noise_strain",
                "controller.modes",
            ]
        );
        assert_eq!(errors.to_string().lines().count(), 7);
    }
}
