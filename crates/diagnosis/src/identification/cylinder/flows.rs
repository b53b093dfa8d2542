//! What flows in and out of a cylinder's chambers, by its figures, and what these leave open.

use crate::identification::excerpt::{CylinderSeries, CylinderStep};
use crate::identification::points::Grouping;
use crate::residual::NominalHydraulics;

/// Density of the oil \[kg/m³\].
const OIL_DENSITY_KG_PER_M3: f64 = 870.0;
/// Pressure outside \[Pa\].
const AMBIENT_PA: f64 = 1e5;
/// Within so many deviations of a pressure's noise of the supply's or the tank's it is not known what flows.
const NEAR_LIMIT: f64 = 20.0;

/// What flows as commanded is known to within such a share, apart from what the valve's figures leave open: large flows reach
/// the limit of a port now sooner and now later than these say.
const OF_FLOW: f64 = 0.05;

/// A step of a cylinder.
#[derive(Debug, Clone, Copy)]
pub(super) struct FlowStep {
    pub(super) at_s: f64,
    /// Time to the next one \[s\].
    pub(super) lasts_s: f64,
    pub(super) pressures_pa: [f64; 2],
    /// The flow into A that is commanded when the step begins, as far as no port limits it \[m³/s\].
    pub(super) commanded: f64,
}

/// FlowSums from the beginning until a step \[m³\].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlowSums {
    /// Into each chamber, as commanded.
    pub(super) oil: [f64; 2],
    /// Into each chamber through a closed valve that lets one m³/s through at the full drop \[s\].
    pub(super) null: [f64; 2],
    /// Through a hole of one square metre: from A to B, from A and from B to the outside \[m\].
    pub(super) leaks: [f64; 3],
    /// What a fully open inlet of A lets in beyond what was commanded.
    pub(super) wide_open: f64,
    /// By how much the flow into each chamber may be wrong: its pressure is as near to a limit as its noise, or much flows.
    pub(super) unsure: [f64; 2],
}

/// The steps as the balance needs them.
pub(super) fn steps(grouping: &Grouping, series: &CylinderSeries) -> Vec<FlowStep> {
    let h = &series.hydraulics;
    let usable = &series.steps;
    let lasts = |place: usize| {
        let next = usable.get(place + 1);
        next.map_or(1, |next| next.step.since(usable[place].step)) as f64 * grouping.step_s
    };
    let step = |(place, step): (usize, &CylinderStep)| FlowStep {
        at_s: grouping.at_s(step.step),
        lasts_s: lasts(place),
        pressures_pa: step.pressures_pa,
        commanded: h.force_gain_m3_per_s_n * (step.demand_n - h.force_n(step.pressures_pa)),
    };
    usable.iter().enumerate().map(step).collect()
}

/// What has flowed until each step. `commanded` tells the mean flow into A over a step that is commanded \[m³/s\].
pub(super) fn sums(h: &NominalHydraulics, steps: &[FlowStep], commanded: &[f64]) -> Vec<FlowSums> {
    let mut sum = FlowSums::default();
    let until = |(step, flow): (&FlowStep, &f64)| {
        let before = sum;
        sum.add(h, step, *flow);
        before
    };
    steps.iter().zip(commanded).map(until).collect()
}

/// The oil alone.
pub(super) fn oil(h: &NominalHydraulics, steps: &[FlowStep], commanded: &[f64]) -> Vec<[f64; 2]> {
    let mut sum = [0.0; 2];
    let until = |(step, flow): (&FlowStep, &f64)| {
        let before = sum;
        let ports = ports(h, step, *flow);
        sum = [0, 1].map(|k| sum[k] + step.lasts_s * ports[k]);
        before
    };
    steps.iter().zip(commanded).map(until).collect()
}

/// The mean flow into A that is commanded over each step \[m³/s\]: within it the valve follows the force, which goes from one
/// sample's to the next one's, whatever changes it.
pub(super) fn commanded(h: &NominalHydraulics, steps: &[FlowStep]) -> Vec<f64> {
    let flow = |(place, step): (usize, &FlowStep)| {
        let after = steps.get(place + 1).unwrap_or(step);
        let moved = h.force_n(after.pressures_pa) - h.force_n(step.pressures_pa);
        step.commanded - h.force_gain_m3_per_s_n * 0.5 * moved
    };
    steps.iter().enumerate().map(flow).collect()
}

impl FlowSums {
    fn add(&mut self, h: &NominalHydraulics, step: &FlowStep, flow: f64) {
        let [a, b] = step.pressures_pa;
        let time = step.lasts_s;
        let ports = ports(h, step, flow);
        let through = [a - b, a - AMBIENT_PA, b - AMBIENT_PA].map(hole);
        for (k, pressure) in step.pressures_pa.into_iter().enumerate() {
            self.oil[k] += time * ports[k];
            self.null[k] += time * null_flow(h, pressure);
            self.unsure[k] += time * (unsure(h, pressure) + OF_FLOW * ports[k].abs());
        }
        for (sum, flow) in self.leaks.iter_mut().zip(through) {
            *sum += time * flow;
        }
        self.wide_open += time * (port(h, f64::INFINITY, a) - ports[0]);
    }
}

fn ports(h: &NominalHydraulics, step: &FlowStep, flow: f64) -> [f64; 2] {
    let [a, b] = step.pressures_pa;
    [port(h, flow, a), port(h, -flow, b)]
}

/// Share of the full drop's flow that passes at this drop.
fn root(h: &NominalHydraulics, across_pa: f64) -> f64 {
    (across_pa.max(0.0) / (h.supply_pa - h.tank_pa)).sqrt()
}

/// Flow into a chamber \[m³/s\]: what is commanded, as far as its inlet or outlet lets it pass.
fn port(h: &NominalHydraulics, command: f64, pressure_pa: f64) -> f64 {
    let across = if command > 0.0 { h.supply_pa - pressure_pa } else { pressure_pa - h.tank_pa };
    let most = h.valve_flow_m3_per_s * root(h, across);
    command.min(most).max(-most)
}

/// Flow into a chamber through a closed valve that lets one m³/s through at the full drop.
fn null_flow(h: &NominalHydraulics, pressure_pa: f64) -> f64 {
    root(h, h.supply_pa - pressure_pa) - root(h, pressure_pa - h.tank_pa)
}

/// By how much a port's flow may be wrong \[m³/s\] where its drop is about as large as its noise.
fn unsure(h: &NominalHydraulics, pressure_pa: f64) -> f64 {
    let noise = h.pressure_noise_pa;
    let drop = (h.supply_pa - pressure_pa).min(pressure_pa - h.tank_pa);
    if drop > NEAR_LIMIT * noise {
        return 0.0;
    }
    h.valve_flow_m3_per_s * (root(h, drop + noise) - root(h, drop - noise))
}

/// Flow through a hole of one square metre \[m³/s\] (eq. 10 and 11).
fn hole(across_pa: f64) -> f64 {
    (2.0 * across_pa.abs() / OIL_DENSITY_KG_PER_M3).sqrt().copysign(across_pa)
}
