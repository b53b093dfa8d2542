//! `trusswatch inject`: faults for the simulated plant.

mod parameters;

use serde_json::json;
use vocabulary::{Injected, Injection, Mention, Step, StructureName, fault::FaultKind};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::Link;
use crate::{output, plant_order};
use parameters::FaultParameters;

const EXAMPLES: &str = "\
Examples:
  trusswatch inject module1/sensor/g2 bias --offset-m 1.5e-4 --connect tcp/127.0.0.1:7447
  trusswatch inject module1/actuator/a3 internal_leakage --area-m2 3e-7 --connect tcp/127.0.0.1:7447
  trusswatch inject module1/sensor/g5 intermittent --offset-m 5e-5 --closed-s 0.5 --open-s 0.02 \\
    --connect tcp/127.0.0.1:7447
  trusswatch inject module1/sensor/g2 --repair --connect tcp/127.0.0.1:7447";

/// Give a component of the simulated plant a fault, or repair it
///
/// The fault replaces any other fault of the component and stays until it is repaired. Exit code 1 if
/// the plant refuses, and 4 if it does not answer: then the fault may or may not be present.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Component, e.g. `module1/sensor/g2`
    #[arg(value_name = "COMPONENT")]
    component: Mention,
    /// Kind of fault
    #[arg(
        value_name = "FAULT", value_parser = parameters::kinds(),
        required_unless_present = "repair", conflicts_with = "repair"
    )]
    kind: Option<FaultKind>,
    #[command(flatten)]
    parameters: FaultParameters,
    /// Remove the component's fault
    #[arg(long)]
    repair: bool,
    /// First step of the plant with the fault [default: the next]
    #[arg(long, value_name = "STEP")]
    at_step: Option<u64>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let injection = arguments.injection()?;
    let send = async |session: &Session, structure: &StructureName, timeout| {
        session::client::inject(session, structure, &injection, timeout).await
    };
    let (structure, injected) = plant_order::give(&arguments.link, &injection.component, send)?;
    let Injected { component, effective_step } = &injected;
    let fault = injection.fault;
    output::print(&if arguments.json {
        // The fault is `null` for a repair.
        output::line(&json!({
            "structure": structure,
            "component": component,
            "fault": fault,
            "effective_step": effective_step,
        }))?
    } else {
        let what = fault.map_or("repaired".to_owned(), |fault| fault.kind().to_string());
        format!("{component}: {what} from step {effective_step} on\n")
    })
}

impl Arguments {
    /// The command, checked before anything is sent.
    fn injection(&self) -> Result<Injection, Failure> {
        let fault = self.parameters.fault(self.kind).map_err(Failure::usage)?;
        let (component, at_step) = (self.component.clone(), self.at_step.map(Step));
        if let Some(fault) = fault {
            let (kind, wanted) = (fault.kind(), fault.kind().component_kind());
            if component.component.kind() != wanted {
                let problem = format!("`{component}` cannot have `{kind}`, a fault of a {wanted}");
                return Err(Failure::usage(problem));
            }
        }
        Ok(Injection { component, fault, at_step })
    }
}
