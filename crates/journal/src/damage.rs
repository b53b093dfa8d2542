//! Parts of a file that are not valid records.

use std::fmt;
use std::path::PathBuf;

/// The kind of damage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DamageKind {
    /// The file's last line is incomplete: a crash interrupted the write, or the end of the file is lost.
    TornTail,
    /// One or more whole lines that do not match their checksums.
    Corrupt,
}

/// A part of a file that is not a valid record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// The file.
    pub file: PathBuf,
    /// Where the part begins, in bytes from the beginning of the file.
    pub offset: u64,
    /// The length of the part in bytes.
    pub bytes: u64,
    /// The kind of damage.
    pub kind: DamageKind,
}

impl Damage {
    /// Appends a damage that follows all others in the file. Adjacent corrupt lines are merged into one damage, because
    /// garbage may contain many newlines.
    pub(crate) fn add_to(self, all: &mut Vec<Damage>) {
        match all.last_mut() {
            Some(last) if last.is_continued_by(&self) => last.bytes += self.bytes,
            _ => all.push(self),
        }
    }

    fn is_continued_by(&self, next: &Damage) -> bool {
        self.kind == DamageKind::Corrupt
            && next.kind == DamageKind::Corrupt
            && self.file == next.file
            && self.offset + self.bytes == next.offset
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.kind {
            DamageKind::TornTail => "belong to a record without an end; they were cut off",
            DamageKind::Corrupt => "do not match their checksums; they were passed over",
        };
        let Self { file, offset, bytes, .. } = self;
        write!(f, "`{}`: {bytes} bytes from byte {offset} on {what}", file.display())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn damage(offset: u64, bytes: u64, kind: DamageKind) -> Damage {
        Damage { file: PathBuf::from("d/journal"), offset, bytes, kind }
    }

    #[test]
    fn corrupt_lines_that_touch_are_one_damage() {
        let mut all = Vec::new();
        damage(10, 5, DamageKind::Corrupt).add_to(&mut all);
        damage(15, 7, DamageKind::Corrupt).add_to(&mut all);
        damage(30, 2, DamageKind::Corrupt).add_to(&mut all);
        damage(32, 9, DamageKind::TornTail).add_to(&mut all);
        let expected = [
            damage(10, 12, DamageKind::Corrupt),
            damage(30, 2, DamageKind::Corrupt),
            damage(32, 9, DamageKind::TornTail),
        ];
        assert_eq!(all, expected);
    }

    #[test]
    fn a_damage_reports_where_and_what_became_of_it() {
        assert_eq!(
            damage(10, 5, DamageKind::TornTail).to_string(),
            "`d/journal`: 5 bytes from byte 10 on belong to a record without an end; they were cut off"
        );
    }
}
