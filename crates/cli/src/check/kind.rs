//! Determines the kind of a file from its content.

use std::path::Path;

use toml::Table;

/// A kind of configuration file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FileKind {
    Structure,
    Plant,
    Diagnoser,
    Thresholds,
    Reference,
    Learned,
    Schedule,
    /// Recipients of messages to people.
    Notify,
    /// The parameters of a plant alone.
    Parameters,
    Zenoh,
}

impl FileKind {
    /// Considers the file extension, and the keys that only one kind has.
    ///
    /// # Errors
    /// The problem and its line: the file is not TOML, or its keys do not belong to any kind.
    pub(crate) fn of(file: &Path, text: &str) -> Result<FileKind, (Option<usize>, String)> {
        let ending = file.extension().and_then(|ending| ending.to_str());
        if matches!(ending, Some("json5" | "json")) {
            return Ok(FileKind::Zenoh);
        }
        let table: Table = text.parse().map_err(|error: toml::de::Error| {
            (error.span().map(|span| line_at(text, span.start)), error.message().to_owned())
        })?;
        FileKind::of_table(&table).ok_or_else(|| {
            let problem = "unknown kind of file: a structure has `modules`, a plant `structure` but \
                           no `module`, a diagnoser `module` and `structure`, thresholds \
                           `thresholds` and `provenance`, a reference `cylinder_threshold` and `cylinders`, a \
                           learned module `change_threshold`, a schedule `faults`, parameters of a \
                           plant `plant`, recipients of messages `webhook`, `alertmanager`, `ntfy` or `mail`";
            (None, problem.to_owned())
        })
    }

    fn of_table(table: &Table) -> Option<FileKind> {
        let has = |key: &str| table.contains_key(key);
        let is_table = |key: &str| table.get(key).is_some_and(toml::Value::is_table);
        if has("modules") {
            Some(FileKind::Structure)
        } else if has("provenance") || is_table("thresholds") {
            Some(FileKind::Thresholds)
        } else if has("cylinder_threshold") && has("cylinders") {
            Some(FileKind::Reference)
        } else if has("change_threshold") {
            Some(FileKind::Learned)
        } else if ["module", "thresholds", "gage_noise_strain", "learned"].into_iter().any(has) {
            // By any of these, so that a file that lacks one or misspells it is still judged as what it was meant to be.
            Some(FileKind::Diagnoser)
        } else if has("structure") {
            Some(FileKind::Plant)
        } else if has("faults") {
            Some(FileKind::Schedule)
        } else if is_table("plant") {
            Some(FileKind::Parameters)
        } else if ["webhook", "alertmanager", "ntfy", "mail", "escalate_after"].into_iter().any(has)
        {
            Some(FileKind::Notify)
        } else {
            None
        }
    }
}

/// The line of an offset in a text, counted from 1.
pub(super) fn line_at(text: &str, offset: usize) -> usize {
    text.bytes().take(offset).filter(|byte| *byte == b'\n').count() + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_what_its_keys_say() {
        let kind = |text| FileKind::of(Path::new("x.toml"), text);
        assert_eq!(kind("name = 't'\n[[modules]]"), Ok(FileKind::Structure));
        assert_eq!(kind("structure = 's'\nseed = 1"), Ok(FileKind::Plant));
        assert_eq!(
            kind("module = 'm'\nstructure = 's'\nthresholds = 't'"),
            Ok(FileKind::Diagnoser)
        );
        let misspelt = "modul = 'm'\nstructure = 's'\nthresholds = 't'";
        assert_eq!(kind(misspelt), Ok(FileKind::Diagnoser));
        assert_eq!(kind("module = 'm'\n[thresholds]"), Ok(FileKind::Thresholds));
        let reference = "module = 'm'\ncylinder_threshold = 6\n[[cylinders]]";
        assert_eq!(kind(reference), Ok(FileKind::Reference));
        assert_eq!(kind("v = 1\nchange_threshold = 8"), Ok(FileKind::Learned));
        assert_eq!(kind("[[faults]]"), Ok(FileKind::Schedule));
        assert_eq!(kind("[plant.loads]"), Ok(FileKind::Parameters));
        assert_eq!(FileKind::of(Path::new("x.json5"), "{"), Ok(FileKind::Zenoh));
        assert_eq!(kind("colour = 1").unwrap_err().0, None);
        assert_eq!(kind("a = 1\nb = [").unwrap_err().0, Some(2));
    }
}
