//! Exports the complete model, with results for comparison, for external finite-element programs. Serialises to any
//! format of serde; SI units throughout, named in the fields.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::assembly::Mechanics;
use crate::direction::Direction;
use crate::member::{Member, MemberKind};
use crate::modal::Modes;
use crate::model_error::ModelError;
use crate::structure::Structure;

/// Number of exported frequencies.
const FREQUENCIES: usize = 12;

/// The meaning of the fields, for readers of the export alone.
const NOTES: [&str; 6] = [
    "`rod`: axial force only, pinned at both ends. `beam`: straight Euler-Bernoulli beam with St Venant torsion, no shear deformation, rigidly joined to other beams",
    "local x runs from the first end to the second; `local_y` and `local_z` = x cross y are unit vectors in global coordinates; `iy_m4` belongs to bending about local y, `iz_m4` about local z",
    "`nodal_masses_kg` is all mass there is: the lumped translational mass of each node in x, y and z alike, in the order of `nodes`, halves of the members included. `density_kg_m3` of the members is in it already, do not add it again. Rotations have no mass",
    "rotations exist only at nodes where a beam ends; rotations elsewhere are no degrees of freedom",
    "an actuator of force F pushes its two nodes apart along the line between them: -F at the first, +F at the second",
    "a gage reads the elongation of its member, positive in tension; `static_elongations_m_per_n` is its reading under one constant newton of one actuator",
];

/// A structure with the complete data of its model.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Export {
    /// Name of the structure.
    pub name: String,
    /// The meaning of the fields.
    pub notes: [&'static str; 6],
    /// Nodes.
    pub nodes: Vec<ExportedNode>,
    /// Members.
    pub members: Vec<ExportedMember>,
    /// The total lumped mass of each node, in the order of `nodes` \[kg\].
    pub nodal_masses_kg: Vec<f64>,
    /// Fixed degrees of freedom.
    pub fixed: Vec<ExportedFixed>,
    /// Stiffness of the rest of a larger structure between nodes of this part of it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub surroundings: Vec<ExportedSurroundings>,
    /// Actuators of all modules.
    pub actuators: Vec<ExportedActuator>,
    /// Gages of all modules.
    pub gages: Vec<ExportedGage>,
    /// Mass coefficient of the damping matrix \[1/s\].
    pub alpha_per_s: f64,
    /// Stiffness coefficient of the damping matrix \[s\].
    pub beta_s: f64,
    /// The first natural frequencies, undamped, ascending \[Hz\].
    pub natural_frequencies_hz: Vec<f64>,
    /// The reading of every gage under a unit force of every actuator.
    pub static_responses: Vec<ExportedResponse>,
}

/// A node.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedNode {
    /// Its name.
    pub name: String,
    /// Coordinates, z upwards \[m\].
    pub position_m: [f64; 3],
}

/// A member.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedMember {
    /// Its name.
    pub name: String,
    /// The module it belongs to.
    pub module: String,
    /// Names of its end nodes.
    pub ends: [String; 2],
    /// `rod` or `beam`.
    pub kind: &'static str,
    /// Cross-section \[m²\].
    pub area_m2: f64,
    /// Second moment of area about local y, beams only [m⁴].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iy_m4: Option<f64>,
    /// Second moment of area about local z, beams only [m⁴].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iz_m4: Option<f64>,
    /// Torsion constant, beams only [m⁴].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub j_m4: Option<f64>,
    /// Young's modulus \[Pa\].
    pub e_pa: f64,
    /// Shear modulus \[Pa\].
    pub g_pa: f64,
    /// Density \[kg/m³\].
    pub density_kg_m3: f64,
    /// Unit vector of the local y axis, beams only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub local_y: Option<[f64; 3]>,
    /// Unit vector of the local z axis, beams only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub local_z: Option<[f64; 3]>,
}

/// The fixed degrees of freedom of a node.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedFixed {
    /// Name of the node.
    pub node: String,
    /// `x`, `y`, `z`, `rx`, `ry`, `rz`.
    pub directions: Vec<Direction>,
}

/// The stiffness of the rest of a larger structure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedSurroundings {
    /// Node and direction of each row and column.
    pub freedoms: Vec<(String, Direction)>,
    /// The rows, symmetric \[N/m, N, N·m\].
    pub stiffness: Vec<Vec<f64>>,
}

/// An actuator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedActuator {
    /// `MODULE/actuator/NAME`.
    pub path: String,
    /// Names of its two nodes.
    pub ends: [String; 2],
}

/// A gage.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedGage {
    /// `MODULE/sensor/NAME`.
    pub path: String,
    /// Name of its member.
    pub member: String,
    /// Length of its member \[m\].
    pub length_m: f64,
}

/// The readings of all gages under a unit force of one actuator.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExportedResponse {
    /// Path of the actuator.
    pub actuator: String,
    /// Elongation per force, in the order of `gages` \[m/N\].
    pub static_elongations_m_per_n: Vec<f64>,
}

impl Mechanics {
    /// Elongation of every gage under a constant unit force of every actuator (gages × actuators)
    /// [m/N]: L·K⁻¹·F_u.
    ///
    /// # Errors
    /// The stiffness matrix was made singular after assembly.
    pub fn static_gage_responses(&self) -> Result<DMatrix<f64>, ModelError> {
        let displacements = self.static_displacements(&self.actuator_map)?;
        Ok(DMatrix::from_fn(self.gage_map.nrows(), displacements.ncols(), |gage, actuator| {
            let displacement = displacements.column(actuator);
            self.gage_map.row(gage).iter().zip(displacement.iter()).map(|(l, u)| l * u).sum()
        }))
    }
}

impl Structure {
    /// The complete model for external finite-element programs.
    ///
    /// # Errors
    /// The structure does not yield a valid model.
    pub fn export(&self) -> Result<Export, ModelError> {
        let mechanics = Mechanics::assemble(self)?;
        let modes = Modes::of(&mechanics, self.damping, Some(FREQUENCIES))?;
        let actuators = self.exported_actuators();
        let responses = mechanics.static_gage_responses()?;
        let static_responses = actuators
            .iter()
            .zip(responses.column_iter())
            .map(|(actuator, column)| ExportedResponse {
                actuator: actuator.path.clone(),
                static_elongations_m_per_n: column.iter().copied().collect(),
            })
            .collect();
        Ok(Export {
            name: self.name.to_string(),
            notes: NOTES,
            nodes: self.exported_nodes(),
            members: self.exported_members(),
            nodal_masses_kg: self.nodal_masses_kg(),
            fixed: self.exported_fixed(),
            surroundings: self.exported_surroundings(),
            actuators,
            gages: self.exported_gages(),
            alpha_per_s: self.damping.alpha_per_s,
            beta_s: self.damping.beta_s,
            natural_frequencies_hz: modes.frequencies_hz().iter().copied().collect(),
            static_responses,
        })
    }

    fn node_names(&self, nodes: [usize; 2]) -> [String; 2] {
        nodes.map(|node| self.nodes[node].name.to_string())
    }

    fn exported_nodes(&self) -> Vec<ExportedNode> {
        let node = |node: &crate::structure::Node| ExportedNode {
            name: node.name.to_string(),
            position_m: node.position_m,
        };
        self.nodes.iter().map(node).collect()
    }

    fn exported_members(&self) -> Vec<ExportedMember> {
        let mut members = Vec::with_capacity(self.members.len());
        for (index, member) in self.members.iter().enumerate() {
            let owner = self.modules.iter().find(|module| module.members.contains(&index));
            let module = owner.map(|module| module.name.to_string()).unwrap_or_default();
            members.push(exported_member(member, module, self.node_names(member.ends)));
        }
        members
    }

    fn exported_surroundings(&self) -> Vec<ExportedSurroundings> {
        let each = self.surroundings.iter().map(|known| ExportedSurroundings {
            freedoms: (known.freedoms.iter())
                .map(|dof| (self.nodes[dof.node].name.to_string(), dof.direction))
                .collect(),
            stiffness: known
                .stiffness
                .row_iter()
                .map(|row| row.iter().copied().collect())
                .collect(),
        });
        each.collect()
    }

    fn exported_fixed(&self) -> Vec<ExportedFixed> {
        let held = self.nodes.iter().filter(|node| node.support.is_any());
        held.map(|node| ExportedFixed {
            node: node.name.to_string(),
            directions: node.support.directions().collect(),
        })
        .collect()
    }

    fn exported_actuators(&self) -> Vec<ExportedActuator> {
        let mut actuators = Vec::new();
        for module in &self.modules {
            actuators.extend(module.actuators.iter().map(|actuator| ExportedActuator {
                path: format!("{}/actuator/{}", module.name, actuator.name),
                ends: self.node_names(actuator.ends),
            }));
        }
        actuators
    }

    fn exported_gages(&self) -> Vec<ExportedGage> {
        let mut gages = Vec::new();
        for module in &self.modules {
            gages.extend(module.gages.iter().map(|gage| ExportedGage {
                path: format!("{}/sensor/{}", module.name, gage.name),
                member: self.gage_member(gage).name.to_string(),
                length_m: self.gage_length_m(gage),
            }));
        }
        gages
    }
}

fn exported_member(member: &Member, module: String, ends: [String; 2]) -> ExportedMember {
    let mut exported = ExportedMember {
        name: member.name.to_string(),
        module,
        ends,
        kind: "rod",
        area_m2: member.area_m2,
        iy_m4: None,
        iz_m4: None,
        j_m4: None,
        e_pa: member.effective_young_pa(),
        g_pa: member.effective_shear_pa(),
        density_kg_m3: member.density_kg_per_m3,
        local_y: None,
        local_z: None,
    };
    if let MemberKind::Beam {
        second_moment_y_m4,
        second_moment_z_m4,
        torsion_constant_m4,
        local_y,
    } = member.kind
    {
        exported.kind = "beam";
        exported.iy_m4 = Some(second_moment_y_m4);
        exported.iz_m4 = Some(second_moment_z_m4);
        exported.j_m4 = Some(torsion_constant_m4);
        exported.local_y = Some(local_y);
        exported.local_z = Some(crate::element::cross(member.axis, local_y));
    }
    exported
}
