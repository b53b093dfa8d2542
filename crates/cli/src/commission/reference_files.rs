//! From snippets to references, and into their files, with the command that makes them again.

use std::fs;
use std::path::{Path, PathBuf};

use diagnosis::state::Reference;

use super::arguments::{Arguments, SnippetFlags};
use crate::failure::Failure;
use shell::clock::unix_ns;
use vocabulary::words::utc;

/// Writes each into a file of its own, and returns where they are.
pub(super) fn write(
    arguments: &Arguments,
    references: &[Reference],
) -> Result<Vec<PathBuf>, Failure> {
    let (directory, provenance) = (&arguments.out, command(arguments));
    let day: String = utc(unix_ns()).chars().take_while(|c| *c != 'T').collect();
    let write = |reference: &Reference| {
        let file = directory.join(format!("{}.toml", reference.module));
        let text =
            toml::to_string(reference).map_err(|error| Failure::runtime(error.to_string()))?;
        let head = format!(
            "# What module `{}` measures while it is healthy; written on {day} by\n# {provenance}\n",
            reference.module
        );
        fs::write(&file, head + &text).map_err(|error| Failure::unwritable(&file, error))?;
        Ok(file)
    };
    references.iter().map(write).collect()
}

/// The command, on one line.
fn command(arguments: &Arguments) -> String {
    let mut words = vec!["trusswatch commission".to_owned()];
    words.extend(arguments.modules.iter().map(|file| quoted(file)));
    let SnippetFlags { snippets, seconds, stroke_n, seed, .. } = arguments.simulation;
    if let Some(plant) = &arguments.simulation.plant {
        words.push(format!("--plant {}", quoted(plant)));
        words.push(format!(
            "--snippets {snippets} --seconds {seconds} --stroke-n {stroke_n} --seed {seed}"
        ));
    }
    let drawn = arguments.simulation.mismatch.zip(arguments.simulation.plant_seed);
    words.extend(drawn.map(|(share, seed)| format!("--mismatch {share} --plant-seed {seed}")));
    let recordings = arguments.recordings.iter();
    words.extend(recordings.map(|directory| format!("--recording {}", quoted(directory))));
    words.extend(arguments.table.words());
    words.extend(arguments.add.iter().map(|file| format!("--add {}", quoted(file))));
    words.push(format!("--false-alarms-per-hour {}", arguments.false_alarms_per_hour));
    words.push(format!("--out {}", quoted(&arguments.out)));
    words.join(" ")
}

/// A path as a shell takes it, on one line whatever it is.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "-_./=,:+@".contains(c);
    if text.chars().all(is_plain) { text } else { format!("{text:?}") }
}
