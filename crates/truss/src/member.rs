//! Rods and beams.

use vocabulary::{MaterialName, MemberName, SectionName};

/// A member stands upright if the cosine of its angle to the vertical exceeds this value.
const UPRIGHT: f64 = 0.95;

/// The internal forces that a member carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MemberKind {
    /// Pinned at both ends: axial force only.
    Rod,
    /// Euler–Bernoulli beam, rigidly joined to the other beams at its ends.
    Beam {
        /// Second moment of area about the local y axis [m⁴].
        second_moment_y_m4: f64,
        /// Second moment of area about the local z axis [m⁴].
        second_moment_z_m4: f64,
        /// St Venant torsion constant [m⁴].
        torsion_constant_m4: f64,
        /// Unit vector of the local y axis, perpendicular to the member.
        local_y: [f64; 3],
    },
}

/// A rod or a beam between two nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Unique in the structure.
    pub name: MemberName,
    /// Rod or beam.
    pub kind: MemberKind,
    /// Name of the cross-section in the description.
    pub section: SectionName,
    /// Name of the material in the description.
    pub material: MaterialName,
    /// Indices of the two end nodes; the local x axis runs from the first to the second.
    pub ends: [usize; 2],
    /// Distance between the ends \[m\].
    pub length_m: f64,
    /// Unit vector from the first end to the second.
    pub axis: [f64; 3],
    /// Cross-section \[m²\].
    pub area_m2: f64,
    /// Young's modulus \[Pa\].
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density \[kg/m³\].
    pub density_kg_per_m3: f64,
    /// Factor on E·A, E·I and G·J together; 1 unless perturbed.
    pub stiffness_factor: f64,
}

impl Member {
    /// Mass of the whole member \[kg\].
    #[must_use]
    pub fn mass_kg(&self) -> f64 {
        self.density_kg_per_m3 * self.area_m2 * self.length_m
    }

    /// Young's modulus with the stiffness factor \[Pa\].
    #[must_use]
    pub fn effective_young_pa(&self) -> f64 {
        self.young_pa * self.stiffness_factor
    }

    /// Shear modulus E / (2 (1 + ν)) with the stiffness factor \[Pa\].
    #[must_use]
    pub fn effective_shear_pa(&self) -> f64 {
        self.effective_young_pa() / (2.0 * (1.0 + self.poisson))
    }

    /// Whether the member stands upright: a column.
    #[must_use]
    pub fn is_upright(&self) -> bool {
        let [.., upwards] = self.axis;
        upwards.abs() > UPRIGHT
    }

    /// Whether the member is a beam.
    #[must_use]
    pub fn is_beam(&self) -> bool {
        matches!(self.kind, MemberKind::Beam { .. })
    }
}
