//! The Kullback–Leibler divergence of a residual's running Gaussian (section 4.2 of the paper).

mod accumulator;
mod bank;
mod estimator;
mod history;
mod lanes;
mod outcome;
mod recent;
mod settings;

pub use bank::DivergenceBank;
pub use outcome::{Outcome, Violation};
pub use settings::{
    DivergenceSettings, Interval, MAX_INTERVAL, MAX_LAG, MAX_WINDOW, SettingsError,
};
