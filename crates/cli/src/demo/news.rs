//! What the parent receives from plant and diagnosers.

use names::ModuleName;
use wire::{
    ChangeReport, DecodeError, FaultTransition, Identification, Key, ModuleStatus, PlantStatus,
    PlantTopic, Progress, Topic, decode,
};

/// A message.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum News {
    /// A channel changed.
    Change(ChangeReport),
    /// A verdict changed.
    Transition(FaultTransition),
    /// The kind of a fault became known.
    Identification(Identification),
    /// The status of a module.
    Module(ModuleStatus),
    /// The status of the plant.
    Plant(PlantStatus),
    /// The progress of a module.
    Progress(ModuleName, Progress),
    /// A process appeared or vanished.
    Alive { process: String, there: bool },
    /// Nothing that could be understood.
    Unreadable(String),
}

/// Reads a message by its key; `None` if it is of no interest.
pub(super) fn read(key: &str, payload: &[u8]) -> Option<News> {
    let news = match key.parse::<Key>() {
        Ok(key) => read_known(key, payload)?,
        Err(error) => return Some(News::Unreadable(format!("key `{key}`: {error}"))),
    };
    Some(news.unwrap_or_else(|error| News::Unreadable(format!("message on `{key}`: {error}"))))
}

fn read_known(key: Key, payload: &[u8]) -> Option<Result<News, DecodeError>> {
    let news = match key {
        Key::Module { topic: Topic::Change, .. } => decode(payload).map(News::Change),
        Key::Module { topic: Topic::Fault(_), .. } => decode(payload).map(News::Transition),
        Key::Module { topic: Topic::Identification(_), .. } => {
            decode(payload).map(News::Identification)
        }
        Key::Module { topic: Topic::Status, .. } => decode(payload).map(News::Module),
        Key::Module { topic: Topic::Progress, module, .. } => {
            decode(payload).map(|progress| News::Progress(module, progress))
        }
        Key::Plant { topic: PlantTopic::Status, .. } => decode(payload).map(News::Plant),
        Key::Module { .. } | Key::Plant { .. } => return None,
    };
    Some(news)
}

/// Reads the appearance or disappearance of a liveliness token.
pub(super) fn read_token(key: &str, there: bool) -> Option<News> {
    let process = match key.parse::<Key>().ok()? {
        Key::Module { module, topic: Topic::Alive, .. } => module.to_string(),
        Key::Plant { topic: PlantTopic::Alive, .. } => wire::keys::PLANT.to_owned(),
        Key::Module { .. } | Key::Plant { .. } => return None,
    };
    Some(News::Alive { process, there })
}
