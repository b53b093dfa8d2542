//! Fields in the text of a message.
//!
//! `journalctl` shows a message's text and none of its fields: of `verdict` with the fields `component`
//! and `state` it shows `verdict`. Hence the text includes them too, formatted as on standard error.

use std::fmt::Debug;

use tracing::Event;
use tracing::field::{Field, Visit};
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::{DefaultFields, Writer};

use super::rewriting::Values;

/// The field that holds the text.
const TEXT: &str = "message";

/// All fields in the text.
pub(super) fn with_fields_in_text(event: &Event<'_>) -> Option<Values> {
    let fields = event.metadata().fields();
    let mut texts = Texts(fields.iter().map(|_| None).collect());
    event.record(&mut texts);
    let place = fields.field(TEXT).map(|field| field.index());
    if let (Some(place), Some(sentence)) = (place, sentence(event)) {
        texts.0[place] = Some(Box::new(sentence));
    }
    Some(texts.0)
}

/// The text and every other field behind it.
fn sentence(event: &Event<'_>) -> Option<String> {
    let mut sentence = String::new();
    DefaultFields::new().format_fields(Writer::new(&mut sentence), event).ok()?;
    Some(sentence)
}

/// Each field's value as text, at the field's place.
struct Texts(Values);

impl Texts {
    fn put(&mut self, field: &Field, text: String) {
        if let Some(place) = self.0.get_mut(field.index()) {
            *place = Some(Box::new(text));
        }
    }
}

impl Visit for Texts {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.put(field, value.to_owned());
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.put(field, format!("{value:?}"));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use parking_lot::Mutex;
    use tracing::Subscriber;
    use tracing_subscriber::Layer;
    use tracing_subscriber::layer::{Context, SubscriberExt};

    use super::*;
    use crate::logging::rewriting::Rewriting;

    /// Keeps what it is handed.
    #[derive(Clone, Default)]
    struct Keep(Arc<Mutex<Vec<(String, String)>>>);

    impl<S: Subscriber> Layer<S> for Keep {
        fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
            event.record(&mut self.clone());
        }
    }

    impl Visit for Keep {
        fn record_str(&mut self, field: &Field, value: &str) {
            self.0.lock().push((field.name().to_owned(), value.to_owned()));
        }

        fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
            self.record_str(field, &format!("{value:?}"));
        }
    }

    fn handed_on(log: impl FnOnce()) -> Vec<(String, String)> {
        let keep = Keep::default();
        let subscriber = Rewriting(keep.clone(), with_fields_in_text);
        let subscriber = tracing_subscriber::registry().with(subscriber);
        tracing::subscriber::with_default(subscriber, log);
        let kept = keep.0.lock();
        kept.clone()
    }

    fn pairs(expected: &[(&str, &str)]) -> Vec<(String, String)> {
        expected.iter().map(|(name, text)| ((*name).to_owned(), (*text).to_owned())).collect()
    }

    #[test]
    fn the_text_says_every_field_and_the_fields_stay() {
        let kept = handed_on(|| {
            let component = "module1/sensor/g2";
            tracing::info!(%component, state = "latched", step = 4, "verdict");
        });
        let text = r#"verdict component=module1/sensor/g2 state="latched" step=4"#;
        let expected = [
            ("message", text),
            ("component", "module1/sensor/g2"),
            ("state", "latched"),
            ("step", "4"),
        ];
        assert_eq!(kept, pairs(&expected));
    }

    #[test]
    fn a_text_without_fields_stays_as_it_is() {
        let kept = handed_on(|| tracing::warn!("stopped after {} s", 3));
        assert_eq!(kept, pairs(&[("message", "stopped after 3 s")]));
    }

    #[test]
    fn a_field_without_a_value_is_not_printed() {
        let kept = handed_on(|| tracing::info!(by = None::<&str>, "verdict"));
        assert_eq!(kept, pairs(&[("message", "verdict")]));
    }
}
