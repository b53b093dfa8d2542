//! Plant and diagnosers go through a history.

use super::draw::{Disturbance, History};
use super::record::HistoryRecord;
use crate::campaign::Campaign;
use crate::error::StudyError;
use crate::rig::{Occurrence, Rig};

/// The publisher keeps samples of so many seconds.
const KEPT_S: f64 = 4.0;

/// Goes through a history and shows `each_step` what happened in each step.
///
/// # Errors
/// A plant or diagnosers that cannot be made.
pub fn run_history(
    campaign: &Campaign,
    history: &History,
    mut each_step: impl FnMut(&Rig, &[Occurrence]),
) -> Result<HistoryRecord, StudyError> {
    let mut rig = campaign.rig(history.seed, history.schedule())?;
    rig.keep_samples((KEPT_S / campaign.parameters.step_s).round() as usize);
    let diagnosers = rig.diagnosers().len();
    let mut lost_until = vec![rig.plant().next_step(); diagnosers];
    let mut all = Vec::new();
    for _ in 0..history.steps {
        let step = rig.plant().next_step();
        for (place, lost_until) in lost_until.iter_mut().enumerate() {
            match history.disturbances.get(&(step, place)) {
                Some(Disturbance::Lost(count)) => *lost_until = step.plus(*count),
                Some(Disturbance::Restarted) => rig.restart(place)?,
                None => {}
            }
        }
        rig.step_without(|place| step < lost_until[place])?;
        let latest = rig.take_occurrences();
        each_step(&rig, &latest);
        all.extend(latest);
    }
    let unconfirmed = rig.diagnosers().iter().flat_map(|diagnoser| diagnoser.verdicts());
    let unconfirmed = unconfirmed
        .filter(|(_, verdict)| matches!(verdict, diagnosis::Verdict::Unconfirmed { .. }))
        .count() as u64;
    Ok(HistoryRecord::of(history, &all, unconfirmed))
}
