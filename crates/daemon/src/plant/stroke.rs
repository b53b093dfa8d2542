//! Orders from the network: let a cylinder make a stroke.

use plant::Plant;
use vocabulary::{Stroke, StrokeBegun};

use super::meaning::meant;

/// Begins a stroke with the next step.
pub(crate) fn begin(order: &Stroke, plant: &mut Plant) -> Result<StrokeBegun, String> {
    let component = meant(&order.component, plant)?;
    let stroke = plant::StrokeTest {
        actuator: component.clone(),
        force_n: order.force_n,
        duration_s: order.duration_s,
        largest_strain: order.largest_strain,
    };
    let first_step = plant.next_step();
    let last_step = plant.begin_stroke(stroke).map_err(|error| error.to_string())?;
    tracing::info!(%component, force_n = order.force_n, %first_step, %last_step, "stroke begins");
    Ok(StrokeBegun { component, first_step, last_step })
}
