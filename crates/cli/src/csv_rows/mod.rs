//! Tables of numbers: CSV with a header row, row by row, in constant memory, every mistake with its line and column.
//!
//! Lines are counted here and not by a CSV library, because an empty line is not nothing: it is a
//! sampling instant without a sample. Only empty lines at the very end are.

mod column;

use std::io::{BufRead, BufReader, Read};

use csv::{ByteRecord, ReaderBuilder};

use crate::failure::Failure;
use column::CsvColumn;

/// Name of the column that numbers the steps.
pub(crate) const STEP: &str = "step";
/// Up to here every whole number is a floating-point number.
const LARGEST_STEP: f64 = (1_u64 << 53) as f64;
/// Longest line that is accepted, in bytes.
const MAX_LINE: u64 = 16 << 20;
/// How much of a bad field is shown, in characters.
const SHOWN: usize = 40;
const BUFFER: usize = 1 << 16;

/// How a bad number is mended.
const RIGHT: &str = "use a finite number, or --skip-bad to take such rows as gaps";

/// One row: its numbers, or what is wrong with it.
#[derive(Debug)]
pub(crate) struct CsvRow<'a> {
    /// Its line in the table, from 1.
    pub(crate) line: u64,
    /// The channels' numbers; meaningless if there is a problem.
    pub(crate) values: &'a [f64],
    pub(crate) problem: Option<String>,
}

/// The rows of a table.
pub(crate) struct CsvRows<R> {
    input: BufReader<R>,
    name: String,
    delimiter: u8,
    header: Vec<CsvColumn>,
    channels: Vec<CsvColumn>,
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

impl<R: Read> CsvRows<R> {
    /// Reads the header row. `name` is how the input is called in messages; `choose` gets the
    /// columns' names and returns those that are wanted, or none for all, or what is wrong.
    pub(crate) fn new(
        input: R,
        name: String,
        delimiter: u8,
        choose: impl FnOnce(&[String]) -> Result<Option<Vec<String>>, String>,
    ) -> Result<Self, Failure> {
        let mut rows = CsvRows {
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
        split(text, self.delimiter, &mut self.fields);
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
    pub(crate) fn next_row(&mut self) -> Result<Option<CsvRow<'_>>, Failure> {
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
        let problem = complaint.map(|complaint| format!("line {line}, {complaint}"));
        Ok(Some(CsvRow { line, values: &self.values, problem }))
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

    /// The problem of an empty line.
    fn empty_line(&self) -> String {
        match &self.header[..] {
            [only] => format!("{only}: empty; {RIGHT}"),
            columns => self.short(&columns[0], 0),
        }
    }

    fn short(&self, first_missing: &CsvColumn, found: usize) -> String {
        let expected = self.header.len();
        format!("{first_missing}: missing, {found} fields instead of {expected}; {RIGHT}")
    }

    /// Takes the line apart and its numbers out.
    fn parse(&mut self) -> Result<(), String> {
        split(&self.text, self.delimiter, &mut self.fields);
        let (found, expected) = (self.fields.len(), self.header.len());
        if let Some(first_missing) = self.header.get(found) {
            return Err(self.short(first_missing, found));
        }
        if found > expected {
            return Err(format!(
                "column {}: one too many, {found} fields instead of {expected}; give each row as \
                 many fields as the header, or --skip-bad to take such rows as gaps",
                expected + 1
            ));
        }
        self.values.clear();
        for channel in &self.channels {
            let number = number(&self.fields[channel.place]);
            self.values.push(number.map_err(|wrong| format!("{channel}: {wrong}; {RIGHT}"))?);
        }
        Ok(())
    }
}

fn number(field: &[u8]) -> Result<f64, String> {
    let field = field.trim_ascii();
    if field.is_empty() {
        return Err("empty".to_owned());
    }
    let shown = || String::from_utf8_lossy(field).chars().take(SHOWN).collect::<String>();
    match std::str::from_utf8(field).ok().and_then(|text| text.parse::<f64>().ok()) {
        Some(number) if number.is_finite() => Ok(number),
        Some(_) => Err(format!("`{}` is not finite", shown())),
        None => Err(format!("`{}` is not a number", shown())),
    }
}

/// Puts the fields of a line into `fields`. Quotes protect delimiters; a field cannot contain a line
/// break, because a table of numbers has none.
fn split(line: &[u8], delimiter: u8, fields: &mut ByteRecord) {
    fields.clear();
    if line.contains(&b'"') && split_quoted(line, delimiter, fields) {
        return;
    }
    line.split(|&byte| byte == delimiter).for_each(|field| fields.push_field(field));
}

/// False if the line has no fields to the reader of quotes.
fn split_quoted(line: &[u8], delimiter: u8, fields: &mut ByteRecord) -> bool {
    let mut reader = ReaderBuilder::new().has_headers(false).delimiter(delimiter).from_reader(line);
    matches!(reader.read_byte_record(fields), Ok(true))
}

/// Reads a step, which is a whole number.
pub(crate) fn whole_step(step: f64) -> Result<u64, String> {
    if step.fract() == 0.0 && (0.0..=LARGEST_STEP).contains(&step) {
        return Ok(step as u64);
    }
    Err(format!("invalid step {step}: expected a whole number from 0"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every row as its numbers or its problem.
    fn rows(text: &str) -> Vec<Result<Vec<f64>, String>> {
        let mut rows = CsvRows::new(text.as_bytes(), "t".into(), b',', |_| Ok(None)).unwrap();
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
            "line 3, column 2 `y`: `two` is not a number",
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

    fn fields(line: &str, delimiter: u8) -> Vec<String> {
        let mut record = ByteRecord::new();
        split(line.as_bytes(), delimiter, &mut record);
        record.iter().map(|field| String::from_utf8_lossy(field).into_owned()).collect()
    }

    #[test]
    fn delimiters_part_and_quotes_protect() {
        assert_eq!(fields("a,b,,c", b','), ["a", "b", "", "c"]);
        assert_eq!(fields("1,5;2", b';'), ["1,5", "2"]);
        assert_eq!(fields("\"a,b\",\"c \"\"d\"\"\"", b','), ["a,b", "c \"d\""]);
        assert_eq!(fields("", b','), [""]);
        assert_eq!(fields("\"open,1", b','), ["open,1"]);
    }

    #[test]
    fn a_step_is_a_whole_number() {
        assert_eq!(whole_step(12.0), Ok(12));
        for step in [-1.0, 0.5, 1e300] {
            assert!(whole_step(step).is_err(), "{step}");
        }
    }
}
