//! Why no model can be made of a structure that is well described.

use crate::direction::Direction;
use crate::ids::{ModuleName, NodeName};

/// A structure from which no model follows.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The stiffness matrix is singular.
    #[error(
        "the structure is a mechanism: node `{node}` is free to {}; add a member or a support that holds it",
        motion(*direction)
    )]
    Mechanism {
        /// Where the mechanism moves most.
        node: NodeName,
        /// The direction in which it does.
        direction: Direction,
    },
    /// Without mass a node has no finite frequency.
    #[error(
        "node `{node}` can move but has no mass; give it `mass_kg` or its members a density above 0"
    )]
    Massless {
        /// The node.
        node: NodeName,
    },
    /// Everything is held.
    #[error("every node is held, nothing can move; leave at least one node free")]
    NothingMoves,
    /// A factor of a perturbation is of no use.
    #[error("the factor on the {what} of `{name}` is {value}; use a finite number above 0")]
    Factor {
        /// Stiffness, mass or damping.
        what: &'static str,
        /// The member, node or structure that it belongs to.
        name: String,
        /// The factor.
        value: f64,
    },
    /// The step of a discrete model must be positive.
    #[error("the time step is {value} s; use a finite time above 0")]
    TimeStep {
        /// The step [s].
        value: f64,
    },
    /// The structure has no module of this name.
    #[error("`{module}` is no module of structure `{structure}`; it has {known}")]
    UnknownModule {
        /// The module asked for.
        module: ModuleName,
        /// The structure that was asked.
        structure: String,
        /// The modules it has.
        known: String,
    },
}

fn motion(direction: Direction) -> String {
    match direction {
        Direction::X | Direction::Y | Direction::Z => format!("move in {direction}"),
        Direction::RotationX => "turn about x".to_owned(),
        Direction::RotationY => "turn about y".to_owned(),
        Direction::RotationZ => "turn about z".to_owned(),
    }
}
