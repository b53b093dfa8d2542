//! What everyone needs who looks on from outside: the demo, the terminal, tests.

use std::time::Duration;

use truss::ids::{ModuleName, StructureName};
use wire::keys::Watched;
use wire::{Injected, Injection, Key, PlantTopic, Refused, Topic};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::query::ConsolidationMode;
use zenoh::sample::SampleKind;

/// Why an order to the plant had no effect that one could know of.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum OrderError {
    /// The plant refused it; nothing was changed.
    #[error("the plant refuses: {0}")]
    Refused(String),
    /// Nobody answered in time; perhaps there is no plant, perhaps it did as told.
    #[error("no plant answered within {0:?}")]
    Unanswered(Duration),
    /// The answer makes no sense.
    #[error("the plant's answer makes no sense: {0}")]
    Senseless(String),
}

/// Not everyone came.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum AttendanceError {
    /// Those who were not seen in time.
    #[error("not there after {waited:?}: {}", missing.join(", "))]
    Missing {
        /// Their names; the plant is `plant`.
        missing: Vec<String>,
        /// How long they were waited for.
        waited: Duration,
    },
    /// The network refused.
    #[error("liveliness cannot be watched: {0}")]
    Network(String),
}

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
    let senseless = |error: &dyn std::fmt::Display| OrderError::Senseless(error.to_string());
    let payload = wire::encode(injection).map_err(|error| senseless(&error))?;
    let replies = session
        .get(Key::of_plant(structure, PlantTopic::Inject).to_string())
        .payload(payload)
        .encoding(Encoding::APPLICATION_JSON)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .await
        .map_err(|error| senseless(&error))?;
    let reply = tokio::time::timeout(timeout, replies.recv_async()).await;
    let Ok(Ok(reply)) = reply else { return Err(OrderError::Unanswered(timeout)) };
    match reply.result() {
        Ok(sample) => wire::decode(&sample.payload().to_bytes()).map_err(|error| senseless(&error)),
        Err(error) => match wire::decode::<Refused>(&error.payload().to_bytes()) {
            Ok(Refused { reason }) => Err(OrderError::Refused(reason)),
            Err(_) => Err(OrderError::Unanswered(timeout)),
        },
    }
}

/// Waits until these diagnosers are there, and the plant if `plant` says so: their liveliness tokens,
/// which they declare last of all.
///
/// # Errors
/// Who is missing when time is up.
pub async fn wait_for(
    session: &Session,
    structure: &StructureName,
    modules: &[ModuleName],
    plant: bool,
    timeout: Duration,
) -> Result<(), AttendanceError> {
    let watched = Watched { structure: Some(structure), module: None };
    let tokens = session
        .liveliness()
        .declare_subscriber(watched.tokens())
        .history(true)
        .await
        .map_err(|error| AttendanceError::Network(error.to_string()))?;
    let mut wanted: Vec<Key> =
        modules.iter().map(|module| Key::of_module(structure, module, Topic::Alive)).collect();
    if plant {
        wanted.push(Key::of_plant(structure, PlantTopic::Alive));
    }
    let mut missing = wanted.clone();
    let everyone = async {
        while !missing.is_empty() {
            let Ok(token) = tokens.recv_async().await else { break };
            let Ok(key) = token.key_expr().as_str().parse::<Key>() else { continue };
            match token.kind() {
                SampleKind::Put => missing.retain(|other| *other != key),
                SampleKind::Delete if wanted.contains(&key) && !missing.contains(&key) => {
                    missing.push(key);
                }
                SampleKind::Delete => {}
            }
        }
    };
    // Whether time was up shows in who is missing.
    let _ = tokio::time::timeout(timeout, everyone).await;
    if missing.is_empty() {
        return Ok(());
    }
    let name = |key: &Key| match key {
        Key::Module { module, .. } => module.to_string(),
        Key::Plant { .. } => wire::keys::PLANT.to_owned(),
    };
    Err(AttendanceError::Missing { missing: missing.iter().map(name).collect(), waited: timeout })
}
