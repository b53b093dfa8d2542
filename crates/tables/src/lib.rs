//! Tables of numbers, as loggers and spreadsheets write them: row by row, in constant memory, every mistake with its
//! line and column.
//!
//! Bytes become lines (`text`), the first lines say how the table is laid out (`layout`), columns are chosen by
//! name or number (`column`), cells become numbers (`number`), and each row gets its step (`clock`).
//!
//! Lines are counted here and not by a CSV library, because an empty line is not nothing: it is a
//! sampling instant without a sample. Only empty lines at the very end are.

mod clock;
mod column;
mod flags;
mod layout;
#[cfg(test)]
mod loggers_test;
mod number;
mod text;

use std::collections::VecDeque;
use std::io::{self, Read, Write};

use csv::{ByteRecord, ReaderBuilder};

use clock::{Clock, ClockError, STEP};
use column::CsvColumn;
pub use flags::TableFlags;
use layout::Layout;
use number::{DecimalMark, Wrong, decoded};
use text::TextLines;

/// Lines in which the header is looked for.
const HEAD_LINES: usize = 200;
/// The same in bytes.
const HEAD_BYTES: usize = 1 << 20;
/// How much of a bad field is shown, in characters.
const SHOWN: usize = 40;

/// How a table without a header is mended.
const HEADER_FIRST: &str = "put a header row with the channels' names first";
/// How a bad number is mended.
const RIGHT: &str = "use a finite number, or --skip-bad to take such rows as gaps";

/// Numbers that loggers write for a missing value.
const SENTINELS: [f64; 14] = [
    -999.0, -9999.0, -99_999.0, -999_999.0, -999.9, -999.99, -9999.99, -6999.0, -7999.0, -1e6,
    -1e30, 1e30, 9.9e37, 9.91e37,
];

/// Why a table cannot be read, with its place.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct TableError(pub String);

/// One row: its numbers, or what is wrong with it.
#[derive(Debug)]
pub struct CsvRow<'a> {
    /// Its step, as numbered, or counted from 0; meaningless if there is a problem.
    pub step: u64,
    /// The channels' values, NaN if missing; meaningless if there is a problem.
    pub values: &'a [f64],
    /// What is wrong with it, in words.
    pub problem: Option<String>,
}

/// A value of a channel that may mean "missing".
#[derive(Debug, Clone, Copy, Default)]
struct Suspect {
    value: f64,
    times: u64,
}

/// When the rows of a table are.
pub struct RowTimes {
    clock: Clock,
    step_s: f64,
}

impl RowTimes {
    /// When two rows are; they are counted from 0, with the missing ones.
    pub fn span(&self, (first, last): (u64, u64)) -> Option<(String, String)> {
        self.clock.at(first, self.step_s).zip(self.clock.at(last, self.step_s))
    }
}

/// The rows of a table.
pub struct CsvRows {
    input: TextLines,
    name: String,
    delimiter: u8,
    mark: Option<DecimalMark>,
    /// Cells without a value, as text and as number.
    missing: Vec<(String, Option<f64>)>,
    header: Vec<CsvColumn>,
    channels: Vec<CsvColumn>,
    /// Columns without data, which are left out.
    left_out: Vec<CsvColumn>,
    clock: Clock,
    next_step: u64,
    /// Lines read ahead.
    ahead: VecDeque<Vec<u8>>,
    text: Vec<u8>,
    fields: ByteRecord,
    values: Vec<f64>,
    suspects: Vec<Suspect>,
    /// Lines taken so far.
    line: u64,
    /// Is the line in `text` still to be delivered?
    held: bool,
    /// Empty lines directly before it that are still to be delivered.
    empty_lines: u64,
}

/// The header and the columns that are wanted of it.
struct Chosen {
    header: Vec<CsvColumn>,
    /// None for all.
    channels: Option<Vec<CsvColumn>>,
}

impl Chosen {
    /// Does it say that this is the header? A column's number is in many lines.
    fn is_by_name(&self) -> bool {
        let is_name = |channel: &CsvColumn| {
            channel.name.parse::<f64>().is_err() && self.header.contains(channel)
        };
        self.channels.as_ref().is_some_and(|channels| channels.iter().all(is_name))
    }
}

impl CsvRows {
    /// Reads the header row. `name` is how the input is called in messages; `choose` gets the
    /// columns' names and returns those that are wanted, or none for all, or what is wrong.
    pub fn open(
        input: Box<dyn Read>,
        name: String,
        flags: &TableFlags,
        mut choose: impl FnMut(&[String]) -> Result<Option<Vec<String>>, String>,
    ) -> Result<Self, TableError> {
        let unreadable = |error| TableError(format!("cannot read `{name}`: {error}"));
        let mut input = TextLines::open(input).map_err(unreadable)?;
        let mut try_header = |line: &[u8], delimiter: u8| -> Result<Chosen, String> {
            let header = header(line, delimiter);
            let names: Vec<String> = header.iter().map(|column| column.name.clone()).collect();
            let wanted = choose(&names).map_err(|wrong| format!(": {wrong}"))?;
            let channels = wanted.map(|wanted| column::wanted(&header, &wanted)).transpose()?;
            Ok(Chosen { header, channels })
        };
        let (mut head, layout) =
            read_head(&mut input, flags, &mut try_header).map_err(unreadable)?;
        let complain = |line: usize, problem: String| {
            TableError(format!("{name}, line {}{problem}", line + 1))
        };
        let first = flags.skip_lines.unwrap_or(0);
        let layout = match (layout, head.get(first).filter(|line| !layout::is_blank(line))) {
            (Some(layout), _) => layout,
            (None, None) => return Err(complain(first, format!(": empty; {HEADER_FIRST}"))),
            (None, Some(line)) => {
                let delimiter = layout::usual_delimiter(line, flags);
                Layout::below(&head, first, delimiter, flags)
            }
        };
        let (layout, chosen) = choose_header(&head, layout, flags, &mut try_header)
            .map_err(|problem| complain(layout.header, problem))?;
        let Chosen { header, channels } = chosen;
        if is_data(&header) {
            let first = &header[0].name;
            let problem = format!(": `{first}` is a number; {HEADER_FIRST}");
            return Err(complain(layout.header, problem));
        }
        let first_row =
            head[layout.rows..].iter().find(|line| !layout::is_blank(line)).map(|line| {
                let mut row = ByteRecord::new();
                split(line, layout.delimiter, &mut row);
                row
            });
        let clock = clock(&header, flags, first_row.as_ref())
            .map_err(|problem| complain(layout.header, problem))?;
        let (channels, left_out) = match channels {
            Some(channels) => (channels, Vec::new()),
            None => {
                let channels = column::all(&header, clock.place, first_row.as_ref())
                    .map_err(|problem| complain(layout.header, problem))?;
                let is_left_out = |column: &&CsvColumn| {
                    !channels.contains(column)
                        && clock.place != Some(column.place)
                        && !column.name.is_empty()
                };
                let left_out = header.iter().filter(is_left_out).cloned().collect();
                (channels, left_out)
            }
        };
        let missing = flags.missing.iter().map(|text| {
            let number = number::number(text.as_bytes(), &mut flags.decimal.clone()).ok();
            (text.trim().to_owned(), number)
        });
        let suspects = vec![Suspect::default(); channels.len()];
        let line = layout.rows as u64;
        Ok(CsvRows {
            input,
            delimiter: layout.delimiter,
            mark: layout.mark,
            missing: missing.collect(),
            header,
            channels,
            left_out,
            clock,
            next_step: 0,
            ahead: head.split_off(layout.rows).into(),
            text: Vec::new(),
            fields: ByteRecord::new(),
            values: Vec::new(),
            suspects,
            line,
            held: false,
            empty_lines: 0,
            name,
        })
    }

    /// How the input is called in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Names of the channels.
    pub fn channels(&self) -> Vec<String> {
        self.channels.iter().map(|channel| channel.name.clone()).collect()
    }

    /// The time between two rows so far \[s\], if a column tells it.
    pub fn step_s(&self) -> Option<f64> {
        let steps = self.next_step.checked_sub(1).filter(|steps| *steps > 0)?;
        Some(self.clock.passed_s()? / steps as f64).filter(|step_s| *step_s > 0.0)
    }

    /// When the first row was taken \[s since 1970\], and whether the table says its time zone; `None` without a date.
    pub fn began_unix_s(&self) -> Option<(f64, bool)> {
        self.clock.began_unix_s()
    }

    /// When rows are, as far as a column tells the times by now.
    pub fn times(&self) -> Option<RowTimes> {
        Some(RowTimes { clock: self.clock.clone(), step_s: self.step_s()? })
    }

    /// Must the next row be waited for?
    pub fn is_drained(&self) -> bool {
        self.ahead.is_empty() && self.input.is_drained()
    }

    /// What of the table should be looked at, once all rows were taken.
    fn remarks(&self) -> Vec<String> {
        let left_out = self
            .left_out
            .iter()
            .map(|column| format!("{}: {column} has no numbers and is left out", self.name));
        let suspects = self.channels.iter().zip(&self.suspects);
        let suspects = suspects.filter(|(_, suspect)| suspect.times > 1);
        let suspects = suspects.map(|(channel, Suspect { value, times })| {
            let (name, channel) = (&self.name, &channel.name);
            format!(
                "{name}: channel `{channel}` is {value} in {times} rows; if that stands for no value, \
                 add --missing {value}"
            )
        });
        left_out.chain(suspects).collect()
    }

    /// Prints the remarks on standard error, which may be closed.
    pub fn print_remarks(&self) {
        let mut stderr = io::stderr().lock();
        for remark in self.remarks() {
            let _ = writeln!(stderr, "{remark}");
        }
    }

    /// The next row; `None` at the end.
    ///
    /// # Errors
    /// Lines that cannot be read, and rows whose steps or times do not rise.
    pub fn next_row(&mut self) -> Result<Option<CsvRow<'_>>, TableError> {
        while !self.held {
            if !self.read_line()? {
                return Ok(None);
            }
            self.held = !layout::is_blank(&self.text);
            self.empty_lines += u64::from(!self.held);
        }
        let problem = if self.empty_lines > 0 {
            self.empty_lines -= 1;
            self.values.clear();
            self.values.resize(self.channels.len(), f64::NAN);
            None
        } else {
            self.held = false;
            match self.parse() {
                Ok(missing) => {
                    self.next_step += missing;
                    None
                }
                Err(RowError::Bad(problem)) => Some(format!("line {}, {problem}", self.line)),
                Err(RowError::Order(problem)) => {
                    let (name, line) = (&self.name, self.line);
                    return Err(TableError(format!("{name}, line {line}: {problem}")));
                }
            }
        };
        let step = self.next_step;
        // Where a column tells the steps, what is missing follows from the next row.
        let counts = self.clock.place.is_none() || (problem.is_none() && !self.held);
        self.next_step += u64::from(counts);
        Ok(Some(CsvRow { step, values: &self.values, problem }))
    }

    /// Reads a line without its end. False at the end of the input.
    fn read_line(&mut self) -> Result<bool, TableError> {
        let read = match self.ahead.pop_front() {
            Some(line) => {
                self.text = line;
                true
            }
            None => self
                .input
                .read(&mut self.text)
                .map_err(|error| TableError(format!("cannot read `{}`: {error}", self.name)))?,
        };
        self.line += u64::from(read);
        Ok(read)
    }

    /// Takes the line apart and its numbers out. Returns how many steps are missing before it.
    fn parse(&mut self) -> Result<u64, RowError> {
        split(&self.text, self.delimiter, &mut self.fields);
        let (found, expected) = (self.fields.len(), self.header.len());
        if found > expected && self.fields.iter().skip(expected).any(|f| !f.trim_ascii().is_empty())
        {
            return Err(RowError::Bad(format!(
                "column {}: one too many, {found} fields instead of {expected}; give each row as \
                 many fields as the header, or --skip-bad to take such rows as gaps",
                expected + 1
            )));
        }
        self.values.clear();
        for (channel, suspect) in self.channels.iter().zip(&mut self.suspects) {
            let Some(field) = self.fields.get(channel.place) else {
                return Err(short(&self.header, found));
            };
            let value = match number::number(field, &mut self.mark) {
                _ if is_missing(&self.missing, field, None) => f64::NAN,
                Ok(number) if is_missing(&self.missing, field, Some(number)) => f64::NAN,
                Ok(number) => number,
                Err(wrong) => return Err(bad_cell(channel, field, wrong)),
            };
            if value.abs() >= 999.0 && SENTINELS.contains(&value) {
                let times = if suspect.value == value { suspect.times + 1 } else { 1 };
                *suspect = Suspect { value, times };
            }
            self.values.push(value);
        }
        let Some(place) = self.clock.place else {
            return Ok(0);
        };
        let Some(cell) = self.fields.get(place) else {
            return Err(short(&self.header, found));
        };
        self.clock.take(cell, &mut self.mark).map_err(|error| match error {
            ClockError::Cell(wrong) => {
                let column = &self.header[place];
                RowError::Bad(format!("{column}: {wrong}; or --skip-bad to take such rows as gaps"))
            }
            ClockError::Order(wrong) => RowError::Order(wrong),
        })
    }
}

/// Reads lines until the first row tells the layout, or there are enough.
fn read_head(
    input: &mut TextLines,
    flags: &TableFlags,
    try_header: &mut impl FnMut(&[u8], u8) -> Result<Chosen, String>,
) -> io::Result<(Vec<Vec<u8>>, Option<Layout>)> {
    let mut head: Vec<Vec<u8>> = Vec::new();
    let (mut layout, mut bytes, mut line) = (None, 0, Vec::new());
    while head.len() < HEAD_LINES && bytes < HEAD_BYTES && input.read(&mut line)? {
        bytes += line.len();
        head.push(line.clone());
        layout = layout.or_else(|| layout::find(&head, flags));
        if let Some(layout) = &mut layout {
            if layout.take_mark(&line) {
                break;
            }
            continue;
        }
        // A row with numbers and text: the header is a line above that has what is wanted.
        let Some((row, above)) = head.split_last() else { continue };
        let may_be = |number: usize| flags.skip_lines.is_none_or(|skipped| skipped == number);
        let delimiters = layout::delimiters(flags).iter().copied();
        layout = delimiters.filter(|&delimiter| layout::has_numbers(row, delimiter)).find_map(
            |delimiter| {
                let mut lines = above.iter().enumerate().filter(|(number, _)| may_be(*number));
                let (header, _) = lines.find(|(_, line)| {
                    try_header(line, delimiter).is_ok_and(|chosen| chosen.is_by_name())
                })?;
                let below = Layout::below(&head, header, delimiter, flags);
                Some(below.up_to(&Layout { rows: above.len(), ..below }, &head))
            },
        );
        if layout.is_some() {
            break;
        }
    }
    Ok((head, layout))
}

/// The header with what is wanted: that of the layout, or else another line.
///
/// # Errors
/// In words, what is wrong with the header of the layout.
fn choose_header(
    head: &[Vec<u8>],
    layout: Layout,
    flags: &TableFlags,
    try_header: &mut impl FnMut(&[u8], u8) -> Result<Chosen, String>,
) -> Result<(Layout, Chosen), String> {
    let problem = match try_header(&head[layout.header], layout.delimiter) {
        Ok(chosen) => return Ok((layout, chosen)),
        Err(problem) if flags.skip_lines.is_some() => return Err(problem),
        Err(problem) => problem,
    };
    for (number, line) in head.iter().enumerate() {
        for &delimiter in layout::delimiters(flags) {
            let found = try_header(line, delimiter).ok().filter(Chosen::is_by_name);
            if let Some(chosen) = found {
                let below = Layout::below(head, number, delimiter, flags);
                return Ok((below.up_to(&layout, head), chosen));
            }
        }
    }
    let is_missing = problem.contains("missing column");
    let hint = "; if the header is another line, give the lines before it with --skip-lines";
    Err(problem + if is_missing { hint } else { "" })
}

/// Why a row cannot be used.
enum RowError {
    /// It is bad.
    Bad(String),
    /// It is not after the row before.
    Order(String),
}

fn short(header: &[CsvColumn], found: usize) -> RowError {
    let expected = header.len();
    let missing = header.get(found).map_or_else(String::new, ToString::to_string);
    RowError::Bad(format!("{missing}: missing, {found} fields instead of {expected}; {RIGHT}"))
}

fn bad_cell(channel: &CsvColumn, field: &[u8], wrong: Wrong) -> RowError {
    let shown: String = decoded(field).chars().take(SHOWN).collect();
    let looks_german = number::marked(&shown, DecimalMark::Comma).is_some();
    RowError::Bad(match wrong {
        Wrong::NotFinite => format!(
            "{channel}: `{shown}` is not finite; {RIGHT}; if it stands for no value, add --missing {shown}"
        ),
        Wrong::Ambiguous => format!(
            "{channel}: `{shown}` has a comma before decimals or between thousands; say which with \
             `--decimal ,` or `--decimal .`"
        ),
        Wrong::Text if looks_german => format!(
            "{channel}: `{shown}` is not a number; {RIGHT}; if a comma comes before decimals, add \
             `--decimal ,`"
        ),
        Wrong::Text if shown.split_whitespace().count() > 1 && is_numbers(&shown) => format!(
            "{channel}: `{shown}` is not a number; {RIGHT}; if blanks separate columns, add `--delimiter ' '`"
        ),
        Wrong::Text => format!(
            "{channel}: `{shown}` is not a number; {RIGHT}; if it stands for no value, add --missing {shown}"
        ),
    })
}

fn is_numbers(text: &str) -> bool {
    text.split_whitespace().all(|word| word.parse::<f64>().is_ok())
}

fn is_missing(missing: &[(String, Option<f64>)], field: &[u8], number: Option<f64>) -> bool {
    match number {
        _ if missing.is_empty() => false,
        Some(number) => missing.iter().any(|(_, missing)| *missing == Some(number)),
        None => {
            let text = decoded(field);
            missing.iter().any(|(missing, _)| text.eq_ignore_ascii_case(missing))
        }
    }
}

fn header(line: &[u8], delimiter: u8) -> Vec<CsvColumn> {
    let mut fields = ByteRecord::new();
    split(line, delimiter, &mut fields);
    let mut header = column::named(&fields);
    // A delimiter at the end of the line begins no column.
    while header.len() > 1 && header.last().is_some_and(|column| column.name.is_empty()) {
        header.pop();
    }
    header
}

/// Numbers instead of names. Whole numbers may be names: some programs number unnamed columns.
fn is_data(columns: &[CsvColumn]) -> bool {
    columns.iter().all(|column| column.name.parse::<f64>().is_ok())
        && columns.iter().any(|column| column.name.parse::<u64>().is_err())
}

/// What tells the steps of rows.
///
/// # Errors
/// In words, which column is missing.
fn clock(
    header: &[CsvColumn],
    flags: &TableFlags,
    first_row: Option<&ByteRecord>,
) -> Result<Clock, String> {
    let of = |column: &CsvColumn| Clock::of_column(column.place, &column.name);
    match flags.time.as_deref() {
        Some("none") => return Ok(Clock::of_rows()),
        Some(name) => return column::find(header, name).map(|column| of(&column)),
        None => {}
    }
    if let Some(step) = header.iter().find(|column| column.name.eq_ignore_ascii_case(STEP)) {
        return Ok(of(step));
    }
    let tells = |column: &&CsvColumn| {
        let cell = first_row.and_then(|row| row.get(column.place));
        clock::is_time_name(&column.name)
            && cell.is_some_and(|cell| clock::is_moment(&decoded(cell)))
    };
    Ok(header.iter().find(tells).map_or_else(Clock::of_rows, of))
}

/// Puts the fields of a line into `fields`. Quotes protect delimiters; a field cannot contain a line
/// break, because a table of numbers has none.
fn split(line: &[u8], delimiter: u8, fields: &mut ByteRecord) {
    fields.clear();
    if line.contains(&b'"') && split_quoted(line, delimiter, fields) {
        return;
    }
    if delimiter == b' ' {
        // Columns are filled up with blanks.
        let fields_of = line.split(u8::is_ascii_whitespace).filter(|field| !field.is_empty());
        return fields_of.for_each(|field| fields.push_field(field));
    }
    line.split(|&byte| byte == delimiter).for_each(|field| fields.push_field(field));
}

/// False if the line has no fields to the reader of quotes.
fn split_quoted(line: &[u8], delimiter: u8, fields: &mut ByteRecord) -> bool {
    let mut reader = ReaderBuilder::new().has_headers(false).delimiter(delimiter).from_reader(line);
    matches!(reader.read_byte_record(fields), Ok(true))
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn open(text: &str) -> CsvRows {
        let input = Box::new(Cursor::new(text.as_bytes().to_vec()));
        CsvRows::open(input, "t".into(), &TableFlags::default(), |_| Ok(None)).unwrap()
    }

    /// Every row as its numbers or its problem.
    fn rows(text: &str) -> Vec<Result<Vec<Option<f64>>, String>> {
        let mut rows = open(text);
        let mut all = Vec::new();
        while let Some(row) = rows.next_row().unwrap() {
            let values = row.values.iter().map(|value| Some(*value).filter(|v| !v.is_nan()));
            all.push(row.problem.map_or_else(|| Ok(values.collect()), Err));
        }
        all
    }

    #[test]
    fn columns_of_blanks_are_read_as_said_and_the_flag_is_named_otherwise() {
        let text = "t  x\n  0.0   1.5\n 1.0  -2.5 \n";
        let flags = TableFlags { delimiter: Some(b' '), ..TableFlags::default() };
        let input = Box::new(Cursor::new(text.as_bytes().to_vec()));
        let mut rows = CsvRows::open(input, "t".into(), &flags, |_| Ok(None)).unwrap();
        let mut all = Vec::new();
        while let Some(row) = rows.next_row().unwrap() {
            assert_eq!(row.problem, None);
            all.push(row.values.to_vec());
        }
        assert_eq!(all.len(), 2);
        assert_eq!(all.concat().last(), Some(&-2.5));
        let Err(problem) = &self::rows("x\n0.5\n0.0  1.5\n")[1] else { panic!("it was read") };
        assert!(problem.contains("add `--delimiter ' '`"), "{problem}");
    }

    #[test]
    fn line_ends_blanks_quotes_and_the_byte_order_mark_do_not_matter() {
        let expected = [Ok(vec![Some(1.0), Some(2.0)]), Ok(vec![Some(3.0), Some(-4e-5)])];
        for text in [
            "x,y\n1,2\n3,-4e-5\n",
            "x,y\r\n1,2\r\n3,-4e-5",
            "\u{feff}x, y\n 1 ,2\n\"3\",\"-4e-5\"\n\n  \n\n",
            "x,y,\n1,2,\n3,-4e-5,\n",
        ] {
            assert_eq!(rows(text), expected, "{text:?}");
        }
    }

    #[test]
    fn an_empty_line_or_cell_is_a_row_without_a_sample() {
        let expected = [Some(1.0), None, None, Some(4.0)].map(|value| Ok(vec![value]));
        assert_eq!(rows("x\n1\n\n\n4\n\n"), expected);
        assert_eq!(rows("x\n1\nNaN\nnull\n4\n"), expected);
        assert_eq!(rows("x,y\n,2\n")[0], Ok(vec![None, Some(2.0)]));
    }

    #[test]
    fn every_problem_names_its_line_and_column() {
        let found = rows("x,y\n1,2\n1,two\n1,-inf\n1e999,0\n1\n1,2,3\n1,0;5\n5,6\n");
        let starts = [
            "line 3, column 2 `y`: `two` is not a number",
            "line 4, column 2 `y`: `-inf` is not finite",
            "line 5, column 1 `x`: `1e999` is not finite",
            "line 6, column 2 `y`: missing, 1 fields instead of 2",
            "line 7, column 3: one too many, 3 fields instead of 2",
            "line 8, column 2 `y`: `0;5` is not a number",
        ];
        for (row, start) in found[1..].iter().zip(starts) {
            assert!(row.as_ref().unwrap_err().starts_with(start), "{row:?}");
        }
        assert_eq!(found[7], Ok(vec![Some(5.0), Some(6.0)]));
    }

    #[test]
    fn a_number_that_may_stand_for_none_is_remarked() {
        let mut rows = open("x,y\n-999,-999\n-999,1\n");
        while rows.next_row().unwrap().is_some() {}
        let said =
            "t: channel `x` is -999 in 2 rows; if that stands for no value, add --missing -999";
        assert_eq!(rows.remarks(), [said]);
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
}
