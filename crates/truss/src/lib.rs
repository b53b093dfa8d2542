//! The structure: nodes, rods, beam columns, masses and modules, and the models made of them.
//!
//! The stages of processing, one file each:
//!
//! 1. [`Structure::from_toml`] reads a description (`description`), generates nodes and members from storeys
//!    (`generator`), and checks it, reporting all errors at once (`validation`).
//! 2. [`Structure::embedded`] extracts one module's own part, held by the condensed stiffness of the rest
//!    (`surroundings`), [`Structure::local`] the same clamped at its lower interface; [`Structure::parts`] separates parts that are not connected, [`Structure::row`] places copies side by side.
//! 3. [`Mechanics::assemble`] puts the members together (`element`) and condenses the rotations
//!    (`assembly`): mass, stiffness, actuator map (eq. 6) and gage map (eq. 7).
//! 4. [`Modes::of`] decouples the equations of motion into single oscillators.
//! 5. [`ModalStepper`] advances them exactly under inputs held constant over a step; [`ModalStepper::of_module`]
//!    creates one that maps a module's actuator forces to its gage elongations.
//!
//! All inputs and outputs are text and numbers. Equation numbers refer to Gienger, Schaut, Sawodny and Tarin, *Modular
//! distributed fault diagnosis for adaptive structures using local models*.
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets: [m] is no link")]

mod assembly;
mod block_matrix;
mod check;
mod cholesky;
mod description;
mod description_error;
mod direction;
mod element;
mod export;
mod generator;
mod local_structure;
mod mechanism;
mod member;
mod modal;
mod modal_stepper;
mod model_error;
mod oscillator;
mod parts;
mod perturbation;
mod place;
mod row;
mod storeys;
mod structure;
mod summary;
mod surroundings;
mod validation;
mod vectorised;
mod writer;

pub use assembly::{Dof, Mechanics};
pub use block_matrix::BlockMatrix;
pub use description_error::{DescriptionError, DescriptionErrors, DescriptionProblem};
pub use direction::{Direction, Support};
pub use export::{
    Export, ExportedActuator, ExportedFixed, ExportedGage, ExportedMember, ExportedNode,
    ExportedResponse, ExportedSurroundings,
};
pub use member::{Member, MemberKind};
pub use modal::Modes;
pub use modal_stepper::ModalStepper;
pub use model_error::ModelError;
pub use perturbation::Perturbation;
pub use place::ComponentLocation;
pub use row::copy_prefix;
pub use structure::{Actuator, Gage, Level, Module, Node, Rayleigh, Structure};
pub use summary::{ModeSummary, ModuleSummary, StructureSummary};
pub use surroundings::{Prediction, Surroundings};
pub use vectorised::vectorised;
