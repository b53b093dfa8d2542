//! What `trusswatch ack` and `trusswatch reset` take.

use std::time::Duration;

use vocabulary::{ComponentPath, OperatorName};

use super::issuer;
use crate::failure::Failure;
use crate::link::{Link, seconds};

/// Acknowledge a fault
///
/// The component stays faulty; who acknowledged it and when is recorded in the module's
/// journal. Exit code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or
/// may not have been carried out; check with `trusswatch faults`. Exit code 5 if it was carried out, but the
/// module's disk has not got it: then a restart may forget it.
#[derive(Debug, clap::Args)]
pub(crate) struct AcknowledgeArguments {
    #[command(flatten)]
    pub(super) orders: Orders,
}

/// Reset a repaired component and resume monitoring
///
/// A diagnoser refuses as long as the evidence of the fault is still there, unless it is forced. Exit
/// code 1 if a diagnoser refuses, 4 if one does not answer: then the command may or may not have been
/// carried out; check with `trusswatch faults`. Exit code 5 if it was carried out, but the module's disk has
/// not got it: then a restart may forget it.
#[derive(Debug, clap::Args)]
pub(crate) struct ResetArguments {
    #[command(flatten)]
    pub(super) orders: Orders,
    /// Reset even though the evidence is still there
    #[arg(long)]
    pub(super) force: bool,
    /// Reset a component that was replaced: what it measures now is right, and its reference is shifted by that
    #[arg(long, conflicts_with = "force")]
    pub(super) re_tare: bool,
    /// Longest time to retry while a diagnoser refuses [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "force")]
    pub(super) wait: Option<Duration>,
}

/// What those take that are about components.
#[derive(Debug, clap::Args)]
pub(super) struct Orders {
    /// Components, e.g. `module1/sensor/g2`
    #[arg(required = true, value_name = "COMPONENT")]
    pub(super) components: Vec<ComponentPath>,
    /// Why
    #[arg(long, value_name = "TEXT")]
    pub(super) note: Option<String>,
    #[command(flatten)]
    pub(super) signature: Signature,
}

/// What every command takes.
#[derive(Debug, clap::Args)]
pub(super) struct Signature {
    /// Who issued the command, where no operator's certificate says so [default: the user and this machine, USER@HOST]
    #[arg(long, value_name = "WHO")]
    by: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) link: Link,
}

impl Signature {
    /// Who issued the command. `operator`: whose certificate is shown.
    pub(super) fn by(&self, operator: Option<&OperatorName>) -> Result<String, Failure> {
        issuer::name(self.by.as_deref(), operator)
    }
}
