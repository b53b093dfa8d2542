//! That several processes run as one module is reported once for as long as it lasts.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::continuity::Whose;

/// It is reported again only if it was over for this long.
const OVER: Duration = Duration::from_secs(60);
/// Modules of which that is remembered.
const REMEMBERED: usize = 1024;

/// When each module was last said to be several processes.
#[derive(Debug, Default)]
pub(super) struct Several(BTreeMap<Whose, Instant>);

impl Several {
    /// A status says so: is it the first to?
    pub(super) fn is_first(&mut self, whose: Whose, now: Instant) -> bool {
        if self.0.len() >= REMEMBERED {
            self.0.clear();
        }
        self.0.insert(whose, now).is_none_or(|before| now.duration_since(before) >= OVER)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_processes_are_reported_once_for_as_long_as_there_are_several() {
        let (mut several, start) = (Several::default(), Instant::now());
        let mut at = |module: &str, second| {
            let (structure, module) = ("tower".parse().unwrap(), module.parse().unwrap());
            several.is_first(Whose { structure, module }, start + Duration::from_secs(second))
        };
        let reported: Vec<u64> = (0..100).filter(|second| at("m1", *second)).collect();
        assert_eq!(reported, [0]);
        assert!(at("m2", 100), "another module");
        assert!(!at("m1", 158));
        assert!(at("m1", 218), "it was over meanwhile");
    }
}
