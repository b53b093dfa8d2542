//! Formats ages.

/// An age in the largest unit that gives at least two: `12 s`, `3 min`, `5 h`, `2 d`.
pub(super) fn age(then_unix_ns: u64, now_unix_ns: u64) -> String {
    span(now_unix_ns.saturating_sub(then_unix_ns))
}

/// A duration \[ns\] in the same format.
pub(super) fn span(ns: u64) -> String {
    let seconds = ns / 1_000_000_000;
    match seconds {
        0..120 => format!("{seconds} s"),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_suits_the_age() {
        let of = |seconds: u64| span(seconds * 1_000_000_000);
        let spans = [of(0), of(119), of(120), of(7200), of(200_000)];
        assert_eq!(spans, ["0 s", "119 s", "2 min", "2 h", "2 d"]);
        assert_eq!(age(5, 3), "0 s");
    }
}
