//! A record that a later version wrote and that this one cannot read: of a kind that it does not know, or of one that has
//! changed. It stays in the journal as it is.

use names::ModuleName;
use serde_json::{Map, Value};

use super::record::Record;

/// What it says of itself.
#[derive(Debug)]
pub(super) struct LaterRecord(Map<String, Value>);

impl LaterRecord {
    /// From a line; `None` for a record that this version can read, and for what is no record at all.
    pub(super) fn from_text(text: &str) -> Option<Self> {
        let fields: Map<String, Value> = serde_json::from_str(text).ok()?;
        let is_record = fields.get("record").is_some_and(Value::is_string);
        let is_known = || serde_json::from_str::<Record>(text).is_ok();
        (is_record && !is_known()).then_some(Self(fields))
    }

    /// Its number, if it is a transition of this module: it must not be given again.
    pub(super) fn number_of(&self, module: &ModuleName) -> Option<u64> {
        let says =
            |field: &str, text: &str| self.0.get(field).and_then(Value::as_str) == Some(text);
        let is_own = says("record", "transition") && says("module", module.as_str());
        self.0.get("sequence").filter(|_| is_own)?.as_u64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_a_record_and_cannot_be_read_is_of_a_later_version() {
        let is_later = |text: &str| LaterRecord::from_text(text).is_some();
        assert!(is_later(r#"{"record":"weighing"}"#));
        assert!(is_later(r#"{"record":"start","software":7,"time_unix_ns":1}"#));
        assert!(!is_later(r#"{"record":"start","software":"7","time_unix_ns":1}"#));
        for text in ["", "weighing", r#"["weighing"]"#, "{}", r#"{"record":7}"#] {
            assert!(!is_later(text), "{text}");
        }
    }

    #[test]
    fn only_a_transition_of_the_module_itself_has_a_number() {
        let [own, other] = ["m1", "m2"].map(|name| name.parse::<ModuleName>().unwrap());
        let later = LaterRecord::from_text(r#"{"record":"transition","module":"m1","sequence":7}"#);
        let later = later.unwrap();
        assert_eq!((later.number_of(&own), later.number_of(&other)), (Some(7), None));
        let later = LaterRecord::from_text(r#"{"record":"weighing","module":"m1","sequence":7}"#);
        assert_eq!(later.unwrap().number_of(&own), None);
    }
}
