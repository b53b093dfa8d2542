//! A diagnoser's file, and its version for a copy.

use std::path::{Path, PathBuf};

use daemon::config::{DiagnoserConfig, load_diagnoser};
use diagnosis::thresholds::{MadeFor, Thresholds};
use settings::ConfigErrors;
use toml::{Table, Value};
use truss::{Structure, copy_prefix};
use vocabulary::{ModuleName, StructureName};

use super::directory::Directory;
use crate::failure::Failure;

/// The files of the original's module.
pub(super) struct Template {
    file: PathBuf,
    config: DiagnoserConfig,
    table: Table,
    thresholds: Thresholds,
}

/// The files of a module in a copy.
pub(super) struct Copied {
    name: ModuleName,
    config: String,
    structure: String,
    thresholds: String,
}

impl Template {
    /// Reads and checks a diagnoser's file and the files named in it.
    pub(super) fn read(file: &Path) -> Result<Template, Failure> {
        let config = load_diagnoser(file).map_err(|errors| unusable(&errors))?;
        let table = read_table(file)?;
        // Checked above, including the two files.
        let named = table.get("thresholds").and_then(Value::as_str).unwrap_or_default();
        let beside =
            file.parent().map_or_else(|| PathBuf::from(named), |folder| folder.join(named));
        let thresholds = read_table(&beside)?
            .try_into()
            .map_err(|error| Failure::input(format!("{}: {error}", beside.display())))?;
        Ok(Template { file: file.to_owned(), config, table, thresholds })
    }

    pub(super) fn file(&self) -> &Path {
        &self.file
    }

    pub(super) fn module(&self) -> &ModuleName {
        self.config.module()
    }

    pub(super) fn peers(&self) -> &[ModuleName] {
        self.config.peers()
    }

    /// The module in the copy with this number.
    pub(super) fn copied(
        &self,
        copy: usize,
        copies: usize,
        row: &StructureName,
        peers: Vec<String>,
        network: Table,
    ) -> Result<Copied, Failure> {
        let original = self.module();
        let name = ModuleName::new(format!("{}{original}", copy_prefix(copy, copies)))
            .map_err(|error| Failure::input(format!("{}: {error}", self.file.display())))?;
        let origin = format!("a copy of `{original}` of {}", self.file.display());
        let comment = format!("# Module `{name}`, {origin}. Made by `trusswatch replicate`.\n");
        let structure = self.structure(&name, row);
        Ok(Copied {
            config: format!("{comment}{}", self.table(&name, peers, network)),
            structure: format!("{comment}{}", structure.to_toml()),
            thresholds: format!("{comment}{}", text(&self.thresholds(&name, row))?),
            name,
        })
    }

    fn table(&self, name: &ModuleName, peers: Vec<String>, network: Table) -> Table {
        let mut table = self.table.clone();
        table.insert("module".into(), name.to_string().into());
        table.insert("structure".into(), format!("structures/{name}.toml").into());
        table.insert("thresholds".into(), format!("thresholds/{name}.toml").into());
        // The healthy measurements of one module do not apply to another.
        table.remove("reference");
        table.insert("peers".into(), peers.into());
        table.insert("network".into(), network.into());
        // The copies cannot share an address or a directory; each gets its own at its start.
        table.remove("health");
        if let Some(state) = table.get_mut("state").and_then(Value::as_table_mut) {
            state.remove("directory");
        }
        table
    }

    /// The original's description of its own module, under the new names.
    fn structure(&self, name: &ModuleName, row: &StructureName) -> Structure {
        let mut structure = self.config.module_setup().structure;
        structure.name = row.clone();
        let own = structure.modules.iter_mut().filter(|module| &module.name == self.module());
        own.for_each(|module| module.name = name.clone());
        structure
    }

    /// The thresholds of the original, because the copy has the same dynamics.
    fn thresholds(&self, name: &ModuleName, row: &StructureName) -> Thresholds {
        let mut thresholds = self.thresholds.clone();
        thresholds.module = name.clone();
        let step_s = self.config.module_setup().step_s;
        let made_for = MadeFor::new(&self.structure(name, row), step_s);
        thresholds.made_for =
            thresholds.made_for.map(|original| MadeFor { loads: original.loads, ..made_for });
        let origin = format!(
            "those of `{}` of the structure `{}`, of which this module of `{row}` is a copy",
            self.module(),
            self.config.structure_name
        );
        let before = thresholds.provenance.note.take().map(|note| format!("{note}; "));
        thresholds.provenance.note = Some(format!("{}{origin}", before.unwrap_or_default()));
        thresholds
    }
}

fn text(thresholds: &Thresholds) -> Result<String, Failure> {
    toml::to_string(thresholds).map_err(|error| Failure::runtime(error.to_string()))
}

impl Copied {
    pub(super) fn write(&self, directory: &Directory) -> Result<(), Failure> {
        let Copied { name, config, structure, thresholds } = self;
        directory.write(&format!("structures/{name}.toml"), structure)?;
        directory.write(&format!("thresholds/{name}.toml"), thresholds)?;
        directory.write(&format!("{name}.toml"), config)
    }
}

/// Reads a file again that was checked before.
pub(super) fn read_table(file: &Path) -> Result<Table, Failure> {
    let unusable = |reason: String| Failure::input(format!("{}: {reason}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| unusable(error.to_string()))?;
    text.parse().map_err(|error: toml::de::Error| unusable(error.message().to_owned()))
}

pub(super) fn unusable(errors: &ConfigErrors) -> Failure {
    Failure::inputs(errors.to_string().lines().map(str::to_owned).collect())
}
