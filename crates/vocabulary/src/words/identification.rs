//! What kind of fault it is, and how large.

use crate::printable;
use crate::{Candidate, FaultSize, Identification, IdentifiedKind};

/// Contenders that are named where there is little room.
const NAMED: usize = 3;

/// On one line: `bias of +45.1 µm (44.8 to 45.4)`, or `bias or drift: not yet decided`.
pub fn identified(identification: &Identification) -> String {
    if let Some(kind) = identification.kind() {
        return candidate(kind);
    }
    let kinds: Vec<&str> =
        identification.candidates.iter().take(NAMED).map(|one| one.kind.words()).collect();
    match &kinds[..] {
        [] => "could not be identified".to_owned(),
        kinds => format!("{}: not yet decided", kinds.join(" or ")),
    }
}

/// A kind with its size.
pub fn candidate(candidate: &Candidate) -> String {
    of_size(candidate, fault_size)
}

/// The same without the interval.
pub fn brief(candidate: &Candidate) -> String {
    of_size(candidate, middle)
}

fn of_size(candidate: &Candidate, in_words: fn(&FaultSize, IdentifiedKind) -> String) -> String {
    let kind = candidate.kind.words();
    let Some(size) = &candidate.size else { return kind.to_owned() };
    let joint = if kind.contains(" of ") { ", " } else { " of " };
    format!("{kind}{joint}{}", in_words(size, candidate.kind))
}

/// The size of a kind of fault with its interval, to as many digits as the interval has a meaning for.
pub fn fault_size(size: &FaultSize, kind: IdentifiedKind) -> String {
    let (scale, _) = in_small_units(unit(size, kind));
    let [low, high] = [size.low, size.high].map(|number| number * scale);
    let digits = digits(size, scale);
    format!("{} ({low:.digits$} to {high:.digits$})", middle(size, kind))
}

/// The middle of a size alone.
fn middle(size: &FaultSize, kind: IdentifiedKind) -> String {
    let (scale, small) = in_small_units(unit(size, kind));
    let (value, digits) = (size.value * scale, digits(size, scale));
    // Of these the sign tells the direction; the others have none.
    let signed = matches!(kind.size_unit(), Some("m" | "m/s"));
    let value = if signed { format!("{value:+.digits$}") } else { format!("{value:.digits$}") };
    if small.is_empty() { value } else { format!("{value} {small}") }
}

/// A kind without a size is given none; a peer that gives it one has given a bare number.
fn unit(size: &FaultSize, kind: IdentifiedKind) -> &'static str {
    match kind.size_unit() {
        Some("m/s") if size.own_unit => "per second",
        Some(unit) if !size.own_unit => unit,
        _ => "1",
    }
}

fn digits(size: &FaultSize, scale: f64) -> usize {
    decimals(scale * (size.high - size.low) / 2.0)
}

/// How many of these units are one of that, and what they are called. Faults are small.
pub fn in_small_units(unit: &str) -> (f64, String) {
    let small = match unit {
        "m" => "µm",
        "m/s" => "µm/s",
        "m per step" => "µm per step",
        "m²" => "mm²",
        "m³" => "cm³",
        "m³/s" => "cm³/s",
        "1" => return (1.0, String::new()),
        other => return (1.0, printable(other)),
    };
    (1e6, small.to_owned())
}

/// A probability; no kind is certain.
pub fn percent(probability: f64) -> String {
    match 100.0 * probability {
        percent if percent > 99.9 => "more than 99.9 %".to_owned(),
        percent => format!("{percent:.1} %"),
    }
}

/// Digits after the point that show a difference of this size, six at most.
pub fn decimals(difference: f64) -> usize {
    // A power of ten may come out a little less than it is.
    let needed = -difference.abs().log10() - 1e-9;
    [0_u8, 1, 2, 3, 4, 5]
        .into_iter()
        .find(|digits| f64::from(*digits) >= needed)
        .map_or(6, usize::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::FaultKind;
    use crate::{RunId, Step};

    fn of_name(kind: &str) -> IdentifiedKind {
        FaultKind::named(kind).map_or(IdentifiedKind::NoneOfThese, IdentifiedKind::Known)
    }

    /// Without sizes.
    fn identification(decided: bool, kinds: &[&str]) -> Identification {
        let candidate = |kind: &&str| {
            let probability = if decided { 0.987 } else { 0.5 };
            Candidate { kind: of_name(kind), probability, size: None }
        };
        Identification {
            structure: "tower".parse().unwrap(),
            module: "m1".parse().unwrap(),
            component: "m1/sensor/g2".parse().unwrap(),
            run: RunId(1),
            sequence: 1,
            as_of_step: Step(142),
            decided,
            candidates: kinds.iter().map(candidate).collect(),
            signature: None,
            since_unix_ns: None,
            time_unix_ns: 1_100_000_000,
        }
    }

    fn sized(kind: &str, [low, value, high]: [f64; 3]) -> Candidate {
        let size = Some(FaultSize { value, low, high, own_unit: false });
        Candidate { kind: of_name(kind), probability: 0.99, size }
    }

    #[test]
    fn sizes_have_small_units_and_the_digits_that_their_interval_allows() {
        for (kind, size, expected) in [
            ("bias", [44.8e-6, 45.1e-6, 45.4e-6], "bias of +45.1 µm (44.8 to 45.4)"),
            ("bias", [-72e-6, -60e-6, -48e-6], "bias of -60 µm (-72 to -48)"),
            ("drift", [8.95e-5, 9e-5, 9.05e-5], "drift of +90.0 µm/s (89.5 to 90.5)"),
            ("gain", [0.941, 0.95, 0.959], "gain of 0.950 (0.941 to 0.959)"),
            ("random_walk", [1.9e-6, 2e-6, 2.1e-6], "random walk of 2.0 µm per step (1.9 to 2.1)"),
            (
                "external_leakage_a",
                [9e-8, 1e-7, 1.1e-7],
                "external leakage of chamber A, 0.10 mm² (0.09 to 0.11)",
            ),
        ] {
            assert_eq!(candidate(&sized(kind, size)), expected);
        }
    }

    #[test]
    fn sizes_in_a_channel_s_own_unit_have_no_other() {
        for (kind, size, expected) in [
            ("bias", [14.6, 15.0, 15.4], "bias of +15.0 (14.6 to 15.4)"),
            ("drift", [-0.12, -0.1, -0.08], "drift of -0.10 per second (-0.12 to -0.08)"),
        ] {
            let one = sized(kind, size);
            let size = one.size.map(|size| FaultSize { own_unit: true, ..size });
            assert_eq!(candidate(&Candidate { size, ..one }), expected);
        }
    }

    #[test]
    fn what_is_not_decided_names_the_contenders() {
        let undecided = |kinds: &[&str]| identified(&identification(false, kinds));
        assert_eq!(undecided(&["bias", "drift"]), "bias or drift: not yet decided");
        assert_eq!(undecided(&["bias"]), "bias: not yet decided");
        let many = undecided(&["bias", "drift", "gain", "stuck"]);
        assert_eq!(many, "bias or drift or gain: not yet decided");
        assert_eq!(undecided(&[]), "could not be identified");
        assert_eq!(identified(&identification(true, &["stuck", "bias"])), "stuck reading");
        let none = identified(&identification(true, &["none_of_these"]));
        assert_eq!(none, "none of the known kinds");
        let perhaps = undecided(&["bias", "none_of_these"]);
        assert_eq!(perhaps, "bias or none of the known kinds: not yet decided");
    }

    #[test]
    fn no_kind_is_certain() {
        assert_eq!([0.5, 0.9873, 1.0].map(percent), ["50.0 %", "98.7 %", "more than 99.9 %"]);
    }

    #[test]
    fn a_difference_of_zero_has_digits_too() {
        assert_eq!([0.0, 1e-9, 0.3, 1.0, 30.0, f64::INFINITY].map(decimals), [6, 6, 1, 0, 0, 0]);
    }
}
