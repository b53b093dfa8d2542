//! One cylinder's pressures over a sub-step (eq. 8–11).

use super::parameters::HydraulicParameters;
use super::spool::Spool;

/// The state of one actuator.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) enum ActuatorState {
    #[default]
    Healthy,
    /// Leak coefficients \[m²\]: from A to B, from A and from B to the environment.
    Leaking {
        internal: f64,
        external_a: f64,
        external_b: f64,
    },
    HardOver,
    /// The valve's spool sticks.
    Sticking(Spool),
    /// Cut off from the supply, both chambers open to the tank.
    ShutOff,
}

/// The constants of eq. 8–11 in the form used by the integration.
#[derive(Debug, Clone)]
pub(super) struct Cylinder {
    area: [f64; 2],
    /// β/V of A and B \[Pa/m³\].
    stiffness: [f64; 2],
    gain: f64,
    supply: f64,
    tank: f64,
    ambient: f64,
    /// Lowest possible pressure.
    floor: f64,
    /// Square of a port's flow over the pressure across it \[m⁶/s² per Pa\].
    valve_square: f64,
    null_square: f64,
    /// √(2/ρ).
    leak_factor: f64,
    /// Root of the pressure difference per leak coefficient below which a leak is laminar.
    laminar: f64,
}

impl Cylinder {
    pub(super) fn new(parameters: &HydraulicParameters, substep_s: f64) -> Self {
        let stiffness = [parameters.stiffness_a(), parameters.stiffness_b()];
        let leak_factor = (2.0 / parameters.oil_density_kg_per_m3).sqrt();
        let valve = parameters.valve_flow_m3_per_s;
        Self {
            area: [parameters.area_a_m2, parameters.area_b_m2],
            stiffness,
            gain: parameters.force_gain_m3_per_s_per_n,
            supply: parameters.supply_pa,
            tank: parameters.tank_pa,
            ambient: parameters.ambient_pa,
            floor: parameters.tank_pa.min(parameters.ambient_pa),
            valve_square: valve * valve / (parameters.supply_pa - parameters.tank_pa),
            null_square: parameters.null_flow_m3_per_s.powi(2)
                / (parameters.supply_pa - parameters.tank_pa),
            leak_factor,
            laminar: leak_factor * (stiffness[0] + stiffness[1]) * substep_s,
        }
    }

    /// One Runge–Kutta step of some cylinders in the same state, side by side: pressures in A, and in B.
    #[inline(always)]
    pub(super) fn substep<const N: usize>(
        &self,
        p: [[f64; N]; 2],
        target: [f64; N],
        state: &ActuatorState,
        step: f64,
    ) -> [[f64; N]; 2] {
        let after = |rate: &[[f64; N]; 2], time: f64| {
            let mut after = p;
            for chamber in 0..2 {
                for of in 0..N {
                    after[chamber][of] += time * rate[chamber][of];
                }
            }
            after
        };
        let k1 = self.rates(p, target, state);
        let k2 = self.rates(after(&k1, 0.5 * step), target, state);
        let k3 = self.rates(after(&k2, 0.5 * step), target, state);
        let k4 = self.rates(after(&k3, step), target, state);
        let mut next = p;
        for chamber in 0..2 {
            for of in 0..N {
                let middle = k2[chamber][of] + k3[chamber][of];
                let rate = k1[chamber][of] + 2.0 * middle + k4[chamber][of];
                // Ports and leaks close towards these bounds; only rounding could exceed them.
                next[chamber][of] =
                    (p[chamber][of] + step / 6.0 * rate).clamp(self.floor, self.supply);
            }
        }
        next
    }

    /// The flow commanded by the force control \[m³/s\].
    #[inline(always)]
    pub(super) fn command(&self, [a, b]: [f64; 2], target: f64) -> f64 {
        self.gain * (target - (a * self.area[0] - b * self.area[1]))
    }

    /// ṗ_A and ṗ_B \[Pa/s\].
    #[inline(always)]
    fn rates<const N: usize>(
        &self,
        [a, b]: [[f64; N]; 2],
        target: [f64; N],
        state: &ActuatorState,
    ) -> [[f64; N]; 2] {
        let (mut into_a, mut into_b) = ([0.0; N], [0.0; N]);
        for of in 0..N {
            into_a[of] = match state {
                ActuatorState::Sticking(spool) => spool.flow(),
                _ => self.command([a[of], b[of]], target[of]),
            };
            into_b[of] = -into_a[of];
        }
        self.limit(&mut into_a, a);
        self.limit(&mut into_b, b);
        match *state {
            ActuatorState::Healthy | ActuatorState::Sticking(_) => {}
            ActuatorState::Leaking { internal, external_a, external_b } => {
                for of in 0..N {
                    let across = self.leak(internal, a[of] - b[of]);
                    into_a[of] -= across + self.leak(external_a, a[of] - self.ambient);
                    into_b[of] += across - self.leak(external_b, b[of] - self.ambient);
                }
            }
            ActuatorState::HardOver => {
                into_a = [f64::INFINITY; N];
                self.limit(&mut into_a, a);
            }
            ActuatorState::ShutOff => {
                (into_a, into_b) = ([f64::NEG_INFINITY; N], [f64::NEG_INFINITY; N]);
                self.limit(&mut into_a, a);
                self.limit(&mut into_b, b);
            }
        }
        let has_null_flow = self.null_square > 0.0 && *state != ActuatorState::ShutOff;
        for of in 0..N {
            if has_null_flow {
                into_a[of] += self.null_flow(a[of]);
                into_b[of] += self.null_flow(b[of]);
            }
            into_a[of] *= self.stiffness[0];
            into_b[of] *= self.stiffness[1];
        }
        [into_a, into_b]
    }

    /// Limits flows into chambers \[m³/s\] to what their inlets and outlets pass.
    #[inline(always)]
    fn limit<const N: usize>(&self, flows: &mut [f64; N], pressures: [f64; N]) {
        let (mut limit_squares, mut excess) = ([0.0; N], f64::NEG_INFINITY);
        for of in 0..N {
            let (flow, pressure) = (flows[of], pressures[of]);
            let across = if flow > 0.0 { self.supply - pressure } else { pressure - self.tank };
            limit_squares[of] = self.valve_square * across.max(0.0);
            excess = excess.max(flow * flow - limit_squares[of]);
        }
        // The roots are needed only at the limit.
        if excess > 0.0 {
            for (flow, limit_square) in flows.iter_mut().zip(limit_squares) {
                if *flow * *flow > limit_square {
                    *flow = limit_square.sqrt().copysign(*flow);
                }
            }
        }
    }

    /// Net flow into a chamber through a closed valve: from the supply, minus that to the tank \[m³/s\].
    #[inline(always)]
    fn null_flow(&self, pressure: f64) -> f64 {
        let root = |across: f64| (self.null_square * across.max(0.0)).sqrt();
        root(self.supply - pressure) - root(pressure - self.tank)
    }

    /// Flow through a leak \[m³/s\], in the direction of falling pressure.
    fn leak(&self, coefficient: f64, difference: f64) -> f64 {
        let least_root = coefficient * self.laminar;
        let root = difference.abs().sqrt();
        if root > least_root {
            (coefficient * self.leak_factor * root).copysign(difference)
        } else if least_root > 0.0 {
            coefficient * self.leak_factor * difference / least_root
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_external_leak_is_about_a_litre_a_minute_at_seventy_bar() {
        let cylinder = Cylinder::new(&HydraulicParameters::default(), 5e-4);
        let litres_per_minute = cylinder.leak(1.3e-7, 70e5) * 6e4;
        assert!((litres_per_minute - 0.99).abs() < 0.01, "{litres_per_minute}");
        assert_eq!(cylinder.leak(1.3e-7, -70e5), -cylinder.leak(1.3e-7, 70e5));
        assert_eq!(cylinder.leak(1.3e-7, 0.0), 0.0);
    }
}
