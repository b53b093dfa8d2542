//! `trusswatch ack`, `trusswatch reset` and what sets alarms aside: commands of an operator to the diagnosers.

mod arguments;
mod carry_out;
mod homes;
pub(crate) mod issuer;
mod outcome;
mod report;
mod set_aside;
mod subject;

use vocabulary::OrderKind;

use crate::failure::Failure;
use crate::link;
pub(crate) use arguments::{AcknowledgeArguments, ResetArguments};
use arguments::{Orders, Signature};
use carry_out::{Issuer, Manner, carry_out};
pub(crate) use set_aside::{
    ShelveArguments, SuppressArguments, UnshelveArguments, UnsuppressArguments, shelve, suppress,
    unshelve, unsuppress,
};
use subject::Subject;

/// Runs `trusswatch ack`.
pub(crate) fn acknowledge(arguments: &AcknowledgeArguments) -> Result<(), Failure> {
    run(&arguments.orders, Manner::of(OrderKind::Acknowledge))
}

/// Runs `trusswatch reset`.
pub(crate) fn reset(arguments: &ResetArguments) -> Result<(), Failure> {
    let ResetArguments { orders, force, re_tare, wait } = arguments;
    let manner = Manner::of(OrderKind::Reset);
    run(orders, Manner { force: *force, re_tare: *re_tare, wait: *wait, ..manner })
}

fn run(orders: &Orders, manner: Manner) -> Result<(), Failure> {
    let Orders { components, note, signature } = orders;
    let subjects: Vec<Subject> = components.iter().cloned().map(Subject::Component).collect();
    give(&subjects, note.as_ref(), signature, manner)
}

/// Gives an order about each of these; all are checked before any is sent.
fn give(
    subjects: &[Subject],
    note: Option<&String>,
    signature: &Signature,
    manner: Manner,
) -> Result<(), Failure> {
    let target = signature.link.target()?;
    let operator = target.operator();
    let issuer = Issuer { by: signature.by(operator.as_ref())?, note: note.cloned() };
    for subject in subjects {
        issuer.order(subject, manner).check(manner.kind).map_err(Failure::usage)?;
    }
    let outcomes = link::block_on(async {
        let session = target.open().await?;
        let outcomes =
            carry_out(&session, &target, subjects, (&issuer, operator.as_ref()), manner).await;
        session::close(&session).await;
        outcomes
    })?;
    report::print(&outcomes, signature.json)?;
    outcome::conclude(&outcomes)
}
