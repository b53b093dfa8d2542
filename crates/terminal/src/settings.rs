//! Where the view looks, and who gives orders.

use std::time::Duration;

use vocabulary::{ModuleName, OperatorName, StructureName};

/// What the view is started with.
#[derive(Debug, Clone)]
pub struct ViewSettings {
    /// How the places that it looks at are called.
    pub places: String,
    /// Only this structure; otherwise every one that is seen.
    pub structure: Option<StructureName>,
    /// Modules that should be there.
    pub expected: Vec<ModuleName>,
    /// Longest wait for each answer.
    pub timeout: Duration,
    /// Who gives orders, or why none may be given.
    pub issuer: Result<OrderIssuer, String>,
    /// Whether colours are shown beside symbols and words.
    pub colours: bool,
}

/// Who gives orders.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OrderIssuer {
    /// The name that goes into the journal.
    pub by: String,
    /// The operator whose certificate the session shows, if it shows one's.
    pub operator: Option<OperatorName>,
}
