//! A layer between events and where they are logged, which changes what they say.

use tracing::field::Value;
use tracing::{Event, Subscriber};
use tracing_subscriber::Layer;
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// Of each field of an event the value, at the field's place.
pub(super) type Values = Vec<Option<Box<dyn Value>>>;

/// What an event is to say; `None` if it stays as it is.
pub(super) type Rewrite = fn(&Event<'_>) -> Option<Values>;

/// Passes each event on to another layer, rewritten.
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
