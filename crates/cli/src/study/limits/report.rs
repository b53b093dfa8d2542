//! The limits, for people and for machines.

use std::io::{self, Write};

use serde::Serialize;
use study::limits::{
    LimitCurve, LimitPoint, SizedKind, WeatherLimits, Within, curves, smallest_within,
};

use super::Arguments;
use crate::failure::Failure;
use crate::study::drawn_plants::DrawnPlants;
use crate::study::tables::{self, Titled};
use crate::table::{table, terminal_width};
use crate::versioned;

/// The times that the tables are of \[s\], and what those are called.
const TIMES: [(f64, &str); 8] = [
    (0.01, "10 ms"),
    (0.03, "30 ms"),
    (0.1, "0.1 s"),
    (0.3, "0.3 s"),
    (1.0, "1 s"),
    (3.0, "3 s"),
    (10.0, "10 s"),
    (30.0, "30 s"),
];

/// What was asked for and what came of it.
#[derive(Serialize)]
pub(super) struct Report<'a> {
    seed: u64,
    mismatch: f64,
    plants: u64,
    runs: u64,
    weathers: &'a [WeatherLimits],
}

impl<'a> Report<'a> {
    pub(super) fn of(arguments: &Arguments, weathers: &'a [WeatherLimits]) -> Self {
        let DrawnPlants { seed, mismatch, plants } = arguments.drawn;
        let (plants, runs) = (plants.get(), arguments.runs.get());
        Self { seed, mismatch, plants, runs, weathers }
    }

    /// Prints it on standard output.
    pub(super) fn print(&self, json: bool) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        if json {
            write!(out, "{}", versioned::text(self)?)?;
        } else {
            tables::write(&self.against_time(), terminal_width(), &mut out)?;
            for kind in SizedKind::ALL {
                self.write_sizes(kind, &mut out)?;
            }
        }
        Ok(out.flush()?)
    }

    fn against_time(&self) -> Vec<Titled> {
        let table = |title, note: &str, of: fn(&LimitCurve) -> &[Within]| {
            let all = SizedKind::ALL.into_iter().flat_map(|kind| curves(self.weathers, kind));
            let row = |(weather, curve): (&WeatherLimits, &LimitCurve)| {
                let kind = format!("{} [{}]", curve.kind.title(), curve.unit);
                let mut row =
                    vec![kind, curve.detector.title().to_owned(), weather.weather.to_owned()];
                row.extend(TIMES.map(|(time, _)| size(smallest_within(of(curve), time))));
                row
            };
            let mut heading = vec!["fault", "detector", "weather"];
            heading.extend(TIMES.map(|(_, name)| name));
            Titled { title, note: note.to_owned(), heading, rows: all.map(row).collect() }
        };
        vec![
            table("Smallest fault found in 95 of 100 runs within", FOUND, |curve| &curve.found),
            table("Smallest fault right in 95 of 100 runs within", RIGHT, |curve| &curve.right),
        ]
    }

    /// How long it takes until faults of each size are found.
    fn write_sizes(&self, kind: SizedKind, out: &mut impl Write) -> io::Result<()> {
        let names = curves(self.weathers, kind).map(|(weather, curve)| {
            let detector = curve.detector.title();
            format!("{detector}, {}", weather.weather)
        });
        let heading: Vec<String> =
            [format!("size [{}]", kind.unit())].into_iter().chain(names).collect();
        let heading: Vec<&str> = heading.iter().map(String::as_str).collect();
        let mut text = table(&heading);
        for (place, size) in kind.sizes().iter().enumerate() {
            let cells = curves(self.weathers, kind)
                .map(|(_, curve)| curve.points.get(place).map_or_else(String::new, time));
            text.add_row([number(*size)].into_iter().chain(cells));
        }
        text.align_right(0..heading.len());
        writeln!(
            out,
            "\nTime within which 95 of 100 are found, or how many are: {}",
            kind.title()
        )?;
        writeln!(out, "{}", text.text(terminal_width()))
    }
}

const FOUND: &str = "change: the fault jumps in; a change that no other fault explains. reference: it is there from the \
                     first sample on;\ndeclared faulty, or one of several suspects.";
const RIGHT: &str = "declared faulty, or the likeliest of several suspects.";

fn size(smallest: Option<f64>) -> String {
    smallest.map_or_else(|| "–".to_owned(), number)
}

/// In plain digits or, if it is as small as a leak, as a power of ten.
fn number(size: f64) -> String {
    if size < 1e-3 { format!("{size:e}") } else { size.to_string() }
}

fn time(point: &LimitPoint) -> String {
    match point.found.within_s {
        Some(seconds) if seconds < 1.0 => format!("{:.0} ms", 1e3 * seconds),
        Some(seconds) => format!("{seconds:.1} s"),
        None => format!("{} of {}", point.found.count, point.runs),
    }
}
