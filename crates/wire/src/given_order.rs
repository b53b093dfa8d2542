//! The order that led to a transition.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::order::OrderKind;

/// What was ordered, as it is reported afterwards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "OrderKind")]
pub enum GivenOrderKind {
    /// A person has seen the fault.
    Acknowledge,
    /// The component is repaired.
    Reset,
    /// Its alarm is set aside for a time.
    Shelve,
    /// Its alarm counts again.
    Unshelve,
    /// Its alarm is set aside while its module is maintained.
    Suppress,
    /// Its alarm counts again.
    Unsuppress,
    /// The time for which its alarm was set aside is over; nobody ordered that.
    Lapse,
}

impl GivenOrderKind {
    /// Whether it is about the alarm being set aside, and leaves the state as it is.
    #[must_use]
    pub fn is_about_shelving(self) -> bool {
        match self {
            GivenOrderKind::Acknowledge | GivenOrderKind::Reset => false,
            GivenOrderKind::Shelve
            | GivenOrderKind::Unshelve
            | GivenOrderKind::Suppress
            | GivenOrderKind::Unsuppress
            | GivenOrderKind::Lapse => true,
        }
    }
}

impl From<OrderKind> for GivenOrderKind {
    fn from(kind: OrderKind) -> Self {
        match kind {
            OrderKind::Acknowledge => GivenOrderKind::Acknowledge,
            OrderKind::Reset => GivenOrderKind::Reset,
            OrderKind::Shelve => GivenOrderKind::Shelve,
            OrderKind::Unshelve => GivenOrderKind::Unshelve,
            OrderKind::Suppress => GivenOrderKind::Suppress,
            OrderKind::Unsuppress => GivenOrderKind::Unsuppress,
        }
    }
}

/// An order as it stands in the transition that it led to.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct GivenOrder {
    /// What was ordered.
    pub order: GivenOrderKind,
    /// By whom.
    pub by: String,
    /// In whose name, if `by` is a program that a person uses, such as the web page.
    pub on_behalf_of: Option<String>,
    /// Why.
    pub note: Option<String>,
    /// Whether it was forced.
    pub force: bool,
    /// Whether the reference of the component was shifted to what it measured.
    pub re_tare: bool,
    /// When it was given, if the alarm was set aside \[ns since 1970\].
    pub since_unix_ns: Option<u64>,
    /// When the alarm counts again, if it was set aside \[ns since 1970\]; of a lapse, when it was noticed.
    pub until_unix_ns: Option<u64>,
}
