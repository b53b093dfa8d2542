//! Round numbers along an axis.

/// A tick on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// The value.
    pub(super) value: f64,
    /// The label; may be empty.
    pub(super) label: String,
    /// Whether it is a minor tick, without label and grid line.
    pub(super) minor: bool,
}

/// Most ticks of an axis, whatever its range.
const MOST: i64 = 200;
/// Tolerance for rounding at the ends of a range, as a share of the tick distance.
const SLACK: f64 = 1e-9;

/// Multiples of 1, 2 or 5 times a power of ten, about `target` in number.
pub(super) fn linear(low: f64, high: f64, target: f64) -> Vec<Tick> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let rough = span / target.max(1.0);
    let power = rough.log10().floor();
    let unit = 10f64.powf(power);
    let step = unit * nearest_round(rough / unit);
    let decimals = (-step.log10() - SLACK).ceil().clamp(0.0, 12.0) as usize;
    let first = (low / step - SLACK).ceil() as i64;
    let last = (high / step + SLACK).floor() as i64;
    (first..=last.min(first.saturating_add(MOST)))
        .map(|i| i as f64 * step)
        .map(|value| Tick { value, label: fixed(value, decimals), minor: false })
        .collect()
}

/// The round factor nearest to a factor from 1 to 10, by ratio.
fn nearest_round(factor: f64) -> f64 {
    let bounds = [(1.0, 2.0_f64.sqrt()), (2.0, 10.0_f64.sqrt()), (5.0, 50.0_f64.sqrt())];
    bounds.into_iter().find(|(_, bound)| factor <= *bound).map_or(10.0, |(round, _)| round)
}

/// Powers of ten between two logarithms, and their multiples; the multiples have labels only if powers are few.
pub(super) fn log(low: f64, high: f64, target: f64) -> Vec<Tick> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) {
        return Vec::new();
    }
    let every = (span / target.max(1.0)).ceil().max(1.0) as i64;
    let labelled: &[i32] = match span {
        s if s < 1.0 => &[1, 2, 3, 5, 7],
        s if s < 2.0 => &[1, 2, 5],
        _ => &[1],
    };
    let powers = low.floor() as i64..=(high.ceil() as i64).min(low.floor() as i64 + MOST);
    let mut ticks = Vec::new();
    for power in powers {
        for multiple in 1..=9 {
            let value = f64::from(multiple) * 10f64.powi(power as i32);
            let place = value.log10();
            let inside = low - SLACK <= place && place <= high + SLACK;
            // Widely spaced powers leave no space for the ticks between them.
            if !inside || (every > 1 && multiple > 1) {
                continue;
            }
            let says = labelled.contains(&multiple) && power.rem_euclid(every) == 0;
            let label = if says { scientific(multiple, power) } else { String::new() };
            ticks.push(Tick { value, label, minor: !says });
        }
    }
    ticks
}

/// A number with this many decimals and a typographic minus sign; zero has no sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    let is_zero = digits.chars().all(|c| matches!(c, '0' | '.'));
    if value < 0.0 && !is_zero { format!("−{digits}") } else { digits }
}

/// multiple·10^power: with plain digits from 0.001 to 10 000, otherwise as a power of ten.
fn scientific(multiple: i32, power: i64) -> String {
    match power {
        0..=4 => format!("{multiple}{}", "0".repeat(power as usize)),
        -3..=-1 => format!("0.{}{multiple}", "0".repeat((-power - 1) as usize)),
        _ if multiple == 1 => format!("10{}", superscript(power)),
        _ => format!("{multiple}·10{}", superscript(power)),
    }
}

fn superscript(power: i64) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    };
    power.to_string().chars().map(raised).collect()
}

/// A number with three significant digits, without trailing zeros.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let power = value.abs().log10().floor();
    if !(-3.0..6.0).contains(&power) {
        let factor = fixed(value / 10f64.powf(power), 2);
        return format!("{}·10{}", without_end_zeros(&factor), superscript(power as i64));
    }
    without_end_zeros(&fixed(value, (2.0 - power).max(0.0) as usize)).to_owned()
}

fn without_end_zeros(digits: &str) -> &str {
    if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<&str> {
        ticks.iter().map(|tick| tick.label.as_str()).filter(|label| !label.is_empty()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(
            labels(&linear(10.4, 11.8, 7.0)),
            ["10.4", "10.6", "10.8", "11.0", "11.2", "11.4", "11.6", "11.8"]
        );
        assert_eq!(labels(&linear(-12.0, 31.0, 5.0)), ["−10", "0", "10", "20", "30"]);
        assert_eq!(labels(&linear(0.0, 1.0, 2.0)), ["0.0", "0.5", "1.0"]);
        assert_eq!(labels(&linear(0.0, 3.3, 3.5)), ["0", "1", "2", "3"]);
        assert!(linear(1.0, 1.0, 5.0).is_empty());
        assert!(linear(f64::NAN, 1.0, 5.0).is_empty());
    }

    #[test]
    fn log_ticks_are_powers_and_more_where_powers_are_rare() {
        assert_eq!(labels(&log(-2.0, 2.0, 5.0)), ["0.01", "0.1", "1", "10", "100"]);
        assert_eq!(labels(&log(0.0, 1.0, 5.0)), ["1", "2", "5", "10"]);
        assert_eq!(labels(&log(-8.0, -4.0, 2.0)), ["10⁻⁸", "10⁻⁶", "10⁻⁴"]);
        assert_eq!(log(-2.0, 0.0, 5.0).len(), 19);
    }

    #[test]
    fn short_numbers_have_three_digits() {
        let numbers = [12.345, -0.5, 250.0, 3e-7, 0.0, 1999.6];
        assert_eq!(numbers.map(short), ["12.3", "−0.5", "250", "3·10⁻⁷", "0", "2000"]);
    }
}
