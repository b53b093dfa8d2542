//! The nominal parameters of a module's hydraulic actuators.

use serde::{Deserialize, Serialize};

/// Nominal figures of a cylinder and its inner force control. All actuators of a module are alike.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NominalHydraulics {
    /// Piston area A_A of chamber A \[m²\].
    pub area_a_m2: f64,
    /// Ring area A_B of chamber B \[m²\].
    pub area_b_m2: f64,
    /// Volume V_A of chamber A \[m³\].
    pub volume_a_m3: f64,
    /// Volume V_B of chamber B \[m³\].
    pub volume_b_m3: f64,
    /// Bulk modulus β of the oil \[Pa\].
    pub bulk_modulus_pa: f64,
    /// Gain K_P of the force control \[m³/s/N\].
    pub force_gain_m3_per_s_n: f64,
    /// Largest flow of a valve at the full pressure drop \[m³/s\].
    pub valve_flow_m3_per_s: f64,
    /// Supply pressure \[Pa\].
    pub supply_pa: f64,
    /// Tank pressure \[Pa\].
    pub tank_pa: f64,
    /// Standard deviation of a measured pressure \[Pa\].
    pub pressure_noise_pa: f64,
    /// By which share a healthy cylinder may be faster or slower than these figures say: 0.25.
    #[serde(default = "quarter")]
    pub speed_uncertainty: f64,
}

fn quarter() -> f64 {
    0.25
}

/// A figure that cannot be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("`{name}` is {value:?}; use {expected}")]
pub struct HydraulicsError {
    /// The figure's name.
    pub name: &'static str,
    value: f64,
    expected: String,
}

impl NominalHydraulics {
    /// The names of the figures without a default.
    pub const REQUIRED: [&str; 10] = [
        "area_a_m2",
        "area_b_m2",
        "volume_a_m3",
        "volume_b_m3",
        "bulk_modulus_pa",
        "force_gain_m3_per_s_n",
        "valve_flow_m3_per_s",
        "supply_pa",
        "tank_pa",
        "pressure_noise_pa",
    ];

    /// F_act = p_A·A_A − p_B·A_B \[N\] (eq. 8).
    #[must_use]
    pub fn force_n(&self, [a, b]: [f64; 2]) -> f64 {
        a * self.area_a_m2 - b * self.area_b_m2
    }

    /// (p_A·A_A + p_B·A_B)/(A_A + A_B) \[Pa\]: it tells how much oil is in both chambers together, whatever the force.
    #[must_use]
    pub fn content_pa(&self, [a, b]: [f64; 2]) -> f64 {
        (a * self.area_a_m2 + b * self.area_b_m2) / (self.area_a_m2 + self.area_b_m2)
    }

    /// Time constant of the force loop while no valve is full \[s\]: 1/(β·K_P·(A_A/V_A + A_B/V_B)).
    #[must_use]
    pub fn time_constant_s(&self) -> f64 {
        1.0 / (self.bulk_modulus_pa * self.force_gain_m3_per_s_n * self.stiffness_per_m())
    }

    /// A_A/V_A + A_B/V_B \[1/m\]: the force that a volume of oil from B into A makes, over β.
    pub(super) fn stiffness_per_m(&self) -> f64 {
        self.area_a_m2 / self.volume_a_m3 + self.area_b_m2 / self.volume_b_m3
    }

    /// Variance of an observed force \[N²\] that the pressure noise alone causes.
    #[must_use]
    pub fn force_variance(&self) -> f64 {
        let a = self.area_a_m2 * self.pressure_noise_pa;
        let b = self.area_b_m2 * self.pressure_noise_pa;
        a * a + b * b
    }

    /// The same so many times as fast.
    #[must_use]
    pub(super) fn with_speed(&self, factor: f64) -> Self {
        Self {
            force_gain_m3_per_s_n: factor * self.force_gain_m3_per_s_n,
            valve_flow_m3_per_s: factor * self.valve_flow_m3_per_s,
            ..*self
        }
    }

    /// Every figure that cannot be right.
    #[must_use]
    pub fn problems(&self) -> Vec<HydraulicsError> {
        let figures = [
            (self.area_a_m2, 1e-8..=100.0, "m²"),
            (self.area_b_m2, 1e-8..=100.0, "m²"),
            (self.volume_a_m3, 1e-12..=1e3, "m³"),
            (self.volume_b_m3, 1e-12..=1e3, "m³"),
            (self.bulk_modulus_pa, 1e6..=1e11, "Pa"),
            (self.force_gain_m3_per_s_n, 1e-18..=1.0, "m³/s per N"),
            (self.valve_flow_m3_per_s, 1e-12..=100.0, "m³/s"),
            (self.supply_pa, 1e3..=1e9, "Pa"),
            (self.tank_pa, 1e-3..=1e9, "Pa"),
            (self.pressure_noise_pa, 1e-3..=1e8, "Pa"),
        ];
        let mut problems: Vec<_> = Self::REQUIRED
            .into_iter()
            .zip(figures)
            .filter(|(_, (value, range, _))| !range.contains(value))
            .map(|(name, (value, range, unit))| {
                let [least, largest] = [range.start(), range.end()].map(|end| format!("{end:e}"));
                let ends = [&least, &largest].map(|end| end.trim_end_matches("e0"));
                let expected = format!("{} to {} {unit}", ends[0], ends[1]);
                HydraulicsError { name, value, expected }
            })
            .collect();
        if !(0.0..1.0).contains(&self.speed_uncertainty) {
            let (name, value) = ("speed_uncertainty", self.speed_uncertainty);
            problems.push(HydraulicsError {
                name,
                value,
                expected: "0 or more, and less than 1".to_owned(),
            });
        }
        if problems.is_empty() && self.tank_pa >= self.supply_pa {
            let expected = "less than the supply pressure".to_owned();
            problems.push(HydraulicsError { name: "tank_pa", value: self.tank_pa, expected });
        }
        problems
    }
}
