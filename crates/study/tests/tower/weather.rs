//! Weather that commissioned plants go through.

use plant::PlantParameters;

/// The shipped plant's weather that is the same in all modules.
pub fn alike() -> PlantParameters {
    let shipped = include_str!("../../../../configs/weather/alike.toml");
    let table: toml::Table = shipped.parse().unwrap();
    table["plant"].clone().try_into().unwrap()
}
