//! From the text of a cell to its number.

use std::borrow::Cow;

/// What separates the decimals of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum DecimalMark {
    Point,
    Comma,
}

/// Why a cell has no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Wrong {
    Text,
    NotFinite,
    /// A comma that may separate decimals or thousands.
    Ambiguous,
}

/// Words for a missing value.
const MISSING: [&str; 5] = ["nan", "na", "n/a", "#n/a", "null"];
/// Between the thousands of a number.
const SPACES: [char; 5] = [' ', '\'', '’', '\u{a0}', '\u{202f}'];

/// The text of a field: UTF-8, or else Latin-1.
pub(crate) fn decoded(field: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(field) {
        Ok(text) => Cow::Borrowed(text.trim()),
        Err(_) => {
            let text: String = field.iter().map(|&byte| char::from(byte)).collect();
            Cow::Owned(text.trim().to_owned())
        }
    }
}

/// Reads a number; NaN is a missing one. `mark` is set by the first number that tells.
pub(crate) fn number(field: &[u8], mark: &mut Option<DecimalMark>) -> Result<f64, Wrong> {
    let field = field.trim_ascii();
    if *mark == Some(DecimalMark::Point)
        && let Some(number) = plain(field)
    {
        return Ok(number);
    }
    if *mark != Some(DecimalMark::Comma)
        && let Ok(text) = std::str::from_utf8(field)
        && let Ok(number) = text.parse::<f64>()
    {
        if mark.is_none() && field.contains(&b'.') {
            *mark = Some(DecimalMark::Point);
        }
        return if number.is_infinite() { Err(Wrong::NotFinite) } else { Ok(number) };
    }
    slow_number(&decoded(field), mark)
}

/// Most digits of which every number is exact, and powers of ten that are.
const EXACT_DIGITS: usize = 15;
const POWERS: [f64; EXACT_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// A number of a few digits and no exponent, which most are: the same as the library's, since digits and power are exact and
/// a division is rounded once.
fn plain(field: &[u8]) -> Option<f64> {
    let (is_negative, digits) = match field {
        [b'-', rest @ ..] => (true, rest),
        _ => (false, field),
    };
    let (mut mantissa, mut count, mut decimals) = (0_u64, 0, None);
    for byte in digits {
        match byte {
            b'0'..=b'9' => {
                mantissa = 10 * mantissa + u64::from(byte - b'0');
                count += 1;
            }
            b'.' if decimals.is_none() => decimals = Some(count),
            _ => return None,
        }
        if count > EXACT_DIGITS {
            return None;
        }
    }
    if count == 0 {
        return None;
    }
    let number = mantissa as f64 / POWERS[decimals.map_or(0, |whole| count - whole)];
    Some(if is_negative { -number } else { number })
}

fn slow_number(text: &str, mark: &mut Option<DecimalMark>) -> Result<f64, Wrong> {
    // Word processors and some spreadsheets write the mathematical minus sign.
    let text = &text.replace('\u{2212}', "-");
    if is_missing(text) {
        return Ok(f64::NAN);
    }
    let point = marked(text, DecimalMark::Point).filter(|_| *mark != Some(DecimalMark::Comma));
    let comma = marked(text, DecimalMark::Comma).filter(|_| *mark != Some(DecimalMark::Point));
    let (number, found) = match (point, comma) {
        (Some(point), Some(comma)) if point != comma => return Err(Wrong::Ambiguous),
        (Some(point), Some(_)) => (point, None),
        (Some(point), None) => (point, Some(DecimalMark::Point)),
        (None, Some(comma)) => (comma, Some(DecimalMark::Comma)),
        (None, None) => {
            let infinite = text.parse::<f64>().is_ok_and(f64::is_infinite);
            return Err(if infinite { Wrong::NotFinite } else { Wrong::Text });
        }
    };
    *mark = mark.or(found);
    if number.is_finite() { Ok(number) } else { Err(Wrong::NotFinite) }
}

/// An empty cell, or a word for none.
pub(crate) fn is_missing(text: &str) -> bool {
    text.is_empty() || MISSING.iter().any(|word| text.eq_ignore_ascii_case(word))
}

/// The number that a text is under a decimal mark. Thousands may be separated.
pub(crate) fn marked(text: &str, mark: DecimalMark) -> Option<f64> {
    let (decimal, group) = match mark {
        DecimalMark::Point => ('.', ','),
        DecimalMark::Comma => (',', '.'),
    };
    let (mantissa, exponent) = text.split_at(text.find(['e', 'E']).unwrap_or(text.len()));
    let (whole, decimals) = mantissa.split_once(decimal).unwrap_or((mantissa, ""));
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let digits = whole.trim_start_matches(['+', '-']);
    let mut groups = digits.split(|c| c == group || SPACES.contains(&c));
    let first = groups.next()?;
    let mut plain = whole[..whole.len() - digits.len()].to_owned() + first;
    for thousands in groups {
        let may_lead = (1..=3).contains(&first.len()) && !first.starts_with('0');
        if thousands.len() != 3 || !may_lead || !is_digits(thousands) {
            return None;
        }
        plain += thousands;
    }
    if !is_digits(first) || !is_digits(decimals) {
        return None;
    }
    (plain + "." + decimals + exponent).parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plain_number_has_the_bits_of_the_library_s() {
        let mut state = 7_u64;
        let mut draw = |below: u64| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % below
        };
        let mut read = 0;
        for _ in 0..200_000 {
            let (whole, decimals) = (draw(10), draw(9));
            let digits = |count: u64, draw: &mut dyn FnMut(u64) -> u64| -> String {
                (0..count).map(|_| char::from(b'0' + draw(10) as u8)).collect()
            };
            let sign = if draw(2) == 0 { "-" } else { "" };
            let text =
                format!("{sign}{}.{}", digits(whole, &mut draw), digits(decimals, &mut draw));
            let Some(number) = plain(text.as_bytes()) else { continue };
            read += 1;
            assert_eq!(number.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
        }
        assert!(read > 150_000, "{read}");
        for text in ["", "-", ".", "-.", "1e3", "1.2.3", "+1", "1 2", "1234567890123456", "nan"] {
            assert_eq!(plain(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn a_number_is_read_under_its_decimal_mark() {
        use DecimalMark::{Comma, Point};
        for (text, mark, expected) in [
            ("1.5", None, Ok((1.5, Some(Point)))),
            ("15", None, Ok((15.0, None))),
            ("0,854", None, Ok((0.854, Some(Comma)))),
            ("-1,5e-3", None, Ok((-1.5e-3, Some(Comma)))),
            ("1,680", None, Err(Wrong::Ambiguous)),
            ("1,680", Some(Comma), Ok((1.68, Some(Comma)))),
            ("1,680", Some(Point), Ok((1680.0, Some(Point)))),
            ("1.234,5", None, Ok((1234.5, Some(Comma)))),
            ("1,234.5", None, Ok((1234.5, Some(Point)))),
            ("1'234.5", None, Ok((1234.5, Some(Point)))),
            ("\u{2212}1.5e\u{2212}3", None, Ok((-1.5e-3, Some(Point)))),
            ("\u{2212}1,5", None, Ok((-1.5, Some(Comma)))),
            ("-12 345 678", None, Ok((-12_345_678.0, None))),
            ("1.5", Some(Comma), Err(Wrong::Text)),
            ("0,5", Some(Point), Err(Wrong::Text)),
            ("1,23,4", None, Err(Wrong::Text)),
            ("1,5 V", None, Err(Wrong::Text)),
            ("-inf", None, Err(Wrong::NotFinite)),
            ("INF", Some(Comma), Err(Wrong::NotFinite)),
            ("1e999", None, Err(Wrong::NotFinite)),
            ("two", None, Err(Wrong::Text)),
        ] {
            let mut found = mark;
            let number = number(text.as_bytes(), &mut found).map(|number| (number, found));
            assert_eq!(number, expected, "{text} {mark:?}");
        }
        for text in ["", " ", "NaN", "NAN", "na", "NULL", "N/A"] {
            let number = number(text.as_bytes(), &mut None).unwrap();
            assert!(number.is_nan(), "{text}");
        }
        assert_eq!(number(b"1\xa0234", &mut None), Ok(1234.0));
    }
}
