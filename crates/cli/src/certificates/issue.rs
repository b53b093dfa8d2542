//! `trusswatch pki authority`, `issue` and `renew`: creates a structure's authority, and issues keys and certificates.

use std::io::Write;

use pki::lifetime::{AUTHORITY_DAYS, HOLDER_DAYS};
use pki::{Address, Authority, Certificate, Holder, Lifetime};
use vocabulary::StructureName;

use super::{CertificateDirectory, day, summary};
use crate::failure::Failure;
use crate::output;

/// Make the authority of a structure; its key can sign a certificate for any name
#[derive(Debug, clap::Args)]
pub(super) struct AuthorityArguments {
    /// Name of the structure
    structure: StructureName,
    #[command(flatten)]
    place: CertificateDirectory,
    /// Days until the authority and all certificates have to be reissued
    #[arg(long, default_value_t = AUTHORITY_DAYS, value_parser = clap::value_parser!(u16).range(1..=7305))]
    days: u16,
}

pub(super) fn make_authority(arguments: &AuthorityArguments) -> Result<(), Failure> {
    let (structure, directory) = (arguments.structure.clone(), &arguments.place.directory);
    let lifetime = Lifetime::of_days(arguments.days);
    let authority = Authority::create(directory, structure, lifetime)?;
    let (structure, until) = (authority.structure(), day(authority.certificate().lifetime));
    let place = directory.join(pki::holder::AUTHORITY);
    writeln!(output::stdout(), "{}: authority of {structure}, until {until}", place.display())?;
    Ok(())
}

/// Make keys and certificates; never overwrites existing ones
#[derive(Debug, clap::Args)]
pub(super) struct IssueArguments {
    /// Holder: MODULE, plant, router.NAME, operator.NAME or observer.NAME
    #[arg(required = true, value_name = "HOLDER")]
    holders: Vec<Holder>,
    /// IP address or DNS name at which others connect to the holder, with a single holder; may be repeated. A holder
    /// without addresses can connect to others, but others cannot connect to it
    #[arg(long = "address", value_name = "ADDRESS")]
    addresses: Vec<Address>,
    #[command(flatten)]
    place: CertificateDirectory,
    /// Days of validity, at most to the authority's end
    #[arg(long, default_value_t = HOLDER_DAYS, value_parser = clap::value_parser!(u16).range(1..=825))]
    days: u16,
}

pub(super) fn issue(arguments: &IssueArguments) -> Result<(), Failure> {
    let IssueArguments { holders, addresses, place, .. } = arguments;
    if holders.len() > 1 && !addresses.is_empty() {
        let right = "issue them one by one, each with its own `--address`";
        return Err(Failure::usage(format!("`--address` with several holders; {right}")));
    }
    let authority = Authority::open(&place.directory)?;
    holders.iter().try_for_each(|holder| issue_one(holder, &authority, arguments))
}

fn issue_one(
    holder: &Holder,
    authority: &Authority,
    arguments: &IssueArguments,
) -> Result<(), Failure> {
    let (place, library) = (&arguments.place, arguments.place.library());
    let generations =
        library.generations().map_err(|error| Failure::unreadable(&place.directory, error))?;
    let directory = library.place_of(holder);
    let lifetime = Lifetime::of_days(arguments.days);
    authority.issue(&directory, generations.of(holder.clone()), &arguments.addresses, lifetime)?;
    writeln!(output::stdout(), "{}", summary(&directory)?)?;
    Ok(())
}

/// Give certificates a new lifetime; names, addresses and keys stay as they are
///
/// Replaces only `certificate.pem`, without needing the key; copy it to the holder. The holder reads it at start; no
/// other process has to be restarted.
#[derive(Debug, clap::Args)]
pub(super) struct RenewArguments {
    /// Holders of the certificates
    #[arg(required_unless_present = "all")]
    holders: Vec<Holder>,
    /// The certificates of all holders
    #[arg(long, conflicts_with = "holders")]
    all: bool,
    #[command(flatten)]
    place: CertificateDirectory,
    /// Days of validity, at most to the authority's end
    #[arg(long, default_value_t = HOLDER_DAYS, value_parser = clap::value_parser!(u16).range(1..=825))]
    days: u16,
}

pub(super) fn renew(arguments: &RenewArguments) -> Result<(), Failure> {
    let (place, library) = (&arguments.place, arguments.place.library());
    let authority = Authority::open(&place.directory)?;
    let all = library.holders().map_err(|error| Failure::unreadable(&place.directory, error))?;
    let holders = if arguments.all { &all } else { &arguments.holders };
    let mut out = output::stdout();
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
