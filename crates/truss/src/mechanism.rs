//! What moves in a mechanism, in words: one node, a group of nodes that moves as a rigid body, or several nodes each in
//! its own direction.

use nalgebra::{Matrix3, Vector3};

use crate::assembly::Dof;
use crate::direction::Direction;
use crate::structure::Structure;

/// A node that moves less than this share of the largest motion is at rest: rounding.
const AT_REST: f64 = 1e-4;
/// A direction is named if the motion along it is at least this share of the largest.
const NAMED: f64 = 0.2;
/// Most names in a list.
const NAMES: usize = 8;
/// Members that hold a node in space.
const HOLDING: usize = 3;
const AXES: [&str; 3] = ["x", "y", "z"];

/// The motion of a rigid body: the translation of its centre, and its rotation.
struct RigidMotion {
    centre: Vector3<f64>,
    translation: Vector3<f64>,
    rotation: Vector3<f64>,
}

/// What moves, and what would hold it. `motion` has a value for each degree of freedom of `dofs`.
pub(crate) fn in_words(structure: &Structure, dofs: &[Dof], motion: &[f64]) -> String {
    let is_held =
        |direction: &&Direction| structure.nodes.iter().any(|node| node.support.holds(**direction));
    let translations = Direction::ALL.iter().filter(|direction| !direction.is_rotation());
    let free: Vec<&str> = translations
        .filter(|direction| !is_held(direction))
        .map(|direction| AXES[direction.index()])
        .collect();
    if structure.surroundings.is_empty() && !free.is_empty() {
        let axes = free.join(" and ");
        return format!("no support holds the structure in {axes}; add one");
    }
    let mut moved = vec![Vector3::zeros(); structure.nodes.len()];
    for (dof, value) in dofs.iter().zip(motion) {
        if !dof.direction.is_rotation() {
            moved[dof.node][dof.direction.index()] = *value;
        }
    }
    let largest = moved.iter().map(Vector3::amax).fold(0.0, f64::max);
    let moving: Vec<usize> =
        (0..moved.len()).filter(|node| moved[*node].amax() > AT_REST * largest).collect();
    match moving[..] {
        [] => turning(structure, dofs, motion),
        [node] => {
            let (name, along) = (&structure.nodes[node].name, axes(&moved[node]));
            format!(
                "node `{name}` is free to move in {along}; add a member or a support that holds it"
            )
        }
        _ => match RigidMotion::of(structure, &moving, &moved, largest) {
            Some(body) => body.in_words(structure, &moved, largest),
            None => separately(structure, &moving, &moved),
        },
    }
}

/// Nodes of beams that only turn.
fn turning(structure: &Structure, dofs: &[Dof], motion: &[f64]) -> String {
    let largest = motion.iter().map(|value| value.abs()).fold(0.0, f64::max);
    // The first of equals, so that rounding does not choose.
    let found = dofs.iter().zip(motion).find(|(_, value)| value.abs() > (1.0 - 1e-6) * largest);
    let dof = found.map_or(Dof { node: 0, direction: Direction::RotationX }, |(dof, _)| *dof);
    let (name, about) = (&structure.nodes[dof.node].name, AXES[dof.direction.index() % 3]);
    format!("node `{name}` is free to turn about {about}; add a member or a support that holds it")
}

fn separately(structure: &Structure, moving: &[usize], moved: &[Vector3<f64>]) -> String {
    let node =
        |node: &usize| format!("`{}` in {}", structure.nodes[*node].name, axes(&moved[*node]));
    let nodes = list(moving.iter().map(node).collect());
    format!(
        "nodes are free to move: {nodes}; add members, such as diagonals, or supports that hold them"
    )
}

impl RigidMotion {
    /// The motion of these nodes, if they move as one body.
    fn of(
        structure: &Structure,
        nodes: &[usize],
        moved: &[Vector3<f64>],
        largest: f64,
    ) -> Option<Self> {
        let place = |node: &usize| Vector3::from(structure.nodes[*node].position_m);
        #[expect(clippy::cast_precision_loss, reason = "the number of nodes")]
        let count = nodes.len() as f64;
        let centre = nodes.iter().map(place).sum::<Vector3<f64>>() / count;
        let translation = nodes.iter().map(|node| moved[*node]).sum::<Vector3<f64>>() / count;
        // Least squares: Σ (|d|²·1 − d·dᵀ)·ω = Σ d × u.
        let (mut inertia, mut moment) = (Matrix3::zeros(), Vector3::zeros());
        for node in nodes {
            let (arm, own) = (place(node) - centre, moved[*node] - translation);
            inertia += Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
            moment += arm.cross(&own);
        }
        let least = 1e-9 * inertia.amax();
        // Nodes on a line have no rotation about it.
        let rotation = inertia.svd(true, true).solve(&moment, least).ok()?;
        let body = Self { centre, translation, rotation };
        nodes.iter().all(|node| body.moves(&place(node), &moved[*node], largest)).then_some(body)
    }

    /// Whether a node at this place moves with the body.
    fn moves(&self, place: &Vector3<f64>, moved: &Vector3<f64>, largest: f64) -> bool {
        let expected = self.translation + self.rotation.cross(&(place - self.centre));
        (moved - expected).amax() < AT_REST * largest
    }

    /// The nodes that move with the body, and those on its axis that it holds.
    fn nodes(&self, structure: &Structure, moved: &[Vector3<f64>], largest: f64) -> Vec<usize> {
        let is_moving = |node: usize| moved[node].amax() > AT_REST * largest;
        let is_held = |node: usize| {
            let ends = structure.members.iter().map(|member| member.ends);
            let joined =
                ends.filter(|&[a, b]| a == node && is_moving(b) || b == node && is_moving(a));
            let support = structure.nodes[node].support;
            joined.count() >= HOLDING && !Direction::ALL.iter().any(|d| support.holds(*d))
        };
        let is_of_body = |node: &usize| {
            let place = Vector3::from(structure.nodes[*node].position_m);
            is_moving(*node) || is_held(*node) && self.moves(&place, &moved[*node], largest)
        };
        (0..moved.len()).filter(is_of_body).collect()
    }

    fn in_words(&self, structure: &Structure, moved: &[Vector3<f64>], largest: f64) -> String {
        let body = self.nodes(structure, moved, largest);
        let names = body.iter().map(|node| format!("`{}`", structure.nodes[*node].name)).collect();
        let between = structure.members.iter().filter(|member| {
            let [from, to] = member.ends.map(|end| body.contains(&end));
            from != to
        });
        let between: Vec<_> = between.map(|member| format!("`{}`", member.name)).collect();
        let reach = body
            .iter()
            .map(|node| (Vector3::from(structure.nodes[*node].position_m) - self.centre).norm());
        let turns = self.rotation.norm() * reach.fold(0.0, f64::max) > AT_REST * largest;
        let motion = if turns {
            format!("turn together about {}", axes(&self.rotation))
        } else {
            format!("move together in {}", axes(&self.translation))
        };
        let hold = if between.is_empty() {
            "add members or supports that hold them".to_owned()
        } else {
            let between = list(between);
            format!(
                "the members that join them to the rest do not prevent it ({between}); brace them with a diagonal"
            )
        };
        format!("nodes {} {motion}; {hold}", list(names))
    }
}

/// The axes along which a vector is long.
fn axes(vector: &Vector3<f64>) -> String {
    let is_named = |axis: &usize| vector[*axis].abs() >= NAMED * vector.amax();
    (0..3).filter(is_named).map(|axis| AXES[axis]).collect::<Vec<_>>().join(" and ")
}

fn list(mut names: Vec<String>) -> String {
    let more = names.len().saturating_sub(NAMES);
    names.truncate(NAMES);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", names.join(", "))
}
