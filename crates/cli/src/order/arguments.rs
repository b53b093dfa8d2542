//! What `trusswatch ack` and `trusswatch reset` take.

use std::time::Duration;

use truss::ids::ComponentPath;
use wire::Order;

use super::giver::{self, Giver};
use crate::failure::Failure;
use crate::link::{Link, seconds};

/// Say that a person has seen a fault
///
/// The component stays faulty, but no longer unseen; who acknowledged it and when is in the module's
/// journal. Exit code 1 if a diagnoser refuses, and 4 if one does not answer: then the order may or may
/// not have been carried out, and `trusswatch faults` tells.
#[derive(Debug, clap::Args)]
pub(crate) struct AcknowledgeArguments {
    #[command(flatten)]
    pub(super) orders: Orders,
}

/// Say that a component is repaired, so that it is watched anew
///
/// A diagnoser refuses as long as the evidence of the fault is still there, unless it is forced. Exit
/// code 1 if a diagnoser refuses, and 4 if one does not answer: then the order may or may not have been
/// carried out, and `trusswatch faults` tells.
#[derive(Debug, clap::Args)]
pub(crate) struct ResetArguments {
    #[command(flatten)]
    pub(super) orders: Orders,
    /// Reset even though the evidence is still there
    #[arg(long)]
    pub(super) force: bool,
    /// Try again for so long while a diagnoser refuses [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, conflicts_with = "force")]
    pub(super) wait: Option<Duration>,
}

/// What both take.
#[derive(Debug, clap::Args)]
pub(super) struct Orders {
    /// Components, e.g. `module1/sensor/g2`
    #[arg(required = true, value_name = "COMPONENT")]
    pub(super) components: Vec<ComponentPath>,
    /// Who orders it [default: the user and this machine, USER@HOST]
    #[arg(long, value_name = "WHO")]
    by: Option<String>,
    /// Why
    #[arg(long, value_name = "TEXT")]
    note: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    pub(super) json: bool,
    #[command(flatten)]
    pub(super) link: Link,
}

impl Orders {
    /// Who orders it and why. Checked before anything is sent.
    pub(super) fn giver(&self) -> Result<Giver, Failure> {
        let by = self.by.clone().or_else(giver::from_surroundings);
        let by = by.ok_or_else(|| Failure::usage("who orders it is not known; use --by WHO"))?;
        let giver = Giver { by, note: self.note.clone() };
        for component in &self.components {
            let order: Order = giver.order(component, false);
            order.check().map_err(Failure::usage)?;
        }
        Ok(giver)
    }
}
