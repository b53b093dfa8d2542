//! Texts of others in a log.
//!
//! An error quotes what came over the network, a warning names a certificate. Whatever it is, it forges no further
//! line, obeys no terminal and does not turn the order of the letters around.

use std::fmt::Debug;

use tracing::Event;
use tracing::field::{Field, Value, Visit, display};
use vocabulary::{is_printable, printable};

use super::rewriting::Values;

/// Nothing but printable characters in the text and the fields; an event that has no others stays as it is.
pub(super) fn with_printable_texts(event: &Event<'_>) -> Option<Values> {
    let each = event.metadata().fields().iter().map(|_| None).collect();
    let mut texts = Texts { each, odd: false };
    event.record(&mut texts);
    texts.odd.then_some(texts.each)
}

/// Each field's value at the field's place, printable; and whether any was not.
struct Texts {
    each: Values,
    odd: bool,
}

impl Texts {
    fn put(&mut self, field: &Field, text: &str, value: impl FnOnce(String) -> Box<dyn Value>) {
        self.odd |= !text.chars().all(is_printable);
        if let Some(place) = self.each.get_mut(field.index()) {
            *place = Some(value(printable(text)));
        }
    }
}

impl Visit for Texts {
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
    use crate::logging::rewriting::Rewriting;

    /// What was written.
    #[derive(Clone, Default)]
    struct Written(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Written {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn logged(log: impl FnOnce()) -> String {
        let written = Written::default();
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
}
