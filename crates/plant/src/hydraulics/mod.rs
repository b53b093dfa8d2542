//! Hydraulic actuators with their inner force control (section 3.2 of the paper).
//!
//! - force (eq. 8): F = p_A A_A − p_B A_B
//! - pressures (eq. 9, leaks with the signs that oil obeys):
//!   ṗ_A = β/V_A (q_A − q_il − q_el,A), ṗ_B = β/V_B (q_B + q_il − q_el,B)
//! - leaks (eq. 10, 11): q = k sign(Δp) √(2|Δp|/ρ); the internal leak runs from A to B, an external
//!   one from its chamber to the environment
//! - force control: q = K_P (u − F). For q > 0 oil enters A and leaves B, for q < 0 the reverse.
//!   Each port passes at most q_max √(Δp / (p_supply − p_tank)), Δp being the pressure across it.
//! - a closed valve leaks some oil from the supply into each chamber, and from there into the tank
//! - hard-over: A's inlet is fully open and its outlet shut; B stays under control.
//! - stiction: the valve's spool follows q once per step, in jumps, if at all.
//! - shut off: nothing enters; both chambers empty into the tank.
//!
//! F in the force control is computed from the *measured* pressures, sampled once per step: the noise of a sample
//! remains in the loop until the next. Within its flow limits the force then follows Ḟ = (u − F) / τ with 1/τ = K_P β
//! (A_A/V_A + A_B/V_B), see [`HydraulicParameters::time_constant_s`].
//!
//! Pressures are integrated with the fourth-order Runge–Kutta method in sub-steps. At zero pressure difference the
//! square root of a leak is infinitely steep; there it is replaced by a straight line (laminar flow) that the sub-step
//! can resolve.

mod cylinder;
mod parameters;
mod spool;

pub(crate) use cylinder::ActuatorState;
use cylinder::Cylinder;
pub use parameters::HydraulicParameters;
pub(crate) use spool::Spool;
use truss::vectorised;

/// So many healthy actuators are integrated at a time, with the same results as one by one.
const SIDE_BY_SIDE: usize = 4;

/// How long a repaired actuator is refilled \[s\]: until its force follows the demand again.
const REFILL_S: f64 = 1.0;

/// The pressures of all actuators.
#[derive(Debug, Clone)]
pub(crate) struct Hydraulics {
    cylinder: Cylinder,
    substep_s: f64,
    parameters: HydraulicParameters,
    pressures_pa: Vec<[f64; 2]>,
    states: Vec<ActuatorState>,
    is_shut_off: Vec<bool>,
    /// Actuators that are being refilled, and for how many more steps.
    refilling: Vec<(usize, u32)>,
    /// Steps of a refill.
    refill_steps: u32,
}

impl Hydraulics {
    /// Healthy actuators that exert these forces \[N\].
    pub(crate) fn new(parameters: &HydraulicParameters, step_s: f64, forces_n: &[f64]) -> Self {
        let substep_s = step_s / parameters.substeps as f64;
        Self {
            cylinder: Cylinder::new(parameters, substep_s),
            substep_s,
            parameters: parameters.clone(),
            pressures_pa: forces_n.iter().map(|&force| parameters.pressures_at(force)).collect(),
            states: vec![ActuatorState::Healthy; forces_n.len()],
            is_shut_off: vec![false; forces_n.len()],
            refilling: Vec::new(),
            refill_steps: (REFILL_S / step_s).ceil() as u32,
        }
    }

    /// True pressures in A and B of each actuator \[Pa\].
    pub(crate) fn pressures_pa(&self) -> &[[f64; 2]] {
        &self.pressures_pa
    }

    /// Writes the true forces \[N\].
    pub(crate) fn forces(&self, out: &mut [f64]) {
        for (force, pressures) in out.iter_mut().zip(&self.pressures_pa) {
            *force = self.parameters.force_n(*pressures);
        }
    }

    /// Sets the state of an actuator. A change back to healthy is a repair: until its force follows the demand again, oil
    /// is refilled to the pressures of the present force, so that the force does not jump.
    pub(crate) fn set(&mut self, actuator: usize, state: ActuatorState) {
        let Some(present) = self.states.get_mut(actuator) else { return };
        let is_repaired = state == ActuatorState::Healthy && *present != ActuatorState::Healthy;
        *present = state;
        self.refill(actuator, is_repaired);
    }

    /// Shuts an actuator off, whatever its fault, or puts it back; then oil is refilled as by a repair.
    pub(crate) fn shut_off(&mut self, actuator: usize, is_shut_off: bool) {
        let Some(present) = self.is_shut_off.get_mut(actuator) else { return };
        let is_back = *present && !is_shut_off;
        *present = is_shut_off;
        self.refill(actuator, is_back);
    }

    /// Begins to refill an actuator, or stops.
    fn refill(&mut self, actuator: usize, begins: bool) {
        self.refilling.retain(|(other, _)| *other != actuator);
        if begins {
            self.fill(actuator);
        }
        // Put back with its fault, it is not kept full.
        if begins && self.states[actuator] == ActuatorState::Healthy {
            self.refilling.push((actuator, self.refill_steps));
        }
    }

    /// The pressures of the present force with as much oil as at rest.
    fn fill(&mut self, actuator: usize) {
        if let Some(pressures) = self.pressures_pa.get_mut(actuator) {
            *pressures = self.parameters.pressures_at(self.parameters.force_n(*pressures));
        }
    }

    /// Integrates over one step under constant demands \[N\]; `noise_n` is the error of the force measured by each
    /// force control during the step \[N\].
    pub(crate) fn step(&mut self, demands_n: &[f64], noise_n: &[f64]) {
        vectorised(
            #[inline(always)]
            || self.integrate(demands_n, noise_n),
        );
        for place in 0..self.refilling.len() {
            let (actuator, steps) = &mut self.refilling[place];
            *steps -= 1;
            let actuator = *actuator;
            self.fill(actuator);
        }
        self.refilling.retain(|(_, steps)| *steps > 0);
    }

    #[inline(always)]
    fn integrate(&mut self, demands_n: &[f64], noise_n: &[f64]) {
        let actuators = self.pressures_pa.len().min(demands_n.len()).min(noise_n.len());
        let mut first = 0;
        while first < actuators {
            let group = first..(first + SIDE_BY_SIDE).min(actuators);
            let are_healthy = self.states[group.clone()]
                .iter()
                .zip(&self.is_shut_off[group.clone()])
                .all(|(state, is_shut_off)| *state == ActuatorState::Healthy && !is_shut_off);
            if are_healthy && group.len() == SIDE_BY_SIDE {
                let healthy = ActuatorState::Healthy;
                self.integrate_group::<SIDE_BY_SIDE>(first, demands_n, noise_n, &healthy);
                first += SIDE_BY_SIDE;
                continue;
            }
            for actuator in group {
                let mut state = self.states[actuator];
                if self.is_shut_off[actuator] {
                    state = ActuatorState::ShutOff;
                } else if let ActuatorState::Sticking(spool) = &mut state {
                    let target = demands_n[actuator] - noise_n[actuator];
                    spool.follow(self.cylinder.command(self.pressures_pa[actuator], target));
                    self.states[actuator] = state;
                }
                self.integrate_group::<1>(actuator, demands_n, noise_n, &state);
                first += 1;
            }
        }
    }

    #[inline(always)]
    fn integrate_group<const N: usize>(
        &mut self,
        first: usize,
        demands_n: &[f64],
        noise_n: &[f64],
        state: &ActuatorState,
    ) {
        let (mut p, mut target) = ([[0.0; N]; 2], [0.0; N]);
        for (of, pressures) in self.pressures_pa[first..first + N].iter().enumerate() {
            [p[0][of], p[1][of]] = *pressures;
            target[of] = demands_n[first + of] - noise_n[first + of];
        }
        for _ in 0..self.parameters.substeps {
            p = self.cylinder.substep(p, target, state, self.substep_s);
        }
        for (of, pressures) in self.pressures_pa[first..first + N].iter_mut().enumerate() {
            *pressures = [p[0][of], p[1][of]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaking(internal: f64, external_a: f64, external_b: f64) -> ActuatorState {
        ActuatorState::Leaking { internal, external_a, external_b }
    }

    fn sticking(band: f64) -> ActuatorState {
        ActuatorState::Sticking(Spool::new(band))
    }

    fn one(parameters: &HydraulicParameters, force: f64, state: ActuatorState) -> Hydraulics {
        let mut hydraulics = Hydraulics::new(parameters, 1e-3, &[force]);
        hydraulics.set(0, state);
        hydraulics
    }

    fn force(hydraulics: &Hydraulics) -> f64 {
        let mut out = [0.0];
        hydraulics.forces(&mut out);
        out[0]
    }

    fn run(hydraulics: &mut Hydraulics, demand: f64, steps: usize) {
        for _ in 0..steps {
            hydraulics.step(&[demand], &[0.0]);
        }
    }

    #[test]
    fn the_force_follows_a_small_step_with_the_time_constant() {
        let parameters = HydraulicParameters::default();
        assert!((parameters.time_constant_s() - 0.010).abs() < 1e-4);
        let mut hydraulics = one(&parameters, 5e3, ActuatorState::Healthy);
        assert!((force(&hydraulics) - 5e3).abs() < 1e-6);
        for step in 1..=60 {
            run(&mut hydraulics, 15e3, 1);
            let time = f64::from(step) * 1e-3;
            let expected = 15e3 - 10e3 * (-time / parameters.time_constant_s()).exp();
            assert!((force(&hydraulics) - expected).abs() < 0.01, "{step}");
        }
    }

    #[test]
    fn a_large_step_is_held_up_by_the_valves() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 0.0, ActuatorState::Healthy);
        run(&mut hydraulics, 120e3, 1);
        // Inlet A at 130 of 199 bar, outlet B at 97.6 of 199 bar.
        let flow = |bar: f64| 3.5e-4 * (bar / 199.0).sqrt();
        let rate =
            1.3273e-2 * 1.3e9 / 2.323e-3 * flow(130.0) + 9.425e-3 * 1.3e9 / 1.649e-3 * flow(97.6);
        assert!((force(&hydraulics) / (rate * 1e-3) - 1.0).abs() < 0.02);
        run(&mut hydraulics, 120e3, 300);
        assert!((force(&hydraulics) - 120e3).abs() < 1.0);
    }

    #[test]
    fn the_noise_of_the_measured_force_acts_as_an_error_of_the_demand() {
        let parameters = HydraulicParameters::default();
        for state in [ActuatorState::Healthy, sticking(1e-6)] {
            let mut noisy = one(&parameters, 0.0, state);
            let mut quiet = noisy.clone();
            for _ in 0..5 {
                noisy.step(&[1e3], &[400.0]);
                quiet.step(&[600.0], &[0.0]);
                assert_eq!(noisy.pressures_pa(), quiet.pressures_pa());
            }
        }
    }

    /// In steady state the force control replaces what leaks: K_P (u − F) = ± leak.
    #[test]
    fn an_internal_leak_leaves_the_error_that_its_flow_needs() {
        let parameters = HydraulicParameters::default();
        let area = 1.3e-7;
        let mut hydraulics = one(&parameters, 0.0, leaking(area, 0.0, 0.0));
        run(&mut hydraulics, 0.0, 2000);
        let [a, b] = hydraulics.pressures_pa()[0];
        // B has the higher pressure at rest, so oil runs from B to A and the force rises.
        let leak = area * (2.0 / 870.0 * (b - a)).sqrt();
        let error = 0.0 - force(&hydraulics);
        let expected = -leak / parameters.force_gain_m3_per_s_per_n;
        assert!((error / expected - 1.0).abs() < 1e-3, "{error} {expected}");
    }

    /// The control shares an external leak between both chambers: q = leak · k_A / (k_A + k_B).
    #[test]
    fn an_external_leak_lowers_its_chamber_and_pulls_the_force() {
        let parameters = HydraulicParameters::default();
        let (area, demand) = (1.3e-7, 0.0);
        for (state, sign) in [(leaking(0.0, area, 0.0), 1.0), (leaking(0.0, 0.0, area), -1.0)] {
            let mut hydraulics = one(&parameters, demand, state);
            let start = hydraulics.pressures_pa()[0];
            run(&mut hydraulics, demand, 80);
            let [a, b] = hydraulics.pressures_pa()[0];
            let (leak, share) = if sign > 0.0 {
                (area * (2.0 / 870.0 * (a - 1e5)).sqrt(), 1.3273e-2 / 2.323e-3)
            } else {
                (area * (2.0 / 870.0 * (b - 1e5)).sqrt(), 9.425e-3 / 1.649e-3)
            };
            let both = 1.3273e-2 / 2.323e-3 + 9.425e-3 / 1.649e-3;
            let expected = sign * leak * share / both / parameters.force_gain_m3_per_s_per_n;
            let error = demand - force(&hydraulics);
            assert!((error / expected - 1.0).abs() < 0.01, "{error} {expected}");
            assert!(a < start[0] && b < start[1]);
        }
    }

    #[test]
    fn a_hard_over_fills_a_until_the_supply_and_leaves_b_to_the_control() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 0.0, ActuatorState::HardOver);
        run(&mut hydraulics, 0.0, 1);
        let rise = force(&hydraulics);
        assert!(rise > 1.5e3, "{rise}");
        run(&mut hydraulics, 0.0, 5000);
        let [a, b] = hydraulics.pressures_pa()[0];
        assert!((a - 200e5).abs() < 1e3 && (b - 200e5).abs() < 1e3, "{a} {b}");
        assert!((force(&hydraulics) - 200e5 * (1.3273e-2 - 9.425e-3)).abs() < 100.0);
    }

    /// A control that is sampled once per step leaves 1 − h/τ of its error after each. A band moves the flow by no more
    /// than itself, and with it the force by no more than band / K_P.
    #[test]
    fn a_spool_that_hardly_sticks_is_a_sampled_control() {
        // However finely pressures are integrated, the control is sampled once per step.
        let parameters = HydraulicParameters { substeps: 4, ..HydraulicParameters::default() };
        let (band, demand) = (1e-14, 15e3);
        let mut hydraulics = one(&parameters, 5e3, sticking(band));
        let mut healthy = one(&parameters, 5e3, ActuatorState::Healthy);
        let per_step = 1e-3 / parameters.time_constant_s();
        let tolerance = 1e-6 + band / parameters.force_gain_m3_per_s_per_n;
        for step in 1..=100 {
            run(&mut hydraulics, demand, 1);
            run(&mut healthy, demand, 1);
            let expected = demand - 10e3 * (1.0 - per_step).powi(step);
            assert!((force(&hydraulics) - expected).abs() < tolerance, "{step}");
            // (1 − x)^n is below exp(−n x) by at most x/(2e), and a bit for the next order.
            let ahead = force(&hydraulics) - force(&healthy);
            assert!((0.0..10e3 * per_step * 0.2).contains(&ahead), "{step}: {ahead}");
        }
    }

    #[test]
    fn a_sticking_spool_stays_where_it_is_while_the_command_stays_within_the_band() {
        let parameters = HydraulicParameters::default();
        let band = 1e-5;
        let within = 0.99 * band / parameters.force_gain_m3_per_s_per_n;
        // From rest it lets nothing pass, so that the pressures stay as they are.
        let mut hydraulics = one(&parameters, 5e3, sticking(band));
        run(&mut hydraulics, 5e3, 1);
        let start = hydraulics.pressures_pa()[0];
        for step in 0..1000 {
            run(&mut hydraulics, 5e3 + within * (f64::from(step) * 0.1).sin(), 1);
            assert_eq!(hydraulics.pressures_pa()[0], start);
        }
        // In motion it lets the same pass, whatever the command.
        let mut hydraulics = one(&parameters, 5e3, sticking(1e-4));
        run(&mut hydraulics, 15e3, 1);
        let [first, second] = [15e3, 8e3].map(|demand| {
            let before = force(&hydraulics);
            run(&mut hydraulics, demand, 1);
            force(&hydraulics) - before
        });
        assert!((first - second).abs() < 1e-6, "{first} {second}");
        let per_step = 1e-3 / parameters.time_constant_s();
        assert!((first - 10e3 * per_step).abs() < 1e-6, "{first}");
    }

    /// It comes to rest where it happens to stick, or hunts: no further away than the command of a band, and what that
    /// grows by in a step.
    #[test]
    fn a_sticking_spool_follows_a_large_demand_up_to_its_band() {
        let parameters = HydraulicParameters::default();
        for band in [1e-6, 1e-5, 5e-5] {
            let mut hydraulics = one(&parameters, 0.0, sticking(band));
            let largest = 1.0 + 1.1 * band / parameters.force_gain_m3_per_s_per_n;
            for demand in [120e3, -60e3] {
                run(&mut hydraulics, demand, 500);
                for _ in 0..2000 {
                    run(&mut hydraulics, demand, 1);
                    let error = force(&hydraulics) - demand;
                    assert!(error.abs() < largest, "{band}: {error}");
                }
            }
        }
    }

    #[test]
    fn a_spool_sticks_from_where_it_is_when_the_fault_begins() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 0.0, ActuatorState::Healthy);
        run(&mut hydraulics, 10e3, 5);
        let (command, before) = (10e3 - force(&hydraulics), force(&hydraulics));
        hydraulics.set(0, sticking(1e-3));
        run(&mut hydraulics, 10e3, 3);
        let per_step = 1e-3 / parameters.time_constant_s();
        let expected = before + 3.0 * per_step * command;
        assert!((force(&hydraulics) - expected).abs() < 1e-6);
    }

    #[test]
    fn pressures_stay_between_environment_and_supply_in_every_state() {
        let parameters = HydraulicParameters::default();
        let states = [
            ActuatorState::Healthy,
            leaking(5e-7, 0.0, 0.0),
            leaking(0.0, 5e-7, 0.0),
            leaking(0.0, 0.0, 5e-7),
            leaking(9.9e-5, 0.0, 0.0),
            leaking(0.0, 9.9e-5, 0.0),
            ActuatorState::HardOver,
            sticking(1e-7),
            sticking(1e-5),
            sticking(1e-3),
        ];
        for state in states {
            let mut hydraulics = one(&parameters, 0.0, state);
            for step in 0..20_000 {
                let demand = 120e3 * (f64::from(step) * 0.01).sin();
                hydraulics.step(&[demand], &[0.0]);
                let [a, b] = hydraulics.pressures_pa()[0];
                assert!((1e5..=200e5).contains(&a) && (1e5..=200e5).contains(&b), "{state:?}");
            }
        }
    }

    /// 77 kN of a hard-over are gone as fast as the valve lets the oil out; what is left is that of the tank's pressure.
    #[test]
    fn an_actuator_that_is_shut_off_lets_go_and_comes_back_without_a_jump() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 0.0, ActuatorState::HardOver);
        run(&mut hydraulics, 0.0, 3000);
        assert!(force(&hydraulics) > 70e3);
        hydraulics.shut_off(0, true);
        run(&mut hydraulics, 50e3, 500);
        let left = parameters.force_n([parameters.tank_pa; 2]);
        assert!((force(&hydraulics) - left).abs() < 1.0, "{}", force(&hydraulics));
        hydraulics.set(0, ActuatorState::Healthy);
        hydraulics.shut_off(0, false);
        assert!((force(&hydraulics) - left).abs() < 1.0);
        run(&mut hydraulics, 50e3, 300);
        assert!((force(&hydraulics) - 50e3).abs() < 1.0);
    }

    #[test]
    fn a_repair_keeps_the_force_and_restores_the_pressures() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 10e3, leaking(0.0, 5e-7, 0.0));
        run(&mut hydraulics, 10e3, 3000);
        let before = force(&hydraulics);
        hydraulics.set(0, ActuatorState::Healthy);
        assert!((force(&hydraulics) - before).abs() < 1e-6);
        run(&mut hydraulics, 10e3, 300);
        let healthy = parameters.pressures_at(10e3);
        for (pressure, expected) in hydraulics.pressures_pa()[0].iter().zip(healthy) {
            assert!((pressure / expected - 1.0).abs() < 1e-9);
        }
    }

    /// The way back from the end of its travel takes more oil through one port than through the other.
    #[test]
    fn a_repaired_hard_over_has_the_oil_that_it_had() {
        let parameters = HydraulicParameters::default();
        let mut hydraulics = one(&parameters, 10e3, ActuatorState::Healthy);
        let before = hydraulics.pressures_pa()[0];
        hydraulics.set(0, ActuatorState::HardOver);
        run(&mut hydraulics, 10e3, 3000);
        hydraulics.set(0, ActuatorState::Healthy);
        run(&mut hydraulics, 10e3, 2000);
        for (pressure, before) in hydraulics.pressures_pa()[0].iter().zip(before) {
            assert!((pressure - before).abs() < 1e2, "{pressure} {before}");
        }
        // Repaired is not immune: the refill does not go on into another fault.
        hydraulics.set(0, leaking(0.0, 5e-7, 0.0));
        run(&mut hydraulics, 10e3, 3000);
        assert!(hydraulics.pressures_pa()[0][0] < before[0] - 1e5);
    }

    #[test]
    fn closed_valves_that_let_oil_through_set_the_pressures_and_make_up_for_a_leak() {
        let parameters =
            HydraulicParameters { null_flow_m3_per_s: 3.5e-6, ..HydraulicParameters::default() };
        let mut hydraulics = one(&parameters, 5e3, ActuatorState::Healthy);
        let start = hydraulics.pressures_pa()[0];
        run(&mut hydraulics, 5e3, 60_000);
        for (now, start) in hydraulics.pressures_pa()[0].iter().zip(start) {
            assert!((now - start).abs() < 0.3e5, "{now} {start}");
        }
        // Without that flow a leak of 1e-9 m² would empty the chamber; with it there is another rest.
        let mut leaky = one(&parameters, 5e3, leaking(0.0, 1e-9, 0.0));
        run(&mut leaky, 5e3, 120_000);
        let [a, b] = leaky.pressures_pa()[0];
        run(&mut leaky, 5e3, 60_000);
        assert!((leaky.pressures_pa()[0][0] - a).abs() < 0.1e5);
        assert!(a < start[0] - 1e5 && b < start[1] - 1e5, "{a} {b} {start:?}");
    }

    /// The error of a whole step is below the noise of 163 N by far, and where the flow is smooth it
    /// falls sixteenfold with half the step.
    #[test]
    fn sub_steps_converge() {
        let after = |substeps: usize, state: ActuatorState, size: f64| {
            let parameters = HydraulicParameters { substeps, ..HydraulicParameters::default() };
            let mut hydraulics = one(&parameters, 0.0, state);
            for step in 0..200 {
                hydraulics.step(&[size * (f64::from(step) * 0.05).sin()], &[0.0]);
            }
            force(&hydraulics)
        };
        for state in [
            ActuatorState::Healthy,
            leaking(5e-7, 0.0, 0.0),
            leaking(0.0, 5e-7, 0.0),
            leaking(0.0, 0.0, 5e-7),
            ActuatorState::HardOver,
        ] {
            let reference = after(256, state, 120e3);
            assert!((after(1, state, 120e3) - reference).abs() < 20.0, "{state:?}");
        }
        let reference = after(256, ActuatorState::Healthy, 20e3);
        let error = |substeps| (after(substeps, ActuatorState::Healthy, 20e3) - reference).abs();
        assert!(error(2) < 1e-3, "{}", error(2));
        assert!((8.0..32.0).contains(&(error(1) / error(2))), "{} {}", error(1), error(2));
    }
}
