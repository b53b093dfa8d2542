//! What happens often is logged seldom: the 1st, 2nd, 4th, 8th … time.

/// Counts occurrences and picks those worth a line in the log.
#[derive(Debug, Default)]
pub struct Occurrences(u64);

impl Occurrences {
    /// Counts one more; how many there were, if that is worth a line.
    pub fn note(&mut self) -> Option<u64> {
        self.0 += 1;
        worth_a_line(self.0).then_some(self.0)
    }
}

/// Is the n-th occurrence worth a line?
#[must_use]
pub fn worth_a_line(n: u64) -> bool {
    n.is_power_of_two()
}
