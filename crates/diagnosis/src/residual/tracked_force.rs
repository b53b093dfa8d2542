//! What force a healthy cylinder gives for a demand: the nominal one, and how far it may be from that.
//!
//! Nobody knows exactly how fast a cylinder is: oil, volumes and valves differ from their figures. While the demand
//! stands that makes no difference; when it jumps, a healthy cylinder is off by a share of the jump until both have
//! arrived. So two more force loops run beside the nominal one, slower and faster by the stated uncertainty; how far they
//! are from it says how far a healthy cylinder may be (an adaptive threshold, as Emami-Naeini, Akhter and Rock have it,
//! 1988). It follows from what is demanded, whatever controller demands it.

use super::force_loop::ForceLoop;
use super::nominal_hydraulics::NominalHydraulics;

/// Nobody knows either at which instant within a step the demand takes effect: half a step to and fro.
const INSTANT_STEPS: f64 = 0.5;

/// Time in which the mean pressures of the loops follow the measured ones \[s\].
const LEANING_S: f64 = 1.0;

/// The nominal force loop of an actuator between a slower and a faster one.
#[derive(Debug, Clone, serde::Serialize, serde::Deserialize)]
pub(super) struct TrackedForce {
    nominal: ForceLoop,
    slow: ForceLoop,
    fast: ForceLoop,
    /// How far a healthy cylinder may be off \[N\], and the share of it that is left after a step.
    margin_n: f64,
    fading: f64,
    /// Share by which mean pressures lean towards the measured ones in a step.
    leaning: f64,
}

impl TrackedForce {
    pub(super) fn new(hydraulics: NominalHydraulics, step_s: f64) -> Self {
        let loop_of = |speed| ForceLoop::new(hydraulics.with_speed(speed), step_s, [0.0; 2]);
        let uncertainty = hydraulics.speed_uncertainty;
        let slow = loop_of(1.0 - uncertainty);
        Self {
            fading: slow.left_after_a_step(),
            nominal: loop_of(1.0),
            fast: loop_of(1.0 + uncertainty),
            slow,
            margin_n: 0.0,
            leaning: (step_s / LEANING_S).min(1.0),
        }
    }

    /// Restarts from measured chamber pressures \[Pa\].
    pub(super) fn settle(&mut self, pressures: [f64; 2]) {
        for force_loop in [&mut self.nominal, &mut self.slow, &mut self.fast] {
            force_loop.settle(pressures);
        }
        self.margin_n = 0.0;
    }

    /// The nominal force \[N\].
    pub(super) fn force_n(&self) -> f64 {
        self.nominal.force_n()
    }

    /// The nominal chamber pressures \[Pa\].
    pub(super) fn pressures_pa(&self) -> [f64; 2] {
        self.nominal.pressures_pa()
    }

    /// How far a healthy cylinder's force may be from the nominal one \[N\]. Once the demand stands it fades no
    /// faster than a slow cylinder arrives.
    pub(super) fn margin_n(&self) -> f64 {
        self.margin_n
    }

    /// Takes up what the measured chamber pressures \[Pa\] tell beside the force.
    pub(super) fn lean(&mut self, measured: [f64; 2]) {
        for force_loop in [&mut self.nominal, &mut self.slow, &mut self.fast] {
            force_loop.lean(measured, self.leaning);
        }
    }

    /// Moves on by one step under the demand \[N\].
    pub(super) fn step(&mut self, demand_n: f64) {
        let before = self.force_n();
        for force_loop in [&mut self.nominal, &mut self.slow, &mut self.fast] {
            force_loop.step(demand_n);
        }
        let nominal = self.force_n();
        let off = |force_loop: &ForceLoop| (force_loop.force_n() - nominal).abs();
        let moved = (nominal - before).abs();
        let margin = off(&self.slow).max(off(&self.fast)) + INSTANT_STEPS * moved;
        self.margin_n = margin.max(self.fading * self.margin_n);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::hydraulics;

    const STEP_S: f64 = 1e-3;
    const REST: [f64; 2] = [70e5, 98.6e5];

    /// The largest excess of a residual over its margin, under a demand that jumps, of a cylinder so many times as fast
    /// as the nominal one.
    fn largest_excess(speed: f64, jump_n: f64) -> f64 {
        let mut tracked = TrackedForce::new(hydraulics(), STEP_S);
        tracked.settle(REST);
        let mut cylinder = ForceLoop::new(hydraulics().with_speed(speed), STEP_S, REST);
        let rest = tracked.force_n();
        let mut largest = f64::NEG_INFINITY;
        for _ in 0..100 {
            let residual = tracked.force_n() - cylinder.force_n();
            largest = largest.max(residual.abs() - tracked.margin_n());
            tracked.step(rest + jump_n);
            cylinder.step(rest + jump_n);
        }
        largest
    }

    #[test]
    fn a_cylinder_as_slow_or_as_fast_as_stated_stays_within_its_margin_however_the_demand_jumps() {
        for speed in [0.75, 0.9, 1.0, 1.1, 1.25] {
            for jump in [100.0, 1e4, 49e3, 120e3] {
                let excess = largest_excess(speed, jump);
                assert!(excess <= 1.0, "{speed} {jump}: {excess}");
            }
        }
        assert!(largest_excess(0.4, 49e3) > 1000.0);
    }

    #[test]
    fn while_the_demand_stands_there_is_no_margin() {
        let mut tracked = TrackedForce::new(hydraulics(), STEP_S);
        tracked.settle(REST);
        let rest = tracked.force_n();
        tracked.step(rest);
        assert_eq!(tracked.margin_n(), 0.0);
        tracked.step(rest + 1e4);
        assert!(tracked.margin_n() > 100.0);
        (0..200).for_each(|_| tracked.step(rest + 1e4));
        assert!(tracked.margin_n() < 1.0);
    }
}
