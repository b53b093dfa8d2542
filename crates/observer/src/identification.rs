//! What kind of fault a component has, with what was measured of it.

use std::time::Duration;

use vocabulary::{ComponentPath, Identification, Key, StructureName, Topic};
use zenoh::Session;

use super::request::{Question, ask, senseless};
use super::view::QueryError;

/// The latest identification of a component's fault with its signature. `None` if its module knows none or
/// gives no answer within `timeout`.
///
/// # Errors
/// A refusal, or an answer that makes no sense.
pub async fn identification(
    session: &Session,
    structure: &StructureName,
    component: &ComponentPath,
    timeout: Duration,
) -> Result<Option<Identification>, QueryError> {
    let topic = Topic::Identification(component.component.clone());
    let key = Key::of_module(structure, &component.module, topic);
    match ask::<Identification>(session, &key, Question::default(), timeout).await {
        Ok(found) if found.component == *component => Ok(Some(found)),
        Ok(found) => Err(senseless(format!("it is of `{}`", found.component))),
        Err(QueryError::Unanswered(_)) => Ok(None),
        Err(error) => Err(error),
    }
}
