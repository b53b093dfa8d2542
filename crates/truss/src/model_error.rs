//! Errors of models of structures whose description is valid.

use vocabulary::{ModuleName, NodeName};

/// The structure does not yield a valid model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// The stiffness matrix is singular.
    #[error("the structure is a mechanism: {what}")]
    Mechanism {
        /// What moves, in which directions, and what would hold it.
        what: String,
    },
    /// Without mass a node has no finite frequency.
    #[error(
        "node `{node}` can move but has no mass; give it `mass_kg` or its members a density above 0"
    )]
    Massless {
        /// The node.
        node: NodeName,
    },
    /// A node's mass is outside the permitted range.
    #[error(
        "node `{node}` has a mass of {mass_kg:e} kg; use one from 1e-9 to 1e15 kg, in the right unit"
    )]
    Mass {
        /// The node.
        node: NodeName,
        /// Its mass, the share of its members included \[kg\].
        mass_kg: f64,
    },
    /// A mode is outside the permitted range.
    #[error(
        "the structure has a mode of {frequency_hz:e} Hz and damping ratio {damping_ratio:e}; look for a stiffness, a mass or a damping in the wrong unit"
    )]
    Mode {
        /// Its natural frequency \[Hz\].
        frequency_hz: f64,
        /// Its damping ratio.
        damping_ratio: f64,
    },
    /// All nodes are fixed.
    #[error("every node is held, nothing can move; leave at least one node free")]
    NothingMoves,
    /// A factor of a perturbation is invalid.
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
    #[error("the time step is {value} s; use a time above 0 and up to 1 s")]
    TimeStep {
        /// The step \[s\].
        value: f64,
    },
    /// The structure has no module of this name.
    #[error("unknown module `{module}` of structure `{structure}`: expected one of {known}")]
    UnknownModule {
        /// The requested module.
        module: ModuleName,
        /// The structure.
        structure: String,
        /// The modules of the structure.
        known: String,
    },
}
