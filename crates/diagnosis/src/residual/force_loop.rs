//! The nominal force loop of an actuator: what force a healthy one gives for a demand.
//!
//! The inner control asks for the flow q = K_P·(u − F); it enters one chamber and leaves the other,
//! each port limited by its valve, and the chambers' pressures follow (eq. 9 without leaks):
//! ṗ_A = β·q/V_A, ṗ_B = −β·q/V_B. Within a step of length T the loop is taken as a first-order lag of
//! rate a = β·K_P·(A_A/V_A + A_B/V_B), so that an unlimited step is exact: the flow's mean over the
//! step is K_P·(u − F)·(1 − e^{−aT})/(aT).

use super::nominal_hydraulics::NominalHydraulics;

/// One actuator's nominal chamber pressures and force.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub struct ForceLoop {
    hydraulics: NominalHydraulics,
    step_s: f64,
    /// Share of K_P·(u − F) that flows on average over a step.
    mean_share: f64,
    pressures: [f64; 2],
}

impl ForceLoop {
    /// A loop at rest with the given chamber pressures \[Pa\]; `step_s` is the step's length \[s\].
    #[must_use]
    pub fn new(hydraulics: NominalHydraulics, step_s: f64, pressures: [f64; 2]) -> Self {
        let stiffness = hydraulics.stiffness_per_m();
        let rate = hydraulics.bulk_modulus_pa * hydraulics.force_gain_m3_per_s_n * stiffness;
        let mean_share = -libm::expm1(-rate * step_s) / (rate * step_s);
        Self { hydraulics, step_s, mean_share, pressures }
    }

    /// Restarts from measured chamber pressures \[Pa\].
    pub fn settle(&mut self, pressures: [f64; 2]) {
        self.pressures = pressures;
    }

    /// The nominal chamber pressures \[Pa\].
    #[must_use]
    pub fn pressures_pa(&self) -> [f64; 2] {
        self.pressures
    }

    /// The nominal force F̂ \[N\].
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.hydraulics.force_n(self.pressures)
    }

    /// The share of a small deviation from the demand that is left after a step.
    pub(super) fn left_after_a_step(&self) -> f64 {
        let h = &self.hydraulics;
        let flow_gain = h.force_gain_m3_per_s_n * self.mean_share * self.step_s;
        1.0 - h.bulk_modulus_pa * flow_gain * h.stiffness_per_m()
    }

    /// Moves on by one step under the demand u \[N\].
    pub fn step(&mut self, demand_n: f64) {
        let h = &self.hydraulics;
        let asked = h.force_gain_m3_per_s_n * (demand_n - self.force_n()) * self.mean_share;
        let flow_a = asked.max(-self.outlet(0)).min(self.inlet(0));
        let flow_b = (-asked).max(-self.outlet(1)).min(self.inlet(1));
        let gain = h.bulk_modulus_pa * self.step_s;
        self.pressures[0] += gain * flow_a / h.volume_a_m3;
        self.pressures[1] += gain * flow_b / h.volume_b_m3;
    }

    /// Leans the pressures by a share towards measured ones \[Pa\], as far as that leaves the force as it is. Nothing
    /// else keeps the mean pressure: every time a valve is full it moves, for ever, and with it what the valves let
    /// through.
    pub(super) fn lean(&mut self, measured: [f64; 2], share: f64) {
        let (a, b) = (self.hydraulics.area_a_m2, self.hydraulics.area_b_m2);
        let off = [measured[0] - self.pressures[0], measured[1] - self.pressures[1]];
        // (b, a) is the direction along which a·p_A − b·p_B stays.
        let along = share * (b * off[0] + a * off[1]) / (a * a + b * b);
        self.pressures[0] += along * b;
        self.pressures[1] += along * a;
    }

    fn inlet(&self, chamber: usize) -> f64 {
        self.valve(self.hydraulics.supply_pa - self.pressures[chamber])
    }

    fn outlet(&self, chamber: usize) -> f64 {
        self.valve(self.pressures[chamber] - self.hydraulics.tank_pa)
    }

    fn valve(&self, drop_pa: f64) -> f64 {
        let full = self.hydraulics.supply_pa - self.hydraulics.tank_pa;
        self.hydraulics.valve_flow_m3_per_s * (drop_pa.max(0.0) / full).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::hydraulics;

    const REST: [f64; 2] = [70e5, 98.6e5];

    #[test]
    fn a_small_step_is_followed_as_a_first_order_lag_of_ten_milliseconds() {
        let mut lag = ForceLoop::new(hydraulics(), 1e-3, REST);
        let start = lag.force_n();
        for _ in 0..10 {
            lag.step(start + 1000.0);
        }
        let rise = (lag.force_n() - start) / 1000.0;
        assert!((rise - (1.0 - (-1.0_f64).exp())).abs() < 0.01, "{rise}");
    }

    #[test]
    fn two_half_steps_equal_one_step_while_no_valve_is_full() {
        let mut whole = ForceLoop::new(hydraulics(), 1e-3, REST);
        let mut halves = ForceLoop::new(hydraulics(), 0.5e-3, REST);
        for demand in [500.0, -300.0, 2000.0] {
            whole.step(demand);
            halves.step(demand);
            halves.step(demand);
            assert!((whole.force_n() - halves.force_n()).abs() < 1e-6);
        }
    }

    #[test]
    fn pressures_lean_towards_measured_ones_and_the_force_stays() {
        let mut drifted = ForceLoop::new(hydraulics(), 1e-3, REST);
        let force = drifted.force_n();
        let shifted = {
            let h = hydraulics();
            [REST[0] + 10e5 * h.area_b_m2 / h.area_a_m2, REST[1] + 10e5]
        };
        (0..5000).for_each(|_| drifted.lean(shifted, 1e-3));
        assert!((drifted.force_n() - force).abs() < 1e-6);
        for (leant, measured) in drifted.pressures_pa().iter().zip(shifted) {
            assert!((leant - measured).abs() < 0.1e5, "{leant} {measured}");
        }
        // A force that is missing is not learnt.
        drifted.settle(REST);
        (0..5000).for_each(|_| drifted.lean([REST[0] - 20e5, REST[1]], 1e-3));
        assert!((drifted.force_n() - force).abs() < 1e-6);
    }

    #[test]
    fn a_large_demand_is_limited_by_the_valves() {
        let mut full = ForceLoop::new(hydraulics(), 1e-3, REST);
        let start = full.force_n();
        full.step(120e3);
        // 3.5e-4 m³/s at full drop would be 5.2 kN in a millisecond; here the drop is smaller.
        let rise = full.force_n() - start;
        assert!((2e3..5.2e3).contains(&rise), "{rise}");
    }
}
