//! Sends the commands one after the other, and reports their outcomes.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::time::Duration;

use observer::{OrderOutcome, OrderRequest};
use serde_json::{Value, json};
use tokio::time::{Instant, sleep};
use vocabulary::words::done;
use vocabulary::{
    ComponentPath, Mention, ModuleName, OperatorName, Order, OrderKind, StructureName, printable,
};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::output;
use crate::paint::{Colour, Paint};

/// Pause before a refused command is repeated.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// The subject of an order: a component, or a module with all its components.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum OrderSubject {
    Component(ComponentPath),
    Module(ModuleName),
}

impl OrderSubject {
    fn module(&self) -> &ModuleName {
        match self {
            OrderSubject::Component(path) => &path.module,
            OrderSubject::Module(module) => module,
        }
    }

    fn component(&self) -> Option<&ComponentPath> {
        match self {
            OrderSubject::Component(path) => Some(path),
            OrderSubject::Module(_) => None,
        }
    }

    /// The component as named in the order.
    pub(super) fn mention(&self) -> Option<Mention> {
        self.component().map(|path| path.component.clone().into())
    }
}

impl fmt::Display for OrderSubject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            OrderSubject::Component(path) => path.fmt(f),
            OrderSubject::Module(module) => module.fmt(f),
        }
    }
}

/// A command and its outcome.
#[derive(Debug)]
pub(super) struct CommandOutcome<'a> {
    structure: Option<StructureName>,
    subject: &'a OrderSubject,
    outcome: OrderOutcome,
}

/// Sends all commands, even if some of them fail.
pub(super) async fn carry_out<'a>(
    session: &Session,
    target: &LinkTarget,
    (kind, operator): (OrderKind, Option<&OperatorName>),
    orders: &'a [(OrderSubject, Order)],
    wait: Option<Duration>,
) -> Result<Vec<CommandOutcome<'a>>, Failure> {
    let homes = homes(session, target, orders.iter().map(|(subject, _)| subject.module())).await?;
    let timeout = target.timeout;
    // One time limit for all: the second command's wait overlaps the first one's.
    let until = wait.map(|wait| Instant::now() + wait);
    let mut outcomes = Vec::new();
    for (subject, order) in orders {
        let structure = homes.get(subject.module()).cloned();
        let outcome = match &structure {
            Some(structure) => {
                let request = OrderRequest {
                    structure: structure.clone(),
                    module: subject.module().clone(),
                    kind,
                    operator: operator.cloned(),
                    order: order.clone(),
                };
                loop {
                    let sent = observer::order(session, &request, timeout);
                    let outcome = OrderOutcome::from(sent.await);
                    // A command without an answer is not repeated, because it may have been carried out.
                    let is_refused = matches!(outcome, OrderOutcome::Refused { .. });
                    let is_last = until.is_none_or(|until| Instant::now() + AGAIN_AFTER > until);
                    if !is_refused || is_last {
                        break outcome;
                    }
                    sleep(AGAIN_AFTER).await;
                }
            }
            None => {
                let why = format!("its diagnoser is not there (looked for {timeout:?})");
                OrderOutcome::not_sent(&why)
            }
        };
        outcomes.push(CommandOutcome { structure, subject, outcome });
    }
    Ok(outcomes)
}

/// The structure of each module; missing modules are left out. A module name found in several structures is ambiguous
/// and refused.
async fn homes(
    session: &Session,
    target: &LinkTarget,
    modules: impl Iterator<Item = &ModuleName>,
) -> Result<BTreeMap<ModuleName, StructureName>, Failure> {
    let modules: BTreeSet<ModuleName> = modules.cloned().collect();
    let modules: Vec<ModuleName> = modules.into_iter().collect();
    let seen = observer::homes(session, target.structure.as_ref(), &modules, target.timeout);
    let mut homes = BTreeMap::new();
    for (module, mut structures) in seen.await? {
        if structures.len() > 1 {
            let names: Vec<String> = structures.iter().map(|name| format!("`{name}`")).collect();
            let names = names.join(" and ");
            return Err(Failure::usage(format!(
                "`{module}` is there in {names}; say which with --structure"
            )));
        }
        homes.extend(structures.pop_first().map(|structure| (module, structure)));
    }
    Ok(homes)
}

/// The JSON document of the outcomes.
pub(super) fn document(outcomes: &[CommandOutcome<'_>], kind: OrderKind, by: &str) -> Value {
    let order = |CommandOutcome { structure, subject, outcome }: &CommandOutcome<'_>| {
        let fields = json!({
            "structure": structure,
            "module": subject.module(),
            // `null` for an order about a module.
            "component": subject.component(),
            "order": kind,
            "by": by,
        });
        output::with(outcome.clone(), fields)
    };
    json!({ "orders": outcomes.iter().map(order).collect::<Vec<_>>() })
}

/// In readable form, a line for each command carried out; the others are reported as errors.
pub(super) fn report(outcomes: &[CommandOutcome<'_>], kind: OrderKind, by: &str) -> String {
    let (what, paint) = (done(kind), Paint::of_stdout());
    let line = |CommandOutcome { subject, outcome, .. }: &CommandOutcome<'_>| {
        let OrderOutcome::Obeyed { state, sequence, .. } = outcome else { return None };
        // The state of one of its components.
        let now = match subject {
            OrderSubject::Component(_) if kind.is_about_verdict() => {
                format!("now {state}, transition {sequence}")
            }
            OrderSubject::Component(_) => format!("transition {sequence}"),
            OrderSubject::Module(_) => format!("up to transition {sequence}"),
        };
        let line = format!("{what:<12} {subject} by {}: {now}", printable(by));
        Some(paint.in_colour(Colour::Green, &line) + "\n")
    };
    outcomes.iter().filter_map(line).collect()
}

/// The failure of the whole command: a missing answer takes precedence over a refusal, because the outcome is unknown,
/// and both take precedence over commands that were carried out but not saved.
pub(super) fn conclude(outcomes: &[CommandOutcome<'_>], kind: OrderKind) -> Result<(), Failure> {
    let (mut complaints, mut is_unheard, mut is_refused) = (Vec::new(), false, false);
    for CommandOutcome { subject, outcome, .. } in outcomes {
        if outcome.is_done() {
            continue;
        }
        let mut words = outcome.words(kind, &subject.to_string());
        match outcome {
            OrderOutcome::Unanswered { .. } => {
                is_unheard = true;
                words += "; check with `trusswatch faults`";
            }
            OrderOutcome::NotSent { .. } => is_unheard = true,
            OrderOutcome::Refused { .. } => is_refused = true,
            OrderOutcome::Obeyed { .. } => {}
        }
        complaints.push(words);
    }
    match (complaints.is_empty(), is_unheard, is_refused) {
        (true, ..) => Ok(()),
        (_, true, _) => Err(Failure::networks(complaints)),
        (_, _, true) => Err(Failure::runtimes(complaints)),
        _ => Err(Failure::not_saved(complaints)),
    }
}
