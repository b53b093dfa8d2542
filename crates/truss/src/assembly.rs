//! The equations of motion of a whole structure (eq. 6 and 7).
//!
//! M·ξ̈ + D·ξ̇ + K·ξ = F_u·u and ζ = L·ξ, with ξ the displacements of the nodes in Cartesian coordinates, u the
//! actuator forces and ζ the elongations that the gages read. M is lumped: half of each member and the share of the
//! storey at each node. Nodes of beams also have rotations, which have no mass and are condensed statically.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector};

use crate::cholesky::{Cholesky, Singular};
use crate::direction::Direction;
use crate::element;
use crate::mechanism;
use crate::model_error::ModelError;
use crate::structure::Structure;

/// The permitted masses of nodes \[kg\]; a mass outside this range is in a wrong unit.
const MASSES_KG: RangeInclusive<f64> = 1e-9..=1e15;

/// One degree of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Dof {
    /// Index of the node in [`Structure::nodes`].
    pub node: usize,
    /// The direction of motion.
    pub direction: Direction,
}

/// Mass, stiffness, gage map and actuator map over the translations that are not fixed.
#[derive(Debug, Clone)]
pub struct Mechanics {
    /// The degrees of freedom, node by node, x before y before z.
    pub dofs: Vec<Dof>,
    /// Condensed stiffness K (dofs × dofs), symmetric \[N/m\].
    pub stiffness: DMatrix<f64>,
    /// Diagonal of the lumped mass matrix M (dofs) \[kg\].
    pub mass: DVector<f64>,
    /// Elongation per displacement, L of eq. 7 (gages × dofs) \[m/m\]; the gages of all modules in
    /// the order of the modules, positive in tension.
    pub gage_map: DMatrix<f64>,
    /// Nodal force per actuator force, F_u of eq. 6 (dofs × actuators) \[N/N\]; the actuators of all
    /// modules in the order of the modules, positive pushes the ends apart.
    pub actuator_map: DMatrix<f64>,
}

impl Mechanics {
    /// Assembles and condenses the matrices.
    ///
    /// # Errors
    /// A mechanism, with what moves; a node without mass or with an absurd one; a structure
    /// in which nothing can move; a perturbation factor that is not above 0.
    pub fn assemble(structure: &Structure) -> Result<Mechanics, ModelError> {
        check_factors(structure)?;
        let freedoms = Freedoms::number(structure);
        if freedoms.translations == 0 {
            return Err(ModelError::NothingMoves);
        }
        let whole = assemble_stiffness(structure, &freedoms);
        let stiffness = condense(&whole, freedoms.translations)
            .map_err(|free| freedoms.mechanism(structure, &free, freedoms.translations))?;
        if let Err(free) = Cholesky::of(&stiffness) {
            return Err(freedoms.mechanism(structure, &free, 0));
        }
        let dofs = freedoms.dofs[..freedoms.translations].to_vec();
        Ok(Mechanics {
            mass: lumped_mass(structure, &dofs)?,
            gage_map: gage_map(structure, &freedoms),
            actuator_map: actuator_map(structure, &freedoms),
            dofs,
            stiffness,
        })
    }

    /// Index of a degree of freedom; `None` if it is fixed or a rotation.
    #[must_use]
    pub fn dof_index(&self, node: usize, direction: Direction) -> Option<usize> {
        self.dofs.iter().position(|dof| dof.node == node && dof.direction == direction)
    }

    /// Displacements under constant forces (dofs × load cases) \[m per N\], K⁻¹·forces.
    ///
    /// # Errors
    /// The stiffness matrix was made singular after assembly.
    pub fn static_displacements(&self, forces: &DMatrix<f64>) -> Result<DMatrix<f64>, ModelError> {
        let factor = Cholesky::of(&self.stiffness).map_err(|_| ModelError::NothingMoves)?;
        Ok(factor.solve(forces))
    }

    /// The elastic elongation read by each gage in equilibrium, per unit of free axial strain of each member (gages ×
    /// members) \[m\]. Under a uniform change of temperature ΔT a free member would strain by α·ΔT; the part that the
    /// other members prevent is elastic. `structure` must be the one that these mechanics were assembled from.
    ///
    /// # Errors
    /// The stiffness matrix was made singular after assembly.
    pub fn strain_response(&self, structure: &Structure) -> Result<DMatrix<f64>, ModelError> {
        // Row g of the gage map, applied as forces, gives displacements; by reciprocity they are the elongations of
        // gage g under any forces.
        let displacements = self.static_displacements(&self.gage_map.transpose())?;
        let freedoms = Freedoms::number(structure);
        let gages: Vec<_> = structure.modules.iter().flat_map(|module| &module.gages).collect();
        let mut response = DMatrix::zeros(gages.len(), structure.members.len());
        for (column, member) in structure.members.iter().enumerate() {
            let force = member.effective_young_pa() * member.area_m2;
            for (freedom, share) in opposed_pair(structure, &freedoms, member.ends) {
                for row in 0..gages.len() {
                    response[(row, column)] += displacements[(freedom, row)] * share * force;
                }
            }
        }
        for (row, gage) in gages.iter().enumerate() {
            response[(row, gage.member)] -= structure.gage_length_m(gage);
        }
        Ok(response)
    }
}

/// The numbering of the degrees of freedom: translations first, then rotations.
pub(crate) struct Freedoms {
    pub(crate) dofs: Vec<Dof>,
    translations: usize,
    /// Index in `dofs` of each direction of each node.
    index: Vec<[Option<usize>; 6]>,
}

impl Freedoms {
    pub(crate) fn number(structure: &Structure) -> Freedoms {
        let mut turns = vec![false; structure.nodes.len()];
        for member in structure.members.iter().filter(|member| member.is_beam()) {
            for end in member.ends {
                turns[end] = true;
            }
        }
        let mut dofs = Vec::new();
        for rotation in [false, true] {
            for (node, described) in structure.nodes.iter().enumerate() {
                let free = Direction::ALL.into_iter().filter(|&direction| {
                    direction.is_rotation() == rotation
                        && !described.support.holds(direction)
                        && (!rotation || turns[node])
                });
                dofs.extend(free.map(|direction| Dof { node, direction }));
            }
        }
        let translations = dofs.iter().filter(|dof| !dof.direction.is_rotation()).count();
        let mut index = vec![[None; 6]; structure.nodes.len()];
        for (position, dof) in dofs.iter().enumerate() {
            index[dof.node][dof.direction.index()] = Some(position);
        }
        Freedoms { dofs, translations, index }
    }

    /// The twelve degrees of freedom of a member; `None` where fixed.
    fn of_ends(&self, [from, to]: [usize; 2]) -> [Option<usize>; 12] {
        std::array::from_fn(|i| self.index[if i < 6 { from } else { to }][i % 6])
    }

    fn mechanism(&self, structure: &Structure, free: &Singular, first: usize) -> ModelError {
        let dofs = &self.dofs[first..];
        ModelError::Mechanism { what: mechanism::in_words(structure, dofs, free.motion.as_slice()) }
    }
}

fn check_factors(structure: &Structure) -> Result<(), ModelError> {
    let usable = |value: f64| value.is_finite() && value > 0.0;
    let member = structure.members.iter().find(|member| !usable(member.stiffness_factor));
    if let Some(member) = member {
        let (name, value) = (member.name.to_string(), member.stiffness_factor);
        return Err(ModelError::Factor { what: "stiffness", name, value });
    }
    if let Some(node) = structure.nodes.iter().find(|node| !usable(node.mass_factor)) {
        let (name, value) = (node.name.to_string(), node.mass_factor);
        return Err(ModelError::Factor { what: "mass", name, value });
    }
    Ok(())
}

fn assemble_stiffness(structure: &Structure, freedoms: &Freedoms) -> DMatrix<f64> {
    let size = freedoms.dofs.len();
    let mut whole = DMatrix::zeros(size, size);
    for member in &structure.members {
        let stiffness = element::stiffness(member);
        let places = freedoms.of_ends(member.ends);
        for (row, place) in stiffness.iter().zip(places) {
            let Some(i) = place else { continue };
            for (value, other) in row.iter().zip(places) {
                if let Some(j) = other {
                    whole[(i, j)] += value;
                }
            }
        }
    }
    for known in &structure.surroundings {
        let places: Vec<_> = known
            .freedoms
            .iter()
            .map(|dof| freedoms.index[dof.node][dof.direction.index()])
            .collect();
        for (row, place) in places.iter().enumerate() {
            for (column, other) in places.iter().enumerate() {
                if let (Some(i), Some(j)) = (*place, *other) {
                    whole[(i, j)] += known.stiffness[(row, column)];
                }
            }
        }
    }
    whole
}

/// The stiffness of a structure between some of its degrees of freedom, while the others at the nodes that its members
/// touch are free of load.
///
/// # Errors
/// The others can move without resistance.
pub(crate) fn condensed_stiffness(
    structure: &Structure,
    freedoms: &Freedoms,
    kept: &[Dof],
    touched: &BTreeSet<usize>,
) -> Result<DMatrix<f64>, ModelError> {
    let stiffness = assemble_stiffness(structure, freedoms);
    let is_other = |dof: &&Dof| touched.contains(&dof.node) && !kept.contains(dof);
    let order: Vec<Dof> =
        kept.iter().chain(freedoms.dofs.iter().filter(is_other)).copied().collect();
    let place = |dof: &Dof| freedoms.index[dof.node][dof.direction.index()];
    let places: Vec<usize> = order.iter().filter_map(place).collect();
    let sorted =
        DMatrix::from_fn(places.len(), places.len(), |i, j| stiffness[(places[i], places[j])]);
    condense(&sorted, kept.len()).map_err(|free| ModelError::Mechanism {
        what: mechanism::in_words(structure, &order[kept.len()..], free.motion.as_slice()),
    })
}

/// Static condensation of the rotations. They have neither mass nor load, so K_rt·u + K_rr·φ = 0 holds at all times,
/// and K = K_tt − K_tr·K_rr⁻¹·K_rt is the exact stiffness between the translations while the rotations are free
/// \[N/m\].
///
/// The first `translations` rows and columns of `stiffness` are the translations.
///
/// # Errors
/// A combination of rotations without resistance, numbered from the first rotation.
fn condense(stiffness: &DMatrix<f64>, translations: usize) -> Result<DMatrix<f64>, Singular> {
    let rotations = stiffness.nrows() - translations;
    let mut condensed = stiffness.view((0, 0), (translations, translations)).into_owned();
    if rotations == 0 {
        return Ok(condensed);
    }
    let own = stiffness.view((translations, translations), (rotations, rotations)).into_owned();
    let coupling = stiffness.view((translations, 0), (rotations, translations)).into_owned();
    let following = Cholesky::of(&own)?.solve(&coupling);
    for column in 0..translations {
        // Only the lower triangle is computed, so that the result is symmetric to the last bit.
        for row in column..translations {
            let relief: f64 =
                (0..rotations).map(|r| coupling[(r, row)] * following[(r, column)]).sum();
            condensed[(row, column)] -= relief;
            condensed[(column, row)] = condensed[(row, column)];
        }
    }
    Ok(condensed)
}

fn lumped_mass(structure: &Structure, dofs: &[Dof]) -> Result<DVector<f64>, ModelError> {
    let masses = structure.nodal_masses_kg();
    if let Some(dof) = dofs.iter().find(|dof| masses[dof.node] <= 0.0) {
        return Err(ModelError::Massless { node: structure.nodes[dof.node].name.clone() });
    }
    if let Some(dof) = dofs.iter().find(|dof| !MASSES_KG.contains(&masses[dof.node])) {
        let node = structure.nodes[dof.node].name.clone();
        return Err(ModelError::Mass { node, mass_kg: masses[dof.node] });
    }
    Ok(DVector::from_iterator(dofs.len(), dofs.iter().map(|dof| masses[dof.node])))
}

/// The degrees of freedom and shares of a pair of unit forces that pushes two nodes apart. The same numbers are the
/// change of the distance between the nodes per unit of displacement.
fn opposed_pair(structure: &Structure, freedoms: &Freedoms, ends: [usize; 2]) -> Vec<(usize, f64)> {
    let along = structure.unit_vector(ends);
    let mut pair = Vec::with_capacity(6);
    for (end, sign) in ends.into_iter().zip([-1.0, 1.0]) {
        for (place, component) in freedoms.index[end].iter().zip(along) {
            if let Some(freedom) = place {
                pair.push((*freedom, sign * component));
            }
        }
    }
    pair
}

fn gage_map(structure: &Structure, freedoms: &Freedoms) -> DMatrix<f64> {
    let gages: Vec<_> = structure.modules.iter().flat_map(|module| &module.gages).collect();
    let mut map = DMatrix::zeros(gages.len(), freedoms.translations);
    for (row, gage) in gages.iter().enumerate() {
        let ends = structure.gage_member(gage).ends;
        for (freedom, value) in opposed_pair(structure, freedoms, ends) {
            map[(row, freedom)] = value;
        }
    }
    map
}

fn actuator_map(structure: &Structure, freedoms: &Freedoms) -> DMatrix<f64> {
    let actuators: Vec<_> = structure.modules.iter().flat_map(|module| &module.actuators).collect();
    let mut map = DMatrix::zeros(freedoms.translations, actuators.len());
    for (column, actuator) in actuators.iter().enumerate() {
        for (freedom, value) in opposed_pair(structure, freedoms, actuator.ends) {
            map[(freedom, column)] = value;
        }
    }
    map
}
