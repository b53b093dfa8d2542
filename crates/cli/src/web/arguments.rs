//! What `trusswatch web` takes.

use std::net::SocketAddr;
use std::path::PathBuf;

use shell::shutdown::ShutdownFlags;
use vocabulary::ModuleName;

use crate::link::Link;
use crate::web_access::{AccessFlags, LinkArguments};

/// Serve a web page of the structure: what needs attention, the drawing, evidence, history
///
/// It is a client of the network like the other commands, and may be started before anything else: the page then
/// shows that no module answers, and fills itself when they come. It needs nothing from elsewhere. The address is
/// logged. Without an address that others reach, only this computer sees the page.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Option<Command>,
    /// The address on which the page is served
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8480", value_parser = address)]
    pub(super) listen: SocketAddr,
    /// Description of the structure (TOML), which is drawn with the states of its components
    #[arg(long, value_name = "FILE")]
    pub(super) drawing: Option<PathBuf>,
    /// Modules that should be there: they are shown even if they are never heard
    #[arg(long, value_name = "MODULE", num_args = 1.., value_delimiter = ',')]
    pub(super) expect: Vec<ModuleName>,
    /// Where what outlives the process is kept
    #[arg(long, value_name = "DIRECTORY", env = "STATE_DIRECTORY")]
    pub(super) state_dir: Option<PathBuf>,
    #[command(flatten)]
    pub(super) access: AccessFlags,
    #[command(flatten)]
    pub(super) shutdown: ShutdownFlags,
    #[command(flatten)]
    pub(super) link: Link,
}

/// What there is to do beside serving the page.
#[derive(Debug, clap::Subcommand)]
pub(crate) enum Command {
    Link(LinkArguments),
}

fn address(text: &str) -> Result<SocketAddr, String> {
    text.parse().map_err(|_| "use an address and a port, e.g. 127.0.0.1:8480".to_owned())
}
