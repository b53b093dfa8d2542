//! `trusswatch ack`, `reset` and `fault shelve`, `unshelve`, `suppress`, `unsuppress`, `shut-off`, `put-back`, `declare`: commands of an operator to the
//! diagnosers.

mod arguments;
mod carry_out;

use std::time::Duration;

use vocabulary::{ComponentPath, ModuleName, OperatorName, Order, OrderKind};

use crate::failure::Failure;
use crate::output;
pub(crate) use arguments::{
    AcknowledgeArguments, DeclareArguments, PutBackArguments, ResetArguments, ShelveArguments,
    ShutOffArguments, SuppressArguments, UnshelveArguments, UnsuppressArguments,
};
use arguments::{ComponentsFlags, IssuerFlags, SetAsideFlags};
use carry_out::carry_out;

/// Runs `trusswatch ack`.
pub(crate) fn acknowledge(arguments: &AcknowledgeArguments) -> Result<(), Failure> {
    arguments.orders.send(OrderKind::Acknowledge)
}

/// Runs `trusswatch reset`.
pub(crate) fn reset(arguments: &ResetArguments) -> Result<(), Failure> {
    let ResetArguments { orders, force, re_tare, wait } = arguments;
    let ComponentsFlags { components, note, issuer } = orders;
    let (note, force, re_tare) = (note.clone(), *force, *re_tare);
    let order = Order { note, force, re_tare, ..Order::default() };
    send_each(OrderKind::Reset, components, order, *wait, issuer)
}

/// Runs `trusswatch fault shelve`.
pub(crate) fn shelve(arguments: &ShelveArguments) -> Result<(), Failure> {
    let ShelveArguments { components, set_aside, issuer } = arguments;
    send_each(OrderKind::Shelve, components, set_aside.order(), None, issuer)
}

/// Runs `trusswatch fault unshelve`.
pub(crate) fn unshelve(arguments: &UnshelveArguments) -> Result<(), Failure> {
    arguments.orders.send(OrderKind::Unshelve)
}

/// Runs `trusswatch fault shut-off`.
pub(crate) fn shut_off(arguments: &ShutOffArguments) -> Result<(), Failure> {
    arguments.orders.send(OrderKind::ShutOff)
}

/// Runs `trusswatch fault declare`.
pub(crate) fn declare(arguments: &DeclareArguments) -> Result<(), Failure> {
    arguments.orders.send(OrderKind::Declare)
}

/// Runs `trusswatch fault put-back`.
pub(crate) fn put_back(arguments: &PutBackArguments) -> Result<(), Failure> {
    arguments.orders.send(OrderKind::PutBack)
}

/// Runs `trusswatch fault suppress`.
pub(crate) fn suppress(arguments: &SuppressArguments) -> Result<(), Failure> {
    let SuppressArguments { module, set_aside, issuer } = arguments;
    send(OrderKind::Suppress, vec![(module.clone(), set_aside.order())], None, issuer)
}

/// Runs `trusswatch fault unsuppress`.
pub(crate) fn unsuppress(arguments: &UnsuppressArguments) -> Result<(), Failure> {
    let UnsuppressArguments { module, note, issuer } = arguments;
    let order = Order { note: note.clone(), ..Order::default() };
    send(OrderKind::Unsuppress, vec![(module.clone(), order)], None, issuer)
}

impl ComponentsFlags {
    /// Sends an order that needs nothing else.
    fn send(&self, kind: OrderKind) -> Result<(), Failure> {
        let Self { components, note, issuer } = self;
        let order = Order { note: note.clone(), ..Order::default() };
        send_each(kind, components, order, None, issuer)
    }
}

impl SetAsideFlags {
    fn order(&self) -> Order {
        let SetAsideFlags { for_s, reason } = self;
        Order { for_s: Some(*for_s), note: Some(reason.clone()), ..Order::default() }
    }
}

/// Sends the same order about each of these components.
fn send_each(
    kind: OrderKind,
    components: &[ComponentPath],
    order: Order,
    wait: Option<Duration>,
    flags: &IssuerFlags,
) -> Result<(), Failure> {
    let of_component = |ComponentPath { module, component }: ComponentPath| {
        (module, Order { component: Some(component.into()), ..order.clone() })
    };
    send(kind, components.iter().cloned().map(of_component).collect(), wait, flags)
}

/// Sends these orders to their modules in the issuer's name, after checking all of them. `wait` is how long to retry
/// refused ones.
fn send(
    kind: OrderKind,
    mut orders: Vec<(ModuleName, Order)>,
    wait: Option<Duration>,
    flags: &IssuerFlags,
) -> Result<(), Failure> {
    let target = flags.link.target()?;
    let operator = target.operator();
    let by = issuer(flags.by.as_deref(), operator.as_ref())?;
    for (_, order) in &mut orders {
        order.by.clone_from(&by);
        order.check(kind).map_err(Failure::usage)?;
    }
    let command = (kind, operator.as_ref());
    let outcomes = target
        .with_session(async |session| carry_out(session, &target, command, &orders, wait).await)?;
    output::print(&if flags.json {
        output::text(&carry_out::document(&outcomes, kind, &by))?
    } else {
        carry_out::report(&outcomes, kind, &by)
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
