//! How the channels are watched: all alike, or each as in its module's configuration.

use diagnosis::divergence::{DivergenceSettings, Interval};

/// How one channel is watched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Tuning {
    /// ε, in squared units of the channel.
    pub(super) prior_scatter: f64,
    /// γ; infinite if nothing is to count as a change.
    pub(super) threshold: f64,
}

/// Channels that have their settings in common; they stand side by side.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) settings: DivergenceSettings,
    /// Vectors that must have been taken before a change counts.
    pub(super) warm_up: u64,
    /// Rows below the threshold after which a change is over.
    pub(super) quiet_steps: u64,
    pub(super) channels: Vec<Tuning>,
}

/// How all channels of a table are watched.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    /// In the order of the channels.
    pub(super) groups: Vec<Group>,
    /// The same in words.
    pub(super) words: String,
}

impl Plan {
    /// All channels alike.
    pub(super) fn alike(group: Group) -> Plan {
        let DivergenceSettings { window, lag, interval } = group.settings;
        let interval = match interval {
            Interval::Growing => "all vectors since the start".to_owned(),
            Interval::Sliding { vectors } => format!("the last {vectors} vectors"),
        };
        let threshold = match group.channels.first() {
            Some(tuning) if tuning.threshold.is_finite() => {
                format!("threshold {}", tuning.threshold)
            }
            _ => "no threshold: nothing counts as a change".to_owned(),
        };
        let words = format!("window {window}, lag {lag}, {interval}; {threshold}");
        Plan { groups: vec![group], words }
    }

    /// Can anything count as a change?
    pub(super) fn has_threshold(&self) -> bool {
        let mut channels = self.groups.iter().flat_map(|group| &group.channels);
        channels.any(|tuning| tuning.threshold.is_finite())
    }
}
