//! Figure 6: a hard-over in an actuator of the first module, which the second module feels.

use vocabulary::{
    ComponentKind::{Actuator, Sensor},
    ComponentPath, ModuleName,
    fault::Fault,
};

use super::place;
use super::story::FigureRun;
use crate::error::StudyError;
use crate::scenarios::ScenarioCampaign;
use figure::plot::{Figure, PanelRow};

const HARD_OVER_AT_S: f64 = 10.8;

/// Most runs searched for one that affects the neighbour.
const RUNS: u64 = 20;

/// Figure 6 of the paper as SVG: the first equipped module's third actuator goes hard over at 10.8 s; demands and
/// divergences of the actuators of all modules, readings and divergences of the gages of the first two. The effect on
/// the neighbour depends on the demand at the moment when the valve opens: of the runs from `seed` on, the figure shows
/// the first in which any of its channels changes, if there is one among a few.
///
/// # Errors
/// A structure without this actuator or with a single equipped module; a plant or diagnosers that
/// cannot be made.
pub fn figure6(campaign: &ScenarioCampaign, seed: u64) -> Result<String, StudyError> {
    let faulty = place::actuator(&campaign.system.structure, 1, 3)?;
    let modules =
        [&faulty.module, &place::module(&campaign.system.structure, 2)?.name].map(Clone::clone);
    let (drawn, story) = felt_by(campaign, seed, &faulty, &modules[1])?;
    let actuators = story.all_channels(Actuator);
    let mut demands = story.signals("Demands on the actuators", &actuators).marked(story.marks());
    demands.x = demands.x.bare();
    let divergences = story
        .divergences("Actuators: divergence over its threshold", &actuators)
        .marked(story.bare_marks());
    let gages = [1, 2].map(|number| story.channels(number, Sensor));
    let readings = modules.iter().zip(&gages).map(|(module, gages)| {
        let panel = story.signals(format!("Readings of {module}"), gages);
        let mut panel = panel.marked(story.bare_marks());
        panel.x = panel.x.bare();
        panel
    });
    let of_gages = modules.iter().zip(&gages).map(|(module, gages)| {
        let panel = story.divergences(format!("Gages of {module}: divergence"), gages);
        panel.marked(story.bare_marks()).marked(story.explanation(gages))
    });
    let close_ups = modules.iter().zip(&gages).map(|(module, gages)| {
        story.close_up(format!("Close-up of the gages of {module}"), gages, 0)
    });
    let [near, far] = &modules;
    let figure = Figure {
        title: format!("A hard-over in {near}, and what {far} sees of it"),
        subtitle: format!(
            "Figure 6 of the paper, redrawn with seed {drawn}{}. {}.",
            if drawn == seed {
                String::new()
            } else {
                format!(", the first from {seed} on in which {far} changes too")
            },
            story.outcome()
        ),
        description: format!(
            "Demands and divergences of the actuators, readings and divergences of the gages of \
             {near} and {far} with a {}. {}.",
            story.faults(),
            story.outcome()
        ),
        rows: vec![
            PanelRow::new(130.0, vec![demands]),
            PanelRow::new(150.0, vec![divergences]),
            PanelRow::new(140.0, readings.collect()),
            PanelRow::new(150.0, of_gages.collect()),
            PanelRow::new(150.0, close_ups.collect()),
        ],
    };
    Ok(figure.svg())
}

/// The first run from `seed` on in which a channel of `neighbour` changes, and its seed; failing that, the first run.
fn felt_by(
    campaign: &ScenarioCampaign,
    seed: u64,
    faulty: &ComponentPath,
    neighbour: &ModuleName,
) -> Result<(u64, FigureRun), StudyError> {
    let run = |seed| {
        FigureRun::run(campaign, seed, vec![(HARD_OVER_AT_S, faulty.clone(), Fault::HardOver {})])
    };
    let first = run(seed)?;
    let felt =
        |story: &FigureRun| story.findings.iter().any(|found| found.component.module == *neighbour);
    if felt(&first) {
        return Ok((seed, first));
    }
    for seed in (1..RUNS).map(|more| seed.wrapping_add(more)) {
        let story = run(seed)?;
        if felt(&story) {
            return Ok((seed, story));
        }
    }
    Ok((seed, first))
}
