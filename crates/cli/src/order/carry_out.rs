//! Sends the commands one after the other, and reports their outcomes.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use observer::{OrderOutcome, OrderRequest, order_subject};
use serde_json::{Value, json};
use tokio::time::{Instant, sleep};
use vocabulary::words::done;
use vocabulary::{ModuleName, OperatorName, Order, OrderKind, StructureName, printable};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::output;
use crate::paint::{Colour, Paint};

/// Pause before a refused command is repeated.
const AGAIN_AFTER: Duration = Duration::from_millis(200);

/// A command, the module that it is sent to, and its outcome.
#[derive(Debug)]
pub(super) struct CommandOutcome<'a> {
    structure: Option<StructureName>,
    module: &'a ModuleName,
    order: &'a Order,
    outcome: OrderOutcome,
}

/// Sends all commands, even if some of them fail.
pub(super) async fn carry_out<'a>(
    session: &Session,
    target: &LinkTarget,
    (kind, operator): (OrderKind, Option<&OperatorName>),
    orders: &'a [(ModuleName, Order)],
    wait: Option<Duration>,
) -> Result<Vec<CommandOutcome<'a>>, Failure> {
    let homes = homes(session, target, orders.iter().map(|(module, _)| module)).await?;
    let timeout = target.timeout;
    // One time limit for all: the second command's wait overlaps the first one's.
    let until = wait.map(|wait| Instant::now() + wait);
    let mut outcomes = Vec::new();
    for (module, order) in orders {
        let structure = homes.get(module).cloned();
        let outcome = match &structure {
            Some(structure) => {
                let request = OrderRequest {
                    structure: structure.clone(),
                    module: module.clone(),
                    kind,
                    operator: operator.cloned(),
                    order: order.clone(),
                };
                loop {
                    let sent = session::client::order(session, &request, timeout);
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
                let why = format!("its diagnoser was not seen (waited {timeout:?})");
                OrderOutcome::not_sent(&why)
            }
        };
        outcomes.push(CommandOutcome { structure, module, order, outcome });
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
    let seen = session::client::homes(session, target.structure.as_ref(), &modules, target.timeout);
    let mut homes = BTreeMap::new();
    for (module, mut structures) in seen.await? {
        if structures.len() > 1 {
            let names: Vec<String> = structures.iter().map(|name| format!("`{name}`")).collect();
            let names = names.join(" and ");
            return Err(Failure::usage(format!(
                "`{module}` exists in {names}; select one with --structure"
            )));
        }
        homes.extend(structures.pop_first().map(|structure| (module, structure)));
    }
    Ok(homes)
}

/// The JSON document of the outcomes.
pub(super) fn document(outcomes: &[CommandOutcome<'_>], kind: OrderKind, by: &str) -> Value {
    let command = |CommandOutcome { structure, module, order, outcome }: &CommandOutcome<'_>| {
        let fields = json!({
            "structure": structure,
            "module": module,
            // `null` for an order about a module.
            "component": order.component.as_ref().map(|_| order_subject(module, order)),
            "order": kind,
            "by": by,
        });
        output::with(outcome.clone(), fields)
    };
    json!({ "orders": outcomes.iter().map(command).collect::<Vec<_>>() })
}

/// In readable form, a line for each command carried out; the others are reported as errors.
pub(super) fn report(outcomes: &[CommandOutcome<'_>], kind: OrderKind, by: &str) -> String {
    let (what, paint) = (done(kind), Paint::of_stdout());
    let line = |CommandOutcome { module, order, outcome, .. }: &CommandOutcome<'_>| {
        let subject = order_subject(module, order);
        let effect = outcome.effect(kind, &subject)?;
        let line = format!("{what:<12} {subject} by {}: {effect}", printable(by));
        Some(paint.in_colour(Colour::Green, &line) + "\n")
    };
    outcomes.iter().filter_map(line).collect()
}

/// The failure of the whole command: a missing answer takes precedence over a refusal, because the outcome is unknown,
/// and both take precedence over commands that were carried out but not saved.
pub(super) fn conclude(outcomes: &[CommandOutcome<'_>], kind: OrderKind) -> Result<(), Failure> {
    let (mut complaints, mut is_unheard, mut is_refused) = (Vec::new(), false, false);
    for CommandOutcome { module, order, outcome, .. } in outcomes {
        if outcome.is_done() {
            continue;
        }
        let mut words = outcome.words(kind, &order_subject(module, order));
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
