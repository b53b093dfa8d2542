//! Where the header and the rows of a table begin, and what separates fields and decimals.

use csv::ByteRecord;

use super::clock::is_date;
use super::flags::TableFlags;
use super::number::{DecimalMark, Wrong, decoded, is_missing, number};
use super::split;

/// What may separate fields, the more usual first.
const DELIMITERS: [u8; 4] = [b',', b';', b'\t', b'|'];

/// Units of measurement, and words that stand for none or for how a value was averaged.
const UNITS: &str = "s ms us ns h min hh:mm:ss TS ts RN - V mV uV A mA N kN MN Nm kNm Pa hPa kPa MPa GPa bar mbar psi \
    m mm cm km um m/m um/m mm/m uE ue ustrain strain microstrain m/s mm/s km/h m/s2 m/s^2 mm/s2 m/s**2 g mg kg t Hz \
    kHz 1/s 1/min rpm rad rad/s mrad deg Deg degC Deg_C DegC K C %RH RH % W kW J kJ Ohm ohm l/min l/s m3/h in ft lb \
    lbf kip Volt Volts Volts/Volt mV/V Newton meter Smp Avg Min Max Std Tot";

/// How a table is laid out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) delimiter: u8,
    /// None while no number has told.
    pub(crate) mark: Option<DecimalMark>,
    /// Index of the header's line.
    pub(crate) header: usize,
    /// Index of the first row's line.
    pub(crate) rows: usize,
}

/// What a line is as a row.
struct RowForm {
    /// Fields up to the last one that is not empty.
    fields: usize,
    names: usize,
    /// Some name has a letter.
    letters: bool,
    numbers: usize,
    whole: usize,
    dates: usize,
}

impl RowForm {
    fn of(line: &[u8], delimiter: u8, mark: Option<DecimalMark>) -> RowForm {
        let mut form =
            RowForm { fields: 0, names: 0, letters: false, numbers: 0, whole: 0, dates: 0 };
        for (place, field) in fields(line, delimiter).iter().enumerate() {
            let text = decoded(field);
            if text.is_empty() {
                continue;
            }
            form.fields = place + 1;
            match number(field, &mut mark.clone()) {
                _ if is_missing(&text) => {}
                Ok(_) | Err(Wrong::NotFinite | Wrong::Ambiguous) => {
                    form.numbers += 1;
                    form.whole += usize::from(text.parse::<u64>().is_ok());
                }
                Err(Wrong::Text) if is_date(&text) => form.dates += 1,
                Err(Wrong::Text) => {
                    form.names += 1;
                    form.letters |= text.contains(char::is_alphabetic);
                }
            }
        }
        form
    }

    fn is_data(&self) -> bool {
        self.numbers > 0 && self.names == 0
    }

    /// Some programs number unnamed columns.
    fn is_header_of(&self, data: &RowForm) -> bool {
        let named = self.letters && self.numbers == self.whole && self.dates == 0;
        self.fields >= data.fields
            && (named || self.names == 0 && self.numbers == self.whole && self.whole > 0)
    }
}

fn fields(line: &[u8], delimiter: u8) -> ByteRecord {
    let mut fields = ByteRecord::new();
    split(line, delimiter, &mut fields);
    fields
}

/// The delimiters that are in question.
pub(crate) fn delimiters(flags: &TableFlags) -> &[u8] {
    flags.delimiter.as_ref().map_or(&DELIMITERS, std::slice::from_ref)
}

/// The delimiter under which a line has most fields.
pub(crate) fn usual_delimiter(line: &[u8], flags: &TableFlags) -> u8 {
    let candidates = delimiters(flags).iter().rev();
    candidates.copied().max_by_key(|&delimiter| fields(line, delimiter).len()).unwrap_or(b',')
}

/// The layout, if the last of these lines, the first of a table, is its first row of numbers.
pub(crate) fn find(head: &[Vec<u8>], flags: &TableFlags) -> Option<Layout> {
    let (last, above) = head.split_last()?;
    let mut best: Option<(usize, Layout)> = None;
    for &delimiter in delimiters(flags) {
        let data = RowForm::of(last, delimiter, flags.decimal);
        if !data.is_data() || best.is_some_and(|(fields, _)| fields >= data.fields) {
            continue;
        }
        if let Some(header) = header_above(above, delimiter, &data, flags) {
            let (mark, rows) = (flags.decimal, above.len());
            best = Some((data.fields, Layout { delimiter, mark, header, rows }));
        }
    }
    let (_, mut layout) = best?;
    while layout.rows > layout.header + 1 && is_blank(&head[layout.rows - 1]) {
        layout.rows -= 1;
    }
    Some(layout)
}

fn header_above(
    above: &[Vec<u8>],
    delimiter: u8,
    data: &RowForm,
    flags: &TableFlags,
) -> Option<usize> {
    let is_header = |line: &Vec<u8>| RowForm::of(line, delimiter, None).is_header_of(data);
    if let Some(skipped) = flags.skip_lines {
        let after_units = skipped + usize::from(flags.units_row);
        return (after_units < above.len()).then_some(skipped);
    }
    if let Some(header) = campbell_header(above) {
        return Some(header);
    }
    let mut header = above.iter().rposition(|line| !is_blank(line))?;
    if flags.units_row {
        header = header.checked_sub(1)?;
    }
    while header > 0 && is_units(&above[header], delimiter) && is_header(&above[header - 1]) {
        header -= 1;
    }
    let form = RowForm::of(&above[header], delimiter, None);
    // Numbers for names are told from a row with text by standing first.
    let may_number = form.numbers == 0 || above[..header].iter().all(|line| is_blank(line));
    (form.is_header_of(data) && may_number).then_some(header)
}

/// Loggers of Campbell Scientific put a line about the logger before the header.
fn campbell_header(above: &[Vec<u8>]) -> Option<usize> {
    let is_of_logger = |line: &Vec<u8>| {
        [&b"\"TOA5\""[..], b"TOA5,", b"\"TOACI1\"", b"TOACI1,"]
            .iter()
            .any(|word| line.starts_with(word))
    };
    let logger = above.iter().position(is_of_logger)?;
    (logger + 1 < above.len()).then_some(logger + 1)
}

pub(crate) fn is_blank(line: &[u8]) -> bool {
    line.trim_ascii().is_empty()
}

/// Are there numbers in a line?
pub(crate) fn has_numbers(line: &[u8], delimiter: u8) -> bool {
    RowForm::of(line, delimiter, None).numbers > 0
}

/// Does a line name units?
pub(crate) fn is_units(line: &[u8], delimiter: u8) -> bool {
    let fields = fields(line, delimiter);
    let mut named = fields.iter().map(decoded).filter(|text| !text.is_empty()).peekable();
    named.peek().is_some() && named.all(|text| is_unit(&text))
}

fn is_unit(text: &str) -> bool {
    let bracketed = [('[', ']'), ('(', ')')];
    let inner = |(open, close)| text.strip_prefix(open)?.strip_suffix(close);
    let is_special =
        text.chars().count() <= 8 && text.contains(['µ', 'μ', 'ε', '°', '²', 'Ω', '‰']);
    bracketed.into_iter().any(|pair| inner(pair).is_some())
        || is_special
        || UNITS.split_whitespace().any(|unit| unit == text)
}

impl Layout {
    /// The layout of a table with this header.
    pub(crate) fn below(
        head: &[Vec<u8>],
        header: usize,
        delimiter: u8,
        flags: &TableFlags,
    ) -> Layout {
        let is_units = |line: &Vec<u8>| flags.units_row || is_units(line, delimiter);
        let rows = header + 1 + usize::from(head.get(header + 1).is_some_and(is_units));
        Layout { delimiter, mark: flags.decimal, header, rows }
    }

    /// This layout with the first row of another, if only lines without numbers are between them.
    pub(crate) fn up_to(mut self, other: &Layout, head: &[Vec<u8>]) -> Layout {
        self.mark = other.mark;
        while self.rows < other.rows {
            let form = RowForm::of(&head[self.rows], self.delimiter, self.mark);
            if form.numbers > 0 || form.fields == 0 {
                break;
            }
            self.rows += 1;
        }
        self
    }

    /// Takes the decimal mark from a row, if its numbers tell. Does none of them leave it open?
    pub(crate) fn take_mark(&mut self, row: &[u8]) -> bool {
        let mut is_open = false;
        let mut found = self.mark;
        for field in &fields(row, self.delimiter) {
            let mut mark = None;
            is_open |= number(field, &mut mark) == Err(Wrong::Ambiguous);
            // A comma before decimals settles the mark; a point may be a thousands separator.
            let tells = mark == Some(DecimalMark::Comma) || found.is_none();
            found = mark.filter(|_| tells).or(found);
        }
        self.mark = self.mark.or(found);
        self.mark.is_some() || !is_open
    }
}
