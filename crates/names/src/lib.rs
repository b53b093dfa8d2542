//! What everything is called: structures, modules and components, steps and runs, and the vocabulary of faults. And how
//! what is numbered is delivered.
//! The lowest crate: it knows no mechanics, no network and no file.
#![allow(rustdoc::broken_intra_doc_links, reason = "units stand in brackets: [m] is no link")]

pub mod delivery;
pub mod fault;

mod component;
mod name;
mod printable;
mod quotation;
mod step;

pub use component::{Component, ComponentError, ComponentKind, ComponentPath, Mention};
pub use name::{
    ActuatorName, GageName, MAX_NAME_LENGTH, MaterialName, MemberName, ModuleName, NameError,
    NodeName, OperatorName, SectionName, StructureName,
};
pub use printable::{is_printable, printable, printable_lines};
pub use quotation::quotation;
pub use step::{RunId, Step};
