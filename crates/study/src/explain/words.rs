//! Numbers and times in a readable format.

use vocabulary::Step;

/// Formats steps as times.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepClock {
    /// Length of a step \[s\].
    pub(super) step_s: f64,
}

impl StepClock {
    pub(super) fn seconds(self, step: Step) -> f64 {
        step.0 as f64 * self.step_s
    }

    /// `10.836 s`
    pub(super) fn time(self, step: Step) -> String {
        format!("{:.3} s", self.seconds(step))
    }

    /// `14 ms`, `2.500 s`
    pub(super) fn span(self, steps: u64) -> String {
        let milliseconds = (steps as f64 * self.step_s * 1e6).round() / 1e3;
        if milliseconds < 1000.0 {
            format!("{milliseconds} ms")
        } else {
            format!("{:.3} s", milliseconds / 1e3)
        }
    }
}

/// A ratio: `less than 0.1 times`, `3.1 times`, `512 times`.
pub(super) fn times(ratio: f64) -> String {
    match ratio {
        // Rounding would suggest that it reached the threshold.
        r if (0.95..1.0).contains(&r) => "0.9 times".to_owned(),
        r if r < 0.05 => "less than 0.1 times".to_owned(),
        r if r < 100.0 => format!("{r:.1} times"),
        r if r < 1e6 => format!("{r:.0} times"),
        r => format!("{r:.1e} times"),
    }
}

/// `once`, `twice`, `7 times`
pub(super) fn often(count: usize) -> String {
    match count {
        1 => "once".to_owned(),
        2 => "twice".to_owned(),
        count => format!("{count} times"),
    }
}

/// `1 channel`, `2 channels`
pub(super) fn counted(count: usize, noun: &str) -> String {
    if count == 1 { format!("1 {noun}") } else { format!("{count} {noun}s") }
}

/// The first `shown` of a list, and how many more there are.
pub(super) fn list(items: &[String], shown: usize) -> String {
    // Listing one more is as short as stating that there is one more.
    if items.len() <= shown + 1 {
        return items.join(", ");
    }
    format!("{} and {} more", items[..shown].join(", "), items.len() - shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_below_one_never_read_as_one() {
        let read: Vec<_> = [0.0, 0.05, 0.94, 0.999, 1.0, 3.17, 512.4].map(times).into();
        let expected = ["less than 0.1", "0.1", "0.9", "0.9", "1.0", "3.2", "512"];
        assert_eq!(read, expected.map(|text| format!("{text} times")));
    }

    #[test]
    fn spans_are_short_and_times_are_not() {
        let clock = StepClock { step_s: 5e-4 };
        assert_eq!(clock.time(Step(21_001)), "10.501 s");
        assert_eq!([3, 4, 5000].map(|n| clock.span(n)), ["1.5 ms", "2 ms", "2.500 s"]);
    }

    #[test]
    fn long_lists_are_cut() {
        let items: Vec<String> = "abcd".chars().map(String::from).collect();
        assert_eq!(list(&items, 3), "a, b, c, d");
        assert_eq!(list(&items, 2), "a, b and 2 more");
    }
}
