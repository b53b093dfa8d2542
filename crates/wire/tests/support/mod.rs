//! Every topic that there is. The matches make a new one fail to compile here.

use wire::{OrderKind, PlantTopic, Topic};

/// A module's topics but for faults and identifications, which have one for each component.
pub fn plain_topics() -> Vec<Topic> {
    let topics = vec![
        Topic::Sample,
        Topic::Divergence,
        Topic::Change,
        Topic::State,
        Topic::Status,
        Topic::Progress,
        Topic::Phase,
        Topic::History,
        Topic::Input,
        Topic::Configuration,
        Topic::FreezeFrame,
        Topic::Command(OrderKind::Acknowledge),
        Topic::Command(OrderKind::Reset),
        Topic::CommandOf(OrderKind::Acknowledge, "ada".parse().unwrap()),
        Topic::CommandOf(OrderKind::Reset, "ada".parse().unwrap()),
        Topic::Alive,
    ];
    for topic in &topics {
        match topic {
            Topic::Sample | Topic::Divergence | Topic::Change | Topic::State => {}
            Topic::Fault(_) | Topic::Identification(_) => {}
            Topic::Status | Topic::Progress | Topic::Phase | Topic::History | Topic::Alive => {}
            Topic::Input | Topic::Configuration | Topic::FreezeFrame => {}
            Topic::Command(OrderKind::Acknowledge | OrderKind::Reset) => {}
            Topic::CommandOf(OrderKind::Acknowledge | OrderKind::Reset, _) => {}
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
