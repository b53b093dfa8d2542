//! `trusswatch pki authority`: a structure's authority.

use std::io::{self, Write};

use pki::lifetime::AUTHORITY_DAYS;
use pki::{Authority, Lifetime};
use vocabulary::StructureName;

use super::{Place, day, refused};
use crate::failure::Failure;

/// Make the authority of a structure; its key can sign a certificate for any name
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Name of the structure
    structure: StructureName,
    #[command(flatten)]
    place: Place,
    /// Days until the authority and all certificates have to be reissued
    #[arg(long, default_value_t = AUTHORITY_DAYS, value_parser = clap::value_parser!(u16).range(1..=7305))]
    days: u16,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (structure, directory) = (arguments.structure.clone(), &arguments.place.directory);
    let lifetime = Lifetime::of_days(arguments.days);
    let authority = Authority::create(directory, structure, lifetime).map_err(refused)?;
    let (structure, until) = (authority.structure(), day(authority.certificate().lifetime));
    let place = directory.join(pki::holder::AUTHORITY);
    writeln!(io::stdout(), "{}: authority of {structure}, until {until}", place.display())?;
    Ok(())
}
