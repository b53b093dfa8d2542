//! A module's table as CSV.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use super::columns::TableRow;

/// Writes a table: step, time and time of publication \[s\], then the other values by name.
pub(super) fn write(
    file: &Path,
    names: &[String],
    rows: impl Iterator<Item = TableRow>,
) -> io::Result<()> {
    let mut out = csv::Writer::from_writer(BufWriter::new(File::create(file)?));
    let (time, values) = names.split_at(1);
    let first = ["step".to_owned(), time.concat(), "published_s".to_owned()];
    out.write_record(first.iter().chain(values))?;
    for TableRow { step, published_ns, values } in rows {
        let (time, values) = values.split_at(1);
        out.write_field(step.to_string())?;
        out.write_field(time.iter().copied().map(number).collect::<String>())?;
        let (whole, rest) = (published_ns / 1_000_000_000, published_ns % 1_000_000_000);
        out.write_field(format!("{whole}.{rest:09}"))?;
        for value in values {
            out.write_field(number(*value))?;
        }
        out.write_record(None::<&[u8]>)?;
    }
    out.flush()
}

/// The shortest text that is read as the same bits; nothing if it is none.
fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}
