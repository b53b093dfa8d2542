//! Which columns of a table are channels.

use csv::ByteRecord;

/// A column that is read as a channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct CsvColumn {
    /// Place among the fields, from 0.
    pub(super) place: usize,
    /// Name in the header row.
    pub(super) name: String,
}

impl std::fmt::Display for CsvColumn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "column {} `{}`", self.place + 1, self.name)
    }
}

/// The channels of a table: those wanted, or all.
///
/// # Errors
/// In words, what is wrong with the header row or the wish.
pub(super) fn channels(
    header: &ByteRecord,
    wanted: Option<&[String]>,
) -> Result<Vec<CsvColumn>, String> {
    let columns = named(header);
    if is_data(&columns) {
        let first = &columns[0].name;
        return Err(format!(
            "line 1: `{first}` is a number; put a header row with the channels' names first"
        ));
    }
    let channels = match wanted {
        None => columns,
        Some(wanted) => wanted.iter().map(|name| find(&columns, name)).collect::<Result<_, _>>()?,
    };
    for (place, channel) in channels.iter().enumerate() {
        if channel.name.is_empty() {
            let number = channel.place + 1;
            return Err(format!(
                "line 1, column {number}: the column has no name; name it or choose with --columns"
            ));
        }
        if channels[..place].iter().any(|earlier| earlier.name == channel.name) {
            return Err(format!("line 1, {channel}: duplicate name; use each once"));
        }
    }
    Ok(channels)
}

pub(super) fn named(header: &ByteRecord) -> Vec<CsvColumn> {
    let name = |field: &[u8]| String::from_utf8_lossy(field.trim_ascii()).into_owned();
    header.iter().enumerate().map(|(place, field)| CsvColumn { place, name: name(field) }).collect()
}

/// Numbers instead of names. Whole numbers may be names: some programs number unnamed columns.
fn is_data(columns: &[CsvColumn]) -> bool {
    columns.iter().all(|column| column.name.parse::<f64>().is_ok())
        && columns.iter().any(|column| column.name.parse::<u64>().is_err())
}

fn find(columns: &[CsvColumn], wanted: &str) -> Result<CsvColumn, String> {
    let wanted = wanted.trim();
    let mut found = columns.iter().filter(|column| column.name == wanted);
    match (found.next(), found.next()) {
        (Some(column), None) => Ok(column.clone()),
        (Some(_), Some(second)) => Err(format!("line 1, {second}: duplicate name; use each once")),
        (None, _) => {
            let known: Vec<_> = columns.iter().map(|column| format!("`{}`", column.name)).collect();
            Err(format!("line 1: missing column `{wanted}`; use {}", known.join(", ")))
        }
    }
}
