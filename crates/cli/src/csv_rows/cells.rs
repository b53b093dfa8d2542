//! One line of a table, taken apart.

use csv::{ByteRecord, ReaderBuilder};

/// Puts the fields of a line into `fields`. Quotes protect delimiters; a field cannot contain a line
/// break, because a table of numbers has none.
pub(super) fn split(line: &[u8], delimiter: u8, fields: &mut ByteRecord) {
    fields.clear();
    if line.contains(&b'"') && split_quoted(line, delimiter, fields) {
        return;
    }
    line.split(|&byte| byte == delimiter).for_each(|field| fields.push_field(field));
}

/// False if the line has no fields to the reader of quotes.
fn split_quoted(line: &[u8], delimiter: u8, fields: &mut ByteRecord) -> bool {
    let mut reader = ReaderBuilder::new().has_headers(false).delimiter(delimiter).from_reader(line);
    matches!(reader.read_byte_record(fields), Ok(true))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(line: &str, delimiter: u8) -> Vec<String> {
        let mut record = ByteRecord::new();
        split(line.as_bytes(), delimiter, &mut record);
        record.iter().map(|field| String::from_utf8_lossy(field).into_owned()).collect()
    }

    #[test]
    fn delimiters_part_and_quotes_protect() {
        assert_eq!(fields("a,b,,c", b','), ["a", "b", "", "c"]);
        assert_eq!(fields("1,5;2", b';'), ["1,5", "2"]);
        assert_eq!(fields("\"a,b\",\"c \"\"d\"\"\"", b','), ["a,b", "c \"d\""]);
        assert_eq!(fields("", b','), [""]);
        assert_eq!(fields("\"open,1", b','), ["open,1"]);
    }
}
