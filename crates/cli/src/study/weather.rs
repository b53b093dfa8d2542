//! Weather of the shipped plant.

use crate::shipped::{PLANT, Shipped, WEATHER_ALIKE, WEATHER_UNEVEN};

/// Weather of the shipped plant.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Weather {
    /// Wind and noise only, as in `configs/plant.toml`
    None,
    /// Any wind, live loads and temperatures, the same in all modules: `configs/weather/alike.toml`
    Alike,
    /// Other temperatures in each module and member, imperfect gages, pressure sensors and valves:
    /// `configs/weather/uneven.toml`
    Uneven,
}

impl Weather {
    /// All of them.
    pub(super) const ALL: [Weather; 3] = [Weather::None, Weather::Alike, Weather::Uneven];

    pub(super) fn plant(self) -> Shipped {
        match self {
            Weather::None => PLANT,
            Weather::Alike => WEATHER_ALIKE,
            Weather::Uneven => WEATHER_UNEVEN,
        }
    }

    pub(super) fn as_str(self) -> &'static str {
        match self {
            Weather::None => "none",
            Weather::Alike => "alike",
            Weather::Uneven => "uneven",
        }
    }
}
