//! The memory that a process has allocated, from beginning to end.

use crate::footprint::allocated_kib;

/// This share of the run is left out at the beginning: tables and queues are still filling.
const WARM_UP: f64 = 0.1;

/// Allocated memory of a process as it was sampled, oldest first \[KiB\].
#[derive(Debug, Default)]
pub struct Memory {
    allocated_kib: Vec<u64>,
}

impl Memory {
    /// Notes how much the process holds now; nothing if it has ended.
    pub fn sample(&mut self, pid: u32) {
        self.allocated_kib.extend(allocated_kib(pid));
    }

    /// The latest sample \[MiB\].
    #[must_use]
    pub fn latest_mib(&self) -> f64 {
        self.allocated_kib.last().map_or(0.0, |kib| mib(*kib))
    }

    /// The largest sample of each quarter after the warm-up \[MiB\].
    ///
    /// # Panics
    /// If there are too few samples.
    #[must_use]
    pub fn quarters_mib(&self) -> [f64; 4] {
        let warm_up = (WARM_UP * self.allocated_kib.len() as f64) as usize;
        let warm = &self.allocated_kib[warm_up..];
        let length = warm.len() / 4;
        assert!(length > 0, "{} samples are too few", self.allocated_kib.len());
        std::array::from_fn(|quarter| {
            let end = if quarter == 3 { warm.len() } else { (quarter + 1) * length };
            mib(warm[quarter * length..end].iter().copied().max().unwrap_or_default())
        })
    }
}

fn mib(kib: u64) -> f64 {
    kib as f64 / 1024.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_each_quarter_excludes_the_warm_up() {
        let mut kib = vec![99 * 1024; 4];
        kib.extend((0..36).map(|n| (n / 9 + 1) * 1024));
        let memory = Memory { allocated_kib: kib };
        assert_eq!(memory.quarters_mib(), [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn this_very_process_holds_something_and_one_that_is_not_there_holds_nothing() {
        let mut memory = Memory::default();
        memory.sample(std::process::id());
        assert!(memory.latest_mib() > 0.1);
        memory.sample(u32::MAX);
        assert_eq!(memory.allocated_kib.len(), 1);
    }
}
