//! What may be said about the form of a table. Nothing need be.

use vocabulary::RunId;

use super::number::DecimalMark;

/// How tables are read. Delimiter, decimal mark, header and units are recognised where these flags do not say them.
#[derive(Debug, Clone, Default, clap::Args)]
#[command(next_help_heading = "Form of the table")]
pub struct TableFlags {
    /// Lines before the header [default: as recognised]
    #[arg(long, value_name = "N")]
    pub(crate) skip_lines: Option<usize>,
    /// The line after the header holds units, not values; usual units are recognised
    #[arg(long)]
    pub(crate) units_row: bool,
    /// Character between the fields of a row, `\t` for a tabulator [default: as recognised]
    #[arg(long, value_name = "CHARACTER", value_parser = delimiter)]
    pub(crate) delimiter: Option<u8>,
    /// Character before the decimals of a number, `.` or `,` [default: as recognised]
    #[arg(long, value_name = "CHARACTER", value_parser = decimal)]
    pub(crate) decimal: Option<DecimalMark>,
    /// A cell of this text or number has no value, like an empty one or NaN, NA, NULL; as often as there are
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    pub(crate) missing: Vec<String>,
    /// Column of the rows' steps or times, from which gaps follow, or `none` to count rows [default: `step`, or the
    /// first column named like a time]
    #[arg(long, value_name = "COLUMN")]
    pub(crate) time: Option<String>,
    /// Count bad rows and take them as gaps instead of stopping at the first one. Bad are rows with
    /// text or an infinite number in a channel, or too few or too many fields
    #[arg(long)]
    pub skip_bad: bool,
    /// Only this run of a recording (MCAP), or of the tables that `export` made of one
    #[arg(long, value_name = "RUN", value_parser = run)]
    pub run: Option<RunId>,
}

impl TableFlags {
    /// The same with this column of steps or times.
    #[must_use]
    pub fn with_time(&self, column: &str) -> Self {
        Self { time: Some(column.to_owned()), ..self.clone() }
    }

    /// The flags as they are given.
    #[must_use]
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut flag = |name: &str, value: String| words.extend([name.to_owned(), value]);
        if let Some(lines) = self.skip_lines {
            flag("--skip-lines", lines.to_string());
        }
        if let Some(delimiter) = self.delimiter {
            flag("--delimiter", format!("'{}'", delimiter.escape_ascii()));
        }
        if let Some(mark) = self.decimal {
            flag("--decimal", if mark == DecimalMark::Comma { "," } else { "." }.to_owned());
        }
        self.missing.iter().for_each(|value| flag("--missing", format!("{value:?}")));
        if let Some(column) = &self.time {
            flag("--time", format!("{column:?}"));
        }
        if let Some(run) = self.run {
            flag("--run", run.to_string());
        }
        words.extend(self.units_row.then(|| "--units-row".to_owned()));
        words.extend(self.skip_bad.then(|| "--skip-bad".to_owned()));
        words
    }
}

fn run(text: &str) -> Result<RunId, String> {
    let number = text.parse().map_err(|_| "use the number of a run, a whole number")?;
    Ok(RunId(number))
}

fn delimiter(text: &str) -> Result<u8, String> {
    match text {
        "\\t" => Ok(b'\t'),
        _ => match text.as_bytes() {
            [byte] if byte.is_ascii() && !b"\"\r\n".contains(byte) => Ok(*byte),
            _ => Err("use one ASCII character, e.g. `;`, or `\\t` for a tabulator".into()),
        },
    }
}

fn decimal(text: &str) -> Result<DecimalMark, String> {
    match text {
        "." => Ok(DecimalMark::Point),
        "," => Ok(DecimalMark::Comma),
        _ => Err("use `.` or `,`".into()),
    }
}
