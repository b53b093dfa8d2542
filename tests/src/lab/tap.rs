//! A node's network card, whose other end the test process holds.

use std::sync::Arc;

use tun_rs::{DeviceBuilder, Layer, SyncDevice};

use super::missing::Missing;
use super::names::{NUMBERS, Names};
use super::node::Node;
use super::program::ip;

/// What the node sends is read from it, what is written to it the node receives: whole frames, with
/// complete checksums, since no offloading is offered. It is gone when it is dropped.
pub(super) type Card = Arc<SyncDevice>;

/// The observer's card in this process's own namespace, with the first number that is free: a card's
/// name can be had once.
pub(super) fn claim() -> Result<(Names, Card), Missing> {
    let mut refusal = None;
    for attempt in 0..NUMBERS {
        let names = Names::attempt(attempt);
        match create(&names, Node::Observer) {
            Ok(card) => return Ok((names, card)),
            Err(missing) => refusal = Some(missing),
        }
    }
    Err(refusal.unwrap_or_else(|| Missing::new("a free subnet", "all are taken")))
}

/// A node's card in the namespace of the calling thread, with its address, ready to be used.
pub(super) fn create(names: &Names, node: Node) -> Result<Card, Missing> {
    let name = names.card(node);
    let device = DeviceBuilder::new().name(&name).layer(Layer::L2).build_sync();
    let device = device.map_err(Missing::io("a TAP device"))?;
    let address = format!("{}/24", names.address(node));
    for arguments in [
        // No frames but those of the processes.
        ["link", "set", "dev", &name, "addrgenmode", "none"].as_slice(),
        &["address", "add", &address, "dev", &name],
        &["link", "set", "dev", &name, "up"],
    ] {
        ip(arguments).map_err(|reason| Missing::new("a TAP device with an address", reason))?;
    }
    Ok(Arc::new(device))
}
