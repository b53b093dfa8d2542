//! `trusswatch watch`: the terminal view.

use std::io::{self, IsTerminal};

use terminal::{OrderIssuer, ViewSettings};
use vocabulary::ModuleName;

use crate::failure::Failure;
use crate::link::{self, Link, LinkTarget};
use crate::order;
use crate::output;
use crate::paint::Paint;

/// Watch modules, alarms and events on the terminal, and issue commands by key
///
/// It may start before the diagnosers, and keeps running when the network fails. `?` lists the keys. Commands
/// are issued under the name in the operator's certificate; without TLS, under the name in --by. NO_COLOR switches
/// colours off; symbols and words give the same information. If LC_ALL, LC_CTYPE or LANG does not name UTF-8, symbols are
/// ASCII.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Modules that should be present; a missing one is listed among the alarms
    #[arg(long, value_name = "MODULE", value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// Name of the person who issues commands, if no operator's certificate is used [default: USER@HOST]
    #[arg(long, value_name = "WHO")]
    by: Option<String>,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if !io::stdout().is_terminal() {
        return Err(Failure::usage(
            "standard output is not a terminal; `trusswatch follow` prints events line by line, and \
             `trusswatch faults` prints the present state",
        ));
    }
    if std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb") {
        return Err(Failure::usage(
            "the terminal has no cursor control (TERM=dumb); `trusswatch follow` prints events line by line, and \
             `trusswatch faults` prints the present state",
        ));
    }
    let target = arguments.link.target()?;
    let settings = settings(arguments, &target)?;
    let open = move || {
        let target = target.clone();
        async move { target.open().await.map_err(|failure| failure.in_words()) }
    };
    link::block_on_and_leave(async {
        let outcome = terminal::run(settings, open).await;
        outcome.map_err(|error| Failure::runtime(error.to_string()))
    })
}

fn settings(arguments: &Arguments, target: &LinkTarget) -> Result<ViewSettings, Failure> {
    Ok(ViewSettings {
        places: target.places(),
        structure: target.structure.clone(),
        expected: arguments.expect.clone(),
        timeout: target.timeout,
        issuer: issuer(arguments, target)?,
        colours: Paint::of_stdout().has_colours(),
        ascii: output::is_ascii_terminal(),
    })
}

/// The issuer of commands; none with the certificate of another holder than an operator, because access control would deny
/// them.
fn issuer(
    arguments: &Arguments,
    target: &LinkTarget,
) -> Result<Result<OrderIssuer, String>, Failure> {
    let operator = target.operator();
    if operator.is_none() && target.network().tls.is_some() {
        return Ok(Err("the certificate is not an operator's".to_owned()));
    }
    match order::issuer(arguments.by.as_deref(), operator.as_ref()) {
        Ok(by) => Ok(Ok(OrderIssuer { by, operator })),
        // Observing needs no name.
        Err(failure) if arguments.by.is_none() => Ok(Err(failure.in_words())),
        Err(failure) => Err(failure),
    }
}
