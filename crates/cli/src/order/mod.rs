//! `trusswatch ack` and `trusswatch reset`: what an operator orders the diagnosers to do.

mod arguments;
mod carry_out;
mod giver;
mod homes;
mod outcome;
mod report;

use daemon::session;
use wire::OrderKind;

use crate::failure::Failure;
use crate::link;
pub(crate) use arguments::{AcknowledgeArguments, ResetArguments};
use carry_out::{Manner, carry_out};

/// Runs `trusswatch ack`.
pub(crate) fn acknowledge(arguments: &AcknowledgeArguments) -> Result<(), Failure> {
    run(&arguments.orders, Manner { kind: OrderKind::Acknowledge, force: false, wait: None })
}

/// Runs `trusswatch reset`.
pub(crate) fn reset(arguments: &ResetArguments) -> Result<(), Failure> {
    let (force, wait) = (arguments.force, arguments.wait);
    run(&arguments.orders, Manner { kind: OrderKind::Reset, force, wait })
}

fn run(orders: &arguments::Orders, manner: Manner) -> Result<(), Failure> {
    let giver = orders.giver()?;
    let told = link::block_on(async {
        let session = orders.link.open().await?;
        let told = carry_out(&session, orders, &giver, manner).await;
        session::close(&session).await;
        told
    })?;
    report::tell(&told, orders.json)?;
    outcome::conclude(&told)
}
