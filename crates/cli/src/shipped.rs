//! The shipped configurations, embedded in the program.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;

/// A shipped file: its path in the directory of configurations, and its text.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shipped {
    pub(crate) path: &'static str,
    pub(crate) text: &'static str,
}

macro_rules! shipped {
    ($path:literal) => {
        Shipped { path: $path, text: include_str!(concat!("../../../configs/", $path)) }
    };
}

/// The plant of the tower.
pub(crate) const PLANT: Shipped = shipped!("plant.toml");
/// The plant in weather common to all modules, and in separate weather for each module.
pub(crate) const WEATHER_ALIKE: Shipped = shipped!("weather/alike.toml");
pub(crate) const WEATHER_UNEVEN: Shipped = shipped!("weather/uneven.toml");
/// The diagnosers of its modules.
pub(crate) const MODULES: [Shipped; 2] = [shipped!("module1.toml"), shipped!("module2.toml")];
/// The diagnosers of its modules with the settings of the paper.
pub(crate) const PAPER_MODULES: [Shipped; 2] =
    [shipped!("paper/module1.toml"), shipped!("paper/module2.toml")];
/// The files that those refer to.
pub(crate) const OTHERS: [Shipped; 9] = [
    shipped!("tower.toml"),
    shipped!("tower/module1.structure.toml"),
    shipped!("tower/module2.structure.toml"),
    shipped!("thresholds/module1.toml"),
    shipped!("thresholds/module2.toml"),
    shipped!("references/module1.toml"),
    shipped!("references/module2.toml"),
    shipped!("paper/thresholds/module1.toml"),
    shipped!("paper/thresholds/module2.toml"),
];

/// Descriptions of structures to start from, and of a plant's traffic, by name.
pub(crate) const TEMPLATES: [(&str, Shipped); 5] = [
    ("tower", shipped!("tower.toml")),
    ("mast", shipped!("templates/mast.toml")),
    ("bridge", shipped!("templates/bridge.toml")),
    ("bridge-traffic", shipped!("templates/bridge-traffic.toml")),
    ("frame", shipped!("templates/frame.toml")),
];

impl Shipped {
    /// Writes the file to its place in this directory; returns its path.
    pub(crate) fn write(self, directory: &Path) -> Result<PathBuf, Failure> {
        self.write_as(directory, self.text)
    }

    /// Writes a different text to the file's place in this directory; returns its path.
    pub(crate) fn write_as(self, directory: &Path, text: &str) -> Result<PathBuf, Failure> {
        let file = directory.join(self.path);
        let folder = file.parent().unwrap_or(directory);
        fs::create_dir_all(folder)
            .and_then(|()| fs::write(&file, text))
            .map_err(|error| Failure::unwritable(&file, error))?;
        Ok(file)
    }
}

/// An empty temporary directory that is removed when dropped.
pub(crate) fn temporary_directory(prefix: &str) -> Result<tempfile::TempDir, Failure> {
    tempfile::Builder::new()
        .prefix(prefix)
        .tempdir()
        .map_err(|error| Failure::runtime(format!("cannot write a temporary directory: {error}")))
}
