//! Orders to diagnosers and to the simulated plant.

use std::time::Duration;

use vocabulary::{
    Component, Injected, Injection, Key, Obeyed, PlantTopic, Stroke, StrokeBegun, StructureName,
};
use zenoh::Session;

use super::request::{command, senseless, untaken};
use super::view::{OrderRequest, QueryError};

/// Gives a module's diagnoser an order about a component, or about the module.
///
/// # Errors
/// [`QueryError::Refused`]: nothing was changed. Anything else: it may or may not have been obeyed.
pub async fn order(
    session: &Session,
    request: &OrderRequest,
    timeout: Duration,
) -> Result<Obeyed, QueryError> {
    let obeyed: Obeyed = command(session, &request.key(), &request.order, timeout).await?;
    let meant = request.order.component.as_ref().map(|mention| &mention.component);
    if obeyed.component.as_ref() != meant {
        let named = |what: Option<&Component>| {
            what.map_or_else(
                || format!("`{}`", request.module),
                |component| format!("`{component}`"),
            )
        };
        let (replied, meant) = (named(obeyed.component.as_ref()), named(meant));
        return Err(senseless(format!("it is about {replied}, the order was about {meant}")));
    }
    Ok(obeyed)
}

/// Orders the plant to give a component a fault, or to repair it.
///
/// # Errors
/// No consent; see [`QueryError`].
pub async fn inject(
    session: &Session,
    structure: &StructureName,
    injection: &Injection,
    timeout: Duration,
) -> Result<Injected, QueryError> {
    let key = Key::of_plant(structure, PlantTopic::Inject);
    command(session, &key, injection, timeout).await.map_err(|error| untaken(error, timeout))
}

/// Orders the plant to let a cylinder make a stroke.
///
/// # Errors
/// No consent; see [`QueryError`].
pub async fn stroke(
    session: &Session,
    structure: &StructureName,
    stroke: &Stroke,
    timeout: Duration,
) -> Result<StrokeBegun, QueryError> {
    let key = Key::of_plant(structure, PlantTopic::Stroke);
    command(session, &key, stroke, timeout).await.map_err(|error| untaken(error, timeout))
}
