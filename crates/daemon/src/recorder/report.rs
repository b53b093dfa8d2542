//! How far the recorder has come.

use std::collections::BTreeMap;
use std::path::PathBuf;

/// How far the recorder has come.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RecorderReport {
    /// The file being written.
    pub file: Option<PathBuf>,
    /// Its length \[bytes\].
    pub file_bytes: u64,
    /// The files begun so far.
    pub files: Vec<PathBuf>,
    /// How many messages of each topic were recorded.
    pub messages: BTreeMap<String, u64>,
    /// How many came in the latest second.
    pub rate: f64,
    /// How many of them were missed at first.
    pub fetched: u64,
    /// How many messages of each topic were lost.
    pub losses: BTreeMap<String, u64>,
    /// What is wrong with the disk at present.
    pub problem: Option<String>,
}

impl RecorderReport {
    /// How many messages were recorded.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.messages.values().sum()
    }

    /// How many were lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.losses.values().sum()
    }

    /// In one line. It begins with `degraded` while nothing can be written.
    #[must_use]
    pub fn line(&self) -> String {
        let mut words = Vec::new();
        if let Some(problem) = &self.problem {
            words.push(format!("degraded: {problem}"));
        }
        if let Some(file) = self.file.as_ref().and_then(|file| file.file_name()) {
            let mebibytes = self.file_bytes as f64 / f64::from(1 << 20);
            words.push(format!("{} of {mebibytes:.1} MiB", file.to_string_lossy()));
        }
        words.push(format!("{:.0} messages/s", self.rate));
        words.push(format!("{} recorded", self.total()));
        if self.fetched > 0 {
            words.push(format!("{} of them fetched", self.fetched));
        }
        words.push(format!("{} lost", self.lost()));
        words.join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_what_is_wrong_first() {
        let mut report = RecorderReport {
            file: Some("/a/tower-20261126T042500Z-0001.mcap".into()),
            file_bytes: 3 << 19,
            messages: BTreeMap::from([("t".to_owned(), 7)]),
            rate: 1999.6,
            ..RecorderReport::default()
        };
        let healthy =
            "tower-20261126T042500Z-0001.mcap of 1.5 MiB, 2000 messages/s, 7 recorded, 0 lost";
        assert_eq!(report.line(), healthy);
        report.problem = Some("no room".to_owned());
        report.losses = BTreeMap::from([("t".to_owned(), 2)]);
        assert!(
            report.line().starts_with("degraded: no room, ") && report.line().ends_with("2 lost")
        );
    }
}
