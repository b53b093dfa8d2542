//! `trusswatch web`: serves the web page.

mod devices;
mod one_time_link;

use std::net::SocketAddr;
use std::path::PathBuf;

use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};
use vocabulary::ModuleName;
use web::PageAccess;

use crate::failure::Failure;
use crate::link::Link;
use crate::model;
use devices::DevicesArguments;
use one_time_link::OneTimeLinkArguments;

/// Serve a web page of the structure: alarms, drawing, evidence, history
///
/// It is a client of the network like the other commands, and may start before the diagnosers: the page then
/// shows that no module answers, and shows modules as they appear. The page loads nothing from other servers. The
/// address is logged; with the default address, only this computer can open the page.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<WebCommand>,
    /// Address and port of the page
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8480", value_parser = address)]
    listen: SocketAddr,
    /// Description of the structure (TOML), drawn with the states of its components
    #[arg(long, value_name = "FILE")]
    drawing: Option<PathBuf>,
    /// Modules that should be present; a missing one is shown as not answering
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// Directory of one-time links and of the page's records: events, margins
    #[arg(long, value_name = "DIRECTORY", env = "STATE_DIRECTORY")]
    state_dir: Option<PathBuf>,
    /// Health address of `trusswatch notify`: the overview says when notifications are not delivered
    #[arg(long, value_name = "HOST:PORT")]
    notifier: Option<String>,
    #[command(flatten)]
    access: PageAccess,
    #[command(flatten)]
    shutdown: ShutdownFlags,
    #[command(flatten)]
    link: Link,
}

/// Further commands beside serving the page.
#[derive(Debug, clap::Subcommand)]
enum WebCommand {
    Link(OneTimeLinkArguments),
    Devices(DevicesArguments),
}

fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "use an address and a port, e.g. 127.0.0.1:8480".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    match &arguments.command {
        Some(WebCommand::Link(arguments)) => return one_time_link::run(arguments),
        Some(WebCommand::Devices(arguments)) => return devices::run(arguments),
        None => {}
    }
    check(arguments)?;
    logging::start();
    let target = arguments.link.target()?;
    let drawing = arguments.drawing.as_deref().map(model::read).transpose()?;
    let config = web::WebConfig {
        network: target.network().clone(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        listen: arguments.listen,
        access: arguments.access.clone(),
        drawing,
        state_dir: arguments.state_dir.clone(),
        timeout: target.timeout,
        notifier: arguments.notifier.clone(),
    };
    Ok(runtime::until_done(arguments.shutdown, |shutdown| web::run(config, shutdown))?)
}

/// The directory of revoked certificates must exist, so that a wrong name does not admit users with revoked ones.
fn check(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { access, listen, .. } = arguments;
    access.check(*listen).map_err(|error| Failure::usage(error.to_string()))?;
    if let Some(directory) = &access.revoked
        && let Err(error) = std::fs::read_dir(directory)
    {
        let right = "make it, empty if no certificate is revoked";
        return Err(Failure::input(format!("{}: {error}; {right}", directory.display())));
    }
    Ok(())
}
