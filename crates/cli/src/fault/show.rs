//! `trusswatch fault show`: what kind of fault a component has, how large it is, and what was measured of it.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use observer::present;
use serde::Serialize;
use vocabulary::{FaultTransition, FreezeFrame, Mention};
use zenoh::Session;

use super::finding::find;
use super::frame;
use super::report::{USUAL_WIDTH, report};
use crate::failure::Failure;
use crate::link::{self, Link, Target};
use crate::paint::Paint;
use crate::table::terminal_width;
use crate::versioned;
use vocabulary::words::{printable, utc};

const EXAMPLES: &str = "\
Examples:
  trusswatch fault show module1/sensor/g3 --connect tcp/127.0.0.1:7447
  trusswatch fault show sensor/g3 --connect tcp/127.0.0.1:7447
  trusswatch fault show sensor/g3 --svg g3.svg --connect tcp/127.0.0.1:7447";

/// Show what kind of fault a component has, and how large it is
///
/// Asks the component's diagnoser for its state and for the latest identification: the kind of fault with its
/// probability and its size with a 95 % interval, or the contenders as long as it is not decided. Below is what was
/// measured around the onset of the fault, and what the most probable kind makes of it. Then follows the freeze frame:
/// what the diagnoser measured and computed of the component from two seconds before the fault to two seconds after it
/// was latched. Exit code 1 if there is no such component, or no freeze frame to be written to a file, and 4 if its
/// diagnoser does not answer.
#[derive(Debug, clap::Args)]
#[command(after_long_help = EXAMPLES)]
pub(super) struct Arguments {
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

/// The component for machines: its state, in which the identification has its signature, and the freeze frame.
#[derive(Debug, Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    transition: &'a FaultTransition,
    time: String,
    freeze_frame: Option<&'a FreezeFrame>,
}

/// What was found of a component.
struct Found {
    state: FaultTransition,
    /// The freeze frame of its fault, or why there is none; nothing if it has no fault.
    frame: Option<Result<FreezeFrame, String>>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let target = &arguments.link.target()?;
    let found = link::block_on(async {
        let session = target.open().await?;
        let found = look(&session, target, &arguments.component).await;
        session::close(&session).await;
        found
    })?;
    for (file, contents) in [
        (&arguments.svg, frame_svg as fn(&FreezeFrame) -> Result<Vec<u8>, Failure>),
        (&arguments.csv, frame_csv),
    ] {
        if let Some(file) = file {
            write_frame(file, &found, contents)?;
        }
    }
    print(arguments, &found)
}

fn frame_svg(frame: &FreezeFrame) -> Result<Vec<u8>, Failure> {
    Ok(frame::svg(frame).into_bytes())
}

fn frame_csv(frame: &FreezeFrame) -> Result<Vec<u8>, Failure> {
    frame::csv(frame).map_err(|error| Failure::runtime(format!("freeze frame: {error}")))
}

fn write_frame(
    file: &Path,
    found: &Found,
    contents: impl Fn(&FreezeFrame) -> Result<Vec<u8>, Failure>,
) -> Result<(), Failure> {
    let component = &found.state.component;
    let frame = match &found.frame {
        Some(Ok(frame)) => frame,
        Some(Err(why)) => {
            return Err(Failure::runtime(format!("{component}: no freeze frame: {why}")));
        }
        None => return Err(Failure::runtime(format!("{component} has no fault"))),
    };
    std::fs::write(file, contents(frame)?)
        .map_err(|error| Failure::runtime(format!("{}: {error}", file.display())))
}

async fn look(session: &Session, target: &Target, component: &Mention) -> Result<Found, Failure> {
    let looked = present(session, target.structure.as_ref(), &[], target.timeout).await;
    let scene = looked.map_err(link::refused)?;
    if !scene.has_heard_a_module() {
        return Err(target.no_module());
    }
    let mut state = find(&scene, component)?;
    let mut frame = None;
    if state.state().is_fault() {
        let (structure, component) = (&state.structure, &state.component);
        let latest = observer::identification(session, structure, component, target.timeout).await;
        let latest = latest.map_err(|error| {
            Failure::runtime(format!("{component}: {}", printable(&error.to_string())))
        })?;
        state.identification = latest.map(Box::new).or(state.identification);
        frame = Some(observer::freeze_frame_of(session, &state, target.timeout).await);
    }
    Ok(Found { state, frame })
}

fn print(arguments: &Arguments, found: &Found) -> Result<(), Failure> {
    let Found { state, frame } = found;
    let mut out = io::stdout().lock();
    if arguments.json {
        let freeze_frame = frame.as_ref().and_then(|frame| frame.as_ref().ok());
        let document = Document { transition: state, time: utc(state.time_unix_ns), freeze_frame };
        write!(out, "{}", versioned::text(&document)?)?;
        return Ok(out.flush()?);
    }
    let paint = Paint::of_stdout();
    let width = terminal_width();
    write!(out, "{}", report(state, width, paint))?;
    match frame {
        Some(Ok(frame)) => {
            write!(out, "\n{}", frame::text(frame, width.unwrap_or(USUAL_WIDTH), paint))?;
        }
        Some(Err(why)) => writeln!(out, "\nno freeze frame: {why}")?,
        None => {}
    }
    Ok(out.flush()?)
}
