//! An alarm that is set aside for a time: shelved by an operator, or suppressed while its module is maintained
//! (ISA-18.2). Not a state of the component but a property beside it: diagnosis goes on underneath.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shortest and longest time for which an alarm may be set aside \[s\]; it always comes back by itself.
pub const SHELVING_SECONDS: std::ops::RangeInclusive<u64> = 1..=31 * 24 * 3600;

/// By whom, why and until when an alarm is set aside.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Shelving {
    /// Since when \[ns since 1970\].
    pub since_unix_ns: u64,
    /// When it ends by itself \[ns since 1970\].
    pub until_unix_ns: u64,
    /// By whom.
    pub by: String,
    /// In whose name, if `by` is a program that a person uses, such as the web page.
    pub on_behalf_of: Option<String>,
    /// Why.
    pub reason: String,
}

/// That an alarm is set aside, and which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aside<'a> {
    /// This component alone.
    Shelved(&'a Shelving),
    /// While its module is maintained.
    Suppressed(&'a Shelving),
}
