//! What a message says, if it is one of those that are of interest.

use vocabulary::{
    DecodeError, FaultTransition, Identification, Key, Message, ModuleStatus, PhaseChange,
    PlantTopic, Topic, keys::PLANT,
};
use zenoh::sample::{Sample, SampleKind};

use super::continuity::Whose;
use crate::view::News;

/// Something that has arrived.
#[derive(Debug, Clone)]
pub(super) enum Arrival {
    Transition(Box<FaultTransition>),
    Identification(Box<Identification>),
    Phase(PhaseChange),
    Status(Box<ModuleStatus>),
    /// A module's token has appeared, or disappeared.
    Token(Whose, bool),
    /// The plant's.
    Other(News),
}

/// A message that was published, or is the reply to a query.
pub(super) fn message(sample: &Sample) -> Option<Arrival> {
    let key = sample.key_expr().as_str();
    let bytes = sample.payload().to_bytes();
    let read = match key.parse::<Key>() {
        Ok(Key::Module { structure, module, topic }) => {
            let whose = Whose { structure, module };
            match topic {
                Topic::Fault(_) => transition(&whose, &bytes),
                Topic::Identification(_) => identification(&whose, &bytes),
                Topic::Phase => phase(&whose, &bytes),
                Topic::Status => status(&whose, &bytes),
                _ => return None,
            }
        }
        Ok(Key::Plant { .. }) => return None,
        Err(error) => Err(error.to_string()),
    };
    let unreadable = |problem| Arrival::Other(News::Unreadable { key: key.to_owned(), problem });
    Some(read.unwrap_or_else(unreadable))
}

fn transition(whose: &Whose, bytes: &[u8]) -> Result<Arrival, String> {
    let message: FaultTransition = decode(bytes)?;
    let named = (&message.structure, &message.module);
    is_of::<FaultTransition>(whose, named)?;
    Ok(Arrival::Transition(Box::new(message)))
}

fn identification(whose: &Whose, bytes: &[u8]) -> Result<Arrival, String> {
    let message: Identification = decode(bytes)?;
    is_of::<Identification>(whose, (&message.structure, &message.module))?;
    // A signature is only in answers; the same without it is what is published.
    Ok(Arrival::Identification(Box::new(Identification { signature: None, ..message })))
}

fn phase(whose: &Whose, bytes: &[u8]) -> Result<Arrival, String> {
    let message: PhaseChange = decode(bytes)?;
    is_of::<PhaseChange>(whose, (&message.structure, &message.module))?;
    Ok(Arrival::Phase(message))
}

fn status(whose: &Whose, bytes: &[u8]) -> Result<Arrival, String> {
    let message: ModuleStatus = decode(bytes)?;
    is_of::<ModuleStatus>(whose, (&message.structure, &message.module))?;
    Ok(Arrival::Status(Box::new(message)))
}

fn decode<M: Message>(bytes: &[u8]) -> Result<M, String> {
    vocabulary::decode(bytes).map_err(|error: DecodeError| error.to_string())
}

fn is_of<M: Message>(
    whose: &Whose,
    (structure, module): (&vocabulary::StructureName, &vocabulary::ModuleName),
) -> Result<(), String> {
    if *structure == whose.structure && *module == whose.module {
        return Ok(());
    }
    Err(format!("the {} names another module than its key", M::WHAT))
}

/// Whose token it is that came or went.
pub(super) fn token(sample: &Sample) -> Option<Arrival> {
    let there = sample.kind() == SampleKind::Put;
    match sample.key_expr().as_str().parse::<Key>().ok()? {
        Key::Module { structure, module, topic: Topic::Alive } => {
            Some(Arrival::Token(Whose { structure, module }, there))
        }
        Key::Plant { structure, topic: PlantTopic::Alive } => {
            let who = PLANT.to_owned();
            Some(Arrival::Other(News::Presence { structure, who, there }))
        }
        Key::Module { .. } | Key::Plant { .. } => None,
    }
}
