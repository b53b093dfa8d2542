//! Orders to a module's diagnoser.

use std::time::Duration;

use vocabulary::{
    Component, Key, ModuleName, Obeyed, OperatorName, Order, OrderKind, StructureName, Topic,
};
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
    /// Where it is sent.
    fn topic(&self) -> Topic {
        match &self.operator {
            Some(operator) => Topic::CommandOf(self.kind, operator.clone()),
            None => Topic::Command(self.kind),
        }
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
    let key = Key::of_module(structure, module, command.topic());
    let question = Question::of_message(order)?;
    let obeyed: Obeyed = command_to(session, &key, question, timeout).await?;
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
