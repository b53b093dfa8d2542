//! Forces on any nodes: of vehicles, and as recorded.
//!
//! They act on the structure's modes in the middle of each step, like the wind's, so that the structure swings under them.

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use truss::{Direction, Mechanics, Structure};
use vocabulary::NodeName;

use crate::check::Checks;
use crate::error::PlantError;
use crate::moving_loads::{Crossings, down, length};
use crate::parameters::PlantParameters;

/// A force over time, e.g. as recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedLoad {
    /// The nodes that share it equally.
    pub nodes: Vec<NodeName>,
    /// Time \[s\] and force \[N\], with rising times; linear between them, constant before and after.
    pub points: Vec<[f64; 2]>,
    /// Direction of a positive force, of any length: down.
    #[serde(default = "down")]
    pub direction: [f64; 3],
}

impl RecordedLoad {
    /// Checks what can be checked without the structure.
    pub(crate) fn check(&self, number: usize, checks: &mut Checks) {
        let mut require = |key: &str, holds: bool, value: String, expected: &str| {
            checks.require(&format!("recorded_loads.{number}.{key}"), holds, value, expected);
        };
        require("nodes", !self.nodes.is_empty(), "empty".to_owned(), "at least one node");
        let finite = self.points.iter().flatten().all(|value| value.is_finite());
        let rises = self.points.windows(2).all(|pair| pair[1][0] > pair[0][0]);
        let expected = "at least one pair of a time and a force, finite and with rising times";
        let words = format!("{} pairs", self.points.len());
        require("points", !self.points.is_empty() && finite && rises, words, expected);
        let length = length(self.direction);
        let is_direction = length > 0.0 && length.is_finite();
        let words = format!("{:?}", self.direction);
        require("direction", is_direction, words, "a direction other than [0, 0, 0]");
    }

    /// Largest force, nodes and duration.
    pub(crate) fn in_words(&self) -> String {
        let largest = self.points.iter().map(|[_, force]| force.abs()).fold(0.0, f64::max);
        format!("a recorded force of up to {} kN on {} nodes", 1e-3 * largest, self.nodes.len())
    }
}

/// A recorded load with the place in its course. It is one input.
#[derive(Debug, Clone)]
struct Course {
    load: RecordedLoad,
    /// The points at or before the latest time.
    passed: usize,
}

impl Course {
    fn new(structure: &Structure, number: usize, load: &RecordedLoad) -> Result<Self, PlantError> {
        if let Some(node) = load.nodes.iter().find(|node| structure.node_index(node).is_none()) {
            return Err(PlantError::LoadNode {
                place: format!("recorded_loads.{number}.nodes"),
                node: node.clone(),
                problem: "which the structure does not have; use its nodes' names",
            });
        }
        Ok(Self { load: load.clone(), passed: 0 })
    }

    /// The force at a time, which must not decrease \[N\].
    fn at(&mut self, time_s: f64) -> f64 {
        let points = &self.load.points;
        while points.get(self.passed).is_some_and(|[time, _]| *time <= time_s) {
            self.passed += 1;
        }
        let previous = self.passed.checked_sub(1).and_then(|index| points.get(index));
        match (previous, points.get(self.passed)) {
            (Some([start, from]), Some([end, to])) => {
                from + (to - from) * (time_s - start) / (end - start)
            }
            (Some([_, force]), None) | (None, Some([_, force])) => *force,
            (None, None) => 0.0,
        }
    }
}

/// The forces of all moving and recorded loads, step by step.
#[derive(Debug, Clone)]
pub(crate) struct NodalLoads {
    crossings: Vec<Crossings>,
    courses: Vec<Course>,
    step_s: f64,
    step: u64,
}

impl NodalLoads {
    /// # Errors
    /// A node that the structure does not have, or a path that stands still.
    pub(crate) fn new(
        structure: &Structure,
        parameters: &PlantParameters,
        seed: u64,
    ) -> Result<Self, PlantError> {
        let crossings = parameters.moving_loads.iter().enumerate();
        let crossings =
            crossings.map(|(number, load)| Crossings::new(structure, number, load, seed));
        let courses = parameters.recorded_loads.iter().enumerate();
        let courses = courses.map(|(number, load)| Course::new(structure, number, load));
        Ok(Self {
            crossings: crossings.collect::<Result<_, _>>()?,
            courses: courses.collect::<Result<_, _>>()?,
            step_s: parameters.step_s,
            step: 0,
        })
    }

    /// The loads on any node of a part of the structure.
    pub(crate) fn of_part(&self, part: &Structure) -> Self {
        let is_own = |node: &NodeName| part.node_index(node).is_some();
        let mut own = self.clone();
        own.crossings.retain(|load| load.nodes().any(is_own));
        own.courses.retain(|course| course.load.nodes.iter().any(is_own));
        own
    }

    pub(crate) fn inputs(&self) -> usize {
        self.crossings.iter().map(|load| load.nodes().count()).sum::<usize>() + self.courses.len()
    }

    /// Nodal forces per input (dofs × inputs); what a support takes is left out, like nodes of other parts.
    pub(crate) fn map(&self, part: &Structure, mechanics: &Mechanics) -> DMatrix<f64> {
        let mut map = DMatrix::zeros(mechanics.dofs.len(), self.inputs());
        let mut add = |column: usize, node: &NodeName, direction: [f64; 3], share: f64| {
            let Some(node) = part.node_index(node) else { return };
            for (axis, along) in
                [Direction::X, Direction::Y, Direction::Z].into_iter().zip(direction)
            {
                if let Some(dof) = mechanics.dof_index(node, axis) {
                    map[(dof, column)] += share * along / length(direction);
                }
            }
        };
        let mut column = 0;
        for load in &self.crossings {
            for node in load.nodes() {
                add(column, node, load.load.direction, 1.0);
                column += 1;
            }
        }
        for Course { load, .. } in &self.courses {
            for node in &load.nodes {
                add(column, node, load.direction, 1.0 / load.nodes.len() as f64);
            }
            column += 1;
        }
        map
    }

    /// The forces at the start \[N\].
    pub(crate) fn at_start(&self) -> Vec<f64> {
        let mut forces_n = vec![0.0; self.inputs()];
        self.clone().write(0.0, &mut forces_n);
        forces_n
    }

    /// Writes the forces in the middle of this step \[N\] and advances to the next step. Allocates nothing.
    pub(crate) fn next(&mut self, forces_n: &mut [f64]) {
        let time_s = (self.step as f64 + 0.5) * self.step_s;
        self.step += 1;
        self.write(time_s, forces_n);
    }

    fn write(&mut self, time_s: f64, forces_n: &mut [f64]) {
        let mut rest = forces_n;
        for load in &mut self.crossings {
            let (own, others) = rest.split_at_mut(load.nodes().count());
            rest = others;
            load.write(time_s, own);
        }
        for (course, force) in self.courses.iter_mut().zip(rest) {
            *force = course.at(time_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::ParameterErrors;

    fn recorded() -> RecordedLoad {
        let nodes = ["T1", "T2"].map(|node| node.parse().unwrap()).to_vec();
        RecordedLoad {
            nodes,
            points: vec![[1.0, 0.0], [2.0, 400.0], [4.0, 200.0]],
            direction: down(),
        }
    }

    #[test]
    fn a_recorded_force_is_linear_between_its_points_and_shared_by_its_nodes() {
        let text = include_str!("../../../configs/templates/bridge.toml");
        let structure = Structure::from_toml(text).unwrap();
        let mechanics = Mechanics::assemble(&structure).unwrap();
        let recorded_loads = vec![recorded()];
        let parameters = PlantParameters { step_s: 0.1, recorded_loads, ..Default::default() };
        let mut loads = NodalLoads::new(&structure, &parameters, 1).unwrap();
        let map = loads.map(&structure, &mechanics);
        assert_eq!((map.ncols(), map.sum(), map.min()), (1, -1.0, -0.5));
        assert_eq!(loads.at_start(), [0.0]);
        let mut force = [0.0];
        for step in 0..50 {
            loads.next(&mut force);
            let time = 0.1 * (f64::from(step) + 0.5);
            let expected = match time {
                time if time < 1.0 => 0.0,
                time if time < 2.0 => 400.0 * (time - 1.0),
                time if time < 4.0 => 400.0 - 100.0 * (time - 2.0),
                _ => 200.0,
            };
            assert!((force[0] - expected).abs() < 1e-9, "{time}: {force:?}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_recording_is_named() {
        let wrong = |load: RecordedLoad| {
            let mut checks = Checks::default();
            load.check(1, &mut checks);
            let ParameterErrors(errors) = checks.finish().unwrap_err();
            errors.into_iter().map(|error| error.parameter).collect::<Vec<_>>().join(", ")
        };
        let of = |key: &str| format!("recorded_loads.1.{key}");
        assert_eq!(wrong(RecordedLoad { nodes: vec![], ..recorded() }), of("nodes"));
        for points in [vec![], vec![[1.0, 2.0], [1.0, 3.0]], vec![[0.0, f64::NAN]]] {
            assert_eq!(wrong(RecordedLoad { points, ..recorded() }), of("points"));
        }
        assert_eq!(wrong(RecordedLoad { direction: [0.0; 3], ..recorded() }), of("direction"));
        let structure = Structure::from_toml(include_str!("../../../configs/small.toml")).unwrap();
        let recorded_loads =
            vec![RecordedLoad { nodes: vec!["T9".parse().unwrap()], ..recorded() }];
        let parameters = PlantParameters { recorded_loads, ..Default::default() };
        let error = NodalLoads::new(&structure, &parameters, 1).unwrap_err().to_string();
        assert!(error.contains("recorded_loads.0.nodes") && error.contains("`T9`"), "{error}");
    }
}
