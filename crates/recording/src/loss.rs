//! Losses of the recorder, as messages in the file, so that the file of a killed recorder has them too.

use serde_json::{Value, json};

use crate::Recorded;

/// The part of the recorder's own topic in the position of the module.
const RECORDER: &str = "recorder";
/// The last part of the topic.
const LOSS: &str = "loss";
/// Name of the schema.
pub(crate) const NAME: &str = "loss";

/// Messages of a topic that are not in the recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Loss {
    /// Their topic.
    pub topic: String,
    /// Their number.
    pub count: u64,
    /// The number of losses on the topic since the start of the recorder, including these.
    pub total: u64,
    /// The reason, in words.
    pub reason: String,
    /// When the recorder noticed \[ns since 1970\].
    pub time_unix_ns: u64,
}

impl Loss {
    /// The message, on `trusswatch/{structure}/recorder/loss` of the structure that the topic belongs to.
    #[must_use]
    pub fn to_message(&self) -> Recorded {
        let structure = self.topic.split('/').nth(1).unwrap_or("unknown");
        let payload = json!({
            "topic": self.topic,
            "count": self.count,
            "total": self.total,
            "reason": self.reason,
            "time_unix_ns": self.time_unix_ns,
        });
        Recorded {
            topic: format!("{}/{structure}/{RECORDER}/{LOSS}", vocabulary::keys::ROOT),
            time_unix_ns: self.time_unix_ns,
            sequence: 0,
            payload: payload.to_string().into_bytes(),
        }
    }
}

/// Whether this is the recorder's own topic.
pub(crate) fn is_loss(topic: &str) -> bool {
    let mut parts = topic.split('/').skip(2);
    parts.next() == Some(RECORDER) && parts.next() == Some(LOSS) && parts.next().is_none()
}

/// The JSON Schema of these messages.
pub(crate) fn schema() -> Value {
    let text = |what: &str| json!({ "description": what, "type": "string" });
    let count = |what: &str| json!({ "description": what, "type": "integer", "minimum": 0 });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Loss",
        "description": "Messages that are not in the recording.",
        "type": "object",
        "properties": {
            "topic": text("The topic that they were on."),
            "count": count("How many."),
            "total": count("How many on the topic since the recorder was started, these included."),
            "reason": text("Why."),
            "time_unix_ns": count("When that was known [ns since 1970]."),
        },
        "required": ["topic", "count", "total", "reason", "time_unix_ns"],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_loss_is_recorded_on_the_recorders_topic() {
        let topic = "trusswatch/tower/module1/sample".to_owned();
        let loss = Loss { topic, count: 3, total: 5, reason: "late".to_owned(), time_unix_ns: 7 };
        let message = loss.to_message();
        assert_eq!(message.topic, "trusswatch/tower/recorder/loss");
        assert!(is_loss(&message.topic) && !is_loss(&loss.topic));
        let value: Value = serde_json::from_slice(&message.payload).unwrap();
        assert_eq!((&value["count"], &value["total"]), (&json!(3), &json!(5)));
        assert_eq!(value["topic"], json!("trusswatch/tower/module1/sample"));
    }
}
