//! `trusswatch faults`: shows the present state of a whole structure.

mod report;
#[cfg(test)]
pub(crate) mod testing;

use observer::{ModuleView, Scene, alarms, all_is_well, structures};
use serde::Serialize;
use serde_json::{Value, json};
use session::client::present;
use vocabulary::words::utc;
use vocabulary::{FaultState, FaultTransition, ModuleName, ModuleStatus};

use crate::failure::Failure;
use crate::link::Link;
use crate::output;
use crate::paint::Paint;
use crate::table::WidthArguments;

/// Show present faults and the condition of every module
///
/// Queries every diagnoser for the state of its components and shows a row for each incident: a fault with its effects
/// and with what cannot be compared since then. Shelved and suppressed alarms have operator, reason and end. Components that their module does not monitor, for instance
/// because samples are missing, are unknown. A module that is expected, or that another module names as its peer, is
/// shown as not answering if it does not answer; the states of its components are then unknown. Several structures are
/// listed in a table, the most urgent first; a structure in which all is well has no further output.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Show every component, normal ones too, and every structure
    #[arg(long)]
    all: bool,
    /// Modules that should be present
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// End with exit code 1 unless all is well: every module is one process that answers, is in service and writes its
    /// journal, and no component is latched, acknowledged, unconfirmed or unknown. Components whose alarm is shelved or
    /// suppressed do not count, and a module with all components suppressed need not be in service, but must answer. A
    /// gateway does not forward statuses, by which peers name each other; behind one, name every module with `--expect`
    /// and the structure with `--structure`
    #[arg(long)]
    exit_code: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    width: WidthArguments,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let link = &arguments.link.target()?;
    let scene = link.with_session(async |session| {
        let structure = link.structure.as_ref();
        Ok(present(session, structure, &arguments.expect, link.timeout).await?)
    })?;
    if arguments.json {
        output::print(&output::text(&document(&scene, arguments.all))?)?;
    } else if !scene.modules.is_empty() {
        let (width, paint) = (arguments.width.limit(), Paint::of_stdout());
        output::print(&report::report(&scene, arguments.all, width, paint))?;
    }
    if !scene.has_heard_a_module() {
        return Err(link.no_module());
    }
    if arguments.exit_code && !all_is_well(&scene) {
        return Err(Failure::reported());
    }
    Ok(())
}

/// The JSON document: the structures, most urgent first; a row for each incident; all modules; and components that are not
/// normal, or whose alarm is shelved or suppressed, or all components.
fn document(scene: &Scene, all: bool) -> Value {
    let is_shown = |component: &&FaultTransition| {
        all || component.state() != FaultState::Normal || component.aside().is_some()
    };
    let components: Vec<_> = scene
        .components()
        .filter(is_shown)
        .map(|state| output::with(state, json!({ "time": utc(state.time_unix_ns) })))
        .collect();
    json!({
        "time": utc(scene.time_unix_ns),
        "all_is_well": all_is_well(scene),
        "structures": structures(scene),
        "incidents": alarms(&scene.modules),
        "modules": scene.modules.iter().map(module).collect::<Vec<_>>(),
        "components": components,
        "problems": scene.problems,
    })
}

/// A module, with the number of its components in each state.
fn module(view: &ModuleView) -> impl Serialize {
    // Of a module that is not heard, nothing of the present is known.
    let status = view.present_status();
    let phase = view.phase().filter(|_| !view.is_silent);
    // The reason is included only if it belongs to the present phase.
    let change = view.latest_phase_change().filter(|_| phase.is_some());
    let counts = view.counts();
    let fields = json!({
        "structure": view.structure,
        "module": view.module,
        "answers": view.answers(),
        "present": view.present,
        "several_processes": view.has_several_processes(),
        "expected": view.expected,
        "peer_of": view.peer_of,
        "phase": phase,
        "phase_reason": change.map(|change| &change.reason),
        "phase_since": change.map(|change| utc(change.time_unix_ns)),
        "in_service_since_step": status.and_then(|status| status.in_service_since_step),
        "run": status.and_then(|status| status.run),
        "step": status.and_then(|status| status.step),
        "lag_ms": status.and_then(|status| status.lag_ms),
        // Included if it explains the lag.
        "clock_ahead_s": status.and_then(ModuleStatus::clock_difference).map(|d| d.ahead_s),
        "sample_age_ms": status.and_then(|status| status.sample_age_ms),
        "journal": status.map(|status| &status.journal),
        "status_time": view.status.as_ref().map(|status| utc(status.time_unix_ns)),
        "not_normal": counts.total() - counts.normal,
        // If the alarms of all components are suppressed, the suppression that ends first.
        "suppressed": view.suppression(),
    });
    output::with(counts, fields)
}
