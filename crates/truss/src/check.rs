//! Tools of validation: collects errors, tracks names, checks ranges of numbers.

use std::collections::{BTreeMap, BTreeSet};

use crate::description::DescriptionEntry;
use crate::description_error::{DescriptionError, DescriptionProblem};
use vocabulary::NameError;

/// Number of existing names listed when a name is not found.
const NAMES_LISTED: usize = 6;

/// A value with the line that it comes from.
pub(crate) struct Located<T> {
    pub(crate) line: usize,
    pub(crate) value: T,
}

/// No number of a structure is larger, whatever its unit.
const LARGEST: f64 = 1e15;

/// A permitted range of numbers.
#[derive(Clone, Copy)]
pub(crate) enum NumberRange {
    /// Beyond it the unit is wrong.
    Within(f64, f64, &'static str),
    NotNegative,
    Finite,
    Poisson,
}

impl NumberRange {
    fn contains(self, value: f64) -> bool {
        match self {
            NumberRange::Within(least, largest, _) => (least..=largest).contains(&value),
            NumberRange::NotNegative => (0.0..=LARGEST).contains(&value),
            NumberRange::Finite => value.abs() <= LARGEST,
            NumberRange::Poisson => value > -1.0 && value <= 0.5,
        }
    }

    fn words(self) -> String {
        match self {
            NumberRange::Within(least, largest, unit) => {
                let [least, largest] = [least, largest].map(|end| format!("{end:e}"));
                let least = least.trim_end_matches("e0");
                return format!("{least} to {largest} {unit}").trim_end().to_owned();
            }
            NumberRange::NotNegative => "a number from 0 to 1e15",
            NumberRange::Finite => "a number from -1e15 to 1e15",
            NumberRange::Poisson => "a number above -1 and up to 0.5",
        }
        .to_owned()
    }
}

/// Collects errors.
pub(crate) struct Check {
    /// The offset at which each line ends, ascending, because the line of every entry of a long description is looked
    /// up.
    ends: Vec<usize>,
    pub(crate) errors: Vec<DescriptionError>,
}

impl Check {
    pub(crate) fn new(text: &str) -> Check {
        let ends = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        Check { ends: ends.map(|(offset, _)| offset).collect(), errors: Vec::new() }
    }

    /// The line of a byte, counted from 1.
    pub(crate) fn line(&self, offset: usize) -> usize {
        1 + self.ends.partition_point(|&end| end < offset)
    }

    pub(crate) fn report(&mut self, line: Option<usize>, problem: DescriptionProblem) {
        self.errors.push(DescriptionError { line, problem });
    }

    pub(crate) fn form(&mut self, line: usize, message: String) {
        self.report(Some(line), DescriptionProblem::Form(message));
    }

    /// The name, unless it is invalid, which is reported.
    pub(crate) fn name<N>(&mut self, line: usize, name: Result<N, NameError>) -> Option<N> {
        name.map_err(|error| self.report(Some(line), error.into())).ok()
    }

    /// Reports a number outside its range.
    pub(crate) fn number(
        &mut self,
        line: usize,
        owner: &str,
        (quantity, value): (&'static str, f64),
        range: NumberRange,
    ) {
        if !range.contains(value) {
            let (owner, expected) = (owner.to_owned(), range.words());
            self.report(
                Some(line),
                DescriptionProblem::Number { quantity, owner, value, expected },
            );
        }
    }

    /// The entry's value; `None` if it cannot be read, which is reported. A readable name is recorded nevertheless, so
    /// that references to it are not reported as well.
    pub(crate) fn entry<T>(
        &mut self,
        names: &mut KnownNames,
        entry: DescriptionEntry<T>,
    ) -> Option<Located<T>> {
        let line = self.line(entry.offset);
        match entry.value {
            Ok(value) => Some(Located { line, value }),
            Err(complaint) => {
                let owner = match &entry.name {
                    Some(name) => format!("{} `{name}`", names.what),
                    None => names.what.to_owned(),
                };
                self.report(
                    Some(line),
                    DescriptionProblem::Format(format!("{owner}: {complaint}")),
                );
                names.broken.extend(entry.name);
                names.unreadable = true;
                None
            }
        }
    }

    /// Records a name; a duplicate is reported.
    pub(crate) fn remember(&mut self, names: &mut KnownNames, line: usize, name: &str) {
        let index = names.order.len();
        names.order.push(name.to_owned());
        if let Some(&(_, first)) = names.places.get(name) {
            let first =
                if first == line { String::new() } else { format!(", first in line {first}") };
            let (what, name) = (names.what, name.to_owned());
            self.report(Some(line), DescriptionProblem::Duplicate { what, name, first });
        } else {
            names.places.insert(name.to_owned(), (index, line));
        }
    }

    /// The index of a name; an unknown one is reported with the existing names.
    pub(crate) fn find(
        &mut self,
        names: &KnownNames,
        line: usize,
        user: &str,
        name: &str,
    ) -> Option<usize> {
        let index = names.index(name);
        if index.is_none() && !names.broken.contains(name) {
            let (user, name) = (user.to_owned(), name.to_owned());
            let (what, hint) = (names.what, names.hint(&name));
            self.report(Some(line), DescriptionProblem::Unknown { user, what, name, hint });
        }
        index
    }
}

/// The names recorded so far, each with its index, in order of appearance.
pub(crate) struct KnownNames {
    pub(crate) what: &'static str,
    places: BTreeMap<String, (usize, usize)>,
    order: Vec<String>,
    broken: BTreeSet<String>,
    unreadable: bool,
}

impl KnownNames {
    pub(crate) fn new(what: &'static str) -> KnownNames {
        KnownNames {
            what,
            places: BTreeMap::new(),
            order: Vec::new(),
            broken: BTreeSet::new(),
            unreadable: false,
        }
    }

    /// Index of a name.
    pub(crate) fn index(&self, name: &str) -> Option<usize> {
        self.places.get(name).map(|&(index, _)| index)
    }

    /// All names, in order of appearance.
    pub(crate) fn names(&self) -> &[String] {
        &self.order
    }

    /// Whether an entry could not be read.
    pub(crate) fn is_broken(&self) -> bool {
        self.unreadable
    }

    /// The hint in the error for an unknown name.
    fn hint(&self, name: &str) -> String {
        let near = self.places.keys().min_by_key(|known| strsim::levenshtein(known, name));
        match near {
            None => format!("there is no {} at all", self.what),
            Some(near) if strsim::levenshtein(near, name) <= 2 => format!("did you mean `{near}`?"),
            Some(_) => self.list(),
        }
    }

    fn list(&self) -> String {
        let mut names = self.order.clone();
        names.dedup();
        let listed: Vec<_> =
            names.iter().take(NAMES_LISTED).map(|name| format!("`{name}`")).collect();
        let more = names.len().saturating_sub(NAMES_LISTED);
        let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
        let verb = if names.len() == 1 { "is" } else { "are" };
        format!("there {verb} {}{tail}", listed.join(", "))
    }
}
