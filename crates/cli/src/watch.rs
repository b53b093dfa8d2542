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
/// It can be started before anything else and stays when the network goes away. `?` lists the keys. Orders are
/// given in the name of the operator whose certificate is shown; without TLS, in the name that --by says. Colours
/// are left out with NO_COLOR; symbols and words say the same. Where LC_ALL, LC_CTYPE or LANG says that the terminal has
/// no UTF-8, symbols are ASCII.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Modules that should be there: until they are heard they stand among the alarms
    #[arg(long, value_name = "MODULE", value_delimiter = ',')]
    expect: Vec<ModuleName>,
    /// Who gives orders, where no operator's certificate says so [default: the user and this machine, USER@HOST]
    #[arg(long, value_name = "WHO")]
    by: Option<String>,
    #[command(flatten)]
    link: Link,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    if !io::stdout().is_terminal() {
        return Err(Failure::usage(
            "standard output is not a terminal; `trusswatch follow` prints events line by line, and \
             `trusswatch faults` prints what is the case now",
        ));
    }
    if std::env::var_os("TERM").is_some_and(|terminal| terminal == "dumb") {
        return Err(Failure::usage(
            "the terminal has no cursor control (TERM=dumb); `trusswatch follow` prints events line by line, and \
             `trusswatch faults` prints what is the case now",
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

/// The issuer of orders. A certificate that does not belong to an operator permits none, because access control would
/// deny them.
fn issuer(
    arguments: &Arguments,
    target: &LinkTarget,
) -> Result<Result<OrderIssuer, String>, Failure> {
    let operator = target.operator();
    if operator.is_none() && target.network().tls.is_some() {
        return Ok(Err("the certificate that is shown is not an operator's".to_owned()));
    }
    match order::issuer(arguments.by.as_deref(), operator.as_ref()) {
        Ok(by) => Ok(Ok(OrderIssuer { by, operator })),
        // Observing needs no name.
        Err(failure) if arguments.by.is_none() => Ok(Err(failure.in_words())),
        Err(failure) => Err(failure),
    }
}
