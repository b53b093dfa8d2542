//! The validated description of a structure.
//!
//! A [`Structure`] is only created by [`Structure::from_toml`], [`Structure::local`], [`Structure::embedded`],
//! [`Structure::parts`], [`Structure::row`], [`Structure::perturbed`] and [`Structure::unmodelled`], so every index in it is valid in its own lists and every member has
//! a length above 0. Members and nodes are identified by their position in [`Structure::members`] and
//! [`Structure::nodes`].

use crate::direction::Support;
use crate::member::Member;
use crate::surroundings::Surroundings;
use vocabulary::{
    ActuatorName, Component, GageName, MemberName, ModuleName, NodeName, StructureName,
};

/// Nodes that differ by less than this in height are on the same level \[m\].
const LEVEL_TOLERANCE_M: f64 = 1e-6;

/// A joint of the structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Unique in the structure.
    pub name: NodeName,
    /// Coordinates, z upwards \[m\].
    pub position_m: [f64; 3],
    /// Mass in addition to the members: the node's share of its storey \[kg\].
    pub mass_kg: f64,
    /// Factor on the total mass lumped here, including the halves of members; 1 unless perturbed.
    pub mass_factor: f64,
    /// The directions in which the node is fixed.
    pub support: Support,
}

/// A hydraulic cylinder: a pair of forces along the line between two nodes. A positive force
/// pushes them apart.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// Unique in the module.
    pub name: ActuatorName,
    /// Indices of the two nodes.
    pub ends: [usize; 2],
    /// The member that contains the cylinder, if the description names one.
    pub member: Option<usize>,
}

/// A strain gage: it reads the elongation of its member, positive in tension.
#[derive(Debug, Clone, PartialEq)]
pub struct Gage {
    /// Unique in the module.
    pub name: GageName,
    /// Index of the member.
    pub member: usize,
}

/// A part of the structure, with a separate computer if equipped.
#[derive(Debug, Clone, PartialEq)]
pub struct Module {
    /// Unique in the structure.
    pub name: ModuleName,
    /// Nodes of the module's members, including the lower interface, ascending.
    pub nodes: Vec<usize>,
    /// The module's members, ascending.
    pub members: Vec<usize>,
    /// Nodes on which the module stands on the one below, ascending; empty if it stands on supports.
    pub lower_interface: Vec<usize>,
    /// Actuators, in the order of every vector of actuator signals.
    pub actuators: Vec<Actuator>,
    /// Gages, in the order of every vector of gage signals.
    pub gages: Vec<Gage>,
}

impl Module {
    /// Whether the module has components to diagnose.
    #[must_use]
    pub fn is_equipped(&self) -> bool {
        !self.actuators.is_empty() || !self.gages.is_empty()
    }

    /// The monitored components: actuators, then gages. Channels have this order everywhere.
    pub fn components(&self) -> impl Iterator<Item = Component> + '_ {
        let actuators = self.actuators.iter().map(|a| Component::Actuator(a.name.clone()));
        actuators.chain(self.gages.iter().map(|g| Component::Sensor(g.name.clone())))
    }
}

/// Rayleigh damping: D = α·M + β·K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    /// Mass coefficient α \[1/s\].
    pub alpha_per_s: f64,
    /// Stiffness coefficient β \[s\].
    pub beta_s: f64,
}

impl Rayleigh {
    /// Damping ratio of a mode, α/(2ω) + β·ω/2, from its angular frequency \[rad/s\].
    #[must_use]
    pub fn damping_ratio(&self, angular_frequency: f64) -> f64 {
        0.5 * (self.alpha_per_s / angular_frequency + self.beta_s * angular_frequency)
    }
}

/// Nodes at one height.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Height of the level \[m\].
    pub height_m: f64,
    /// Indices of its nodes, ascending.
    pub nodes: Vec<usize>,
}

/// A structure whose description has passed all checks.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Structure {
    /// Name of the whole structure.
    pub name: StructureName,
    /// Rayleigh damping.
    pub damping: Rayleigh,
    /// Nodes, in the order of the description.
    pub nodes: Vec<Node>,
    /// Members, in the order of the description.
    pub members: Vec<Member>,
    /// Modules, lowest first, in the order of the description.
    pub modules: Vec<Module>,
    /// What the rest of a larger structure does to these nodes; empty of a whole structure.
    pub surroundings: Vec<Surroundings>,
}

impl Structure {
    /// A structure of which only the name is known: it has no modules. Nothing can be computed of it.
    #[must_use]
    pub fn unmodelled(name: StructureName) -> Self {
        let damping = Rayleigh { alpha_per_s: 0.0, beta_s: 0.0 };
        let (nodes, members, modules) = (Vec::new(), Vec::new(), Vec::new());
        Self { name, damping, nodes, members, modules, surroundings: Vec::new() }
    }

    /// The modules that have actuators or gages, in order.
    pub fn equipped(&self) -> impl Iterator<Item = &Module> {
        self.modules.iter().filter(|module| module.is_equipped())
    }

    /// The module of this name.
    #[must_use]
    pub fn module(&self, name: &ModuleName) -> Option<&Module> {
        self.modules.iter().find(|module| &module.name == name)
    }

    /// Index of the node of this name.
    #[must_use]
    pub fn node_index(&self, name: &NodeName) -> Option<usize> {
        self.nodes.iter().position(|node| &node.name == name)
    }

    /// Index of the member of this name.
    #[must_use]
    pub fn member_index(&self, name: &MemberName) -> Option<usize> {
        self.members.iter().position(|member| &member.name == name)
    }

    /// The member to which a gage is attached.
    #[must_use]
    pub fn gage_member(&self, gage: &Gage) -> &Member {
        // Validation has found the gage's member in this list.
        &self.members[gage.member]
    }

    /// Length of the member of a gage: the gage reads strain × length \[m\].
    #[must_use]
    pub fn gage_length_m(&self, gage: &Gage) -> f64 {
        self.gage_member(gage).length_m
    }

    /// The total mass lumped at each node: its share of the storey and half of each member that ends there, times its
    /// factor \[kg\]; one value per node.
    #[must_use]
    pub fn nodal_masses_kg(&self) -> Vec<f64> {
        let mut masses: Vec<f64> = self.nodes.iter().map(|node| node.mass_kg).collect();
        for member in &self.members {
            for end in member.ends {
                masses[end] += 0.5 * member.mass_kg();
            }
        }
        for (mass, node) in masses.iter_mut().zip(&self.nodes) {
            *mass *= node.mass_factor;
        }
        masses
    }

    /// Unit vector from one node to another.
    #[must_use]
    pub(crate) fn unit_vector(&self, ends: [usize; 2]) -> [f64; 3] {
        let [from, to] = ends.map(|end| self.nodes[end].position_m);
        let along: [f64; 3] = std::array::from_fn(|i| to[i] - from[i]);
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        along.map(|x| x / length)
    }

    /// The nodes grouped by height, lowest level first.
    #[must_use]
    pub fn levels(&self) -> Vec<Level> {
        let mut order: Vec<usize> = (0..self.nodes.len()).collect();
        let height = |node: usize| self.nodes[node].position_m[2];
        order.sort_by(|&a, &b| height(a).total_cmp(&height(b)).then(a.cmp(&b)));
        let mut levels: Vec<Level> = Vec::new();
        for node in order {
            match levels.last_mut() {
                Some(level) if height(node) - level.height_m < LEVEL_TOLERANCE_M => {
                    level.nodes.push(node);
                }
                _ => levels.push(Level { height_m: height(node), nodes: vec![node] }),
            }
        }
        for level in &mut levels {
            level.nodes.sort_unstable();
        }
        levels
    }
}
