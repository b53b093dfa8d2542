//! Commands to diagnosers and to the simulated plant.

use std::time::Duration;

use vocabulary::{
    Component, Injected, Injection, Key, Obeyed, PlantTopic, Stroke, StrokeBegun, StructureName,
};
use zenoh::Session;

use super::request::{command, senseless, untaken};
use observer::{OrderRequest, QueryError};

/// Sends a module's diagnoser an order about a component or the whole module.
///
/// # Errors
/// [`QueryError::Refused`]: nothing was changed. Any other error: the order may have been carried out.
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
        return Err(senseless(format!("the reply names {replied}, the command named {meant}")));
    }
    Ok(obeyed)
}

/// Commands the plant to inject a fault into a component, or to repair it.
///
/// # Errors
/// The plant did not confirm; see [`QueryError`].
pub async fn inject(
    session: &Session,
    structure: &StructureName,
    injection: &Injection,
    timeout: Duration,
) -> Result<Injected, QueryError> {
    let key = Key::of_plant(structure, PlantTopic::Inject);
    command(session, &key, injection, timeout).await.map_err(|error| untaken(error, timeout))
}

/// Commands the plant to perform a stroke of a cylinder.
///
/// # Errors
/// The plant did not confirm; see [`QueryError`].
pub async fn stroke(
    session: &Session,
    structure: &StructureName,
    stroke: &Stroke,
    timeout: Duration,
) -> Result<StrokeBegun, QueryError> {
    let key = Key::of_plant(structure, PlantTopic::Stroke);
    command(session, &key, stroke, timeout).await.map_err(|error| untaken(error, timeout))
}
