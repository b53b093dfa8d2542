//! Gives the orders, one after the other.

use std::time::Duration;

use daemon::observer;
use tokio::time::{Instant, sleep};
use truss::ids::{ComponentPath, StructureName};
use wire::OrderKind;
use zenoh::Session;

use super::arguments::Orders;
use super::giver::Giver;
use super::homes::homes;
use super::outcome::{Outcome, Told};
use crate::failure::Failure;

/// From a refusal to the next attempt.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// What is ordered, and how insistently.
#[derive(Debug, Clone, Copy)]
pub(super) struct Manner {
    pub(super) kind: OrderKind,
    pub(super) force: bool,
    /// How long to try again while it is refused.
    pub(super) wait: Option<Duration>,
}

/// Gives every order, whatever becomes of the others.
pub(super) async fn carry_out(
    session: &Session,
    orders: &Orders,
    giver: &Giver,
    manner: Manner,
) -> Result<Vec<Told>, Failure> {
    let homes = homes(session, orders).await?;
    let timeout = orders.link.timeout;
    // One span of time for all: what the second waits for passes while the first is waited for.
    let until = manner.wait.map(|wait| Instant::now() + wait);
    let mut told = Vec::new();
    for component in &orders.components {
        let structure = homes.get(&component.module);
        let outcome = match structure {
            Some(structure) => {
                let place = Place { session, structure, timeout };
                place.give(component, giver, manner, until).await
            }
            None => Outcome::not_there(timeout),
        };
        told.push(Told {
            structure: structure.cloned(),
            component: component.clone(),
            order: manner.kind,
            by: giver.by.clone(),
            outcome,
        });
    }
    Ok(told)
}

/// Where orders go.
struct Place<'a> {
    session: &'a Session,
    structure: &'a StructureName,
    timeout: Duration,
}

impl Place<'_> {
    /// Gives an order; again and again while it is refused and there is time. An order without an
    /// answer is not repeated: it may have been carried out.
    async fn give(
        &self,
        component: &ComponentPath,
        giver: &Giver,
        manner: Manner,
        until: Option<Instant>,
    ) -> Outcome {
        let order = giver.order(component, manner.force);
        loop {
            let (structure, module) = (self.structure, &component.module);
            let result =
                observer::order(self.session, structure, module, manner.kind, &order, self.timeout);
            let outcome = Outcome::of(result.await);
            let is_refused = matches!(outcome, Outcome::Refused { .. });
            if !is_refused || until.is_none_or(|until| Instant::now() + AGAIN_AFTER > until) {
                return outcome;
            }
            sleep(AGAIN_AFTER).await;
        }
    }
}
