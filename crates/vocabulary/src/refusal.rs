//! Why a question or a command was refused.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::encoding::Message;

/// The error reply to a query: nothing was done, nothing is known.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Refused {
    /// Why, in words.
    pub reason: String,
}

impl Message for Refused {
    const WHAT: &'static str = "refusal";
}
