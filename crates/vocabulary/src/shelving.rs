//! An alarm that is shelved by an operator, or suppressed while its module is maintained (ISA-18.2). This is a property
//! beside the component's state; diagnosis continues meanwhile.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shortest and longest time of shelving and suppression \[s\]; the alarm always returns automatically.
pub const SHELVING_SECONDS: std::ops::RangeInclusive<u64> = 1..=31 * 24 * 3600;

/// Tolerated clock skew before the beginning of a span \[ns\].
const SET_BACK_NS: u64 = 60_000_000_000;

/// Start and end of the shelving or suppression of an alarm, by the clock of its module.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Span {
    /// When it began \[ns since 1970\].
    pub since_unix_ns: u64,
    /// When it ends \[ns since 1970\].
    pub until_unix_ns: u64,
}

impl Span {
    /// Whether it has expired. It also counts as expired if the clock is far before its beginning: a clock that was set
    /// back must not hide an alarm.
    #[must_use]
    pub fn is_over(&self, now_unix_ns: u64) -> bool {
        now_unix_ns >= self.until_unix_ns
            || now_unix_ns.saturating_add(SET_BACK_NS) < self.since_unix_ns
    }
}

/// Who shelved or suppressed an alarm, why and until when.
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

impl Shelving {
    /// From when to when.
    #[must_use]
    pub fn span(&self) -> Span {
        Span { since_unix_ns: self.since_unix_ns, until_unix_ns: self.until_unix_ns }
    }
}

/// How an alarm is hidden: shelved or suppressed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aside<'a> {
    /// This component alone.
    Shelved(&'a Shelving),
    /// While its module is maintained.
    Suppressed(&'a Shelving),
}
