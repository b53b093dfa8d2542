//! `trusswatch pki issue`: a holder's key and certificate.

use std::io::{self, Write};

use pki::lifetime::HOLDER_DAYS;
use pki::{Address, Authority, Holder, Lifetime};

use super::{Place, refused, summary, unreadable};
use crate::failure::Failure;

/// Make keys and certificates; never over one that is there
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Holder: MODULE, plant, router.NAME, operator.NAME or observer.NAME
    #[arg(required = true, value_name = "HOLDER")]
    holders: Vec<Holder>,
    /// IP address or DNS name that others connect to, of a single holder; may be repeated. Without any
    /// the holder can connect to others, but others cannot connect to it
    #[arg(long = "address", value_name = "ADDRESS")]
    addresses: Vec<Address>,
    #[command(flatten)]
    place: Place,
    /// Days until it has to be renewed; never beyond the authority's
    #[arg(long, default_value_t = HOLDER_DAYS, value_parser = clap::value_parser!(u16).range(1..=825))]
    days: u16,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { holders, addresses, place, .. } = arguments;
    if holders.len() > 1 && !addresses.is_empty() {
        let right = "issue them one by one, each with its own `--address`";
        return Err(Failure::usage(format!("holders have no address in common; {right}")));
    }
    let authority = Authority::open(&place.directory).map_err(refused)?;
    holders.iter().try_for_each(|holder| issue(holder, &authority, arguments))
}

fn issue(holder: &Holder, authority: &Authority, arguments: &Arguments) -> Result<(), Failure> {
    let (place, library) = (&arguments.place, arguments.place.library());
    let generations =
        library.generations().map_err(|error| unreadable(&place.directory, &error))?;
    let directory = library.place_of(holder);
    let lifetime = Lifetime::of_days(arguments.days);
    authority
        .issue(&directory, generations.of(holder.clone()), &arguments.addresses, lifetime)
        .map_err(refused)?;
    writeln!(io::stdout(), "{}", summary(&directory)?)?;
    Ok(())
}
