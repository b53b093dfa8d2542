//! How references were made: the command that makes them again.

use std::path::Path;

use super::arguments::{Arguments, Simulation};

/// The command, on one line.
pub(super) fn command(arguments: &Arguments) -> String {
    let mut words = vec!["trusswatch commission".to_owned()];
    words.extend(arguments.modules.iter().map(|file| quoted(file)));
    let Simulation { snippets, seconds, stroke_n, seed, .. } = arguments.simulation;
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
    words.extend(arguments.skip_bad.then(|| "--skip-bad".to_owned()));
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
