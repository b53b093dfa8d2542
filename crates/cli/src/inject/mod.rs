//! `trusswatch inject`: faults for the simulated plant.

mod parameters;
mod report;

use std::time::Duration;

use names::fault::FaultKind;
use names::{Mention, Step, StructureName};
use observer::OrderError;
use wire::{Injected, Injection};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::{self, Link, Target};
use crate::wording::plain;
use parameters::Parameters;

const EXAMPLES: &str = "\
Faults and what they take:
  internal_leakage    --area-m2
  external_leakage_a  --area-m2
  external_leakage_b  --area-m2
  hard_over           nothing
  zero_output         nothing
  no_signal           nothing
  bias                --offset-m
  random_walk         --drift-m-per-s --increment-m

Examples:
  trusswatch inject module1/sensor/g2 bias --offset-m 1.5e-4 --connect tcp/127.0.0.1:7447
  trusswatch inject module1/actuator/a3 internal_leakage --area-m2 3e-7 --connect tcp/127.0.0.1:7447
  trusswatch inject module1/sensor/g2 --repair --connect tcp/127.0.0.1:7447";

/// Give a component of the simulated plant a fault, or repair it
///
/// The fault takes the place of any that the component has, and stays until it is repaired. Exit code 1 if
/// the plant refuses, and 4 if it does not answer: then the fault may or may not be there.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Component, e.g. `module1/sensor/g2`
    #[arg(value_name = "COMPONENT")]
    component: Mention,
    /// Its fault
    #[arg(
        value_name = "FAULT", value_parser = parameters::kinds(),
        required_unless_present = "repair", conflicts_with = "repair"
    )]
    kind: Option<FaultKind>,
    #[command(flatten)]
    parameters: Parameters,
    /// Take the component's fault away
    #[arg(long)]
    repair: bool,
    /// From this step of the plant on; without it, from the next
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
    let link = &arguments.link.target()?;
    let (structure, injected) = link::block_on(async {
        let session = link.open().await?;
        let given = give(&session, link, &injection).await;
        session::close(&session).await;
        given
    })?;
    report::print(&structure, &injection, &injected, arguments.json)
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

/// Sends the command to the plant, and returns the plant's structure.
async fn give(
    session: &Session,
    link: &Target,
    injection: &Injection,
) -> Result<(StructureName, Injected), Failure> {
    let structure = home(session, link).await?;
    let given = observer::inject(session, &structure, injection, link.timeout).await;
    let injected = given.map_err(|error| not_obeyed(injection, error))?;
    Ok((structure, injected))
}

/// The structure whose plant is there. One of several is not guessed at.
async fn home(session: &Session, link: &Target) -> Result<StructureName, Failure> {
    let seen = observer::plants(session, link.structure.as_ref(), link.timeout).await;
    let mut seen = seen.map_err(link::refused)?;
    if seen.len() > 1 {
        let names: Vec<String> = seen.iter().map(|name| format!("`{name}`")).collect();
        let names = names.join(" and ");
        return Err(Failure::usage(format!(
            "there are plants of {names}; say which with --structure"
        )));
    }
    seen.pop_first().ok_or_else(|| no_plant(link, link.timeout))
}

fn no_plant(link: &Target, within: Duration) -> Failure {
    let places = link.places();
    Failure::network(format!(
        "no plant was there at {places} within {within:?}; no command was sent"
    ))
}

fn not_obeyed(injection: &Injection, error: OrderError) -> Failure {
    let component = &injection.component;
    match error {
        OrderError::Refused(reason) => {
            Failure::runtime(format!("{component}: refused: {}", plain(&reason)))
        }
        error => {
            let error = plain(&error.to_string());
            Failure::network(format!(
                "{component}: {error}; the command may or may not have been carried out"
            ))
        }
    }
}
