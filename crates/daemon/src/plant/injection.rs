//! Orders from the network: give a component a fault, or repair it.

use plant::Plant;
use vocabulary::{Injected, Injection, Step};

use super::agenda::{Agenda, Item};
use super::meaning::meant;

/// Carries out an order, or puts it on the agenda.
pub(crate) fn obey(
    injection: Injection,
    plant: &mut Plant,
    agenda: &mut Agenda,
) -> Result<Injected, String> {
    let Injection { component, fault, at_step } = injection;
    let component = meant(&component, plant)?;
    let next_step = plant.next_step();
    let step = at_step.unwrap_or(next_step);
    if step < next_step {
        return Err(format!("step {step} is over; the next one is {next_step}"));
    }
    let item = Item { step, component: component.clone(), fault };
    // An order for later is tried on a copy, so that it can be refused now.
    if step == next_step {
        apply(&item, plant)?;
    } else {
        apply(&item, &mut plant.clone())?;
        agenda.add(item);
    }
    tracing::info!(%component, ?fault, %step, "order");
    Ok(Injected { component, effective_step: step })
}

/// Applies an item to its component.
fn apply(item: &Item, plant: &mut Plant) -> Result<(), String> {
    let done = match item.fault {
        Some(fault) => plant.inject(&item.component, fault),
        None => plant.clear(&item.component),
    };
    done.map_err(|error| error.to_string())
}

/// Does all that is due before `step` is computed. Was there anything?
pub(crate) fn catch_up(agenda: &mut Agenda, plant: &mut Plant, step: Step) -> bool {
    let mut any = false;
    while let Some(item) = agenda.next_due(step) {
        any = true;
        let done = if item.fault.is_some() { "fault injected" } else { "repaired" };
        match apply(&item, plant) {
            Ok(()) => {
                tracing::info!(component = %item.component, %step, fault = ?item.fault, "{done}")
            }
            Err(error) => {
                tracing::error!(component = %item.component, %step, "not {done}: {error}")
            }
        }
    }
    any
}
