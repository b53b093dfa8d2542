//! What `trusswatch detect` takes, each setting with its range.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use diagnosis::detector::{ChannelGroup, GapRule, Tuning};
use diagnosis::divergence::{
    DivergenceSettings, Interval, MAX_INTERVAL, MAX_LAG, MAX_WINDOW, SettingsError,
};

use tables::TableFlags;

/// Run the change detector on your own numbers
///
/// FILE is a table (CSV, or what a logger or spreadsheet exports) with a header row; each column is a
/// channel, each row a sampling instant. A column `step` or of times tells which rows are missing and is
/// no channel. An empty cell is a gap of its channel, an empty line one of all.
///
/// For every row and channel the detector gives the Kullback-Leibler divergence between the running
/// Gaussian of the last vectors of samples and that of some steps ago: about 0 as long as the
/// statistics of the channel stay what they are, large when they change. A sliding interval gives a change
/// a second time: when it leaves the interval, about that many rows later, and so does the end of one. While samples that
/// leave the interval cause more of the divergence than new ones do, rows count neither as changes nor for the largest
/// divergence; --json marks them with `"leaving":true`.
///
/// All channels share one set of settings: channels of different units are best run one by one
/// with --columns. With --config each column is watched as the module's diagnoser does it: a gap of a few
/// steps is filled, after a long one the channel is learnt anew.
///
/// With the --config of a module that `learn` made, columns are readings, and every sensor and input is judged: faulty,
/// with kind, size and what it should have read; without a signal; or unknown, with the reason.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Table with a header row; `-` reads standard input. Or, with --config, files of `trusswatch record` (MCAP), of
    /// which several are one recording: the diagnosers' residuals are computed from its samples
    #[arg(required = true, value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,
    /// Samples in a vector, 1 to 256
    #[arg(long, value_name = "W", default_value = "10", value_parser = window, allow_hyphen_values = true)]
    window: usize,
    /// Steps between the two Gaussians that are compared, 1 to 4096
    #[arg(long, value_name = "L", default_value = "10", value_parser = lag, allow_hyphen_values = true)]
    lag: usize,
    /// Vectors that a Gaussian rests on, 2 to 10000000; 0 for all since the start
    #[arg(long, value_name = "M", default_value = "2000", value_parser = interval, allow_hyphen_values = true)]
    interval: usize,
    /// Take the settings of the columns from a diagnoser's configuration, as often as there are
    /// modules. Columns are then residuals of components, `module1/actuator/a1/residual` or
    /// `module1/actuator/a1`, with one module also without its name; other columns are left out. The first row counts as the first step of a run. Changes that leave the
    /// interval are listed like others
    #[arg(
        long = "config",
        value_name = "CONFIG.toml",
        conflicts_with_all = [
            "window", "lag", "interval", "prior_scatter", "threshold", "warm_up", "quiet_steps"
        ],
    )]
    pub(super) modules: Vec<PathBuf>,
    /// Scatter to start from, above 0: about the square of the sensor's noise (standard deviation),
    /// in squared units of the channel. Keeps a stuck or silent channel well defined
    #[arg(long, value_name = "E", value_parser = prior_scatter, allow_hyphen_values = true, required_unless_present = "modules")]
    prior_scatter: Option<f64>,
    /// Divergence from which on a row counts as a change, above 0; without it nothing does
    #[arg(long, value_name = "G", value_parser = threshold, allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Vectors that must have been taken before a row can count as a change: the first divergences of
    /// any series are large
    #[arg(long, value_name = "VECTORS", default_value_t = 0)]
    warm_up: u64,
    /// Rows below the threshold after which a change has ended, at least 1
    #[arg(long, value_name = "ROWS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    quiet_steps: u64,
    /// Only these columns, separated by commas: names, or numbers from 1 such as `#3`
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    pub(super) columns: Option<Vec<String>>,
    /// Rows per second, if no column of times tells it; with a learned module
    #[arg(long, value_name = "HZ", requires = "modules", value_parser = crate::learn::rate)]
    pub(super) rate: Option<f64>,
    /// Draw the readings and what was found of them; with a learned module
    #[arg(long, value_name = "PICTURE.svg", requires = "modules")]
    pub(super) svg: Option<PathBuf>,
    /// Write what each channel reads in every row, or while it is faulty what it should have read in the latest window,
    /// with a 95 % interval, and nothing while that is not known or it has no signal; with a learned module
    #[arg(long, value_name = "TABLE.csv", requires = "modules")]
    pub(super) corrected: Option<PathBuf>,
    #[command(flatten)]
    pub(super) table: TableFlags,
    /// Print one line of JSON for each row
    #[arg(long)]
    pub(super) json: bool,
    /// Print every row instead of a summary
    #[arg(long, conflicts_with = "json")]
    pub(super) all: bool,
}

impl Arguments {
    /// The settings of this many channels, from the flags.
    pub(super) fn group(&self, channels: usize) -> ChannelGroup {
        let interval = match self.interval {
            0 => Interval::Growing,
            vectors => Interval::Sliding { vectors },
        };
        let tuning = Tuning {
            // Not a number is refused like any other that cannot be meant, if ever it is missing.
            prior_scatter: self.prior_scatter.unwrap_or(f64::NAN),
            threshold: self.threshold.unwrap_or(f64::INFINITY),
        };
        ChannelGroup {
            settings: DivergenceSettings { window: self.window, lag: self.lag, interval },
            warm_up: self.warm_up,
            quiet_steps: self.quiet_steps,
            gaps: GapRule::OPEN,
            marks_leaving: true,
            channels: vec![tuning; channels],
        }
    }
}

fn whole_number(text: &str, range: RangeInclusive<usize>, hint: &str) -> Result<usize, String> {
    let right = || format!("use a whole number from {} to {}{hint}", range.start(), range.end());
    let number = text.parse().map_err(|_| right())?;
    if range.contains(&number) { Ok(number) } else { Err(right()) }
}

fn window(text: &str) -> Result<usize, String> {
    whole_number(text, 1..=MAX_WINDOW, " samples")
}

fn lag(text: &str) -> Result<usize, String> {
    whole_number(text, 1..=MAX_LAG, " steps")
}

fn interval(text: &str) -> Result<usize, String> {
    if text == "0" {
        return Ok(0);
    }
    whole_number(text, 2..=MAX_INTERVAL, " vectors, or 0 for all since the start")
}

fn prior_scatter(text: &str) -> Result<f64, String> {
    let number = text.parse().unwrap_or(f64::NAN);
    match SettingsError::check_prior_scatter(number) {
        Ok(()) => Ok(number),
        Err(_) => Err("use a finite number above 0, in squared units of the channel".into()),
    }
}

fn threshold(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().unwrap_or(f64::NAN);
    let usable = number.is_finite() && number > 0.0;
    if usable { Ok(number) } else { Err("use a finite number above 0".into()) }
}
