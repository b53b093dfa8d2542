//! Sends an order to the simulated plant, and interprets a failure.

use std::time::Duration;

use observer::QueryError;
use vocabulary::{Mention, StructureName};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::{Link, LinkTarget};
use vocabulary::words::printable;

/// Sends an order about a component to the plant, and returns the plant's structure and reply. `send` receives the
/// structure and the timeout.
pub(crate) fn give<R>(
    link: &Link,
    component: &Mention,
    send: impl AsyncFnOnce(&Session, &StructureName, Duration) -> Result<R, QueryError>,
) -> Result<(StructureName, R), Failure> {
    let link = &link.target()?;
    link.with_session(async |session| {
        let structure = home(session, link).await?;
        let sent = send(session, &structure, link.timeout).await;
        let reply = sent.map_err(|error| not_obeyed(component, error))?;
        Ok((structure, reply))
    })
}

/// The structure with a plant; several are ambiguous and refused.
async fn home(session: &Session, link: &LinkTarget) -> Result<StructureName, Failure> {
    let mut seen = session::client::plants(session, link.structure.as_ref(), link.timeout).await?;
    if seen.len() > 1 {
        let names: Vec<String> = seen.iter().map(|name| format!("`{name}`")).collect();
        let names = names.join(" and ");
        return Err(Failure::usage(format!(
            "there are plants of {names}; say which with --structure"
        )));
    }
    let (places, within) = (link.places(), link.timeout);
    seen.pop_first().ok_or_else(|| {
        Failure::network(format!(
            "no plant was there at {places} within {within:?}; no command was sent"
        ))
    })
}

fn not_obeyed(component: &Mention, error: QueryError) -> Failure {
    match error {
        QueryError::Refused(reason) => {
            Failure::runtime(format!("{component}: refused: {}", printable(&reason)))
        }
        error => {
            let error = printable(&error.to_string());
            Failure::network(format!(
                "{component}: {error}; the command may or may not have been carried out"
            ))
        }
    }
}
