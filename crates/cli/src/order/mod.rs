//! `trusswatch ack`, `reset` and `fault shelve`, `unshelve`, `suppress`, `unsuppress`: commands of an operator to the
//! diagnosers.

mod arguments;
mod carry_out;

use std::time::Duration;

use vocabulary::{OperatorName, Order, OrderKind};

use crate::failure::Failure;
use crate::output;
pub(crate) use arguments::{
    AcknowledgeArguments, ResetArguments, ShelveArguments, SuppressArguments, UnshelveArguments,
    UnsuppressArguments,
};
use arguments::{ComponentsFlags, IssuerFlags, SetAsideFlags};
use carry_out::{OrderSubject, carry_out};

/// Runs `trusswatch ack`.
pub(crate) fn acknowledge(arguments: &AcknowledgeArguments) -> Result<(), Failure> {
    give_each(OrderKind::Acknowledge, &arguments.orders, Order::default(), None)
}

/// Runs `trusswatch reset`.
pub(crate) fn reset(arguments: &ResetArguments) -> Result<(), Failure> {
    let ResetArguments { orders, force, re_tare, wait } = arguments;
    let order = Order { force: *force, re_tare: *re_tare, ..Order::default() };
    give_each(OrderKind::Reset, orders, order, *wait)
}

/// Runs `trusswatch fault shelve`.
pub(crate) fn shelve(arguments: &ShelveArguments) -> Result<(), Failure> {
    let ShelveArguments { components, set_aside, issuer } = arguments;
    let subjects = components.iter().cloned().map(OrderSubject::Component).collect();
    give(OrderKind::Shelve, subjects, set_aside.order(), None, issuer)
}

/// Runs `trusswatch fault unshelve`.
pub(crate) fn unshelve(arguments: &UnshelveArguments) -> Result<(), Failure> {
    give_each(OrderKind::Unshelve, &arguments.orders, Order::default(), None)
}

/// Runs `trusswatch fault suppress`.
pub(crate) fn suppress(arguments: &SuppressArguments) -> Result<(), Failure> {
    let SuppressArguments { module, set_aside, issuer } = arguments;
    let subjects = vec![OrderSubject::Module(module.clone())];
    give(OrderKind::Suppress, subjects, set_aside.order(), None, issuer)
}

/// Runs `trusswatch fault unsuppress`.
pub(crate) fn unsuppress(arguments: &UnsuppressArguments) -> Result<(), Failure> {
    let UnsuppressArguments { module, note, issuer } = arguments;
    let subjects = vec![OrderSubject::Module(module.clone())];
    let order = Order { note: note.clone(), ..Order::default() };
    give(OrderKind::Unsuppress, subjects, order, None, issuer)
}

impl SetAsideFlags {
    fn order(&self) -> Order {
        let SetAsideFlags { for_s, reason } = self;
        Order { for_s: Some(*for_s), note: Some(reason.clone()), ..Order::default() }
    }
}

fn give_each(
    kind: OrderKind,
    orders: &ComponentsFlags,
    order: Order,
    wait: Option<Duration>,
) -> Result<(), Failure> {
    let ComponentsFlags { components, note, issuer } = orders;
    let subjects = components.iter().cloned().map(OrderSubject::Component).collect();
    give(kind, subjects, Order { note: note.clone(), ..order }, wait, issuer)
}

/// Sends an order about each of these subjects, after checking all of them. `order` contains everything but the subject
/// and the issuer. `wait` is how long to retry refused commands.
fn give(
    kind: OrderKind,
    subjects: Vec<OrderSubject>,
    order: Order,
    wait: Option<Duration>,
    flags: &IssuerFlags,
) -> Result<(), Failure> {
    let target = flags.link.target()?;
    let operator = target.operator();
    let order = Order { by: issuer(flags.by.as_deref(), operator.as_ref())?, ..order };
    let of_subject = |subject: OrderSubject| {
        let order = Order { component: subject.mention(), ..order.clone() };
        order.check(kind).map_err(Failure::usage)?;
        Ok((subject, order))
    };
    let orders = subjects.into_iter().map(of_subject).collect::<Result<Vec<_>, Failure>>()?;
    let command = (kind, operator.as_ref());
    let outcomes = target
        .with_session(async |session| carry_out(session, &target, command, &orders, wait).await)?;
    output::print(&if flags.json {
        output::text(&carry_out::document(&outcomes, kind, &order.by))?
    } else {
        carry_out::report(&outcomes, kind, &order.by)
    })?;
    carry_out::conclude(&outcomes, kind)
}

/// The recorded name: that of the operator in the certificate, otherwise the given one, otherwise `USER@HOST`.
pub(crate) fn issuer(by: Option<&str>, operator: Option<&OperatorName>) -> Result<String, Failure> {
    if let (Some(by), Some(operator)) = (by, operator)
        && by != operator.as_str()
    {
        return Err(Failure::usage(format!(
            "--by {by}: the certificate is that of `{operator}`, whose name is recorded; leave --by out, or \
             show the certificate of `{by}`"
        )));
    }
    let shown = operator.map(ToString::to_string);
    let by = shown.or_else(|| by.map(str::to_owned)).or_else(from_environment);
    by.ok_or_else(|| Failure::usage("the issuer is unknown; use --by WHO"))
}

/// `USER@HOST` from the environment; `None` without a user.
fn from_environment() -> Option<String> {
    let variable = |name| std::env::var(name).ok().filter(|user: &String| !user.trim().is_empty());
    let user = variable("USER").or_else(|| variable("LOGNAME"))?;
    let host = nix::unistd::gethostname().ok()?;
    Some(format!("{user}@{}", host.to_string_lossy()))
}
