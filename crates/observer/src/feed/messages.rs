//! Decodes the messages that the feed handles.

use vocabulary::{
    FaultTransition, Identification, Key, Message, ModuleName, ModuleStatus, PhaseChange,
    PlantTopic, StructureName, Topic, keys::PLANT,
};

use super::ModuleKey;
use crate::view::News;

/// A message, or a liveliness token that appeared or disappeared.
#[derive(Debug, Clone)]
pub enum Incoming {
    /// The state of a component.
    Transition(Box<FaultTransition>),
    /// The kind of a fault.
    Identification(Box<Identification>),
    /// A module's phase.
    Phase(PhaseChange),
    /// A module's status.
    Status(Box<ModuleStatus>),
    /// A module's liveliness token appeared (`true`) or disappeared (`false`).
    Token(ModuleKey, bool),
    /// The liveliness token of the plant, or a message that cannot be read.
    Other(News),
}

/// Decodes a published message or the reply to a query.
pub fn message(key: &str, bytes: &[u8]) -> Option<Incoming> {
    let read = match key.parse::<Key>() {
        Ok(Key::Module { structure, module, topic }) => {
            let key = (structure, module);
            match topic {
                Topic::Fault(_) => {
                    own(&key, bytes, |read: &FaultTransition| (&read.structure, &read.module))
                        .map(|read| Incoming::Transition(Box::new(read)))
                }
                Topic::Identification(_) => {
                    own(&key, bytes, |read: &Identification| (&read.structure, &read.module))
                        // Only replies to queries carry the signature; removed, the reply equals the published message.
                        .map(|read| {
                            Incoming::Identification(Box::new(Identification {
                                signature: None,
                                ..read
                            }))
                        })
                }
                Topic::Phase => {
                    own(&key, bytes, |read: &PhaseChange| (&read.structure, &read.module))
                        .map(Incoming::Phase)
                }
                Topic::Status => {
                    own(&key, bytes, |read: &ModuleStatus| (&read.structure, &read.module))
                        .map(|read| Incoming::Status(Box::new(read)))
                }
                _ => return None,
            }
        }
        Ok(Key::Plant { .. }) => return None,
        Err(error) => Err(error.to_string()),
    };
    let unreadable = |problem| Incoming::Other(News::Unreadable { key: key.to_owned(), problem });
    Some(read.unwrap_or_else(unreadable))
}

/// Decodes a message and checks that it is about the module that its key names.
fn own<M: Message>(
    (structure, module): &ModuleKey,
    bytes: &[u8],
    names: impl Fn(&M) -> (&StructureName, &ModuleName),
) -> Result<M, String> {
    let message: M = vocabulary::decode(bytes).map_err(|error| error.to_string())?;
    if names(&message) == (structure, module) {
        return Ok(message);
    }
    Err(format!("the {} names another module than its key", M::WHAT))
}

/// Decodes the key of a liveliness token that appeared, or disappeared.
pub fn token(key: &str, there: bool) -> Option<Incoming> {
    match key.parse::<Key>().ok()? {
        Key::Module { structure, module, topic: Topic::Alive } => {
            Some(Incoming::Token((structure, module), there))
        }
        Key::Plant { structure, topic: PlantTopic::Alive } => {
            let who = PLANT.to_owned();
            Some(Incoming::Other(News::Presence { structure, who, there, at_start: false }))
        }
        Key::Module { .. } | Key::Plant { .. } => None,
    }
}
