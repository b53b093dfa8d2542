//! The encoding of a record: the CRC-32 of its text in eight hexadecimal digits, a space, the text, a newline.

use crate::error::{MAX_RECORD_BYTES, WriteError};

/// Checksum, space and newline.
const FRAME_BYTES: usize = CHECKSUM_BYTES + 2;
const CHECKSUM_BYTES: usize = 8;

/// A longer line is invalid.
pub(crate) const MAX_LINE_BYTES: usize = MAX_RECORD_BYTES + FRAME_BYTES;

/// Encodes records as lines; fails if one of them is not valid.
pub(crate) fn encode<S: AsRef<str>>(
    records: impl IntoIterator<Item = S>,
) -> Result<Vec<u8>, WriteError> {
    let mut lines = Vec::new();
    for record in records {
        push(&mut lines, record.as_ref())?;
    }
    Ok(lines)
}

fn push(lines: &mut Vec<u8>, record: &str) -> Result<(), WriteError> {
    if record.len() > MAX_RECORD_BYTES {
        return Err(WriteError::TooLong { bytes: record.len() });
    }
    if let Some(at) = record.find('\n') {
        return Err(WriteError::Newline { at });
    }
    lines.reserve(record.len() + FRAME_BYTES);
    lines.extend(checksum(record.as_bytes()));
    lines.push(b' ');
    lines.extend(record.as_bytes());
    lines.push(b'\n');
    Ok(())
}

/// The record in a line that includes the newline; `None` unless it is exactly as encoded.
pub(crate) fn decode(line: &[u8]) -> Option<&str> {
    let (expected, rest) = line.split_at_checked(CHECKSUM_BYTES)?;
    let text = rest.strip_prefix(b" ")?.strip_suffix(b"\n")?;
    // Compares the digits, so that other spellings of the same number are rejected.
    if checksum(text) != expected {
        return None;
    }
    std::str::from_utf8(text).ok()
}

/// The checksum that the line of a text begins with.
pub(crate) fn checksum(text: &[u8]) -> [u8; CHECKSUM_BYTES] {
    let checksum = crc32fast::hash(text);
    std::array::from_fn(|k| b"0123456789abcdef"[(checksum >> (28 - 4 * k)) as usize & 0xf])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_is_checksum_space_text_newline() {
        // the check value of CRC-32 by which its implementations are distinguished
        assert_eq!(encode(["123456789", ""]).unwrap(), b"cbf43926 123456789\n00000000 \n");
    }

    #[test]
    fn only_the_very_line_that_was_written_is_a_record() {
        assert_eq!(decode(b"cbf43926 123456789\n"), Some("123456789"));
        for line in [
            &b""[..],
            b"\n",
            b"cbf43926",
            b"cbf43926 ",
            b"cbf43926 123456789",
            b"CBF43926 123456789\n",
            b"cbf43926\t123456789\n",
            b"cbf43926 123456788\n",
            b"00000000 123456789\n",
            b"\0\0\0\0\0\0\0\0\0\n",
        ] {
            assert_eq!(decode(line), None, "{line:?}");
        }
    }

    #[test]
    fn a_matching_checksum_does_not_make_bytes_a_text() {
        let line = [&checksum(&[0xff])[..], b" \xff\n"].concat();
        assert_eq!(decode(&line), None);
    }

    #[test]
    fn what_is_no_single_line_of_bearable_length_is_refused() {
        let error = encode(["ab\nc"]).unwrap_err();
        assert!(matches!(error, WriteError::Newline { at: 2 }), "{error}");
        let longest = "x".repeat(MAX_RECORD_BYTES);
        let line = encode([&longest]).unwrap();
        assert_eq!(line.len(), MAX_LINE_BYTES);
        assert_eq!(decode(&line), Some(&longest[..]));
        let error = encode([longest + "x"]).unwrap_err();
        assert!(matches!(error, WriteError::TooLong { bytes: 1_048_577 }), "{error}");
    }
}
