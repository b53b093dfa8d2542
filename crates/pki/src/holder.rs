//! Holders of certificates.
//!
//! ```text
//! module1          a module's computer
//! plant            the simulated plant, or another process that publishes the samples of every module
//! router.ground    a router
//! operator.ada     may issue commands
//! observer.wall    may only read
//! module1~2        the second *generation* of a certificate: issued after a revocation
//! ```
//!
//! Access control identifies a certificate by its common name alone. To exclude a lost certificate, its successor must
//! therefore have another name; a renewed certificate keeps its generation.

use std::fmt;
use std::num::NonZeroU32;
use std::str::FromStr;

use vocabulary::{ModuleName, StructureName};

/// Directory of the authority; not permitted as a module name.
pub const AUTHORITY: &str = "authority";
/// Directory of revoked certificates; not permitted as a module name.
pub const REVOKED: &str = "revoked";
/// The plant.
const PLANT: &str = "plant";
/// Longest common name that X.509 allows (RFC 5280, `ub-common-name`).
const MAX_COMMON_NAME: usize = 64;

/// A person, process or computer with a certificate.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Holder {
    /// A module's diagnoser, and other programs on its computer.
    Module(ModuleName),
    /// The simulated plant.
    Plant,
    /// A router, by name.
    Router(BearerName),
    /// A person or a program that may acknowledge, reset, inject and order strokes.
    Operator(BearerName),
    /// A person or a program that may only read.
    Observer(BearerName),
}

/// The name of a router, an operator or an observer, with the same characters as all other names.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct BearerName(ModuleName);

/// Separates holder and generation: not permitted in names, and without special meaning in file names and JSON.
const MARK: char = '~';

/// The number of common names that a holder has had, including this one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Generation(NonZeroU32);

impl Generation {
    /// The generation before any revocation; it is omitted from names.
    pub const FIRST: Self = Self(NonZeroU32::MIN);

    /// The generation after this one is revoked.
    #[must_use]
    pub fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }

    /// The number of the generation, from 1.
    #[must_use]
    pub fn number(self) -> u32 {
        self.0.get()
    }

    /// Parses the number after the mark; accepts only its canonical form.
    fn written(text: &str) -> Option<Self> {
        let read = Self(text.parse().ok()?);
        (read > Self::FIRST && read.0.to_string() == text).then_some(read)
    }
}

/// A holder with the generation of a certificate.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Issued {
    /// The holder.
    pub holder: Holder,
    /// The generation of the certificate.
    pub generation: Generation,
}

/// A holder in a structure: the common name in a certificate.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CommonName {
    /// The holder and the generation.
    pub issued: Issued,
    /// The structure.
    pub structure: StructureName,
}

/// The text is not the name of a holder.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum HolderError {
    /// The text does not have the form of a holder.
    #[error(
        "invalid holder `{0}`: expected MODULE, plant, router.NAME, operator.NAME or observer.NAME"
    )]
    Form(String),
    /// The generation is not in canonical form.
    #[error(
        "invalid certificate generation `{0}`: expected e.g. `module1~2`, or `module1` for the first"
    )]
    Generation(String),
    /// The common name has no structure.
    #[error("invalid common name `{0}`: expected HOLDER.STRUCTURE, e.g. `module1.tower`")]
    NoStructure(String),
    /// The name is too long for a certificate.
    #[error("`{0}` is longer than the {MAX_COMMON_NAME} characters of a common name")]
    TooLong(String),
}

impl fmt::Display for BearerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for BearerName {
    type Err = vocabulary::NameError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Holder::Module(name) => name.fmt(f),
            Holder::Plant => f.write_str(PLANT),
            Holder::Router(name) => write!(f, "router.{name}"),
            Holder::Operator(name) => write!(f, "operator.{name}"),
            Holder::Observer(name) => write!(f, "observer.{name}"),
        }
    }
}

impl FromStr for Holder {
    type Err = HolderError;

    fn from_str(text: &str) -> Result<Self, HolderError> {
        let wrong = || HolderError::Form(text.chars().take(80).collect());
        match text.split_once('.') {
            None if text == PLANT => Ok(Holder::Plant),
            None if text == AUTHORITY || text == REVOKED => Err(wrong()),
            None => text.parse().map(Holder::Module).map_err(|_| wrong()),
            Some((role, name)) => {
                let name: BearerName = name.parse().map_err(|_| wrong())?;
                match role {
                    "router" => Ok(Holder::Router(name)),
                    "operator" => Ok(Holder::Operator(name)),
                    "observer" => Ok(Holder::Observer(name)),
                    _ => Err(wrong()),
                }
            }
        }
    }
}

/// The first generation.
impl From<Holder> for Issued {
    fn from(holder: Holder) -> Self {
        Self { holder, generation: Generation::FIRST }
    }
}

impl fmt::Display for Issued {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.generation {
            Generation::FIRST => self.holder.fmt(f),
            generation => write!(f, "{}{MARK}{}", self.holder, generation.number()),
        }
    }
}

impl FromStr for Issued {
    type Err = HolderError;

    fn from_str(text: &str) -> Result<Self, HolderError> {
        let Some((holder, generation)) = text.split_once(MARK) else {
            return Ok(text.parse::<Holder>()?.into());
        };
        let wrong = || HolderError::Generation(text.chars().take(80).collect());
        let generation = Generation::written(generation).ok_or_else(wrong)?;
        Ok(Self { holder: holder.parse()?, generation })
    }
}

impl CommonName {
    /// The common name of a holder in a structure.
    ///
    /// # Errors
    /// The name is too long for a certificate.
    pub fn new(issued: impl Into<Issued>, structure: StructureName) -> Result<Self, HolderError> {
        let name = Self { issued: issued.into(), structure };
        let text = name.to_string();
        if text.len() > MAX_COMMON_NAME { Err(HolderError::TooLong(text)) } else { Ok(name) }
    }

    /// Whether both have the same holder and structure, in any generation. Only access control knows the present
    /// generation.
    #[must_use]
    pub fn is_of_holder_of(&self, other: &Self) -> bool {
        self.issued.holder == other.issued.holder && self.structure == other.structure
    }
}

impl fmt::Display for CommonName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.issued, self.structure)
    }
}

impl FromStr for CommonName {
    type Err = HolderError;

    fn from_str(text: &str) -> Result<Self, HolderError> {
        let wrong = || HolderError::NoStructure(text.chars().take(80).collect());
        let (issued, structure) = text.rsplit_once('.').ok_or_else(wrong)?;
        CommonName::new(issued.parse::<Issued>()?, structure.parse().map_err(|_| wrong())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_holder_is_written_as_it_is_read() {
        for text in ["module1", "plant", "router.ground", "operator.ada", "observer.wall-2"] {
            assert_eq!(text.parse::<Holder>().unwrap().to_string(), text);
            let common = format!("{text}.tower");
            assert_eq!(common.parse::<CommonName>().unwrap().to_string(), common);
        }
        assert_eq!("plant".parse(), Ok(Holder::Plant));
        assert_eq!("operator".parse(), Ok(Holder::Module("operator".parse().unwrap())));
    }

    #[test]
    fn nothing_else_is_a_holder() {
        for text in [
            "",
            "authority",
            "revoked",
            "a~2",
            "king.ada",
            "operator.",
            "operator.a.b",
            "../x",
            "a/b",
            "-x",
        ] {
            assert!(text.parse::<Holder>().is_err(), "{text}");
        }
        for text in
            ["tower", "module1.", ".tower", "king.ada.tower", "operator.ada.to wer", "a.b~2"]
        {
            assert!(text.parse::<CommonName>().is_err(), "{text}");
        }
        let long = format!("operator.{}.tower", "a".repeat(60));
        assert!(matches!(long.parse::<CommonName>(), Err(HolderError::TooLong(_))));
    }

    #[test]
    fn a_common_name_of_a_later_generation_is_of_the_same_holder() {
        let name = |text: &str| text.parse::<CommonName>().unwrap();
        let second = name("operator.ada~2.tower");
        assert_eq!(second.to_string(), "operator.ada~2.tower");
        assert_eq!(second.issued.generation.number(), 2);
        assert!(second.is_of_holder_of(&name("operator.ada.tower")));
        assert!(second.is_of_holder_of(&name("operator.ada~10.tower")));
        for other in ["operator.ada.mast", "operator.ada2.tower", "observer.ada~2.tower"] {
            assert!(!second.is_of_holder_of(&name(other)), "{other}");
        }
    }

    #[test]
    fn the_generation_counts_among_the_characters_of_a_common_name() {
        let longest = "a".repeat(MAX_COMMON_NAME - ".tower".len());
        assert!(format!("{longest}.tower").parse::<CommonName>().is_ok());
        let later = format!("{longest}~2.tower").parse::<CommonName>();
        assert!(matches!(later, Err(HolderError::TooLong(_))), "{later:?}");
        assert!(format!("{}~2.tower", &longest[2..]).parse::<CommonName>().is_ok());
    }

    #[test]
    fn a_generation_is_written_as_it_is_read_and_the_first_is_not_written() {
        for (text, number) in
            [("module1", 1), ("plant~2", 2), ("operator.ada~4294967295", u32::MAX)]
        {
            let issued: Issued = text.parse().unwrap();
            assert_eq!((issued.generation.number(), issued.to_string().as_str()), (number, text));
        }
        assert_eq!(Generation::FIRST.next().number(), 2);
    }

    #[test]
    fn every_generation_is_written_in_one_way() {
        for text in ["a~", "a~0", "a~1", "a~02", "a~+2", "a~-2", "a~2~2", "a~4294967296", "a~two"] {
            let refused = text.parse::<Issued>();
            assert_eq!(refused, Err(HolderError::Generation(text.to_owned())), "{text}");
        }
        assert!(matches!("king.ada~2".parse::<Issued>(), Err(HolderError::Form(_))));
    }
}
