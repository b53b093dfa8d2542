//! Divergences as objects keyed by component, because viewers plot by name, not by position in an array.

use serde_json::{Map, Number, Value, json};
use vocabulary::Divergences;

use crate::Recorded;

/// Suffix of the topic, after that of the divergences.
pub(crate) const BY_COMPONENT: &str = "/by-component";
/// Name of its schema.
pub(crate) const NAME: &str = "divergences-by-component";

/// The same divergences keyed by component, on the topic `…/{module}/divergence/by-component`; `None` of any other
/// message.
#[must_use]
pub fn by_component(message: &Recorded) -> Option<Recorded> {
    if !message.topic.ends_with("/divergence") {
        return None;
    }
    let divergences: Divergences = vocabulary::decode(&message.payload).ok()?;
    let payload = keyed(&divergences).to_string().into_bytes();
    let topic = format!("{}{BY_COMPONENT}", message.topic);
    Some(Recorded { topic, payload, ..*message })
}

fn keyed(divergences: &Divergences) -> Value {
    let [mut residual, mut divergence, mut ratio] = [(); 3].map(|()| Map::new());
    for channel in &divergences.channels {
        let name = channel.component.to_string();
        residual.insert(name.clone(), number(Some(channel.residual)));
        let share = channel.divergence.map(|divergence| divergence / channel.threshold);
        ratio.insert(name.clone(), number(share));
        divergence.insert(name, number(channel.divergence));
    }
    json!({
        "run": divergences.run,
        "step": divergences.step,
        "time_unix_ns": divergences.time_unix_ns,
        "residual": residual,
        "divergence": divergence,
        "ratio": ratio,
    })
}

/// Values that are not finite are `null`.
fn number(value: Option<f64>) -> Value {
    value.and_then(Number::from_f64).map_or(Value::Null, Value::Number)
}

/// The JSON Schema of these messages.
pub(crate) fn schema() -> Value {
    let values = |what: &str| {
        json!({
            "description": format!("{what}, by component, e.g. `sensor/g1`."),
            "type": "object",
            "additionalProperties": { "type": ["number", "null"] },
        })
    };
    let count = |what: &str| json!({ "description": what, "type": "integer", "minimum": 0 });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "DivergencesByComponent",
        "description": "Divergences of a module at one step, keyed by component. Derived by the recorder.",
        "type": "object",
        "properties": {
            "run": count("The run that the step is counted in."),
            "step": count("The step."),
            "time_unix_ns": count("When the divergences were published [ns since 1970]."),
            "residual": values("The residual: [N] of an actuator, [m] of a gage"),
            "divergence": values("The divergence; null while undefined"),
            "ratio": values("The divergence over its threshold; null while undefined"),
        },
        "required": ["run", "step", "time_unix_ns", "residual", "divergence", "ratio"],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channels::entry_of;

    /// The catalogue's example of the message on this topic.
    fn example(topic: &str) -> Recorded {
        let payload = entry_of(topic).unwrap().example().as_bytes().to_vec();
        Recorded::received(topic.to_owned(), payload, 1)
    }

    #[test]
    fn divergences_are_keyed_by_component() {
        let message = example("trusswatch/tower/module1/divergence");
        let original: Divergences = vocabulary::decode(&message.payload).unwrap();
        let derived = by_component(&message).unwrap();
        assert_eq!(derived.topic, "trusswatch/tower/module1/divergence/by-component");
        assert_eq!(
            (derived.time_unix_ns, derived.sequence),
            (message.time_unix_ns, message.sequence)
        );
        let value: Value = serde_json::from_slice(&derived.payload).unwrap();
        for channel in &original.channels {
            let name = channel.component.to_string();
            assert_eq!(value["residual"][&name], json!(channel.residual));
            assert_eq!(value["divergence"][&name], json!(channel.divergence));
            let ratio = channel.divergence.map(|divergence| divergence / channel.threshold);
            assert_eq!(value["ratio"][&name], json!(ratio));
        }
    }

    #[test]
    fn nothing_is_derived_from_other_messages() {
        assert_eq!(by_component(&example("trusswatch/tower/module1/sample")), None);
        let damaged = Recorded { payload: b"{".to_vec(), ..example("trusswatch/t/m/divergence") };
        assert_eq!(by_component(&damaged), None);
    }
}
