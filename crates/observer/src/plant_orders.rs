//! Orders to the simulated plant.

use std::time::Duration;

use vocabulary::{Injected, Injection, Key, PlantTopic, Stroke, StrokeBegun, StructureName};
use zenoh::Session;

use super::request::{Question, ask};
use super::view::OrderError;

/// Orders the plant to give a component a fault, or to repair it.
///
/// # Errors
/// No consent; see [`OrderError`].
pub async fn inject(
    session: &Session,
    structure: &StructureName,
    injection: &Injection,
    timeout: Duration,
) -> Result<Injected, OrderError> {
    let key = Key::of_plant(structure, PlantTopic::Inject);
    ask(session, &key, Question::of_message(injection)?, timeout).await
}

/// Orders the plant to let a cylinder make a stroke.
///
/// # Errors
/// No consent; see [`OrderError`].
pub async fn stroke(
    session: &Session,
    structure: &StructureName,
    stroke: &Stroke,
    timeout: Duration,
) -> Result<StrokeBegun, OrderError> {
    let key = Key::of_plant(structure, PlantTopic::Stroke);
    ask(session, &key, Question::of_message(stroke)?, timeout).await
}
