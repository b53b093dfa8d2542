//! `trusswatch ack` and `trusswatch reset`: commands of an operator to the diagnosers.

mod arguments;
mod carry_out;
mod homes;
mod issuer;
mod outcome;
mod report;

use observer::Command;
use wire::OrderKind;

use crate::failure::Failure;
use crate::link;
pub(crate) use arguments::{AcknowledgeArguments, ResetArguments};
use carry_out::{Manner, carry_out};

/// Runs `trusswatch ack`.
pub(crate) fn acknowledge(arguments: &AcknowledgeArguments) -> Result<(), Failure> {
    let kind = OrderKind::Acknowledge;
    run(&arguments.orders, Manner { kind, force: false, re_tare: false, wait: None })
}

/// Runs `trusswatch reset`.
pub(crate) fn reset(arguments: &ResetArguments) -> Result<(), Failure> {
    let ResetArguments { orders, force, re_tare, wait } = arguments;
    let kind = OrderKind::Reset;
    run(orders, Manner { kind, force: *force, re_tare: *re_tare, wait: *wait })
}

fn run(orders: &arguments::Orders, manner: Manner) -> Result<(), Failure> {
    let target = orders.link.target()?;
    let operator = target.operator();
    let issuer = orders.issuer(operator.as_ref())?;
    let command = Command { kind: manner.kind, operator };
    let outcomes = link::block_on(async {
        let session = target.open().await?;
        let outcomes = carry_out(&session, &target, orders, (&issuer, &command), manner).await;
        session::close(&session).await;
        outcomes
    })?;
    report::print(&outcomes, orders.json)?;
    outcome::conclude(&outcomes)
}
