//! The width of tables.

use std::io::{self, IsTerminal};

use terminal_size::{Width, terminal_size_of};

/// The width assumed for a terminal that does not report its own.
const USUAL: u16 = 80;
/// On a narrower terminal, a line of a cell would have space for only a letter or two.
const NARROWEST: u16 = 40;

/// Whether tables may be wider than the terminal.
#[derive(Debug, Clone, Copy, Default, clap::Args)]
pub(crate) struct WidthArguments {
    /// Print every row of a table on one line, even if that is wider than the terminal
    #[arg(long)]
    wide: bool,
}

impl WidthArguments {
    /// The maximum width of tables; `None` if unlimited.
    pub(crate) fn limit(self) -> Option<u16> {
        if self.wide { None } else { terminal_width() }
    }
}

/// The width of the terminal on standard output; `None` for files and pipes, which get unbroken lines.
pub(crate) fn terminal_width() -> Option<u16> {
    let out = io::stdout();
    let variable = std::env::var("COLUMNS").ok();
    let reported = terminal_size_of(&out).map(|(Width(columns), _)| columns);
    out.is_terminal().then(|| chosen(reported, variable.as_deref()))
}

fn chosen(reported: Option<u16>, variable: Option<&str>) -> u16 {
    let variable = variable.and_then(|text| text.trim().parse::<u16>().ok());
    let columns = reported.or(variable).filter(|columns| *columns > 0);
    columns.unwrap_or(USUAL).max(NARROWEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_terminal_is_asked_before_the_environment() {
        assert_eq!(chosen(Some(132), Some("90")), 132);
        assert_eq!(chosen(None, Some("90")), 90);
        assert_eq!([None, Some("0"), Some("wide")].map(|text| chosen(None, text)), [USUAL; 3]);
        assert_eq!(chosen(Some(1), None), NARROWEST);
    }

    #[test]
    fn who_asks_for_wide_tables_gets_them() {
        assert_eq!(WidthArguments { wide: true }.limit(), None);
    }
}
