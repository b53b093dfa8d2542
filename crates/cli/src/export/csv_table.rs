//! A module's table as CSV: written to a file, or read as one.

use std::fs::File;
use std::io::{self, BufWriter, Read, Write};
use std::iter::Peekable;
use std::path::Path;

use ::replay::{RunRows, TableRow};

/// Writes a table: step, time and time of publication \[s\], then the other values by name.
pub(super) fn write(
    file: &Path,
    names: &[String],
    rows: impl Iterator<Item = TableRow>,
) -> io::Result<()> {
    let mut out = csv::Writer::from_writer(BufWriter::new(File::create(file)?));
    write_header(&mut out, names)?;
    rows.into_iter().try_for_each(|row| write_row(&mut out, &row))?;
    out.flush()
}

fn write_header<W: Write>(out: &mut csv::Writer<W>, names: &[String]) -> io::Result<()> {
    let (time, values) = names.split_at(1);
    let first = ["step".to_owned(), time.concat(), "published_s".to_owned()];
    Ok(out.write_record(first.iter().chain(values))?)
}

fn write_row<W: Write>(out: &mut csv::Writer<W>, row: &TableRow) -> io::Result<()> {
    let TableRow { step, published_ns, values } = row;
    let (time, values) = values.split_at(1);
    out.write_field(step.to_string())?;
    out.write_field(time.iter().copied().map(number).collect::<String>())?;
    let (whole, rest) = (published_ns / 1_000_000_000, published_ns % 1_000_000_000);
    out.write_field(format!("{whole}.{rest:09}"))?;
    for value in values {
        out.write_field(number(*value))?;
    }
    Ok(out.write_record(None::<&[u8]>)?)
}

/// The shortest text that parses to the same bits; empty if the value is not finite.
pub(crate) fn number(value: f64) -> String {
    if value.is_finite() { format!("{value:?}") } else { String::new() }
}

/// Tables of several modules as the text of one, made row by row while it is read: it is what the file would hold.
pub(super) struct TableText {
    parts: Vec<Peekable<RunRows>>,
    widths: Vec<usize>,
    text: Vec<u8>,
    delivered: usize,
}

impl TableText {
    pub(super) fn new(parts: Vec<RunRows>) -> io::Result<Self> {
        let names: Vec<Vec<String>> = parts.iter().map(RunRows::names).collect();
        let widths = names.iter().map(|names| names.len() - 1).collect();
        let time = "time_s".to_owned();
        let values = names.into_iter().flat_map(|names| names.into_iter().skip(1));
        let names: Vec<String> = std::iter::once(time).chain(values).collect();
        let mut out = csv::Writer::from_writer(Vec::new());
        write_header(&mut out, &names)?;
        let text = out.into_inner().map_err(|error| io::Error::other(error.to_string()))?;
        let parts = parts.into_iter().map(Iterator::peekable).collect();
        Ok(Self { parts, widths, text, delivered: 0 })
    }

    /// The next step that any module has; the others have no values there.
    fn next_row(&mut self) -> Option<TableRow> {
        let step = self.parts.iter_mut().filter_map(|part| Some(part.peek()?.step)).min()?;
        let mut joined = TableRow { step, published_ns: 0, values: vec![f64::NAN] };
        for (part, width) in self.parts.iter_mut().zip(&self.widths) {
            match part.next_if(|row| row.step == step) {
                Some(row) => {
                    joined.published_ns = joined.published_ns.max(row.published_ns);
                    joined.values[0] = row.values[0];
                    joined.values.extend(&row.values[1..]);
                }
                None => joined.values.extend(std::iter::repeat_n(f64::NAN, *width)),
            }
        }
        Some(joined)
    }
}

impl Read for TableText {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.delivered == self.text.len() {
            let Some(row) = self.next_row() else { return Ok(0) };
            self.text.clear();
            self.delivered = 0;
            let mut out = csv::Writer::from_writer(std::mem::take(&mut self.text));
            write_row(&mut out, &row)?;
            self.text = out.into_inner().map_err(|error| io::Error::other(error.to_string()))?;
        }
        let count = into.len().min(self.text.len() - self.delivered);
        into[..count].copy_from_slice(&self.text[self.delivered..self.delivered + count]);
        self.delivered += count;
        Ok(count)
    }
}
