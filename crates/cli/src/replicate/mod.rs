//! `trusswatch replicate`: configures many copies of a structure side by side.
//!
//! | file | job |
//! |---|---|
//! | `template` | a diagnoser's file, and its version for a copy |
//! | `neighbourhood` | determines peers |
//! | `layout` | the endpoints of each process |
//! | `directory` | the output directory |

pub(crate) mod directory;
pub(crate) mod layout;
mod neighbourhood;
mod template;

use std::io::Write;
use std::path::{Path, PathBuf};

use daemon::config::{PlantFlags, load_plant};
use session::endpoint;
use toml::Value;
use truss::{Structure, copy_prefix};
use zenoh::config::EndPoint;

use crate::failure::Failure;
use crate::output;
use directory::Directory;
use layout::NetworkLayout;
use neighbourhood::Neighbourhood;
use template::{Template, read_table, unusable};

/// Most copies; with more, the plant alone takes minutes to start.
const MOST_COPIES: usize = 500;

/// Write the configurations of many copies of a structure side by side
///
/// Each copy stands by itself, with a controller, gusts, loads and noise of its own, so that its modules
/// see what those of the original see, and the original's thresholds are theirs. What grows is the
/// network. The directory gets `structure.toml`, `plant.toml` and, for each equipped module, the
/// configuration of its diagnoser with its own part of the structure and its thresholds. All of them are
/// processes of this machine; on a real network `[network]` of each is to be changed.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Configurations of the diagnosers, one for each equipped module
    #[arg(required = true, value_name = "MODULE.toml")]
    modules: Vec<PathBuf>,
    /// Configuration of the plant, which names the structure
    #[arg(long, value_name = "FILE")]
    plant: PathBuf,
    /// How many copies: 1 to 500
    #[arg(long, value_name = "N")]
    copies: usize,
    /// The directory that takes the files; a new or an empty one
    #[arg(long, value_name = "DIRECTORY")]
    out: PathBuf,
    /// Peers of a module are all modules of its own copy and of this many copies on either side; without
    /// this option those that its configuration names, in its own copy
    #[arg(long, value_name = "N")]
    neighbours: Option<usize>,
    /// Every process is a client of a router that listens there, whose settings are written too; without
    /// this option every process connects to the plant and to those of its peers that come before it
    #[arg(long, value_name = "ENDPOINT", value_parser = endpoint, conflicts_with = "first_port")]
    router: Option<EndPoint>,
    /// The port on which the plant listens; the modules take those that follow
    #[arg(long, value_name = "PORT", default_value_t = 7447)]
    first_port: u16,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let copies = arguments.copies;
    if !(1..=MOST_COPIES).contains(&copies) {
        let message = format!("`--copies` is {copies}; use 1 to {MOST_COPIES}");
        return Err(Failure::usage(message));
    }
    let plant = load_plant(&arguments.plant, &PlantFlags::default()).map_err(|e| unusable(&e))?;
    let templates = templates(&arguments.modules, &plant.structure)?;
    let row = plant
        .structure
        .row(copies)
        .map_err(|error| Failure::input(format!("{}: {error}", arguments.plant.display())))?;
    let neighbourhood = Neighbourhood::new(&templates, copies, arguments.neighbours);
    let layout = match &arguments.router {
        Some(endpoint) => NetworkLayout::star(endpoint),
        None => NetworkLayout::mesh(arguments.first_port, neighbourhood.members())?,
    };
    let directory = Directory::claim(&arguments.out)?;
    directory.write("structure.toml", &structure_text(&row, &plant.structure, copies))?;
    directory.write("plant.toml", &plant_text(&arguments.plant, &layout, copies)?)?;
    if let Some((file, text)) = layout.router_settings() {
        directory.write(file, &text)?;
    }
    for member in 0..neighbourhood.members() {
        let (copy, kind) = neighbourhood.place(member);
        let network = layout.of_module(member, &neighbourhood.linked(member));
        let peers = neighbourhood.peer_names(member);
        templates[kind].copied(copy, copies, &row.name, peers, network)?.write(&directory)?;
    }
    directory.keep();
    let mut out = output::stdout();
    writeln!(
        out,
        "{}: {copies} copies of `{}`, {} diagnosers",
        arguments.out.display(),
        plant.structure.name,
        neighbourhood.members()
    )?;
    Ok(out.flush()?)
}

/// The templates in the order of the structure's equipped modules.
fn templates(files: &[PathBuf], structure: &Structure) -> Result<Vec<Template>, Failure> {
    let mut read = files.iter().map(|file| Template::read(file)).collect::<Result<Vec<_>, _>>()?;
    let mut ordered = Vec::with_capacity(read.len());
    for module in structure.equipped() {
        let found = read.iter().position(|template| template.module() == &module.name);
        let Some(place) = found else {
            let name = &module.name;
            return Err(Failure::usage(format!(
                "no configuration of the equipped module `{name}` is given; add it"
            )));
        };
        ordered.push(read.remove(place));
    }
    match read.first() {
        Some(superfluous) => Err(Failure::usage(format!(
            "{}: `{}` is not an equipped module of `{}`, or is given twice; remove it",
            superfluous.file().display(),
            superfluous.module(),
            structure.name
        ))),
        None => Ok(ordered),
    }
}

fn structure_text(row: &Structure, original: &Structure, copies: usize) -> String {
    let original = &original.name;
    format!(
        "# {copies} copies of the structure `{original}` side by side, each standing by itself. Made by\n\
         # `trusswatch replicate`.\n{}",
        row.to_toml()
    )
}

/// The loads on the nodes of each copy.
fn of_all_copies(loads: &[Value], copies: usize) -> Vec<Value> {
    let of_copy = |copy| {
        let prefix = copy_prefix(copy, copies);
        loads.iter().cloned().map(move |mut load| {
            for key in ["paths", "nodes"] {
                if let Some(nodes) = load.get_mut(key) {
                    prefix_names(nodes, &prefix);
                }
            }
            load
        })
    };
    (0..copies).flat_map(of_copy).collect()
}

fn prefix_names(names: &mut Value, prefix: &str) {
    match names {
        Value::String(name) => name.insert_str(0, prefix),
        Value::Array(names) => names.iter_mut().for_each(|names| prefix_names(names, prefix)),
        _ => {}
    }
}

fn plant_text(file: &Path, layout: &NetworkLayout, copies: usize) -> Result<String, Failure> {
    let mut table = read_table(file)?;
    table.insert("structure".into(), "structure.toml".into());
    table.insert("network".into(), layout.of_plant().into());
    // The entries name modules of the original.
    table.remove("wait_for");
    table.remove("schedule");
    for kind in ["moving_loads", "recorded_loads"] {
        let loads = table.get_mut("plant").and_then(|plant| plant.get_mut(kind));
        if let Some(loads) = loads.and_then(Value::as_array_mut) {
            *loads = of_all_copies(loads, copies);
        }
    }
    Ok(format!(
        "# The plant of structure.toml. Made of {} by `trusswatch replicate`.\n{table}",
        file.display()
    ))
}
