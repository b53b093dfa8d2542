//! The parameters of the actuators, and quantities derived in closed form.

use serde::{Deserialize, Serialize};

use crate::check::Checks;

/// The actuators, which are all alike. Marks: \[S\] from publications on the demonstrator, \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HydraulicParameters {
    /// Piston area of chamber A, A_A \[m²\]: 1.3273e-2, Ø130 mm \[S\].
    pub area_a_m2: f64,
    /// Ring area of chamber B, A_B \[m²\]: 9.425e-3, Ø130 mm less Ø70 mm \[S\].
    pub area_b_m2: f64,
    /// Oil volume of chamber A, V_A \[m³\]: 2.323e-3, mid-stroke \[S\].
    pub volume_a_m3: f64,
    /// Oil volume of chamber B, V_B \[m³\]: 1.649e-3, mid-stroke \[S\].
    pub volume_b_m3: f64,
    /// Bulk modulus of the oil, β \[Pa\]: 1.3e9 \[S\].
    pub bulk_modulus_pa: f64,
    /// Density of the oil, ρ \[kg/m³\]: 870 \[E\].
    pub oil_density_kg_per_m3: f64,
    /// Supply pressure \[Pa\]: 200e5 \[S\].
    pub supply_pa: f64,
    /// Tank pressure \[Pa\]: 1e5 \[E\].
    pub tank_pa: f64,
    /// Pressure of the environment, p_0 \[Pa\]: 1e5 \[E\].
    pub ambient_pa: f64,
    /// Pressure of chamber A at rest \[Pa\]: 70e5 \[E\].
    pub rest_a_pa: f64,
    /// Pressure of chamber B at rest \[Pa\]: 98.6e5 \[E\].
    pub rest_b_pa: f64,
    /// Flow of an open valve at the full pressure drop, q_max \[m³/s\]: 3.5e-4 \[E\].
    pub valve_flow_m3_per_s: f64,
    /// Gain of the force control, K_P \[m³/s per N\]: 6.7e-9, about 10 ms \[E\].
    pub force_gain_m3_per_s_per_n: f64,
    /// Limit of demands in both directions, ± \[N\]: 120e3 \[E\].
    pub demand_limit_n: f64,
    /// Standard deviation of the pressure measurements' noise \[Pa\]: 1e4, about 163 N \[E\].
    pub pressure_noise_pa: f64,
    /// Drift of each pressure sensor in a day, ± \[Pa\]: 0.
    pub pressure_drift_pa: f64,
    /// Flow through a closed valve from the supply into each chamber, and from there into the tank, at the full
    /// pressure drop \[m³/s\]: 0. For a worn spool valve it is a few percent of the valve's flow.
    pub null_flow_m3_per_s: f64,
    /// Integration sub-steps per step: 1; the force control is ten times slower than a step.
    pub substeps: usize,
}

impl Default for HydraulicParameters {
    fn default() -> Self {
        Self {
            area_a_m2: 1.3273e-2,
            area_b_m2: 9.425e-3,
            volume_a_m3: 2.323e-3,
            volume_b_m3: 1.649e-3,
            bulk_modulus_pa: 1.3e9,
            oil_density_kg_per_m3: 870.0,
            supply_pa: 200e5,
            tank_pa: 1e5,
            ambient_pa: 1e5,
            rest_a_pa: 70e5,
            rest_b_pa: 98.6e5,
            valve_flow_m3_per_s: 3.5e-4,
            force_gain_m3_per_s_per_n: 6.7e-9,
            demand_limit_n: 120e3,
            pressure_noise_pa: 1e4,
            pressure_drift_pa: 0.0,
            null_flow_m3_per_s: 0.0,
            substeps: 1,
        }
    }
}

impl HydraulicParameters {
    /// The largest limit of a demand \[N\], which none reaches.
    pub const NO_DEMAND_LIMIT_N: f64 = 1e12;

    /// Cylinders of the same kind and their valves, so many times as large: at the same pressures they exert so many times
    /// the force, and their force control is as fast.
    #[must_use]
    pub fn enlarged(&self, times: f64) -> Self {
        Self {
            area_a_m2: times * self.area_a_m2,
            area_b_m2: times * self.area_b_m2,
            volume_a_m3: times * self.volume_a_m3,
            volume_b_m3: times * self.volume_b_m3,
            valve_flow_m3_per_s: times * self.valve_flow_m3_per_s,
            null_flow_m3_per_s: times * self.null_flow_m3_per_s,
            demand_limit_n: times * self.demand_limit_n,
            ..self.clone()
        }
    }

    /// Force of the pressures in chambers A and B \[Pa\] (eq. 8) \[N\].
    #[must_use]
    pub fn force_n(&self, [a, b]: [f64; 2]) -> f64 {
        a * self.area_a_m2 - b * self.area_b_m2
    }

    /// Time constant τ of the force control within its flow limits \[s\].
    #[must_use]
    pub fn time_constant_s(&self) -> f64 {
        1.0 / (self.force_gain_m3_per_s_per_n * self.newtons_per_m3())
    }

    /// The change of force by oil that is moved from chamber B to chamber A \[N/m³\].
    #[must_use]
    pub fn newtons_per_m3(&self) -> f64 {
        self.area_a_m2 * self.stiffness_a() + self.area_b_m2 * self.stiffness_b()
    }

    /// Pressures of a healthy actuator, started from rest, that exerts this force \[Pa\]. If closed valves leak, the
    /// leakage determines them; otherwise the oil filled in does.
    #[must_use]
    pub fn pressures_at(&self, force_n: f64) -> [f64; 2] {
        if self.null_flow_m3_per_s > 0.0 {
            return self.pressures_of_null_flow(force_n);
        }
        let missing = force_n - self.force_n([self.rest_a_pa, self.rest_b_pa]);
        let volume = missing / self.newtons_per_m3();
        [self.rest_a_pa + volume * self.stiffness_a(), self.rest_b_pa - volume * self.stiffness_b()]
    }

    /// Net flow into a chamber through a closed valve \[m³/s\].
    fn null_flow(&self, pressure_pa: f64) -> f64 {
        let full = self.supply_pa - self.tank_pa;
        let root = |across: f64| (across.max(0.0) / full).sqrt();
        let flows = root(self.supply_pa - pressure_pa) - root(pressure_pa - self.tank_pa);
        self.null_flow_m3_per_s * flows
    }

    /// The pressures at which the net flows into the chambers cancel: the force control moves oil from one chamber to
    /// the other.
    fn pressures_of_null_flow(&self, force_n: f64) -> [f64; 2] {
        let with_b = |b: f64| {
            let a = (force_n + b * self.area_b_m2) / self.area_a_m2;
            [a.clamp(self.tank_pa, self.supply_pa), b]
        };
        let (mut low, mut high) = (self.tank_pa, self.supply_pa);
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            let [a, b] = with_b(middle);
            if self.null_flow(a) + self.null_flow(b) > 0.0 { low = middle } else { high = middle }
        }
        with_b(0.5 * (low + high))
    }

    /// Pressure per volume of oil added to chamber A \[Pa/m³\].
    pub(super) fn stiffness_a(&self) -> f64 {
        self.bulk_modulus_pa / self.volume_a_m3
    }

    /// Pressure per volume of oil added to chamber B \[Pa/m³\].
    pub(super) fn stiffness_b(&self) -> f64 {
        self.bulk_modulus_pa / self.volume_b_m3
    }

    pub(crate) fn check(&self, step_s: f64, checks: &mut Checks) {
        for (name, value, range, unit) in [
            ("hydraulics.area_a_m2", self.area_a_m2, 1e-8..=100.0, "m²"),
            ("hydraulics.area_b_m2", self.area_b_m2, 1e-8..=100.0, "m²"),
            ("hydraulics.volume_a_m3", self.volume_a_m3, 1e-12..=1e3, "m³"),
            ("hydraulics.volume_b_m3", self.volume_b_m3, 1e-12..=1e3, "m³"),
            ("hydraulics.bulk_modulus_pa", self.bulk_modulus_pa, 1e6..=1e11, "Pa"),
            ("hydraulics.oil_density_kg_per_m3", self.oil_density_kg_per_m3, 1.0..=1e5, "kg/m³"),
            ("hydraulics.valve_flow_m3_per_s", self.valve_flow_m3_per_s, 1e-12..=100.0, "m³/s"),
            (
                "hydraulics.force_gain_m3_per_s_per_n",
                self.force_gain_m3_per_s_per_n,
                1e-18..=1.0,
                "m³/s per N",
            ),
            ("hydraulics.demand_limit_n", self.demand_limit_n, 1e-6..=Self::NO_DEMAND_LIMIT_N, "N"),
        ] {
            checks.within(name, value, range, unit);
        }
        checks.within("hydraulics.tank_pa", self.tank_pa, 0.0..=1e9, "Pa");
        checks.within("hydraulics.ambient_pa", self.ambient_pa, 0.0..=1e9, "Pa");
        checks.within("hydraulics.pressure_noise_pa", self.pressure_noise_pa, 0.0..=1e8, "Pa");
        checks.within("hydraulics.pressure_drift_pa", self.pressure_drift_pa, 0.0..=1e9, "Pa");
        checks.require(
            "hydraulics.null_flow_m3_per_s",
            (0.0..=0.2 * self.valve_flow_m3_per_s).contains(&self.null_flow_m3_per_s),
            self.null_flow_m3_per_s,
            "at least 0 and at most a fifth of `hydraulics.valve_flow_m3_per_s`",
        );
        self.check_pressures(checks);
        let slow_enough = self.time_constant_s() > 2.0 * step_s;
        checks.require(
            "hydraulics.force_gain_m3_per_s_per_n",
            slow_enough || !self.time_constant_s().is_finite(),
            self.force_gain_m3_per_s_per_n,
            "a gain whose time constant is above two steps, or the sampled force control oscillates",
        );
        checks.require(
            "hydraulics.substeps",
            (1..=1000).contains(&self.substeps),
            self.substeps,
            "1 to 1000 sub-steps",
        );
    }

    fn check_pressures(&self, checks: &mut Checks) {
        let floor = self.tank_pa.max(self.ambient_pa);
        checks.require(
            "hydraulics.supply_pa",
            self.supply_pa > floor && self.supply_pa <= 1e9,
            self.supply_pa,
            "a pressure above those of the tank and of the environment, up to 1e9 Pa",
        );
        for (name, value) in
            [("hydraulics.rest_a_pa", self.rest_a_pa), ("hydraulics.rest_b_pa", self.rest_b_pa)]
        {
            checks.require(
                name,
                value > floor && value < self.supply_pa,
                value,
                "a pressure between those of tank and supply",
            );
        }
    }
}
