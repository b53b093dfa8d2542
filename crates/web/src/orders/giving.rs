//! How an order is sent to the module.

use std::collections::BTreeSet;

use observer::{Command, OrderOutcome};
use vocabulary::StructureName;
use zenoh::Session;

use super::given::Given;
use crate::app::App;

/// Who gives the orders of a page without a certificate; with one, access control knows who it is.
const PAGE: &str = "web";

/// Sends it, in the name of a person, and waits for the answer.
pub(super) async fn give(app: &App, person: &str, given: &Given) -> OrderOutcome {
    let Some(session) = app.observed.session() else {
        return OrderOutcome::not_sent("there is no network");
    };
    let structure = match structure(app, &session, given).await {
        Ok(structure) => structure,
        Err(wrong) => return OrderOutcome::not_sent(&wrong),
    };
    let by = app.operator.as_ref().map_or(PAGE, |operator| operator.as_str());
    let order = given.order(by, person);
    let command = Command { kind: given.kind, operator: app.operator.clone() };
    let (module, timeout) = (&given.module, app.observed.timeout);
    observer::order(&session, &structure, module, &command, &order, timeout).await.into()
}

/// Where the module is. One that is there in several structures is not guessed at.
async fn structure(app: &App, session: &Session, given: &Given) -> Result<StructureName, String> {
    let (module, within) = (&given.module, app.observed.timeout);
    let wanted = given.structure.as_ref().or(app.structure.as_ref());
    if let (Some(wanted), Some(shown)) = (wanted, &app.structure)
        && wanted != shown
    {
        return Err(format!("this page is about `{shown}`, not about `{wanted}`"));
    }
    let homes = observer::homes(session, wanted, std::slice::from_ref(module), within).await;
    let homes = homes.map_err(|error| error.to_string())?;
    let mut homes: BTreeSet<StructureName> = homes.get(module).cloned().unwrap_or_default();
    if homes.len() > 1 {
        let names: Vec<String> = homes.iter().map(|name| format!("`{name}`")).collect();
        return Err(format!("`{module}` is there in {}; say which", names.join(" and ")));
    }
    homes
        .pop_first()
        .ok_or_else(|| format!("the diagnoser of `{module}` is not there (looked for {within:?})"))
}
