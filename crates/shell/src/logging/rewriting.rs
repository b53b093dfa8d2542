//! A layer that rewrites events before another layer logs them.
//!
//! - Text from other parties. Errors quote messages from the network, warnings name certificates. Such text must not
//!   forge further lines, control the terminal or reverse the direction of text.
//! - Fields in the message text. `journalctl` shows the text of a message and none of its fields: of `verdict` with the
//!   fields `component` and `state` it shows `verdict`. The text therefore includes the fields, formatted as on
//!   standard error.

use std::fmt::Debug;

use tracing::field::{Field, Value, Visit, display};
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::fmt::FormatFields;
use tracing_subscriber::fmt::format::{DefaultFields, Writer};
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;
use vocabulary::{is_printable, printable};

/// The field that contains the text.
const TEXT: &str = "message";

/// The value of each field of an event, at the field's index.
pub(super) type Values = Vec<Option<Box<dyn Value>>>;

/// Rewrites an event; `None` leaves it unchanged.
pub(super) type Rewrite = fn(&Event<'_>) -> Option<Values>;

/// Passes each event to another layer, rewritten.
pub(super) struct Rewriting<L>(pub(super) L, pub(super) Rewrite);

impl<S, L> Layer<S> for Rewriting<L>
where
    S: Subscriber + for<'span> LookupSpan<'span>,
    L: Layer<S>,
{
    fn on_new_span(
        &self,
        attributes: &tracing::span::Attributes<'_>,
        id: &tracing::span::Id,
        context: Context<'_, S>,
    ) {
        self.0.on_new_span(attributes, id, context);
    }

    fn on_record(
        &self,
        id: &tracing::span::Id,
        values: &tracing::span::Record<'_>,
        context: Context<'_, S>,
    ) {
        self.0.on_record(id, values, context);
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        let Some(values) = (self.1)(event) else { return self.0.on_event(event, context) };
        let values: Vec<Option<&dyn Value>> = values.iter().map(Option::as_deref).collect();
        let values = event.metadata().fields().value_set_all(&values);
        self.0.on_event(&Event::new(event.metadata(), &values), context);
    }
}

/// Replaces characters that are not printable in the text and the fields; other events are unchanged.
pub(super) fn with_printable_texts(event: &Event<'_>) -> Option<Values> {
    let texts = FieldTexts::of(event, printable);
    texts.is_odd.then_some(texts.values)
}

/// Appends all fields to the text.
pub(super) fn with_fields_in_text(event: &Event<'_>) -> Option<Values> {
    let mut values = FieldTexts::of(event, str::to_owned).values;
    let place = event.metadata().fields().field(TEXT).map(|field| field.index());
    let mut sentence = String::new();
    let written = DefaultFields::new().format_fields(Writer::new(&mut sentence), event);
    if let (Some(place), Ok(())) = (place, written) {
        values[place] = Some(Box::new(sentence));
    }
    Some(values)
}

/// Each field's value as text, at the field's index; and whether any contains characters that are not printable.
struct FieldTexts {
    values: Values,
    is_odd: bool,
    change: fn(&str) -> String,
}

impl FieldTexts {
    fn of(event: &Event<'_>, change: fn(&str) -> String) -> Self {
        let values = event.metadata().fields().iter().map(|_| None).collect();
        let mut texts = Self { values, is_odd: false, change };
        event.record(&mut texts);
        texts
    }

    fn put(&mut self, field: &Field, text: &str, value: impl FnOnce(String) -> Box<dyn Value>) {
        self.is_odd |= !text.chars().all(is_printable);
        if let Some(place) = self.values.get_mut(field.index()) {
            *place = Some(value((self.change)(text)));
        }
    }
}

impl Visit for FieldTexts {
    fn record_str(&mut self, field: &Field, value: &str) {
        self.put(field, value, |text| Box::new(text));
    }

    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.put(field, &format!("{value:?}"), |text| Box::new(display(text)));
    }
}

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::Arc;

    use parking_lot::Mutex;
    use tracing_subscriber::fmt;
    use tracing_subscriber::layer::SubscriberExt;

    use super::*;

    /// What was written.
    #[derive(Clone, Default)]
    struct LogOutput(Arc<Mutex<Vec<u8>>>);

    impl io::Write for LogOutput {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn logged(log: impl FnOnce()) -> String {
        let written = LogOutput::default();
        let writer = written.clone();
        let layer =
            fmt::layer().without_time().with_ansi(false).with_writer(move || writer.clone());
        let subscriber =
            tracing_subscriber::registry().with(Rewriting(layer, with_printable_texts));
        tracing::subscriber::with_default(subscriber, log);
        let bytes = written.0.lock().clone();
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn foreign_texts_stay_on_their_line_and_in_their_order() {
        let text = logged(|| {
            let foreign = "x\nERROR \u{202e}y\u{1b}[2K";
            tracing::warn!(%foreign, quoted = foreign, times = 3, "refused: {foreign}");
        });
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(text.trim_end_matches('\n').chars().all(is_printable), "{text}");
        let expected = r"refused: x\nERROR \u{202e}y\u{1b}[2K foreign=x\nERROR \u{202e}y\u{1b}[2K";
        assert!(text.contains(expected) && text.contains("times=3"), "{text}");
    }

    #[test]
    fn other_events_are_not_changed() {
        let text = logged(|| tracing::info!(state = "latched", step = 4, "größer"));
        assert!(text.ends_with("größer state=\"latched\" step=4\n"), "{text}");
    }

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
