//! A table, row by row, in constant memory, every mistake with its line and column.
//!
//! Lines are counted here and not by a CSV library, because an empty line is not nothing: it is a
//! sampling instant without a sample. Only empty lines at the very end are.

use std::fmt;
use std::io::{BufRead, BufReader, Read};

use csv::ByteRecord;

use super::cells;
use super::column::{self, Column};
use crate::failure::Failure;

/// Longest line that is accepted, in bytes.
const MAX_LINE: u64 = 16 << 20;
/// How much of a bad field is shown, in characters.
const SHOWN: usize = 40;
const BUFFER: usize = 1 << 16;

/// What is wrong with a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Problem {
    line: u64,
    complaint: Complaint,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Complaint {
    Empty(Column),
    Text(Column, String),
    NonFinite(Column, String),
    Short { first_missing: Column, found: usize, expected: usize },
    Long { found: usize, expected: usize },
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const RIGHT: &str = "use a finite number, or --skip-bad to take such rows as gaps";
        write!(f, "line {}, ", self.line)?;
        match &self.complaint {
            Complaint::Empty(column) => write!(f, "{column}: empty; {RIGHT}"),
            Complaint::Text(column, text) => write!(f, "{column}: `{text}` is no number; {RIGHT}"),
            Complaint::NonFinite(column, text) => {
                write!(f, "{column}: `{text}` is not finite; {RIGHT}")
            }
            Complaint::Short { first_missing, found, expected } => {
                write!(f, "{first_missing}: missing, {found} fields instead of {expected}; {RIGHT}")
            }
            Complaint::Long { found, expected } => write!(
                f,
                "column {}: one too many, {found} fields instead of {expected}; give each row as \
                 many fields as the header, or --skip-bad to take such rows as gaps",
                expected + 1
            ),
        }
    }
}

/// One row: its numbers, or what is wrong with it.
#[derive(Debug)]
pub(crate) struct Row<'a> {
    /// Its line in the table, from 1.
    pub(crate) line: u64,
    /// The channels' numbers; meaningless if there is a problem.
    pub(crate) values: &'a [f64],
    pub(crate) problem: Option<Problem>,
}

/// The rows of a table.
pub(crate) struct Rows<R> {
    input: BufReader<R>,
    name: String,
    delimiter: u8,
    header: Vec<Column>,
    channels: Vec<Column>,
    text: Vec<u8>,
    fields: ByteRecord,
    values: Vec<f64>,
    /// Lines read so far.
    line: u64,
    /// Is the line in `text` still to be delivered?
    held: bool,
    /// Empty lines directly before it that are still to be delivered.
    empty_lines: u64,
}

impl<R: Read> Rows<R> {
    /// Reads the header row. `name` is how the input is called in messages; `choose` gets the
    /// columns' names and returns those that are wanted, or none for all, or what is wrong.
    pub(crate) fn new(
        input: R,
        name: String,
        delimiter: u8,
        choose: impl FnOnce(&[String]) -> Result<Option<Vec<String>>, String>,
    ) -> Result<Self, Failure> {
        let mut rows = Rows {
            input: BufReader::with_capacity(BUFFER, input),
            name,
            delimiter,
            header: Vec::new(),
            channels: Vec::new(),
            text: Vec::new(),
            fields: ByteRecord::new(),
            values: Vec::new(),
            line: 0,
            held: false,
            empty_lines: 0,
        };
        rows.read_header(choose)?;
        Ok(rows)
    }

    fn read_header(
        &mut self,
        choose: impl FnOnce(&[String]) -> Result<Option<Vec<String>>, String>,
    ) -> Result<(), Failure> {
        if !self.read_line()? || self.is_empty_line() {
            let name = &self.name;
            return Err(Failure::input(format!(
                "{name}, line 1: empty; put a header row with the channels' names first"
            )));
        }
        let byte_order_mark = b"\xef\xbb\xbf";
        let text = self.text.strip_prefix(byte_order_mark).unwrap_or(&self.text);
        cells::split(text, self.delimiter, &mut self.fields);
        let complain = |problem| Failure::input(format!("{}, {problem}", self.name));
        self.header = column::named(&self.fields);
        let names: Vec<String> = self.header.iter().map(|column| column.name.clone()).collect();
        let wanted = choose(&names).map_err(|wrong| complain(format!("line 1: {wrong}")))?;
        self.channels = column::channels(&self.fields, wanted.as_deref()).map_err(complain)?;
        Ok(())
    }

    /// How the input is called in messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Names of the channels.
    pub(crate) fn channels(&self) -> Vec<String> {
        self.channels.iter().map(|channel| channel.name.clone()).collect()
    }

    /// Must the next row be waited for?
    pub(crate) fn is_drained(&self) -> bool {
        self.input.buffer().is_empty()
    }

    /// The next row; `None` at the end.
    pub(crate) fn next_row(&mut self) -> Result<Option<Row<'_>>, Failure> {
        while !self.held {
            if !self.read_line()? {
                return Ok(None);
            }
            self.held = !self.is_empty_line();
            self.empty_lines += u64::from(!self.held);
        }
        let (line, complaint) = if self.empty_lines > 0 {
            let line = self.line - self.empty_lines;
            self.empty_lines -= 1;
            (line, Some(self.empty_line()))
        } else {
            self.held = false;
            (self.line, self.parse().err())
        };
        let problem = complaint.map(|complaint| Problem { line, complaint });
        Ok(Some(Row { line, values: &self.values, problem }))
    }

    /// Reads a line without its end. False at the end of the input.
    fn read_line(&mut self) -> Result<bool, Failure> {
        self.text.clear();
        let read = (&mut self.input).take(MAX_LINE).read_until(b'\n', &mut self.text);
        let read =
            read.map_err(|error| Failure::input(format!("cannot read `{}`: {error}", self.name)))?;
        self.line += u64::from(read > 0);
        if self.text.last() == Some(&b'\n') {
            self.text.pop();
        } else if read as u64 == MAX_LINE {
            let (name, line, limit) = (&self.name, self.line, MAX_LINE >> 20);
            return Err(Failure::input(format!("{name}, line {line}: longer than {limit} MiB")));
        }
        if self.text.last() == Some(&b'\r') {
            self.text.pop();
        }
        Ok(read > 0)
    }

    fn is_empty_line(&self) -> bool {
        self.text.trim_ascii().is_empty()
    }

    /// What is wrong with an empty line.
    fn empty_line(&self) -> Complaint {
        let expected = self.header.len();
        match &self.header[..] {
            [only] => Complaint::Empty(only.clone()),
            columns => Complaint::Short { first_missing: columns[0].clone(), found: 0, expected },
        }
    }

    /// Takes the line apart and its numbers out.
    fn parse(&mut self) -> Result<(), Complaint> {
        cells::split(&self.text, self.delimiter, &mut self.fields);
        let (found, expected) = (self.fields.len(), self.header.len());
        if let Some(first_missing) = self.header.get(found) {
            let first_missing = first_missing.clone();
            return Err(Complaint::Short { first_missing, found, expected });
        }
        if found > expected {
            return Err(Complaint::Long { found, expected });
        }
        self.values.clear();
        for channel in &self.channels {
            self.values.push(number(&self.fields[channel.place], channel)?);
        }
        Ok(())
    }
}

fn number(field: &[u8], column: &Column) -> Result<f64, Complaint> {
    let field = field.trim_ascii();
    if field.is_empty() {
        return Err(Complaint::Empty(column.clone()));
    }
    let shown = || String::from_utf8_lossy(field).chars().take(SHOWN).collect();
    match std::str::from_utf8(field).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(number) if number.is_finite() => Ok(number),
        Some(_) => Err(Complaint::NonFinite(column.clone(), shown())),
        None => Err(Complaint::Text(column.clone(), shown())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every row as its numbers or its problem.
    fn rows(text: &str) -> Vec<Result<Vec<f64>, String>> {
        let mut rows = Rows::new(text.as_bytes(), "t".into(), b',', |_| Ok(None)).unwrap();
        let mut all = Vec::new();
        while let Some(row) = rows.next_row().unwrap() {
            all.push(match row.problem {
                Some(problem) => Err(problem.to_string()),
                None => Ok(row.values.to_vec()),
            });
        }
        all
    }

    #[test]
    fn line_ends_blanks_quotes_and_the_byte_order_mark_do_not_matter() {
        let expected = [Ok(vec![1.0, 2.0]), Ok(vec![3.0, -4e-5])];
        for text in [
            "x,y\n1,2\n3,-4e-5\n",
            "x,y\r\n1,2\r\n3,-4e-5",
            "\u{feff}x, y\n 1 ,2\n\"3\",\"-4e-5\"\n\n  \n\n",
        ] {
            assert_eq!(rows(text), expected, "{text:?}");
        }
    }

    #[test]
    fn an_empty_line_between_rows_is_a_row_without_a_sample() {
        let found = rows("x\n1\n\n\n4\n\n");
        assert_eq!(found.len(), 4);
        assert!(found[1].as_ref().unwrap_err().starts_with("line 3, column 1 `x`: empty"));
        assert!(found[2].as_ref().unwrap_err().starts_with("line 4, column 1 `x`: empty"));
        assert_eq!(found[3], Ok(vec![4.0]));
    }

    #[test]
    fn every_problem_names_its_line_and_column() {
        let found = rows("x,y\n1,\n1,two\nNaN,1\n1,-inf\n1e999,0\n1\n1,2,3\n\n5,6\n");
        let starts = [
            "line 2, column 2 `y`: empty",
            "line 3, column 2 `y`: `two` is no number",
            "line 4, column 1 `x`: `NaN` is not finite",
            "line 5, column 2 `y`: `-inf` is not finite",
            "line 6, column 1 `x`: `1e999` is not finite",
            "line 7, column 2 `y`: missing, 1 fields instead of 2",
            "line 8, column 3: one too many, 3 fields instead of 2",
            "line 9, column 1 `x`: missing, 0 fields instead of 2",
        ];
        for (row, start) in found.iter().zip(starts) {
            assert!(row.as_ref().unwrap_err().starts_with(start), "{row:?}");
        }
        assert_eq!(found[8], Ok(vec![5.0, 6.0]));
    }
}
