//! Names of a laboratory and its parts, and their owner.
//!
//! A laboratory has a number that no other on this machine has at the time. It is in its subnet and in the
//! observer's card. A number is free again before its namespaces are gone, so these have another one, that
//! is never used twice, and name the process that made them.

use std::net::Ipv4Addr;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use super::namespace;
use super::node::Node;

/// Numbers that can be had; the rest of the subnets is left to others.
pub(super) const NUMBERS: u32 = 200;

const PREFIX: &str = "trusswatch";

/// Names of one laboratory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Names {
    number: u8,
    /// How many came before in this process.
    serial: u32,
}

static SERIAL: AtomicU32 = AtomicU32::new(0);

impl Names {
    /// The `attempt`-th number to try.
    pub(super) fn attempt(attempt: u32) -> Self {
        let number = (std::process::id() + attempt) % NUMBERS;
        let serial = SERIAL.fetch_add(1, Ordering::Relaxed);
        Self { number: u8::try_from(number).unwrap(), serial }
    }

    /// At most 15 bytes, the kernel's limit. Only the observer's is among cards of others.
    pub(super) fn card(&self, node: Node) -> String {
        match node {
            Node::Observer => format!("twlab{}", self.number),
            _ => "lab".to_string(),
        }
    }

    pub(super) fn namespace(&self, node: Node) -> String {
        format!("{PREFIX}-{}-{}-{}", std::process::id(), self.serial, node.name())
    }

    pub(super) fn address(&self, node: Node) -> Ipv4Addr {
        let host = u8::try_from(node.index()).unwrap() + 1;
        Ipv4Addr::new(10, 213, self.number, host)
    }
}

/// Removes what terminated processes have left behind; killed ones cannot do it themselves.
pub(super) fn remove_leftovers() {
    for name in namespace::existing() {
        if maker(&name).is_some_and(|pid| !Path::new("/proc").join(pid.to_string()).exists()) {
            namespace::remove_with_processes(&name);
        }
    }
}

/// The process that made a namespace, if it was one of ours.
fn maker(name: &str) -> Option<u32> {
    let rest = name.strip_prefix(PREFIX)?.strip_prefix('-')?;
    rest.split('-').next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_namespace_tells_its_maker_and_foreign_ones_tell_nothing() {
        let own = Names::attempt(0).namespace(Node::Plant);
        assert_eq!(maker(&own), Some(std::process::id()));
        for foreign in ["trusswatch", "trusswatch-", "trusswatch-x-1-plant", "other-12-1-plant"] {
            assert_eq!(maker(foreign), None, "{foreign}");
        }
    }

    #[test]
    fn every_attempt_has_another_subnet() {
        let subnets: std::collections::BTreeSet<_> =
            (0..NUMBERS).map(|attempt| Names::attempt(attempt).address(Node::Plant)).collect();
        assert_eq!(subnets.len(), NUMBERS as usize);
    }
}
