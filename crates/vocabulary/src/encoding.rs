//! Bytes to messages and back.
//!
//! A message is one JSON object, or the same as CBOR (RFC 8949) where both are offered. Its field `v` is the version of the format, [`VERSION`]; it is
//! looked at before anything else, so that a message of another version is called just that and not
//! malformed. The version is raised when a field changes its meaning or goes, or an enumeration gets another word; a new
//! field alone does not raise it, so fields that are not known are ignored.
//!
//! Finite numbers come back as the very same bits. A number that is not finite is written `null` in JSON, as itself in CBOR.

use crate::quotation;
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::error::Category;
use serde_json::{Map, Value};

/// The version that this crate reads and writes.
pub const VERSION: u64 = 1;

/// What this crate writes begins like this.
const OWN_BEGINNING: &str = r#"{"v":1,"#;
/// The same in CBOR: a map without a stated length, the text `v`, 1.
const OWN_BEGINNING_CBOR: &[u8] = b"\xbf\x61v\x01";

/// Longer messages are refused unread.
pub const MAX_MESSAGE_BYTES: usize = 1 << 20;

/// The form that a message has as bytes; it travels beside them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Encoding {
    /// Text that anything reads: `application/json`.
    #[default]
    Json,
    /// Half as long, read in a fraction of the time: `application/cbor`.
    Cbor,
}

/// A message that can be sent.
pub trait Message: Serialize + DeserializeOwned + JsonSchema {
    /// What an error calls it, e.g. `sample`.
    const WHAT: &'static str;

    /// Text that cannot be read as the message that its writer meant, if that is known.
    fn corrected(_text: &str) -> Option<String> {
        None
    }
}

/// Deserializes a sum type that is flattened into its parent. Its tag is read as text, because `flatten` would take a
/// number for the variant's index.
pub(crate) fn tagged_by_word<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: DeserializeOwned,
{
    let fields = Map::deserialize(deserializer)?;
    T::deserialize(Value::Object(fields)).map_err(Error::custom)
}

/// Bytes that are no message of the kind expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// Too many bytes.
    #[error("{bytes} bytes are too many; a message has at most {MAX_MESSAGE_BYTES}")]
    TooLong {
        /// How many.
        bytes: usize,
    },
    /// Not even text.
    #[error("not UTF-8 text; a message is one JSON object")]
    NotText,
    /// Text that is not JSON, or bytes that are not CBOR.
    #[error("malformed {0}")]
    Malformed(String),
    /// An object without a version.
    #[error("no version; a message has the field `v`, presently {VERSION}")]
    NoVersion,
    /// A version that this crate does not read.
    #[error("unknown version {0}; this side reads version {VERSION}")]
    UnknownVersion(String),
    /// The right version, but not the message expected.
    #[error("invalid {what}: {reason}")]
    WrongMessage {
        /// The message expected.
        what: &'static str,
        /// What does not fit.
        reason: String,
    },
}

/// A message that cannot be written.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} cannot be written: {reason}")]
pub struct EncodeError {
    what: &'static str,
    reason: String,
}

#[derive(Serialize)]
struct Versioned<'a, M> {
    v: u64,
    #[serde(flatten)]
    message: &'a M,
}

#[derive(Deserialize)]
struct VersionOnly {
    v: Option<Value>,
}

/// Writes a message.
///
/// # Errors
/// A message that JSON has no form for; none of this crate's is.
pub fn encode<M: Message>(message: &M) -> Result<Vec<u8>, EncodeError> {
    serde_json::to_vec(&Versioned { v: VERSION, message })
        .map_err(|error| EncodeError { what: M::WHAT, reason: error.to_string() })
}

/// Writes a message in a form.
///
/// # Errors
/// A message that has none; none of this crate's is.
pub fn encode_as<M: Message>(message: &M, encoding: Encoding) -> Result<Vec<u8>, EncodeError> {
    match encoding {
        Encoding::Json => encode(message),
        Encoding::Cbor => {
            let mut bytes = Vec::with_capacity(512);
            ciborium::into_writer(&Versioned { v: VERSION, message }, &mut bytes)
                .map_err(|error| EncodeError { what: M::WHAT, reason: error.to_string() })?;
            Ok(bytes)
        }
    }
}

/// Reads a message in a form.
///
/// # Errors
/// Whatever is not a message of this kind and version in this form, with what is wrong about it.
pub fn decode_as<M: Message>(bytes: &[u8], encoding: Encoding) -> Result<M, DecodeError> {
    match encoding {
        Encoding::Json => decode(bytes),
        Encoding::Cbor => decode_cbor(bytes),
    }
}

fn decode_cbor<M: Message>(bytes: &[u8]) -> Result<M, DecodeError> {
    if bytes.len() > MAX_MESSAGE_BYTES {
        return Err(DecodeError::TooLong { bytes: bytes.len() });
    }
    if let Some(message) = plainly_own_cbor(bytes) {
        return Ok(message);
    }
    let mut rest = bytes;
    let found: VersionOnly = ciborium::from_reader(&mut rest).map_err(|error| match error {
        ciborium::de::Error::Semantic(_, reason) => wrong_cbor::<M>(&reason),
        other => DecodeError::Malformed(format!("CBOR: {}", shortened(&other.to_string()))),
    })?;
    if !rest.is_empty() {
        let reason = format!("CBOR: {} bytes after the message", rest.len());
        return Err(DecodeError::Malformed(reason));
    }
    check_found(found)?;
    ciborium::from_reader(bytes).map_err(|error| wrong_cbor::<M>(&error.to_string()))
}

/// As [`plainly_own`].
fn plainly_own_cbor<M: Message>(bytes: &[u8]) -> Option<M> {
    let rest = bytes.strip_prefix(OWN_BEGINNING_CBOR)?;
    // However long its head, whether text or bytes, whole or in pieces, another `v` has one of these before it. Numbers may
    // look so, too; then the message is read twice.
    let is_another = |two: &[u8]| two[1] == b'v' && matches!(two[0], 0x61 | 0x41 | 0x01);
    if rest.windows(2).any(is_another) {
        return None;
    }
    let mut unread = bytes;
    let message = ciborium::from_reader(&mut unread).ok()?;
    unread.is_empty().then_some(message)
}

fn wrong_cbor<M: Message>(reason: &str) -> DecodeError {
    DecodeError::WrongMessage { what: M::WHAT, reason: shortened(reason) }
}

/// Reads a message of JSON.
///
/// # Errors
/// Whatever is not a message of this kind and version, with what is wrong about it.
pub fn decode<M: Message>(bytes: &[u8]) -> Result<M, DecodeError> {
    if bytes.len() > MAX_MESSAGE_BYTES {
        return Err(DecodeError::TooLong { bytes: bytes.len() });
    }
    let text = std::str::from_utf8(bytes).map_err(|_| DecodeError::NotText)?;
    // RFC 8259, section 8.1: a mark of the byte order may be ignored.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if let Some(message) = plainly_own(text) {
        return Ok(message);
    }
    read(text).or_else(|error| M::corrected(text).map_or(Err(error), |corrected| read(&corrected)))
}

fn read<M: Message>(text: &str) -> Result<M, DecodeError> {
    check_version::<M>(text)?;
    // The text is JSON; what serde still calls a syntax error is a number or a list that does not fit.
    serde_json::from_str(text).map_err(|error| wrong::<M>(&error))
}

/// A message as [`encode`] writes it is read once, not twice: most samples are.
fn plainly_own<M: Message>(text: &str) -> Option<M> {
    // With a second version, or a name spelt by escapes that might be one, it is not plain.
    let rest = text.strip_prefix(OWN_BEGINNING)?;
    let is_plain = !rest.contains(r#""v""#) && !rest.contains('\\');
    is_plain.then(|| serde_json::from_str(text).ok())?
}

fn check_version<M: Message>(text: &str) -> Result<(), DecodeError> {
    let found: VersionOnly = match serde_json::from_str(text) {
        Ok(found) => found,
        Err(error) if error.classify() == Category::Data => return Err(wrong::<M>(&error)),
        Err(error) => {
            return Err(DecodeError::Malformed(format!("JSON: {}", shortened(&error.to_string()))));
        }
    };
    if !text.trim_start().starts_with('{') {
        let reason = "an array; a message is a JSON object".to_owned();
        return Err(DecodeError::WrongMessage { what: M::WHAT, reason });
    }
    check_found(found)
}

fn check_found(found: VersionOnly) -> Result<(), DecodeError> {
    match found.v {
        None => Err(DecodeError::NoVersion),
        Some(v) if v.as_u64() == Some(VERSION) => Ok(()),
        Some(v) => Err(DecodeError::UnknownVersion(shortened(&v.to_string()))),
    }
}

fn wrong<M: Message>(error: &serde_json::Error) -> DecodeError {
    DecodeError::WrongMessage { what: M::WHAT, reason: shortened(&error.to_string()) }
}

/// Errors quote what they found; a hostile message must neither fill the log nor forge lines of it.
fn shortened(text: &str) -> String {
    const LONGEST: usize = 200;
    let mut quoted = quotation(text, LONGEST);
    if text.chars().nth(LONGEST).is_some() {
        quoted.push('…');
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Progress;
    use crate::{RunId, Step};

    fn refused(bytes: &[u8]) -> DecodeError {
        decode::<Progress>(bytes).unwrap_err()
    }

    #[test]
    fn the_version_stands_first() {
        let bytes = encode(&Progress { run: RunId(7), step: Step(3) }).unwrap();
        assert_eq!(String::from_utf8(bytes).unwrap(), r#"{"v":1,"run":7,"step":3}"#);
        assert_eq!(OWN_BEGINNING, format!(r#"{{"v":{VERSION},"#));
    }

    #[test]
    fn cbor_with_a_second_version_however_it_is_spelt_is_refused() {
        let own = encode_as(&Progress { run: RunId(7), step: Step(3) }, Encoding::Cbor).unwrap();
        assert!(own.starts_with(OWN_BEGINNING_CBOR), "{own:x?}");
        let read = |bytes: &[u8]| decode_as::<Progress>(bytes, Encoding::Cbor);
        assert_eq!(read(&own), Ok(Progress { run: RunId(7), step: Step(3) }));
        let spelt: [&[u8]; 5] =
            [b"\x61v", b"\x78\x01v", b"\x79\0\x01v", b"\x7f\x60\x61v\xff", b"\x7f\x78\x01v\xff"];
        for name in spelt {
            let two = [&own[..own.len() - 1], name, b"\x02\xff"].concat();
            assert!(read(&two).is_err(), "{two:x?}");
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_called_that() {
        assert_eq!(refused(&[0xff, 0xfe]), DecodeError::NotText);
    }

    #[test]
    fn a_byte_order_mark_does_not_matter() {
        assert_eq!(refused("\u{feff}{}".as_bytes()), DecodeError::NoVersion);
    }

    #[test]
    fn text_that_is_no_json_is_malformed() {
        let deep = "[".repeat(1000);
        for text in
            ["", "{", "hello", r#"{"v":1,}"#, r#"{"v":1,"run":NaN,"step":1}"#, "1e999", &deep]
        {
            let error = refused(text.as_bytes());
            assert!(matches!(error, DecodeError::Malformed(_)), "{text}: {error}");
        }
    }

    #[test]
    fn an_object_without_a_version_is_called_that() {
        assert_eq!(refused(br#"{"run":1,"step":1}"#), DecodeError::NoVersion);
        assert_eq!(refused(br#"{"v":null,"run":1,"step":1}"#), DecodeError::NoVersion);
    }

    #[test]
    fn another_version_is_unknown_before_it_is_anything_else() {
        for (text, named) in [
            (r#"{"v":2,"anything":[1,2,3]}"#, "2"),
            (r#"{"v":"1","run":1,"step":1}"#, "\"1\""),
            (r#"{"v":-1}"#, "-1"),
            (r#"{"v":1.5}"#, "1.5"),
        ] {
            assert_eq!(refused(text.as_bytes()), DecodeError::UnknownVersion(named.to_owned()));
        }
    }

    #[test]
    fn a_second_version_is_refused_however_it_is_spelt() {
        for second in [r#""v":2"#, r#""v":1"#, r#""\u0076":2"#] {
            let text = format!(r#"{{"v":1,"run":1,"step":1,{second}}}"#);
            let error = refused(text.as_bytes());
            assert!(matches!(error, DecodeError::WrongMessage { .. }), "{text}: {error:?}");
        }
    }

    #[test]
    fn the_version_may_stand_anywhere() {
        let text = br#" {"run":1,"step":2, "v" : 1}"#;
        assert_eq!(decode(text), Ok(Progress { run: RunId(1), step: Step(2) }));
    }

    #[test]
    fn json_of_the_right_version_that_does_not_fit_is_a_wrong_message() {
        for text in [
            r#"{"v":1}"#,
            r#"{"v":1,"run":1,"step":-4}"#,
            r#"{"v":1,"run":1,"step":1.5}"#,
            r#"{"v":1,"run":1,"run":1,"step":1}"#,
            "[1]",
            "3",
            "null",
        ] {
            let error = refused(text.as_bytes());
            assert!(matches!(error, DecodeError::WrongMessage { .. }), "{text}: {error:?}");
            assert!(error.to_string().contains("progress"), "{error}");
        }
    }

    #[test]
    fn fields_that_are_not_known_are_passed_over() {
        let text = br#"{"v":1,"run":1,"step":2,"colour":"red"}"#;
        assert_eq!(decode(text), Ok(Progress { run: RunId(1), step: Step(2) }));
    }

    #[test]
    fn a_message_too_long_is_refused_unread() {
        let bytes = vec![b' '; MAX_MESSAGE_BYTES + 1];
        assert_eq!(refused(&bytes), DecodeError::TooLong { bytes: MAX_MESSAGE_BYTES + 1 });
    }

    #[test]
    fn errors_stay_on_one_line_whatever_they_quote() {
        for text in [
            r#"{"v":1,"structure":"s","component":"m/sensor/g","fault":{"kind":"a\nERROR b"}}"#,
            r#"{"v":1,"component":"m\nERROR b","fault":null}"#,
        ] {
            let error = decode::<crate::Injection>(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains("ERROR b") && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn errors_stay_short_whatever_they_quote() {
        let text = format!(r#"{{"v":1,"run":"{}","step":1}}"#, "x".repeat(10_000));
        assert!(refused(text.as_bytes()).to_string().len() < 300);
    }
}
