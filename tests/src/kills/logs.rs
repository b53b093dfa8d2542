//! What the diagnosers logged about their journals.

/// Any other log line about a journal, and the daemon's own errors; links break all the time.
const COMPLAINTS: [&str; 4] = ["journal", "ERROR daemon", "error:", "panicked"];

/// Counts and complaints from a diagnoser's log over many lives.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Lives {
    /// How often the process was ready.
    pub ready: usize,
    /// Records that were being written in a crash, and were cut off.
    pub torn_tails: usize,
    /// Lines that should not be there.
    pub complaints: Vec<String>,
}

impl Lives {
    /// Reads a log.
    #[must_use]
    pub fn found_in(log: &str) -> Self {
        let mut lives = Self::default();
        for line in log.lines() {
            lives.read(line);
        }
        lives
    }

    fn read(&mut self, line: &str) {
        if line.contains("ready structure=") {
            self.ready += 1;
        } else if line.contains("journal damaged") && line.contains("without an end") {
            self.torn_tails += 1;
        } else if COMPLAINTS.iter().any(|word| line.contains(word)) {
            self.complaints.push(line.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torn_tails_are_counted_and_everything_else_about_a_journal_is_a_complaint() {
        let lives = Lives::found_in(
            "INFO ready structure=tower module=module1\n\
             WARN journal damaged, damaged records skipped: `j`: 3 bytes from byte 1 on belong to a record \
             without an end; they were cut off\n\
             WARN journal damaged, damaged records skipped: `j`: 3 bytes from byte 1 on do not match their \
             checksums; they were passed over\n\
             INFO verdict component=module1/sensor/g1\n\
             thread 'main' panicked at x\n",
        );
        assert_eq!((lives.ready, lives.torn_tails, lives.complaints.len()), (1, 1, 2));
    }
}
