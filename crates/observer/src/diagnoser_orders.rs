//! Orders to a module's diagnoser.

use std::time::Duration;

use names::{ModuleName, StructureName};
use wire::{Key, Obeyed, Order, OrderKind, Topic};
use zenoh::Session;

use super::request::{OrderError, Question, ask, senseless};

/// Orders a module's diagnoser to acknowledge a fault or to reset a component.
///
/// # Errors
/// [`OrderError::Refused`]: nothing was changed. Anything else: it may or may not have been obeyed.
pub async fn order(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    kind: OrderKind,
    order: &Order,
    timeout: Duration,
) -> Result<Obeyed, OrderError> {
    let key = Key::of_module(structure, module, Topic::Command(kind));
    let obeyed: Obeyed = ask(session, &key, Question::of_message(order)?, timeout).await?;
    if obeyed.component != order.component.component {
        let (replied, meant) = (&obeyed.component, &order.component);
        return Err(senseless(format!("it is about `{replied}`, the order was about `{meant}`")));
    }
    Ok(obeyed)
}
