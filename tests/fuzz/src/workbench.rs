//! A directory to try files in, one for each thread.

use std::fs;
use std::path::{Path, PathBuf};

use daemon::config::load_diagnoser;
use diagnosis::ModuleSetup;
use tempfile::TempDir;

/// The shipped small mast: every file that another one names.
const COMPANIONS: [(&str, &str); 3] = [
    ("small.toml", include_str!("../../../configs/small.toml")),
    ("lower.structure.toml", include_str!("../../../configs/small/lower.structure.toml")),
    ("lower.thresholds.toml", include_str!("../../../configs/small/lower.thresholds.toml")),
];

/// The shipped diagnoser whose thresholds are being tried.
const DIAGNOSER: &str = include_str!("../../../configs/small/lower.toml");

thread_local! {
    static DIRECTORY: TempDir = furnished();
}

fn furnished() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, text) in COMPANIONS {
        fs::write(directory.path().join(name), text).unwrap();
    }
    let diagnoser = DIAGNOSER.replace("lower.thresholds.toml", "tried.toml");
    fs::write(directory.path().join("lower.toml"), diagnoser).unwrap();
    directory
}

/// Calls `job` with the path of a file of these bytes; the files that it may name lie beside it. The
/// file `lower.toml` there is a diagnoser's, with this one as its thresholds.
pub(crate) fn with_file(bytes: &[u8], job: impl FnOnce(&Path)) {
    let file: PathBuf = DIRECTORY.with(|directory| directory.path().join("tried.toml"));
    fs::write(&file, bytes).unwrap();
    job(&file);
}

/// The lower module of the shipped small mast.
pub(crate) fn shipped_module() -> ModuleSetup {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../configs/small/lower.toml");
    load_diagnoser(&file).unwrap().module_setup()
}

/// Calls `job` with the path of an empty directory, and removes it.
pub(crate) fn with_directory(job: impl FnOnce(&Path)) {
    let directory = tempfile::tempdir().unwrap();
    job(directory.path());
}
