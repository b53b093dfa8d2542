//! What an operator orders a diagnoser to do, and what becomes of it.
//!
//! An order is the payload of a query on `{module}/command/acknowledge` or `{module}/command/reset`. The
//! reply is [`Obeyed`], which says whether the transition is in the journal, or [`crate::Refused`].

use names::{Component, Mention};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;
use crate::fault_state::FaultState;

/// Longest name and longest note that are accepted, in bytes.
pub const MAX_ORDER_TEXT: usize = 500;

/// What is ordered; the key says it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OrderKind {
    /// A person has seen the fault.
    Acknowledge,
    /// The component is repaired.
    Reset,
}

impl OrderKind {
    /// The name in keys and messages.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            OrderKind::Acknowledge => "acknowledge",
            OrderKind::Reset => "reset",
        }
    }
}

/// An order concerning one component.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Order {
    /// The component, with its module or without: the key says which it is.
    pub component: Mention,
    /// Who issued the command.
    pub by: String,
    /// Why.
    #[serde(default)]
    pub note: Option<String>,
    /// Reset even though the evidence is still there.
    #[serde(default)]
    pub force: bool,
    /// Reset, for the component was replaced and what it measures now is right: its reference is shifted by that.
    #[serde(default)]
    pub re_tare: bool,
}

impl Order {
    /// What is wrong with the texts of an order, if anything is.
    ///
    /// # Errors
    /// No name is given, a text is too long, or two manners exclude each other.
    pub fn check(&self) -> Result<(), String> {
        if self.force && self.re_tare {
            return Err("`force` and `re_tare` exclude each other; use one".to_owned());
        }
        if self.by.trim().is_empty() {
            return Err("`by` is empty; state who issues the command".to_owned());
        }
        let texts = [("by", Some(&self.by)), ("note", self.note.as_ref())];
        for (name, text) in texts {
            let length = text.map_or(0, String::len);
            if length > MAX_ORDER_TEXT {
                return Err(format!("`{name}` has {length} bytes; use at most {MAX_ORDER_TEXT}"));
            }
        }
        Ok(())
    }
}

/// The order was obeyed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Obeyed {
    /// The component.
    pub component: Component,
    /// Its state now.
    pub state: FaultState,
    /// The sequence number of the transition.
    pub sequence: u64,
    /// Whether the journal has it. If not, a disk is full or hangs, and a restart may forget the order.
    #[serde(default = "yes")]
    pub durable: bool,
}

/// Former versions replied with what the journal had.
fn yes() -> bool {
    true
}

impl Message for Order {
    const WHAT: &'static str = "order";
}

impl Message for Obeyed {
    const WHAT: &'static str = "order's reply";
}
