//! What a plant counts.

use std::fmt;

use shell::health::Sheet;
use vocabulary::{PlantPhase, PlantStatus};

use super::module::{seconds_of_ms, seconds_of_ns};

const PHASES: [(PlantPhase, &str); 3] = [
    (PlantPhase::Waiting, "waiting"),
    (PlantPhase::Running, "running"),
    (PlantPhase::Done, "done"),
];

pub(super) fn write(status: &PlantStatus, sheet: &mut Sheet<'_>) -> fmt::Result {
    let help = "When these metrics were taken.";
    let taken_s = seconds_of_ns(status.time_unix_ns);
    sheet.seconds("trusswatch_status_timestamp", help, Some(taken_s))?;
    let phases = PHASES.map(|(phase, name)| (name.into(), u64::from(phase == status.phase)));
    sheet.gauges("trusswatch_plant_phase", "1 for the phase that it is in.", "phase", phases)?;
    let help = "Diagnosers that it waits for before step 0.";
    sheet.gauge("trusswatch_plant_modules_awaited", help, status.waiting_for.len() as u64)?;
    sheet.gauge("trusswatch_plant_next_step", "The next step.", status.next_step.0)?;
    if let Some(speed) = status.speed {
        let help = "Simulated time by real time, as configured; absent for as fast as possible.";
        sheet.gauge("trusswatch_plant_speed_ratio", help, speed)?;
    }
    let help = "Steps computed more than a step's length too late.";
    sheet.counter("trusswatch_plant_steps_late", help, status.late_steps)?;
    let latest_s = seconds_of_ms(status.latest_ms);
    sheet.seconds("trusswatch_plant_worst_delay", "The worst delay of a step.", Some(latest_s))?;
    let help = "Samples that the network would not take.";
    sheet.counter("trusswatch_plant_samples_unsent", help, status.samples_unsent)?;
    let help = "Faults that are present, injected or scheduled.";
    sheet.gauge("trusswatch_plant_faults", help, status.faults.len() as u64)?;
    let help = "Gages and cylinders that the controller does without.";
    sheet.gauge(
        "trusswatch_plant_components_done_without",
        help,
        status.done_without.len() as u64,
    )?;
    let help = "Messages on gages and cylinders that the controller could not use.";
    sheet.counter("trusswatch_plant_messages_refused", help, status.messages_refused)
}
