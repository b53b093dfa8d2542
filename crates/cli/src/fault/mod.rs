//! `trusswatch fault`: shows a component's fault, shelves or suppresses alarms, and shuts cylinders off.

mod finding;
mod frame;
mod report;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use serde_json::json;
use session::client::present;
use vocabulary::words::{printable, utc};
use vocabulary::{ComponentPath, FaultTransition, FreezeFrame, Mention};
use zenoh::Session;

use crate::failure::Failure;
use crate::link::{Link, LinkTarget};
use crate::paint::Paint;
use crate::table::terminal_width;
use crate::{order, output};
use finding::find;
use report::{USUAL_WIDTH, report};

/// Show the fault of a component; shelve its alarm, suppress the alarms of a module, or shut a cylinder off
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: FaultCommand,
}

#[derive(Debug, Subcommand)]
enum FaultCommand {
    Show(ShowArguments),
    Shelve(order::ShelveArguments),
    Unshelve(order::UnshelveArguments),
    Suppress(order::SuppressArguments),
    Unsuppress(order::UnsuppressArguments),
    ShutOff(order::ShutOffArguments),
    PutBack(order::PutBackArguments),
    Declare(order::DeclareArguments),
}

const EXAMPLES: &str = "\
Examples:
  trusswatch fault show module1/sensor/g3 --connect tcp/127.0.0.1:7447
  trusswatch fault show sensor/g3 --connect tcp/127.0.0.1:7447
  trusswatch fault show sensor/g3 --svg g3.svg --connect tcp/127.0.0.1:7447";

/// Show the kind and size of a component's fault
///
/// Queries the component's diagnoser for its state and for the latest identification: the kind of fault with its
/// probability and its size with a 95 % interval, or the contenders until the evidence decides. The measured signal
/// around the onset of the fault is shown with the prediction of the most probable kind. The freeze frame follows:
/// measured and computed values of the component from two seconds before the onset to two seconds after the fault was
/// latched. Exit code 1 if the component does not exist or has no freeze frame to write to a file; 4 if its
/// diagnoser does not answer.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
struct ShowArguments {
    /// Component, e.g. `module1/sensor/g3`; without the module if only one has such a component
    #[arg(value_name = "COMPONENT")]
    component: Mention,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
    /// Draw the freeze frame into this file, as SVG
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write the freeze frame into this file, as CSV: one row a step
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        FaultCommand::Show(arguments) => show(arguments),
        FaultCommand::Shelve(arguments) => order::shelve(arguments),
        FaultCommand::Unshelve(arguments) => order::unshelve(arguments),
        FaultCommand::Suppress(arguments) => order::suppress(arguments),
        FaultCommand::Unsuppress(arguments) => order::unsuppress(arguments),
        FaultCommand::ShutOff(arguments) => order::shut_off(arguments),
        FaultCommand::PutBack(arguments) => order::put_back(arguments),
        FaultCommand::Declare(arguments) => order::declare(arguments),
    }
}

/// The freeze frame of a fault, or the reason why it is missing; `None` if no fault of the component is declared.
type FoundFrame = Option<Result<FreezeFrame, String>>;

fn show(arguments: &ShowArguments) -> Result<(), Failure> {
    let link = &arguments.link.target()?;
    let (state, frame) =
        link.with_session(async |session| query(session, link, &arguments.component).await)?;
    let component = &state.component;
    if let Some(file) = &arguments.svg {
        write(file, figure::freeze_frame::svg(latched_frame(component, &frame)?).as_bytes())?;
    }
    if let Some(file) = &arguments.csv {
        let rows = frame::csv(latched_frame(component, &frame)?);
        write(file, &rows.map_err(|error| Failure::runtime(format!("freeze frame: {error}")))?)?;
    }
    output::print(&if arguments.json {
        let freeze_frame = frame.as_ref().and_then(|frame| frame.as_ref().ok());
        let fields = json!({ "time": utc(state.time_unix_ns), "freeze_frame": freeze_frame });
        output::text(&output::with(&state, fields))?
    } else {
        text(&state, &frame)
    })
}

fn text(state: &FaultTransition, frame: &FoundFrame) -> String {
    let (paint, width) = (Paint::of_stdout(), terminal_width());
    let mut text = report(state, width, paint);
    match frame {
        Some(Ok(frame)) => {
            text += &format!("\n{}", frame::text(frame, width.unwrap_or(USUAL_WIDTH), paint));
        }
        Some(Err(why)) => text += &format!("\nno freeze frame: {why}\n"),
        None => {}
    }
    text
}

fn latched_frame<'a>(
    component: &ComponentPath,
    frame: &'a FoundFrame,
) -> Result<&'a FreezeFrame, Failure> {
    match frame {
        Some(Ok(frame)) => Ok(frame),
        Some(Err(why)) => Err(Failure::runtime(format!("{component}: no freeze frame: {why}"))),
        None => Err(Failure::runtime(format!("{component}: no fault is declared"))),
    }
}

fn write(file: &Path, contents: &[u8]) -> Result<(), Failure> {
    std::fs::write(file, contents).map_err(|error| Failure::unwritable(file, error))
}

/// The component's state, including the signature in its identification, and its freeze frame.
async fn query(
    session: &Session,
    link: &LinkTarget,
    component: &Mention,
) -> Result<(FaultTransition, FoundFrame), Failure> {
    let scene = present(session, link.structure.as_ref(), &[], link.timeout).await?;
    if !scene.has_heard_a_module() {
        return Err(link.no_module());
    }
    let mut state = find(&scene, component)?;
    if !state.state().is_fault() {
        return Ok((state, None));
    }
    let (structure, component) = (&state.structure, &state.component);
    let latest = session::client::identification(session, structure, component, link.timeout).await;
    let latest = latest.map_err(|error| {
        Failure::runtime(format!("{component}: {}", printable(&error.to_string())))
    })?;
    state.identification = latest.map(Box::new).or(state.identification);
    let frame = session::client::freeze_frame_of(session, &state, link.timeout).await;
    Ok((state, Some(frame)))
}
