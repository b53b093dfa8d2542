//! Figure 4: a random walk and a bias in two gages of the first module.

use vocabulary::ComponentKind::Sensor;

use super::place;
use super::story::FigureRun;
use crate::error::StudyError;
use crate::scenarios::ScenarioCampaign;
use figure::plot::{Figure, PanelRow};

const WALK_AT_S: f64 = 10.8;
const BIAS_AT_S: f64 = 11.1;

/// Figure 4 of the paper as SVG: a random walk in gage 5 at 10.8 s and a bias in gage 1 at 11.1 s, both
/// in the first equipped module; readings, residuals, divergences and a close-up of either fault.
///
/// # Errors
/// A structure without these gages; a plant or diagnosers that cannot be made.
pub fn figure4(campaign: &ScenarioCampaign, seed: u64) -> Result<String, StudyError> {
    let (walking, walking_m) = place::gage(&campaign.system.structure, 1, 5)?;
    let (biased, biased_m) = place::gage(&campaign.system.structure, 1, 1)?;
    let names = [&walking, &biased].map(|path| path.component.name().to_owned());
    let story = FigureRun::run(
        campaign,
        seed,
        vec![
            (WALK_AT_S, walking, place::random_walk(campaign, walking_m)),
            (BIAS_AT_S, biased, place::bias(campaign, biased_m)),
        ],
    )?;
    let module = &place::module(&campaign.system.structure, 1)?.name;
    let gages = story.channels(1, Sensor);
    let mut readings = story.signals("Readings of the gages", &gages).marked(story.marks());
    let mut residuals = story.residuals("Residuals", &gages).marked(story.bare_marks());
    readings.x = readings.x.bare();
    residuals.x = residuals.x.bare();
    let divergences = story.divergences("Divergence over its threshold", &gages);
    let close_ups = names.iter().enumerate();
    let close_ups =
        close_ups.map(|(fault, name)| story.close_up(format!("Close-up of {name}"), &gages, fault));
    let figure = Figure {
        title: format!("A random walk and a bias in two gages of {module}"),
        subtitle: format!("Figure 4 of the paper, redrawn with seed {seed}. {}.", story.outcome()),
        description: format!(
            "Readings, residuals and divergences of the gages of {module} with a {}. {}.",
            story.faults(),
            story.outcome()
        ),
        rows: vec![
            PanelRow::new(150.0, vec![readings]),
            PanelRow::new(150.0, vec![residuals]),
            PanelRow::new(170.0, vec![divergences.marked(story.bare_marks())]),
            PanelRow::new(170.0, close_ups.collect()),
        ],
    };
    Ok(figure.svg())
}
