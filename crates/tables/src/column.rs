//! Which columns of a table are channels.

use csv::ByteRecord;

use super::clock::is_date;
use super::number::{decoded, is_missing};

/// A column that is read as a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct CsvColumn {
    /// Place among the fields, from 0.
    pub(crate) place: usize,
    /// Name in the header row.
    pub(crate) name: String,
}

impl std::fmt::Display for CsvColumn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "column {} `{}`", self.place + 1, self.name)
    }
}

/// The columns of a header row.
pub(crate) fn named(header: &ByteRecord) -> Vec<CsvColumn> {
    let column = |(place, field)| CsvColumn { place, name: decoded(field).into_owned() };
    header.iter().enumerate().map(column).collect()
}

/// The columns that are wanted, by name or number.
///
/// # Errors
/// In words, what is wrong with the wish.
pub(crate) fn wanted(columns: &[CsvColumn], wanted: &[String]) -> Result<Vec<CsvColumn>, String> {
    let channels: Vec<CsvColumn> =
        wanted.iter().map(|name| find(columns, name)).collect::<Result<_, _>>()?;
    for (number, channel) in channels.iter().enumerate() {
        if channels[..number].iter().any(|earlier| earlier.place == channel.place) {
            return Err(format!(", {channel}: duplicate name; use each once"));
        }
    }
    Ok(channels)
}

/// All columns but that of the clock, those whose first row has a date, and those at the end without data.
///
/// # Errors
/// In words, what is wrong with the header row.
pub(crate) fn all(
    columns: &[CsvColumn],
    clock: Option<usize>,
    first_row: Option<&ByteRecord>,
) -> Result<Vec<CsvColumn>, String> {
    let is_channel = |column: &&CsvColumn| {
        let cell = first_row.map(|row| row.get(column.place).map(decoded));
        let has_data = match cell {
            None => true,
            Some(None) => false,
            Some(Some(cell)) => !(is_date(&cell) || column.name.is_empty() && is_missing(&cell)),
        };
        Some(column.place) != clock && has_data
    };
    let channels: Vec<CsvColumn> = columns.iter().filter(is_channel).cloned().collect();
    for (number, channel) in channels.iter().enumerate() {
        let place = channel.place + 1;
        if channel.name.is_empty() {
            return Err(format!(
                ", column {place}: the column has no name; name it or choose by number, e.g. \
                 --columns '#{place}'"
            ));
        }
        if channels[..number].iter().any(|earlier| earlier.name == channel.name) {
            return Err(format!(
                ", {channel}: duplicate name; choose by number, e.g. --columns '#{place}'"
            ));
        }
    }
    Ok(channels)
}

/// Finds a column by its name or by its number from 1, `#3` or `3`.
///
/// # Errors
/// In words, what is wrong with the wish.
pub(crate) fn find(columns: &[CsvColumn], wanted: &str) -> Result<CsvColumn, String> {
    let wanted = wanted.trim();
    let mut found = columns.iter().filter(|column| column.name == wanted);
    match (found.next(), found.next()) {
        (Some(column), None) => Ok(column.clone()),
        (Some(first), Some(second)) => Err(format!(
            ", {second}: duplicate name; choose by number, e.g. --columns '#{}' or '#{}'",
            first.place + 1,
            second.place + 1
        )),
        (None, _) => numbered(columns, wanted).ok_or_else(|| {
            let known: Vec<_> = columns.iter().map(|column| format!("`{}`", column.name)).collect();
            format!(": missing column `{wanted}`; use {}", known.join(", "))
        }),
    }
}

/// A column that is chosen by number is called by it, unless its own name tells it from all others.
fn numbered(columns: &[CsvColumn], wanted: &str) -> Option<CsvColumn> {
    let number: usize = wanted.strip_prefix('#').unwrap_or(wanted).parse().ok()?;
    let column = columns.get(number.checked_sub(1)?)?;
    let alike = columns.iter().filter(|other| other.name == column.name).count();
    let name = match (alike, column.name.is_empty()) {
        (1, false) => column.name.clone(),
        _ => format!("{}#{number}", column.name),
    };
    Some(CsvColumn { place: column.place, name })
}
