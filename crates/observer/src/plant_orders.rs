//! Orders to the simulated plant.

use std::time::Duration;

use names::StructureName;
use wire::{Injected, Injection, Key, PlantTopic};
use zenoh::Session;

use super::request::{OrderError, Question, ask};

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
