//! `trusswatch pki renew`: certificates with a new lifetime.

use std::io::{self, Write};

use pki::lifetime::HOLDER_DAYS;
use pki::{Authority, Certificate, Holder, Lifetime};

use super::{Place, day, refused, unreadable};
use crate::failure::Failure;

/// Give certificates a new lifetime; names, addresses and keys stay as they are
///
/// Only `certificate.pem` is replaced, and only that has to be brought to the holder; its key need not
/// even be here. The holder reads it at start; nobody else has to be restarted.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Holders of the certificates
    #[arg(required_unless_present = "all")]
    holders: Vec<Holder>,
    /// The certificates of all holders
    #[arg(long, conflicts_with = "holders")]
    all: bool,
    #[command(flatten)]
    place: Place,
    /// Days until they have to be renewed again; never beyond the authority's
    #[arg(long, default_value_t = HOLDER_DAYS, value_parser = clap::value_parser!(u16).range(1..=825))]
    days: u16,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (place, library) = (&arguments.place, arguments.place.library());
    let authority = Authority::open(&place.directory).map_err(refused)?;
    let all = library.holders().map_err(|error| unreadable(&place.directory, &error))?;
    let holders = if arguments.all { &all } else { &arguments.holders };
    let mut out = io::stdout().lock();
    let mut mistakes = Vec::new();
    for holder in holders {
        let identity = library.identity(holder);
        match authority.renew(&identity, Lifetime::of_days(arguments.days)) {
            Ok(()) => {
                let until = Certificate::read(&identity.certificate).map(|read| day(read.lifetime));
                let until = until.unwrap_or_else(|error| error.to_string());
                writeln!(out, "{}: until {until}", identity.certificate.display())?;
            }
            Err(error) => mistakes.push(error.to_string()),
        }
    }
    if mistakes.is_empty() { Ok(()) } else { Err(Failure::inputs(mistakes)) }
}
