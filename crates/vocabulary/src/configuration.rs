//! What a diagnoser was set up with: the answer to a query, so that a recording can be replayed without its files.

use crate::{ModuleName, StructureName};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::encoding::Message;

/// The setup of a module's diagnoser.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ModuleConfiguration {
    /// The structure.
    pub structure: StructureName,
    /// The module.
    pub module: ModuleName,
    /// Version of the software.
    pub software: String,
    /// Distinguishes this setup from others.
    pub fingerprint: String,
    /// Fingerprint of the thresholds, as in the status.
    pub thresholds: String,
    /// Fingerprint of the reference, if there is one.
    pub reference: Option<String>,
    /// Everything that a verdict depends on: the description of the module's part of the structure, hydraulics, noise,
    /// the settings of detection and isolation, thresholds, peers, the reference. Its form is that of `diagnosis`.
    pub setup: Value,
    /// When this was sent \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl Message for ModuleConfiguration {
    const WHAT: &'static str = "configuration";
}
