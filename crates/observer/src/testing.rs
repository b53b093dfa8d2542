//! Messages for the tests of this crate.

use names::{RunId, Step};
use wire::{ModulePhase, ModuleStatus, PeerStatus};

/// A status of a module of the tower, in service, that names these peers.
pub(crate) fn status(module: &str, peers: &[&str]) -> ModuleStatus {
    let waiting = ModuleStatus::waiting("tower".parse().unwrap(), module.parse().unwrap());
    ModuleStatus {
        phase: ModulePhase::InService,
        in_service_since_step: Some(Step(1)),
        run: Some(RunId(1)),
        step: Some(Step(9)),
        lag_ms: Some(1.0),
        peers: peers.iter().map(|peer| PeerStatus::unasked(peer.parse().unwrap())).collect(),
        time_unix_ns: 5,
        ..waiting
    }
}
