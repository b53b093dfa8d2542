//! Vehicles and trains that drive over nodes.
//!
//! An axle is a force that moves along a line of nodes. Between two nodes a simply supported stringer hands it to both by
//! the lever rule. In front of the first node and behind the last lies such a stringer too, as long as its neighbour, with
//! its other end on the ground; so a load enters and leaves without a jump.
//!
//! The inertia and the springs of the vehicle are left out: the moving-force model (L. Frýba, Vibration of Solids and
//! Structures under Moving Loads, 1999, chapter 1), right for vehicles that are light against the structure.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use truss::Structure;
use vocabulary::NodeName;

use crate::check::Checks;
use crate::error::PlantError;
use crate::streams::Stream;

/// A vehicle or a train that crosses a structure again and again, one crossing at a time. Each range is of a uniform
/// distribution, from which every crossing draws.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovingLoad {
    /// The lines of nodes along which it drives, first to last: one in a flat structure, in a spatial one for instance
    /// one below each row of wheels. Each line carries the same share of every axle.
    pub paths: Vec<Vec<NodeName>>,
    /// Load of each axle \[N\].
    pub axles_n: Vec<f64>,
    /// Distance of each axle behind the first one \[m\]; rises from 0.
    pub axles_behind_m: Vec<f64>,
    /// Speed \[m/s\].
    pub speed_m_per_s: [f64; 2],
    /// Time from the start of the run, or from the end of a crossing, to the next crossing \[s\].
    pub pause_s: [f64; 2],
    /// Factor on the axles' loads: 1.
    #[serde(default = "laden")]
    pub load_factor: [f64; 2],
    /// Direction of the forces, of any length: down.
    #[serde(default = "down")]
    pub direction: [f64; 3],
}

fn laden() -> [f64; 2] {
    [1.0, 1.0]
}

pub(crate) fn down() -> [f64; 3] {
    [0.0, 0.0, -1.0]
}

impl MovingLoad {
    /// Checks what can be checked without the structure.
    pub(crate) fn check(&self, number: usize, checks: &mut Checks) {
        let mut require = |key: &str, holds: bool, value: &dyn std::fmt::Debug, expected: &str| {
            checks.require(
                &format!("moving_loads.{number}.{key}"),
                holds,
                format!("{value:?}"),
                expected,
            );
        };
        let lines = !self.paths.is_empty() && self.paths.iter().all(|path| path.len() >= 2);
        require("paths", lines, &self.paths, "one path or several, each of at least two nodes");
        let is_load = |load: &f64| (1e-6..=1e12).contains(load);
        let loads = !self.axles_n.is_empty() && self.axles_n.iter().all(is_load);
        require("axles_n", loads, &self.axles_n, "1e-6 to 1e12 N for each axle");
        let behind = &self.axles_behind_m;
        let rises = behind.windows(2).all(|pair| pair[1] > pair[0] && pair[1] <= 1e6);
        let fits = behind.len() == self.axles_n.len() && behind.first() == Some(&0.0) && rises;
        let expected = "a distance for each axle of `axles_n`, rising from 0, up to 1e6 m";
        require("axles_behind_m", fits, behind, expected);
        let ranges = [
            ("speed_m_per_s", self.speed_m_per_s, 1e-3..=1e4, "m/s"),
            ("pause_s", self.pause_s, 0.0..=1e9, "s"),
            ("load_factor", self.load_factor, 1e-6..=1e6, ""),
        ];
        for (key, [from, to], range, unit) in ranges {
            let is_range = from <= to && range.contains(&from) && range.contains(&to);
            let (least, largest) = (range.start(), range.end());
            let space = if unit.is_empty() { "" } else { " " };
            let expected = format!(
                "two numbers from {least:?} to {largest:?}{space}{unit}, the smaller one first"
            );
            require(key, is_range, &[from, to], &expected);
        }
        let length = length(self.direction);
        let is_direction = length > 0.0 && length.is_finite();
        require("direction", is_direction, &self.direction, "a direction other than [0, 0, 0]");
    }

    /// Number and loads of its axles, speeds and pauses.
    pub(crate) fn in_words(&self) -> String {
        let total_kn = 1e-3 * self.axles_n.iter().sum::<f64>();
        let range = |[from, to]: [f64; 2]| match from == to {
            true => format!("{from}"),
            false => format!("{from} to {to}"),
        };
        let tenths = |x: f64| (10.0 * x).round() / 10.0;
        let loads_kn = range(self.load_factor.map(|factor| tenths(total_kn * factor)));
        let (axles, speeds) = (self.axles_n.len(), range(self.speed_m_per_s));
        format!("{loads_kn} kN on {axles} axles at {speeds} m/s every {} s", range(self.pause_s))
    }
}

pub(crate) fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// A line of nodes with their distances from the first one along the line.
#[derive(Debug, Clone)]
struct Line {
    nodes: Vec<NodeName>,
    /// \[m\], rising.
    at_m: Vec<f64>,
}

impl Line {
    fn new(structure: &Structure, load: usize, path: &[NodeName]) -> Result<Self, PlantError> {
        let mut at_m = Vec::with_capacity(path.len());
        let mut before: Option<[f64; 3]> = None;
        for node in path {
            let place = || format!("moving_loads.{load}.paths");
            let wrong =
                |problem| PlantError::LoadNode { place: place(), node: node.clone(), problem };
            let index = structure
                .node_index(node)
                .ok_or_else(|| wrong("which the structure does not have; use its nodes' names"))?;
            let position = structure.nodes[index].position_m;
            let step = before.map_or(0.0, |before| {
                length(std::array::from_fn(|axis| position[axis] - before[axis]))
            });
            if before.is_some() && step <= 0.0 {
                return Err(wrong("which is where the one before it is; leave one of them out"));
            }
            at_m.push(at_m.last().copied().unwrap_or(0.0) + step);
            before = Some(position);
        }
        Ok(Self { nodes: path.to_vec(), at_m })
    }

    /// Lengths of the stringers in front of the first node and behind the last one \[m\].
    fn approaches_m(&self) -> [f64; 2] {
        match (self.at_m.first_chunk(), self.at_m.last_chunk()) {
            (Some([first, second]), Some([before, last])) => [second - first, last - before],
            _ => [0.0; 2],
        }
    }

    fn length_m(&self) -> f64 {
        self.at_m.last().copied().unwrap_or(0.0)
    }

    /// Adds an axle at this distance behind the first node \[m\] to the nodes' forces \[N\].
    fn add(&self, place_m: f64, axle_n: f64, forces_n: &mut [f64]) {
        let after = self.at_m.partition_point(|at| *at <= place_m);
        let next = self.at_m.get(after);
        let previous = after.checked_sub(1).and_then(|index| self.at_m.get(index));
        let [in_front, behind] = self.approaches_m();
        match (previous, next) {
            (Some(from), Some(to)) => {
                let share = (place_m - from) / (to - from);
                forces_n[after - 1] += (1.0 - share) * axle_n;
                forces_n[after] += share * axle_n;
            }
            (None, Some(to)) => {
                forces_n[after] += (1.0 - (to - place_m) / in_front).max(0.0) * axle_n;
            }
            (Some(from), None) => {
                forces_n[after - 1] += (1.0 - (place_m - from) / behind).max(0.0) * axle_n;
            }
            (None, None) => {}
        }
    }
}

/// A moving load with its present or next crossing. Each node of each line is an input of its own.
#[derive(Debug, Clone)]
pub(crate) struct Crossings {
    pub(crate) load: MovingLoad,
    lines: Vec<Line>,
    generator: ChaCha8Rng,
    begins_s: f64,
    ends_s: f64,
    speed_m_per_s: f64,
    factor: f64,
}

impl Crossings {
    pub(crate) fn new(
        structure: &Structure,
        number: usize,
        load: &MovingLoad,
        seed: u64,
    ) -> Result<Self, PlantError> {
        let lines = load.paths.iter().map(|path| Line::new(structure, number, path));
        let mut crossings = Self {
            lines: lines.collect::<Result<_, _>>()?,
            load: load.clone(),
            generator: Stream::MovingLoad(number).generator(seed),
            begins_s: 0.0,
            ends_s: 0.0,
            speed_m_per_s: 0.0,
            factor: 0.0,
        };
        crossings.next_crossing();
        Ok(crossings)
    }

    /// From the outer end of the stringer in front to the first node \[m\]: the longest of all lines.
    fn in_front_m(&self) -> f64 {
        self.lines.iter().map(|line| line.approaches_m()[0]).fold(0.0, f64::max)
    }

    fn next_crossing(&mut self) {
        let mut draw = |[from, to]: [f64; 2]| from + (to - from) * self.generator.random::<f64>();
        self.begins_s = self.ends_s + draw(self.load.pause_s);
        self.speed_m_per_s = draw(self.load.speed_m_per_s);
        self.factor = draw(self.load.load_factor);
        let ends = self.lines.iter().map(|line| line.length_m() + line.approaches_m()[1]);
        let last_axle = self.load.axles_behind_m.last().copied().unwrap_or(0.0);
        let length_m = self.in_front_m() + ends.fold(0.0, f64::max) + last_axle;
        self.ends_s = self.begins_s + length_m / self.speed_m_per_s;
    }

    /// Writes the forces of the nodes of all lines at a time, which must not decrease \[N\].
    pub(crate) fn write(&mut self, time_s: f64, forces_n: &mut [f64]) {
        forces_n.fill(0.0);
        while time_s >= self.ends_s {
            self.next_crossing();
        }
        if time_s < self.begins_s {
            return;
        }
        let first_m = self.speed_m_per_s * (time_s - self.begins_s) - self.in_front_m();
        let share = self.factor / self.lines.len() as f64;
        let mut rest = forces_n;
        for line in &self.lines {
            let (own, others) = rest.split_at_mut(line.nodes.len());
            rest = others;
            for (axle_n, behind_m) in self.load.axles_n.iter().zip(&self.load.axles_behind_m) {
                line.add(first_m - behind_m, share * axle_n, own);
            }
        }
    }

    pub(crate) fn nodes(&self) -> impl Iterator<Item = &NodeName> {
        self.lines.iter().flat_map(|line| &line.nodes)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use truss::{Direction, Mechanics};

    use super::*;
    use crate::check::ParameterErrors;
    use crate::nodal_loads::NodalLoads;
    use crate::parameters::PlantParameters;

    /// Six panels of 3 m, 2 m high, on a pin and a roller: statically determinate.
    fn bridge() -> Structure {
        Structure::from_toml(include_str!("../../../configs/templates/bridge.toml")).unwrap()
    }

    const SPAN_M: f64 = 18.0;
    const HEIGHT_M: f64 = 2.0;

    fn path() -> Vec<NodeName> {
        (0..7).map(|node| format!("B{node}").parse().unwrap()).collect()
    }

    /// Two axles, 4 m apart, at 6 m/s, from the first instant on.
    fn truck() -> MovingLoad {
        MovingLoad {
            paths: vec![path()],
            axles_n: vec![20e3, 40e3],
            axles_behind_m: vec![0.0, 4.0],
            speed_m_per_s: [6.0; 2],
            pause_s: [0.0; 2],
            load_factor: laden(),
            direction: down(),
        }
    }

    fn loads(
        structure: &Structure,
        load: &MovingLoad,
        step_s: f64,
    ) -> Result<NodalLoads, PlantError> {
        let moving_loads = vec![load.clone()];
        NodalLoads::new(
            structure,
            &PlantParameters { step_s, moving_loads, ..Default::default() },
            1,
        )
    }

    fn forces(load: &MovingLoad, step_s: f64, steps: usize) -> Vec<Vec<f64>> {
        let mut loads = loads(&bridge(), load, step_s).unwrap();
        let mut forces = vec![0.0; loads.inputs()];
        let next = |_| {
            loads.next(&mut forces);
            forces.clone()
        };
        (0..steps).map(next).collect()
    }

    #[test]
    fn nodes_carry_what_is_on_the_bridge_at_the_place_where_it_is() {
        // 3 m of approach, 18 m of bridge, 4 m of vehicle and 3 m at the end, in 28 m / (6 m/s) = 4667 ms
        for (step, forces) in forces(&truck(), 1e-3, 4660).into_iter().enumerate() {
            let first = 6e-3 * (step as f64 + 0.5) - 3.0;
            let (mut sum, mut moment, mut is_exact) = (0.0, 0.0, true);
            for (place, load) in [(first, 20e3), (first - 4.0, 40e3)] {
                if (0.0..=SPAN_M).contains(&place) {
                    sum += load;
                    moment += load * place;
                } else {
                    // on an approach, or not there at all
                    is_exact &= place <= -3.0 || place >= SPAN_M + 3.0;
                }
            }
            let (carried, about) = forces
                .iter()
                .enumerate()
                .fold((0.0, 0.0), |(f, m), (k, n)| (f + n, m + 3.0 * k as f64 * n));
            if is_exact {
                assert!((carried - sum).abs() < 1e-9 * 60e3, "{step}: {carried} {sum}");
                assert!((about - moment).abs() < 1e-9 * 60e3 * SPAN_M, "{step}");
            } else {
                assert!((sum - 1e-6..=60e3).contains(&carried), "{step}: {carried} {sum}");
            }
        }
    }

    #[test]
    fn loads_enter_and_leave_without_a_jump_and_come_again() {
        let run = forces(&truck(), 1e-3, 10_000);
        // an axle passes from node to node in 500 ms
        let most = (40e3 + 20e3) / 500.0 + 1e-6;
        assert!(run[0].iter().all(|force| force.abs() < most));
        for pair in run.windows(2) {
            for (before, now) in pair[0].iter().zip(&pair[1]) {
                assert!((now - before).abs() < most, "{before} {now}");
            }
        }
        let crossings = run.windows(2).filter(|pair| pair[0][3] == 0.0 && pair[1][3] > 0.0);
        assert!(crossings.count() >= 2);
    }

    /// Influence lines by the method of sections (A. Ritter, 1862): the cut through panel 1 meets `top1`, `diagonal1` and
    /// `bottom1`; the moment about B2, where the latter two meet, gives the first, and the sum of the vertical forces the
    /// second.
    #[test]
    fn readings_of_a_truss_are_its_influence_lines() {
        let structure = bridge();
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let single = MovingLoad { axles_n: vec![10e3], axles_behind_m: vec![0.0], ..truck() };
        let mut loads = loads(&structure, &single, 0.01).unwrap();
        let map = loads.map(&structure, &mechanics);
        let gage = |name: &str| {
            let module = &structure.modules[0];
            let place = module.gages.iter().position(|gage| gage.name.as_str() == name).unwrap();
            let member = structure.gage_member(&module.gages[place]);
            let length = structure.gage_length_m(&module.gages[place]);
            (place, member.effective_young_pa() * member.area_m2 / length)
        };
        let [top1, diagonal1] = ["g2", "g4"].map(gage);
        let mut forces = vec![0.0; loads.inputs()];
        for step in 0..400 {
            let x = 0.06 * (f64::from(step) + 0.5) - 3.0;
            loads.next(&mut forces);
            let nodal = &map * DVector::from_column_slice(&forces);
            let moved = mechanics.static_displacements(&DMatrix::from_columns(&[nodal])).unwrap();
            let elongations = &mechanics.gage_map * moved;
            if !(0.0..=SPAN_M).contains(&x) {
                // the ends are supports
                assert!(elongations.amax() < 1e-15);
                continue;
            }
            let moment = 10e3 * (x * (SPAN_M - 6.0)).min(6.0 * (SPAN_M - x)) / SPAN_M;
            let on_the_left = ((6.0 - x) / 3.0).clamp(0.0, 1.0);
            let shear = 10e3 * ((SPAN_M - x) / SPAN_M - on_the_left);
            let expected = [-moment / HEIGHT_M, shear * 13.0_f64.sqrt() / HEIGHT_M];
            for ((place, stiffness), expected) in [top1, diagonal1].into_iter().zip(expected) {
                let force = stiffness * elongations[(place, 0)];
                assert!((force - expected).abs() < 1e-9 * 10e3, "{x}: {force} {expected}");
            }
        }
    }

    #[test]
    fn lines_share_the_load_and_its_direction_is_kept() {
        let across = MovingLoad {
            paths: vec![path(), path().into_iter().rev().collect()],
            direction: [3.0, 0.0, -4.0],
            ..truck()
        };
        let structure = bridge();
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let loads = loads(&structure, &across, 1e-3).unwrap();
        assert_eq!(loads.inputs(), 14);
        let map = loads.map(&structure, &mechanics);
        let dof =
            |direction| mechanics.dof_index(structure.node_index(&path()[1]).unwrap(), direction);
        assert!((map[(dof(Direction::X).unwrap(), 1)] - 0.6).abs() < 1e-15);
        assert!((map[(dof(Direction::Z).unwrap(), 12)] + 0.8).abs() < 1e-15);
        for forces in forces(&across, 1e-3, 4000) {
            let (there, back) = forces.split_at(7);
            assert_eq!(there, back);
        }
    }

    #[test]
    fn crossings_are_drawn_within_their_ranges_by_the_seed_alone() {
        let load = MovingLoad {
            speed_m_per_s: [5.0, 25.0],
            pause_s: [1.0, 8.0],
            load_factor: [0.3, 1.0],
            ..truck()
        };
        let mut crossings = Crossings::new(&bridge(), 0, &load, 3).unwrap();
        let same = Crossings::new(&bridge(), 0, &load, 3).unwrap();
        let other = Crossings::new(&bridge(), 0, &load, 4).unwrap();
        assert_eq!(crossings.begins_s, same.begins_s);
        assert_ne!(crossings.begins_s, other.begins_s);
        let mut fastest = 0.0_f64;
        for _ in 0..1000 {
            let ended = crossings.ends_s;
            crossings.next_crossing();
            assert!((1.0..=8.0).contains(&(crossings.begins_s - ended)));
            assert!((0.3..=1.0).contains(&crossings.factor));
            let takes = crossings.ends_s - crossings.begins_s;
            assert!((takes - 28.0 / crossings.speed_m_per_s).abs() < 1e-9);
            fastest = fastest.max(crossings.speed_m_per_s);
        }
        assert!((24.0..=25.0).contains(&fastest), "{fastest}");
    }

    #[test]
    fn what_is_wrong_is_named_with_what_would_be_right() {
        let wrong = |load: MovingLoad| {
            let mut checks = Checks::default();
            load.check(2, &mut checks);
            let ParameterErrors(errors) = checks.finish().unwrap_err();
            let named: Vec<String> = errors.into_iter().map(|error| error.parameter).collect();
            named.join(", ")
        };
        let of = |key: &str| format!("moving_loads.2.{key}");
        assert_eq!(wrong(MovingLoad { paths: vec![], ..truck() }), of("paths"));
        let single = vec![path(), path()[..1].to_vec()];
        assert_eq!(wrong(MovingLoad { paths: single, ..truck() }), of("paths"));
        assert_eq!(wrong(MovingLoad { axles_n: vec![1.0, -1.0], ..truck() }), of("axles_n"));
        for spacing in [vec![0.0], vec![0.0, 0.0], vec![1.0, 4.0], vec![0.0, f64::NAN]] {
            let load = MovingLoad { axles_behind_m: spacing, ..truck() };
            assert_eq!(wrong(load), of("axles_behind_m"));
        }
        for speeds in [[0.0, 1.0], [2.0, 1.0], [1.0, f64::INFINITY]] {
            let load = MovingLoad { speed_m_per_s: speeds, ..truck() };
            assert_eq!(wrong(load), of("speed_m_per_s"));
        }
        assert_eq!(wrong(MovingLoad { pause_s: [-1.0, 1.0], ..truck() }), of("pause_s"));
        assert_eq!(wrong(MovingLoad { direction: [0.0; 3], ..truck() }), of("direction"));
        let mut checks = Checks::default();
        truck().check(0, &mut checks);
        checks.finish().unwrap();

        let refused = |path: Vec<&str>| {
            let path = path.into_iter().map(|node| node.parse().unwrap()).collect();
            let load = MovingLoad { paths: vec![path], ..truck() };
            loads(&bridge(), &load, 1e-3).unwrap_err().to_string()
        };
        let error = refused(vec!["B0", "B9"]);
        assert!(error.contains("moving_loads.0.paths") && error.contains("`B9`"), "{error}");
        assert!(refused(vec!["B0", "B1", "B1"]).contains("`B1`, which is where"));
    }
}
