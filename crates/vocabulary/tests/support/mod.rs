//! Every topic that there is. The matches make a new one fail to compile here.

use vocabulary::{OrderKind, PlantTopic, Topic};

/// A module's topics but for faults and identifications, which have one for each component.
pub fn plain_topics() -> Vec<Topic> {
    let mut topics = vec![
        Topic::Sample,
        Topic::Divergence,
        Topic::Corrected,
        Topic::Capability,
        Topic::Change,
        Topic::State,
        Topic::Status,
        Topic::Progress,
        Topic::Phase,
        Topic::History,
        Topic::Input,
        Topic::Configuration,
        Topic::FreezeFrame,
        Topic::Alive,
    ];
    for kind in OrderKind::ALL {
        topics.push(Topic::Command(kind));
        topics.push(Topic::CommandOf(kind, "ada".parse().unwrap()));
    }
    for topic in &topics {
        match topic {
            Topic::Sample | Topic::Divergence | Topic::Corrected | Topic::Capability => {}
            Topic::Change | Topic::State => {}
            Topic::Fault(_) | Topic::Identification(_) => {}
            Topic::Status | Topic::Progress | Topic::Phase | Topic::History | Topic::Alive => {}
            Topic::Input | Topic::Configuration | Topic::FreezeFrame => {}
            Topic::Command(kind) | Topic::CommandOf(kind, _) => match kind {
                OrderKind::Acknowledge | OrderKind::Reset => {}
                OrderKind::Shelve | OrderKind::Unshelve => {}
                OrderKind::Suppress | OrderKind::Unsuppress => {}
                OrderKind::ShutOff | OrderKind::PutBack | OrderKind::Declare => {}
            },
        }
    }
    topics
}

/// The plant's topics.
pub fn plant_topics() -> [PlantTopic; 4] {
    let topics = [PlantTopic::Inject, PlantTopic::Stroke, PlantTopic::Status, PlantTopic::Alive];
    for topic in topics {
        match topic {
            PlantTopic::Inject | PlantTopic::Stroke => {}
            PlantTopic::Status | PlantTopic::Alive => {}
        }
    }
    topics
}
