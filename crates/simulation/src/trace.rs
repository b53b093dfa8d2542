//! What happened in a world, in words. Two runs of a seed have the same lines, byte for byte.

use std::fmt::Write as _;

/// The lines, or only what tells two traces apart.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorldTrace {
    lines: Option<Vec<String>>,
    line: String,
    /// FNV-1a of all lines (Fowler, Noll, Vo 1991).
    hash: u64,
}

impl WorldTrace {
    /// Without the lines, unless they are kept.
    #[must_use]
    pub fn new(keep: bool) -> Self {
        let lines = keep.then(Vec::new);
        Self { lines, line: String::new(), hash: 0xcbf2_9ce4_8422_2325 }
    }

    /// Notes what happened at a time \[ns\].
    pub(crate) fn note(&mut self, now_ns: u64, words: std::fmt::Arguments<'_>) {
        self.line.clear();
        // Writing to a string does not fail.
        let _ = write!(self.line, "{:10.4} {words}", now_ns as f64 / 1e9);
        for byte in self.line.bytes().chain([b'\n']) {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        if let Some(lines) = &mut self.lines {
            lines.push(self.line.clone());
        }
    }

    /// The lines, if they were kept.
    #[must_use]
    pub fn lines(&self) -> &[String] {
        self.lines.as_deref().unwrap_or_default()
    }

    /// What tells it from another.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }
}
