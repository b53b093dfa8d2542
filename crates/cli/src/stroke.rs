//! `trusswatch stroke`: stroke tests of the simulated plant.

use serde_json::json;
use vocabulary::words::force;
use vocabulary::{ComponentKind, Mention, Stroke, StrokeBegun, StructureName};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::Link;
use crate::{output, plant_order};

const EXAMPLES: &str = "\
Examples:
  trusswatch stroke module1/actuator/a3 --connect tcp/127.0.0.1:7447
  trusswatch stroke module1/actuator/a3 --force-n 20e3 --duration-s 30 --connect tcp/127.0.0.1:7447";

/// Stroke a cylinder of the simulated plant
///
/// The demand of the cylinder swings smoothly by the force, first up and then down, while the demands of
/// the others stand still; then the controller goes on. Only the simulated plant takes this command, and
/// one stroke at a time. Exit code 1 if the plant refuses, and 4 if it does not answer: then the stroke may
/// or may not be under way.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Actuator, e.g. `module1/actuator/a3`
    #[arg(value_name = "COMPONENT")]
    component: Mention,
    /// Largest change of its demand, both ways [N]
    #[arg(
        long, value_name = "NUMBER", allow_hyphen_values = true,
        default_value_t = Stroke::FORCE_N, value_parser = size
    )]
    force_n: f64,
    /// How long the stroke takes [s]
    #[arg(
        long, value_name = "NUMBER", allow_hyphen_values = true,
        default_value_t = Stroke::DURATION_S, value_parser = size
    )]
    duration_s: f64,
    /// End it early once a gage reads more than this strain, either way
    #[arg(
        long, value_name = "NUMBER", allow_hyphen_values = true,
        default_value_t = Stroke::LARGEST_STRAIN, value_parser = size
    )]
    largest_strain: f64,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

/// Parses a size; the plant checks its range.
fn size(text: &str) -> Result<f64, String> {
    let size = text.parse::<f64>().ok().filter(|size| *size > 0.0 && size.is_finite());
    size.ok_or_else(|| "use a finite number above 0".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let stroke = arguments.stroke()?;
    let send = async |session: &Session, structure: &StructureName, timeout| {
        session::client::stroke(session, structure, &stroke, timeout).await
    };
    let (structure, begun) = plant_order::give(&arguments.link, &stroke.component, send)?;
    let Stroke { force_n, duration_s, largest_strain, .. } = stroke;
    let StrokeBegun { component, first_step, last_step } = &begun;
    output::print(&if arguments.json {
        output::line(&json!({
            "structure": structure,
            "component": component,
            "force_n": force_n,
            "duration_s": duration_s,
            "largest_strain": largest_strain,
            "first_step": first_step,
            "last_step": last_step,
        }))?
    } else {
        let size = force(force_n);
        format!("{component}: stroke of ±{size} from step {first_step} to step {last_step}\n")
    })
}

impl Arguments {
    /// The command, checked before it is sent.
    fn stroke(&self) -> Result<Stroke, Failure> {
        let Arguments { force_n, duration_s, largest_strain, .. } = *self;
        let component = self.component.clone();
        let (kind, wanted) = (component.component.kind(), ComponentKind::Actuator);
        if kind != wanted {
            let problem = format!("`{component}` is a {kind}; only an {wanted} makes strokes");
            return Err(Failure::usage(problem));
        }
        Ok(Stroke { component, force_n, duration_s, largest_strain })
    }
}
