//! Figure 5: an external leakage in an actuator of the first module.

use vocabulary::ComponentKind::{Actuator, Sensor};

use super::place;
use super::story::FigureRun;
use crate::error::StudyError;
use crate::scenarios::ScenarioCampaign;
use figure::plot::{Figure, PanelRow};

const LEAK_AT_S: f64 = 10.8;

/// Figure 5 of the paper as SVG: chamber A of the first equipped module's first actuator leaks from
/// 10.8 s on; demands, residuals and divergences of its actuators, divergences of its gages.
///
/// # Errors
/// A structure without this actuator; a plant or diagnosers that cannot be made.
pub fn figure5(campaign: &ScenarioCampaign, seed: u64) -> Result<String, StudyError> {
    let leaking = place::actuator(&campaign.system.structure, 1, 1)?;
    let module = leaking.module.clone();
    let fault = place::external_leakage_a(campaign);
    let story = FigureRun::run(campaign, seed, vec![(LEAK_AT_S, leaking, fault)])?;
    let actuators = story.channels(1, Actuator);
    let gages = story.channels(1, Sensor);
    let mut demands = story.signals("Demands on the actuators", &actuators).marked(story.marks());
    let mut residuals =
        story.residuals("Residuals of the actuators", &actuators).marked(story.bare_marks());
    let mut divergences = story
        .divergences("Actuators: divergence over its threshold", &actuators)
        .marked(story.bare_marks());
    for panel in [&mut demands, &mut residuals, &mut divergences] {
        panel.x = panel.x.clone().bare();
    }
    let of_gages = story
        .divergences("Gages: divergence over its threshold", &gages)
        .marked(story.bare_marks());
    let close_ups = vec![
        story.close_up("Close-up of the actuators", &actuators, 0),
        story.close_up("Close-up of the gages", &gages, 0),
    ];
    let figure = Figure {
        title: format!("An actuator of {module} leaks"),
        subtitle: format!("Figure 5 of the paper, redrawn with seed {seed}. {}.", story.outcome()),
        description: format!(
            "Demands, residuals and divergences of the actuators and divergences of the gages of \
             {module} with an {}. {}.",
            story.faults(),
            story.outcome()
        ),
        rows: vec![
            PanelRow::new(110.0, vec![demands]),
            PanelRow::new(110.0, vec![residuals]),
            PanelRow::new(130.0, vec![divergences]),
            PanelRow::new(150.0, vec![of_gages]),
            PanelRow::new(150.0, close_ups),
        ],
    };
    Ok(figure.svg())
}
