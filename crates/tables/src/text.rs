//! From bytes to lines: the encoding and what ends a line.

use std::io::{self, BufRead, BufReader, Cursor, Read};

/// Longest line that is accepted, in bytes.
const MAX_LINE: u64 = 16 << 20;
const BUFFER: usize = 1 << 16;
/// So many bytes at the beginning say the encoding.
const LOOKED_AT: usize = 64;
/// So much rarer is a zero in the lower half of a UTF-16 unit.
const RARER: usize = 8;
const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";

/// Lines of UTF-8, or of any encoding whose first half is ASCII: what is not UTF-8 is read as Latin-1.
pub(crate) struct TextLines {
    input: BufReader<Box<dyn Read>>,
    /// `\n`, or `\r` where nothing else ends a line.
    end: u8,
}

impl TextLines {
    /// Looks at the beginning: a byte order mark says the encoding, the first line says what ends it.
    pub(crate) fn open(mut input: Box<dyn Read>) -> io::Result<TextLines> {
        let mut head = read_on(&mut *input, Vec::new(), |head| head.len() >= 4)?;
        input = match utf16(&head)? {
            Some((mark, big_endian)) => {
                let bytes = Cursor::new(head.split_off(mark)).chain(input);
                head = Vec::new();
                Box::new(Utf16 { input: bytes, big_endian, units: Units::default() })
            }
            None => {
                if head.starts_with(UTF8_MARK) {
                    head.drain(..UTF8_MARK.len());
                }
                input
            }
        };
        let is_end = |&byte: &u8| byte == b'\n' || byte == b'\r';
        // What follows a `\r` says whether it ends a line alone.
        let head = read_on(&mut *input, head, |head| {
            head.iter().position(is_end).is_some_and(|at| head[at] == b'\n' || at + 1 < head.len())
        })?;
        let alone = head.iter().position(is_end).is_some_and(|at| {
            head[at] == b'\r' && head.get(at + 1).is_some_and(|next| !b"\r\n".contains(next))
        });
        let input: Box<dyn Read> = Box::new(Cursor::new(head).chain(input));
        let end = if alone { b'\r' } else { b'\n' };
        Ok(TextLines { input: BufReader::with_capacity(BUFFER, input), end })
    }

    /// Must the next line be waited for?
    pub(crate) fn is_drained(&self) -> bool {
        self.input.buffer().is_empty()
    }

    /// Reads a line without its end. False at the end of the input.
    pub(crate) fn read(&mut self, line: &mut Vec<u8>) -> io::Result<bool> {
        line.clear();
        let read = (&mut self.input).take(MAX_LINE).read_until(self.end, line)?;
        if line.last() == Some(&self.end) {
            line.pop();
        } else if read as u64 == MAX_LINE {
            let limit = MAX_LINE >> 20;
            return Err(io::Error::other(format!("a line is longer than {limit} MiB")));
        }
        while line.last() == Some(&b'\r') {
            line.pop();
        }
        Ok(read > 0)
    }
}

/// Reads until there is enough, or the end, or a buffer full.
fn read_on(
    input: &mut dyn Read,
    mut head: Vec<u8>,
    enough: impl Fn(&[u8]) -> bool,
) -> io::Result<Vec<u8>> {
    let mut chunk = [0; 4096];
    while !enough(&head) && head.len() < BUFFER {
        match input.read(&mut chunk) {
            Ok(0) => break,
            Ok(read) => head.extend_from_slice(&chunk[..read]),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(head)
}

/// How many bytes say that it is UTF-16, none if only its zero bytes do, and whether it is big-endian.
///
/// # Errors
/// The bytes are binary, or UTF-32.
fn utf16(head: &[u8]) -> io::Result<Option<(usize, bool)>> {
    let head = &head[..head.len().min(LOOKED_AT)];
    let zeros = |from: usize| head.iter().skip(from).step_by(2).filter(|byte| **byte == 0).count();
    let half = head.len() / 2;
    match head {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => {
            Err(io::Error::other("it is UTF-32; save it as UTF-8"))
        }
        [0xff, 0xfe, ..] => Ok(Some((2, false))),
        [0xfe, 0xff, ..] => Ok(Some((2, true))),
        _ => match (zeros(0), zeros(1)) {
            (0, 0) => Ok(None),
            (even, odd) if 2 * odd > half && odd >= RARER * even => Ok(Some((0, false))),
            (even, odd) if 2 * even > half && even >= RARER * odd => Ok(Some((0, true))),
            _ => Err(io::Error::other(
                "it begins with zero bytes between others, so it is not a table of text; save it as CSV in UTF-8",
            )),
        },
    }
}

/// UTF-16 as UTF-8.
struct Utf16<R> {
    input: R,
    big_endian: bool,
    units: Units,
}

/// What was read and not yet delivered.
#[derive(Default)]
struct Units {
    bytes: Vec<u8>,
    text: Vec<u8>,
    delivered: usize,
}

impl<R: Read> Utf16<R> {
    /// Decodes the complete characters read so far; at the end of the input, everything.
    fn decode(&mut self, at_end: bool) {
        let unit = |pair: &[u8; 2]| match self.big_endian {
            true => u16::from_be_bytes(*pair),
            false => u16::from_le_bytes(*pair),
        };
        let (pairs, _) = self.units.bytes.as_chunks::<2>();
        let mut units: Vec<u16> = pairs.iter().map(unit).collect();
        let is_high = |unit: &u16| (0xd800..0xdc00).contains(unit);
        if !at_end && units.last().is_some_and(is_high) {
            units.pop();
        }
        self.units.bytes.drain(..2 * units.len());
        let letters = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
        self.units.text = letters.collect::<String>().into_bytes();
        self.units.delivered = 0;
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.units.delivered == self.units.text.len() {
            let mut chunk = [0; 8192];
            let read = self.input.read(&mut chunk)?;
            self.units.bytes.extend_from_slice(&chunk[..read]);
            self.decode(read == 0);
            if read == 0 && self.units.text.is_empty() {
                return Ok(0);
            }
        }
        let count = out.len().min(self.units.text.len() - self.units.delivered);
        let begin = self.units.delivered;
        out[..count].copy_from_slice(&self.units.text[begin..begin + count]);
        self.units.delivered += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: Vec<u8>) -> Vec<String> {
        let mut lines = TextLines::open(Box::new(Cursor::new(bytes))).unwrap();
        let (mut line, mut all) = (Vec::new(), Vec::new());
        while lines.read(&mut line).unwrap() {
            all.push(String::from_utf8(line.clone()).unwrap());
        }
        all
    }

    #[test]
    fn a_mark_says_the_encoding_and_the_first_line_its_end() {
        let text = "µ,ε𝜀\n1,2\n\n3,4";
        let expected = ["µ,ε𝜀", "1,2", "", "3,4"];
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            [UTF8_MARK, text.as_bytes()].concat(),
            little.clone(),
            big.clone(),
            [&[0xff, 0xfe], &little[..]].concat(),
            [&[0xfe, 0xff], &big[..]].concat(),
            text.replace('\n', "\r").into_bytes(),
            text.replace('\n', "\r\n").into_bytes(),
            text.replace('\n', "\r\r\n").into_bytes(),
        ] {
            assert_eq!(lines(bytes.clone()), expected, "{bytes:?}");
        }
        assert!(lines(Vec::new()).is_empty());
        assert_eq!(lines(b"x\r".to_vec()), ["x"]);
        let wide = text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        for (bytes, problem) in [
            (vec![0; 1000], "zero bytes"),
            (wide, "zero bytes"),
            (b"\xff\xfe\0\0x\0\0\0".to_vec(), "UTF-32"),
        ] {
            let opened = TextLines::open(Box::new(Cursor::new(bytes)));
            let error = opened.err().unwrap().to_string();
            assert!(error.contains(problem) && error.contains("UTF-8"), "{error}");
        }
    }
}
