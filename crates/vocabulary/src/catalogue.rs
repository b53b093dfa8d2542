//! Every message with its keys, its schema and an example: what a program in another language needs.

use serde_json::{Value, json};

use crate::encoding::{DecodeError, Message, decode};
use crate::schema::schema;
use crate::{
    Capability, ChangeReport, Corrected, Divergences, FaultTransition, FreezeFrame, HistoryPage,
    Identification, Injected, Injection, Input, ModuleConfiguration, ModuleStatus, Obeyed, Order,
    PhaseChange, PlantStatus, Progress, Refused, Sample, StateAnswer, Stroke, StrokeBegun,
};

/// How a message travels on a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Travels {
    /// Published.
    Published,
    /// As the payload of a query.
    Querying,
    /// As a reply to a query.
    Replying,
    /// As an error reply to a query.
    Refusing,
}

impl Travels {
    /// In one word.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Travels::Published => "publication",
            Travels::Querying => "query",
            Travels::Replying => "reply",
            Travels::Refusing => "error reply",
        }
    }
}

/// A kind of message.
#[derive(Debug, Clone)]
pub struct Entry {
    /// Its name, e.g. `fault-transition`.
    pub name: &'static str,
    /// Where it travels, and how. Keys stand under `trusswatch/{structure}/`; what is in braces is a name.
    pub travels: &'static [(&'static str, Travels)],
    schema: fn() -> Value,
    example: &'static str,
    accept: fn(&[u8]) -> Result<(), DecodeError>,
}

impl Entry {
    const fn of<M: Message>(
        name: &'static str,
        travels: &'static [(&'static str, Travels)],
        example: &'static str,
    ) -> Entry {
        Entry { name, travels, schema: schema::<M>, example, accept: accept::<M> }
    }

    /// Its JSON Schema, which has the example, and in the field `x-keys` where the message travels.
    #[must_use]
    pub fn schema(&self) -> Value {
        let mut schema = (self.schema)();
        let keys = self.travels.iter().map(|(key, travels)| {
            json!({ "key": format!("{}/{{structure}}/{key}", crate::keys::ROOT), "as": travels.as_str() })
        });
        if let Value::Object(fields) = &mut schema {
            fields.insert("x-keys".to_owned(), keys.collect());
            let example = serde_json::from_str(self.example).unwrap_or(Value::Null);
            fields.insert("examples".to_owned(), json!([example]));
        }
        schema
    }

    /// An example, as JSON text for people to read.
    #[must_use]
    pub fn example(&self) -> &'static str {
        self.example
    }

    /// Would its recipient accept this message?
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn check(&self, bytes: &[u8]) -> Result<(), DecodeError> {
        (self.accept)(bytes)
    }
}

fn accept<M: Message>(bytes: &[u8]) -> Result<(), DecodeError> {
    decode::<M>(bytes).map(drop)
}

macro_rules! example {
    ($name:literal) => {
        include_str!(concat!("../messages/", $name, ".json"))
    };
}

use Travels::{Published, Querying, Refusing, Replying};

/// All messages, those that are published first.
#[must_use]
pub fn catalogue() -> [Entry; 23] {
    [
        Entry::of::<Sample>(
            "sample",
            &[("{module}/sample", Published), ("{module}/sample", Replying)],
            example!("sample"),
        ),
        Entry::of::<Divergences>(
            "divergences",
            &[("{module}/divergence", Published)],
            example!("divergences"),
        ),
        Entry::of::<Corrected>(
            "corrected",
            &[("{module}/corrected", Published)],
            example!("corrected"),
        ),
        Entry::of::<Capability>(
            "capability",
            &[("{module}/capability", Published)],
            example!("capability"),
        ),
        Entry::of::<ChangeReport>("change", &[("{module}/change", Published)], example!("change")),
        Entry::of::<FaultTransition>(
            "fault-transition",
            &[
                ("{module}/fault/actuator/{name}", Published),
                ("{module}/fault/sensor/{name}", Published),
                ("{module}/fault/actuator/{name}", Replying),
                ("{module}/fault/sensor/{name}", Replying),
            ],
            example!("fault-transition"),
        ),
        Entry::of::<Identification>(
            "identification",
            &[
                ("{module}/identification/actuator/{name}", Published),
                ("{module}/identification/sensor/{name}", Published),
                ("{module}/identification/actuator/{name}", Replying),
                ("{module}/identification/sensor/{name}", Replying),
            ],
            example!("identification"),
        ),
        Entry::of::<Progress>(
            "progress",
            &[("{module}/progress", Published)],
            example!("progress"),
        ),
        Entry::of::<ModuleStatus>(
            "module-status",
            &[("{module}/status", Published)],
            example!("module-status"),
        ),
        Entry::of::<PhaseChange>(
            "phase-change",
            &[("{module}/phase", Published), ("{module}/phase", Replying)],
            example!("phase-change"),
        ),
        Entry::of::<PlantStatus>(
            "plant-status",
            &[("plant/status", Published)],
            example!("plant-status"),
        ),
        Entry::of::<StateAnswer>(
            "state-answer",
            &[("{module}/state", Replying)],
            example!("state-answer"),
        ),
        Entry::of::<HistoryPage>(
            "history-page",
            &[("{module}/history", Replying)],
            example!("history-page"),
        ),
        Entry::of::<Input>(
            "input",
            &[("{module}/input", Published), ("{module}/input", Replying)],
            example!("input"),
        ),
        Entry::of::<ModuleConfiguration>(
            "configuration",
            &[("{module}/configuration", Replying)],
            example!("configuration"),
        ),
        Entry::of::<FreezeFrame>(
            "freeze-frame",
            &[("{module}/freeze-frame", Replying)],
            example!("freeze-frame"),
        ),
        Entry::of::<Order>(
            "order",
            &[
                ("{module}/command/acknowledge", Querying),
                ("{module}/command/acknowledge/{operator}", Querying),
                ("{module}/command/reset", Querying),
                ("{module}/command/reset/{operator}", Querying),
                ("{module}/command/shelve", Querying),
                ("{module}/command/shelve/{operator}", Querying),
                ("{module}/command/unshelve", Querying),
                ("{module}/command/unshelve/{operator}", Querying),
                ("{module}/command/suppress", Querying),
                ("{module}/command/suppress/{operator}", Querying),
                ("{module}/command/unsuppress", Querying),
                ("{module}/command/unsuppress/{operator}", Querying),
                ("{module}/command/shut-off", Querying),
                ("{module}/command/shut-off/{operator}", Querying),
                ("{module}/command/put-back", Querying),
                ("{module}/command/put-back/{operator}", Querying),
                ("{module}/command/declare", Querying),
                ("{module}/command/declare/{operator}", Querying),
            ],
            example!("order"),
        ),
        Entry::of::<Obeyed>(
            "obeyed",
            &[
                ("{module}/command/acknowledge", Replying),
                ("{module}/command/acknowledge/{operator}", Replying),
                ("{module}/command/reset", Replying),
                ("{module}/command/reset/{operator}", Replying),
                ("{module}/command/shelve", Replying),
                ("{module}/command/shelve/{operator}", Replying),
                ("{module}/command/unshelve", Replying),
                ("{module}/command/unshelve/{operator}", Replying),
                ("{module}/command/suppress", Replying),
                ("{module}/command/suppress/{operator}", Replying),
                ("{module}/command/unsuppress", Replying),
                ("{module}/command/unsuppress/{operator}", Replying),
                ("{module}/command/shut-off", Replying),
                ("{module}/command/shut-off/{operator}", Replying),
                ("{module}/command/put-back", Replying),
                ("{module}/command/put-back/{operator}", Replying),
                ("{module}/command/declare", Replying),
                ("{module}/command/declare/{operator}", Replying),
            ],
            example!("obeyed"),
        ),
        Entry::of::<Injection>(
            "injection",
            &[("plant/command/inject", Querying)],
            example!("injection"),
        ),
        Entry::of::<Injected>(
            "injected",
            &[("plant/command/inject", Replying)],
            example!("injected"),
        ),
        Entry::of::<Stroke>("stroke", &[("plant/command/stroke", Querying)], example!("stroke")),
        Entry::of::<StrokeBegun>(
            "stroke-begun",
            &[("plant/command/stroke", Replying)],
            example!("stroke-begun"),
        ),
        Entry::of::<Refused>(
            "refused",
            &[
                ("{module}/sample", Refusing),
                ("{module}/fault/actuator/{name}", Refusing),
                ("{module}/fault/sensor/{name}", Refusing),
                ("{module}/identification/actuator/{name}", Refusing),
                ("{module}/identification/sensor/{name}", Refusing),
                ("{module}/state", Refusing),
                ("{module}/history", Refusing),
                ("{module}/input", Refusing),
                ("{module}/configuration", Refusing),
                ("{module}/freeze-frame", Refusing),
                ("{module}/command/acknowledge", Refusing),
                ("{module}/command/acknowledge/{operator}", Refusing),
                ("{module}/command/reset", Refusing),
                ("{module}/command/reset/{operator}", Refusing),
                ("{module}/command/shelve", Refusing),
                ("{module}/command/shelve/{operator}", Refusing),
                ("{module}/command/unshelve", Refusing),
                ("{module}/command/unshelve/{operator}", Refusing),
                ("{module}/command/suppress", Refusing),
                ("{module}/command/suppress/{operator}", Refusing),
                ("{module}/command/unsuppress", Refusing),
                ("{module}/command/unsuppress/{operator}", Refusing),
                ("{module}/command/shut-off", Refusing),
                ("{module}/command/shut-off/{operator}", Refusing),
                ("{module}/command/put-back", Refusing),
                ("{module}/command/put-back/{operator}", Refusing),
                ("{module}/command/declare", Refusing),
                ("{module}/command/declare/{operator}", Refusing),
                ("plant/command/inject", Refusing),
                ("plant/command/stroke", Refusing),
            ],
            example!("refused"),
        ),
    ]
}
