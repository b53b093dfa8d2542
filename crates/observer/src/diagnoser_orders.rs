//! Orders to a module's diagnoser.

use std::time::Duration;

use names::{Component, ModuleName, OperatorName, StructureName};
use wire::{Key, Obeyed, Order, OrderKind, Topic};
use zenoh::Session;

use super::request::{Question, command_to, senseless};
use super::view::OrderError;

/// What is ordered, and by whom.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Command {
    /// What is ordered.
    pub kind: OrderKind,
    /// The operator whose certificate the session shows: access control admits no other to his keys. Without one the
    /// message itself says who it is.
    pub operator: Option<OperatorName>,
}

impl From<OrderKind> for Command {
    fn from(kind: OrderKind) -> Self {
        Self { kind, operator: None }
    }
}

impl Command {
    /// Where it is sent, one after the other as long as nobody takes it: diagnosers of former versions and their access
    /// control know no keys of operators. A command that was obeyed before its diagnoser ended is refused the second time.
    fn topics(&self) -> impl Iterator<Item = Topic> {
        let own = self.operator.clone().map(|operator| Topic::CommandOf(self.kind, operator));
        own.into_iter().chain([Topic::Command(self.kind)])
    }
}

/// Gives a module's diagnoser an order about a component, or about the module.
///
/// # Errors
/// [`OrderError::Refused`]: nothing was changed. Anything else: it may or may not have been obeyed.
pub async fn order(
    session: &Session,
    structure: &StructureName,
    module: &ModuleName,
    command: &Command,
    order: &Order,
    timeout: Duration,
) -> Result<Obeyed, OrderError> {
    let mut outcome = Err(OrderError::Untaken);
    for topic in command.topics() {
        let key = Key::of_module(structure, module, topic);
        outcome = command_to(session, &key, Question::of_message(order)?, timeout).await;
        if !matches!(outcome, Err(OrderError::Untaken)) {
            break;
        }
    }
    let obeyed: Obeyed = outcome?;
    let meant = order.component.as_ref().map(|mention| &mention.component);
    if obeyed.component.as_ref() != meant {
        let named = |what: Option<&Component>| {
            what.map_or_else(|| format!("`{module}`"), |component| format!("`{component}`"))
        };
        let (replied, meant) = (named(obeyed.component.as_ref()), named(meant));
        return Err(senseless(format!("it is about {replied}, the order was about {meant}")));
    }
    Ok(obeyed)
}
