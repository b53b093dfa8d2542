//! Temperature: members that expand unevenly strain each other.
//!
//! A temperature-compensated gage reads the elastic part: the elongation of its member minus its free expansion α·ΔT·l.
//! Temperature changes slowly, so the structure is in equilibrium ([`truss::Mechanics::strain_response`]). Every
//! pattern varies separately between plus and minus its amplitude ([`DayCourse`]).

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use truss::{Member, Structure};

use crate::check::Checks;
use crate::course::DayCourse;
use crate::streams::Stream;

/// Amplitudes of temperature patterns; all are 0 by default. Marks: \[E\] engineering estimate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TemperatureParameters {
    /// Thermal expansion of the members, α \[1/K\]: 1.2e-5, steel.
    pub expansion_per_k: f64,
    /// All members equally, ± \[K\].
    pub uniform_k: f64,
    /// The columns relative to the other members, ± \[K\]: they are thicker and respond later.
    pub columns_k: f64,
    /// The faces relative to the middle of the plan, ± in x and y \[K\]: the sun.
    pub sun_k: f64,
    /// Each member separately, ± \[K\].
    pub members_k: f64,
    /// Whether columns and sun vary separately in each module, or together in all.
    pub per_module: bool,
}

impl Default for TemperatureParameters {
    fn default() -> Self {
        Self {
            expansion_per_k: 1.2e-5,
            uniform_k: 0.0,
            columns_k: 0.0,
            sun_k: 0.0,
            members_k: 0.0,
            per_module: false,
        }
    }
}

impl TemperatureParameters {
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.within("temperature.expansion_per_k", self.expansion_per_k, 0.0..=0.01, "1/K");
        checks.within("temperature.uniform_k", self.uniform_k, 0.0..=1e4, "K");
        checks.within("temperature.columns_k", self.columns_k, 0.0..=1e4, "K");
        checks.within("temperature.sun_k", self.sun_k, 0.0..=1e4, "K");
        checks.within("temperature.members_k", self.members_k, 0.0..=1e4, "K");
    }

    /// Whether the temperature is always that of the description.
    pub(crate) fn is_even(&self) -> bool {
        [self.uniform_k, self.columns_k, self.sun_k, self.members_k].iter().all(|k| *k == 0.0)
    }
}

/// The effect of a pattern's largest value on the gages, and its variation over time.
#[derive(Debug, Clone)]
struct Pattern {
    elongations_m: DVector<f64>,
    course: DayCourse,
}

/// The effect of temperature on the gages.
#[derive(Debug, Clone)]
pub(crate) struct Temperature {
    patterns: Vec<Pattern>,
}

impl Temperature {
    /// `response`: elastic elongation per free strain (gages × members).
    pub(crate) fn new(
        structure: &Structure,
        response: &DMatrix<f64>,
        parameters: &TemperatureParameters,
        seed: u64,
    ) -> Self {
        let mut patterns = Vec::new();
        let mut add = |warming_k: Vec<f64>| {
            let strains = parameters.expansion_per_k * DVector::from_vec(warming_k);
            if strains.iter().any(|strain| *strain != 0.0) {
                let course = DayCourse::draw(Stream::Temperature(patterns.len()), seed);
                patterns.push(Pattern { elongations_m: response * strains, course });
            }
        };
        let members = structure.members.len();
        add(vec![parameters.uniform_k; members]);
        for group in groups(structure, parameters.per_module) {
            let of_group = |of: &dyn Fn(&Member) -> f64| {
                let mut warming = vec![0.0; members];
                for &member in &group {
                    warming[member] = of(&structure.members[member]);
                }
                warming
            };
            add(of_group(&|member| if member.is_upright() { parameters.columns_k } else { 0.0 }));
            for axis in 0..2 {
                let place = place_in_plan(structure, axis);
                add(of_group(&|member| parameters.sun_k * place(member)));
            }
        }
        for member in 0..members {
            let mut warming = vec![0.0; members];
            warming[member] = parameters.members_k;
            add(warming);
        }
        Self { patterns }
    }

    /// Adds the effect on the gages at a time \[m\]. Allocates nothing.
    pub(crate) fn add_to(&self, elongations_m: &mut [f64], time_s: f64) {
        for Pattern { elongations_m: largest, course } in &self.patterns {
            let value = course.at(time_s);
            for (elongation, largest) in elongations_m.iter_mut().zip(largest) {
                *elongation += value * largest;
            }
        }
    }
}

/// Groups of members with a common variation.
fn groups(structure: &Structure, per_module: bool) -> Vec<Vec<usize>> {
    if per_module {
        structure.modules.iter().map(|module| module.members.clone()).collect()
    } else {
        vec![(0..structure.members.len()).collect()]
    }
}

/// The position of a member's midpoint between the faces of the plan: −1 to 1.
fn place_in_plan(structure: &Structure, axis: usize) -> impl Fn(&Member) -> f64 {
    let at = move |node: usize| structure.nodes[node].position_m[axis];
    let all = (0..structure.nodes.len()).map(at);
    let (least, most) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), value| {
        (least.min(value), most.max(value))
    });
    let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
    move |member: &Member| {
        let [from, to] = member.ends;
        if half > 0.0 { (0.5 * (at(from) + at(to)) - middle) / half } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use truss::Mechanics;

    fn readings(parameters: &TemperatureParameters, time_s: f64, seed: u64) -> Vec<f64> {
        let structure = Structure::from_toml(include_str!("../../../configs/tower.toml")).unwrap();
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let response = mechanics.strain_response(&structure).unwrap();
        let temperature = Temperature::new(&structure, &response, parameters, seed);
        let mut elongations = vec![0.0; 16];
        temperature.add_to(&mut elongations, time_s);
        elongations
    }

    #[test]
    fn without_temperature_nothing_is_read() {
        assert!(TemperatureParameters::default().is_even());
        assert_eq!(readings(&TemperatureParameters::default(), 5.0, 1), vec![0.0; 16]);
    }

    #[test]
    fn sunshine_bends_the_faces_and_leaves_little_to_the_gages_of_a_tower_that_may_bend() {
        // 6 K on a face would be 72 microstrain if nothing could move; a free tower bends instead.
        let sun = TemperatureParameters { sun_k: 6.0, ..TemperatureParameters::default() };
        for seed in 0..20 {
            let largest = readings(&sun, 0.0, seed).iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            assert!(largest < 72e-6 * 3.0, "{largest}");
        }
    }

    #[test]
    fn columns_that_expand_more_than_the_rest_pull_at_the_diagonals() {
        let columns = TemperatureParameters { columns_k: 8.0, ..TemperatureParameters::default() };
        let read = readings(&columns, 0.0, 3);
        let (column, diagonal) = (read[0], read[4]);
        assert!(column * diagonal < 0.0, "{read:?}");
        // A quarter turn of the plan changes nothing.
        assert!((read[0] - read[1]).abs() < 1e-9 && (read[4] - read[6]).abs() < 1e-9, "{read:?}");
    }

    #[test]
    fn modules_of_their_own_differ() {
        let alike = TemperatureParameters { columns_k: 8.0, ..TemperatureParameters::default() };
        let own = TemperatureParameters { per_module: true, ..alike.clone() };
        assert_ne!(readings(&alike, 0.0, 3), readings(&own, 0.0, 3));
        assert_ne!(readings(&own, 0.0, 3), readings(&own, 20_000.0, 3));
    }
}
