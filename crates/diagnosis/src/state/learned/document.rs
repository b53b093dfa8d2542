//! What was learnt and judged, as machine output has it.

use serde_json::{Value, json};

use super::judge::{ChannelSummary, ChannelVerdict};
use super::kind::FittedKind;
use super::learning::Learnt;

impl ChannelVerdict {
    /// The verdict by the names of the channels. A faulty channel has its kind, size and expected reading besides.
    #[must_use]
    pub fn document(&self, names: &[String]) -> Value {
        let ChannelVerdict { channel, state, first, last, lasts, reason, fault } = self;
        let mut document = json!({
            "component": channel.map(|channel| &names[channel]),
            "state": state.as_str(),
            "first_index": first,
            "last_index": last,
            "lasts": lasts,
            "reason": reason,
        });
        if let Some(FittedKind { kind, decided, size, expected, within }) = *fault {
            document["kind"] = kind.as_str().into();
            document["decided"] = decided.into();
            document["size"] = size.value.into();
            document["expected"] = expected.into();
            document["expected_low"] = (expected - within).into();
            document["expected_high"] = (expected + within).into();
        }
        document
    }
}

impl ChannelSummary {
    /// The summary of one channel.
    #[must_use]
    pub fn document(&self) -> Value {
        let (state, first, normal) = (self.state.as_str(), self.first, self.normal);
        json!({ "state": state, "first_index": first, "normal_share": normal })
    }
}

impl Learnt {
    /// What should be known of the module: its channels, and what was left out.
    #[must_use]
    pub fn document(&self) -> Value {
        let module = &self.module;
        let channels = module.channels.iter().enumerate().map(|(k, channel)| {
            json!({
                "name": channel.name,
                "role": if k < module.sensors { "sensor" } else { "input" },
                "lowest": channel.lowest,
                "highest": channel.highest,
                "explained": self.explained.get(k),
                "smallest_found": channel.smallest_found,
                "can_be_judged": !channel.is_beyond_judging(),
            })
        });
        let left_out = self.cleaned.iter().map(|interval| {
            let (first, last) = interval.samples;
            json!({
                "recording": interval.recording,
                "channel": interval.channel,
                "first_index": first,
                "last_index": last,
            })
        });
        json!({
            "recordings": module.recordings,
            "hours": module.hours,
            "window_s": module.window_s,
            "channels": channels.collect::<Vec<_>>(),
            "left_out": left_out.collect::<Vec<_>>(),
        })
    }
}
