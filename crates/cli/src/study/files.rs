//! Files that a campaign leaves in its directory.

use std::fmt::Display;
use std::fs;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use study::Rows;

use crate::failure::Failure;

/// Makes a directory unless it is there.
pub(super) fn make(directory: &Path) -> Result<(), Failure> {
    fs::create_dir_all(directory).map_err(|error| cannot_write(directory, &error))
}

/// Writes a file whole or not at all.
pub(super) fn write(file: &Path, content: impl AsRef<[u8]>) -> Result<(), Failure> {
    let beside = file.with_extension("new");
    let written = fs::write(&beside, content).and_then(|()| fs::rename(&beside, file));
    written.map_err(|error| cannot_write(file, &error))
}

/// Writes a table, a row of it for each item.
pub(super) fn write_table(
    file: &Path,
    mut rows: impl Iterator<Item = impl Serialize>,
) -> Result<(), Failure> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.try_for_each(|row| writer.serialize(row)).map_err(|error| cannot_write(file, &error))?;
    write(file, writer.into_inner().map_err(|error| cannot_write(file, &error))?)
}

/// Writes `cases.csv`: a row for each case, a column for each field, lists as JSON.
pub(super) fn write_cases<R: Serialize>(directory: &Path, rows: &Rows<R>) -> Result<(), Failure> {
    let mut columns = vec!["case".to_owned()];
    let mut lines = Vec::new();
    for (case, row) in rows {
        let mut cells = vec![case.to_string()];
        flatten("", &serde_json::to_value(row)?, &mut |name, text| {
            let known = columns.iter().position(|column| column == name);
            let place = known.unwrap_or_else(|| {
                columns.push(name.to_owned());
                columns.len() - 1
            });
            cells.resize(cells.len().max(place + 1), String::new());
            cells[place] = text;
        });
        lines.push(cells);
    }
    for cells in &mut lines {
        cells.resize(columns.len(), String::new());
    }
    write_table(&directory.join("cases.csv"), [columns].into_iter().chain(lines))
}

/// The fields of a value; those of an object within it have its name and a point before theirs.
fn flatten(name: &str, value: &Value, take: &mut impl FnMut(&str, String)) {
    match value {
        Value::Object(fields) => {
            for (field, value) in fields {
                let name = if name.is_empty() { field.clone() } else { format!("{name}.{field}") };
                flatten(&name, value, take);
            }
        }
        Value::Null => {}
        Value::String(text) => take(name, text.clone()),
        other => take(name, other.to_string()),
    }
}

/// What a file that cannot be written is answered with.
pub(super) fn cannot_write(path: &Path, error: &dyn Display) -> Failure {
    Failure::runtime(format!("cannot write `{}`: {error}", path.display()))
}
