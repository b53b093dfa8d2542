//! The location of a component on the structure, in words for whoever has to go there.

use std::fmt;

use vocabulary::{Component, ComponentPath, MemberName, NodeName};

use crate::Structure;

/// Coordinates that differ by less are the same \[m\].
const SAME_M: f64 = 1e-3;

/// Where a component is. Displayed as `level 2 to 3 (8.0 to 12.0 m), face at y = 0.0 m, member d7, from node n5 to n9`.
#[derive(Debug, Clone, PartialEq)]
pub struct ComponentLocation {
    /// The lowest and the highest level that it touches, counted from 0, the lowest one.
    pub levels: [usize; 2],
    /// Their heights \[m\].
    pub heights_m: [f64; 2],
    /// The outer faces that it lies in, each as axis and coordinate \[m\]; two are an edge.
    pub faces: Vec<(char, f64)>,
    /// Its member, if the description names one.
    pub member: Option<MemberName>,
    /// The nodes at its ends.
    pub nodes: [NodeName; 2],
}

impl Structure {
    /// Where a component is; `None` if the structure has no such component.
    #[must_use]
    pub fn place_of(&self, path: &ComponentPath) -> Option<ComponentLocation> {
        let module = self.module(&path.module)?;
        let (ends, member) = match &path.component {
            Component::Actuator(name) => {
                let actuator = module.actuators.iter().find(|actuator| actuator.name == *name)?;
                (actuator.ends, actuator.member)
            }
            Component::Sensor(name) => {
                let gage = module.gages.iter().find(|gage| gage.name == *name)?;
                (self.gage_member(gage).ends, Some(gage.member))
            }
        };
        let levels = self.levels();
        let level_of = |node: usize| levels.iter().position(|level| level.nodes.contains(&node));
        let mut levels_of = [level_of(ends[0])?, level_of(ends[1])?];
        levels_of.sort_unstable();
        Some(ComponentLocation {
            levels: levels_of,
            heights_m: levels_of.map(|level| levels[level].height_m),
            faces: self.faces_of(ends),
            member: member.map(|member| self.members[member].name.clone()),
            nodes: ends.map(|node| self.nodes[node].name.clone()),
        })
    }

    /// The outer faces in which both ends lie.
    fn faces_of(&self, ends: [usize; 2]) -> Vec<(char, f64)> {
        let mut faces = Vec::new();
        for (axis, name) in ['x', 'y'].into_iter().enumerate() {
            let of = |node: usize| self.nodes[node].position_m[axis];
            let all = || self.nodes.iter().map(|node| node.position_m[axis]);
            let outer =
                [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)];
            if outer[1] - outer[0] < SAME_M {
                continue;
            }
            let face =
                outer.into_iter().find(|at| ends.iter().all(|end| (of(*end) - at).abs() < SAME_M));
            faces.extend(face.map(|at| (name, at)));
        }
        faces
    }
}

impl fmt::Display for ComponentLocation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([low, high], [from, to]) = (self.levels, self.heights_m);
        if low == high {
            write!(f, "level {low} ({from:.1} m)")?;
        } else {
            write!(f, "level {low} to {high} ({from:.1} to {to:.1} m)")?;
        }
        let faces: Vec<String> =
            self.faces.iter().map(|(axis, at)| format!("{axis} = {at:.1} m")).collect();
        match self.faces.len() {
            0 => f.write_str(", inside")?,
            1 => write!(f, ", face at {}", faces[0])?,
            _ => write!(f, ", edge at {}", faces.join(", "))?,
        }
        if let Some(member) = &self.member {
            write!(f, ", member {member}")?;
        }
        let [one, other] = &self.nodes;
        write!(f, ", from node {one} to {other}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_component_of_the_tower_has_a_place() {
        let text = include_str!("../../../configs/tower.toml");
        let structure = Structure::from_toml(text).unwrap();
        let mut words = Vec::new();
        for module in structure.equipped() {
            for component in module.components() {
                let path = ComponentPath { module: module.name.clone(), component };
                let place = structure.place_of(&path).unwrap();
                let [low, high] = place.nodes.clone().map(|name| {
                    let node = structure.node_index(&name).unwrap();
                    structure.nodes[node].position_m[2]
                });
                assert_eq!(place.heights_m, [low.min(high), low.max(high)], "{path}");
                assert!(place.faces.len() <= 2, "{place:?}");
                words.push(place.to_string());
            }
        }
        assert!(words[0].contains("level ") && words[0].contains(" from node "), "{}", words[0]);
        let unknown = "module1/sensor/g99".parse().unwrap();
        assert_eq!(structure.place_of(&unknown), None);
    }
}
