//! `trusswatch web`: serves the web page.

mod access;

use std::net::SocketAddr;
use std::path::PathBuf;

use shell::shutdown::ShutdownFlags;
use shell::{logging, runtime};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::Link;
use crate::model;
use access::{AccessFlags, OneTimeLinkArguments};

/// Serve a web page of the structure: what needs attention, the drawing, evidence, history
///
/// It is a client of the network like the other commands, and may be started before anything else: the page then
/// shows that no module answers, and fills itself when they come. It needs nothing from elsewhere. The address is
/// logged. Without an address that others reach, only this computer sees the page.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<WebCommand>,
    /// The address on which the page is served
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8480", value_parser = address)]
    listen: SocketAddr,
    /// Description of the structure (TOML), which is drawn with the states of its components
    #[arg(long, value_name = "FILE")]
    drawing: Option<PathBuf>,
    /// Modules that should be there: they are shown even if they are never heard
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// Where what outlives the process is kept
    #[arg(long, value_name = "DIRECTORY", env = "STATE_DIRECTORY")]
    state_dir: Option<PathBuf>,
    #[command(flatten)]
    access: AccessFlags,
    #[command(flatten)]
    shutdown: ShutdownFlags,
    #[command(flatten)]
    link: Link,
}

/// What there is to do beside serving the page.
#[derive(Debug, clap::Subcommand)]
enum WebCommand {
    Link(OneTimeLinkArguments),
}

fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "use an address and a port, e.g. 127.0.0.1:8480".to_owned())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(WebCommand::Link(arguments)) = &arguments.command {
        return access::link(arguments);
    }
    logging::start();
    let target = arguments.link.target()?;
    let drawing = arguments.drawing.as_deref().map(model::read).transpose()?;
    let config = web::WebConfig {
        network: target.network().clone(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        listener: arguments.access.listener(arguments.listen)?,
        require_sign_in: arguments.access.require_sign_in,
        revoked: arguments.access.revoked()?,
        drawing,
        state_dir: arguments.state_dir.clone(),
        timeout: target.timeout,
    };
    Ok(runtime::until_done(arguments.shutdown, |shutdown| web::run(config, shutdown))?)
}
