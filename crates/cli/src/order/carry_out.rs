//! Sends the commands, one after the other.

use std::time::Duration;

use observer::{OrderOutcome, OrderRequest};
use tokio::time::{Instant, sleep};
use vocabulary::{OperatorName, Order, OrderKind, StructureName};
use zenoh::Session;

use super::homes::homes;
use super::outcome::CommandOutcome;
use super::subject::Subject;
use crate::failure::Failure;
use crate::link::Target;

/// From a refusal to the next attempt.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// Which command, and how it is retried.
#[derive(Debug, Clone, Copy)]
pub(super) struct Manner {
    pub(super) kind: OrderKind,
    pub(super) force: bool,
    pub(super) re_tare: bool,
    /// For how long an alarm is set aside \[s\].
    pub(super) for_s: Option<u64>,
    /// How long to try again while it is refused.
    pub(super) wait: Option<Duration>,
}

impl Manner {
    /// Without anything else.
    pub(super) fn of(kind: OrderKind) -> Self {
        Self { kind, force: false, re_tare: false, for_s: None, wait: None }
    }
}

/// A person, and the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Issuer {
    pub(super) by: String,
    pub(super) note: Option<String>,
}

impl Issuer {
    /// A command concerning a component or a module.
    pub(super) fn order(&self, subject: &Subject, manner: Manner) -> Order {
        let Issuer { by, note } = self.clone();
        let Manner { force, re_tare, for_s, .. } = manner;
        let component = subject.mention();
        Order { component, by, on_behalf_of: None, note, for_s, force, re_tare }
    }
}

/// Sends every command, whatever the outcome of the others.
pub(super) async fn carry_out(
    session: &Session,
    target: &Target,
    subjects: &[Subject],
    (issuer, operator): (&Issuer, Option<&OperatorName>),
    manner: Manner,
) -> Result<Vec<CommandOutcome>, Failure> {
    let homes = homes(session, target, subjects).await?;
    let timeout = target.timeout;
    // One span of time for all: what the second waits for passes while the first is waited for.
    let until = manner.wait.map(|wait| Instant::now() + wait);
    let mut outcomes = Vec::new();
    for subject in subjects {
        let structure = homes.get(subject.module());
        let outcome = match structure {
            Some(structure) => {
                let place = Place { session, structure, operator, timeout };
                place.give(subject, issuer, manner, until).await
            }
            None => {
                let why = format!("its diagnoser is not there (looked for {timeout:?})");
                OrderOutcome::not_sent(&why)
            }
        };
        outcomes.push(CommandOutcome {
            structure: structure.cloned(),
            subject: subject.clone(),
            order: manner.kind,
            by: issuer.by.clone(),
            outcome,
        });
    }
    Ok(outcomes)
}

/// Where commands go.
struct Place<'a> {
    session: &'a Session,
    structure: &'a StructureName,
    operator: Option<&'a OperatorName>,
    timeout: Duration,
}

impl Place<'_> {
    /// Sends a command, and retries while it is refused and there is time. A command without an
    /// answer is not repeated: it may have been carried out.
    async fn give(
        &self,
        subject: &Subject,
        issuer: &Issuer,
        manner: Manner,
        until: Option<Instant>,
    ) -> OrderOutcome {
        let request = OrderRequest {
            structure: self.structure.clone(),
            module: subject.module().clone(),
            kind: manner.kind,
            operator: self.operator.cloned(),
            order: issuer.order(subject, manner),
        };
        loop {
            let result = observer::order(self.session, &request, self.timeout);
            let outcome = OrderOutcome::from(result.await);
            let is_refused = matches!(outcome, OrderOutcome::Refused { .. });
            if !is_refused || until.is_none_or(|until| Instant::now() + AGAIN_AFTER > until) {
                return outcome;
            }
            sleep(AGAIN_AFTER).await;
        }
    }
}
