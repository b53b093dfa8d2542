//! What must sometimes happen: histories that no seed reaches are not tested.

use std::collections::BTreeMap;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// What happened in how many worlds, by its words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ReachedHistories(BTreeMap<&'static str, u64>);

/// Everything that must sometimes happen.
pub const SOMETIMES: &[&str] = &[
    "a gage latched",
    "a cylinder latched",
    "a change explained by another component's",
    "a change unconfirmed",
    "an unconfirmed change latched",
    "a latched fault acknowledged",
    "a fault reset",
    "an order refused",
    "an order obeyed about a healthy component",
    "an order without a reply",
    "shelved while latched",
    "shelved and latched afterwards",
    "latched while cut off",
    "latched while a peer is down",
    "latched while a peer is frozen",
    "latched while messages are lost",
    "latched while messages are late",
    "latched while another publisher sends",
    "latched while the disk hangs",
    "latched while the disk is full",
    "latched while the disk is slow",
    "latched with a wrong clock",
    "latched, repaired and restarted",
    "latched before a restart and known after it",
    "killed while a record was being written",
    "killed between a change and its verdict",
    "killed with a question under way",
    "killed twice",
    "killed while catching up",
    "a process two seconds behind",
    "samples that the publisher has no more",
    "a journal's third file",
    "power lost with records that no disk had",
    "a number given again after a loss of power",
    "restarted on a full disk",
    "restarted while cut off",
    "a fault began while its module was down",
    "a fault began while its module was frozen",
    "a fault began while its module was deaf",
    "a fault began while the publisher was silent",
    "a fault ended while its module was down",
    "two faults at once",
    "a second fault while the first is unconfirmed",
    "two faults in one module",
    "faults in two modules",
    "no fault at all",
    "a gage lost its value",
    "a gage that is faulty lost its value",
    "samples fetched from the publisher",
    "a fetch in vain",
    "a fetch of more than a thousand samples",
    "samples dropped because too many waited",
    "a backlog dropped",
    "another publisher's samples put aside",
    "another publisher taken over",
    "a new run began",
    "a question answered",
    "a question refused",
    "a question timed out",
    "a question to a peer that is down",
    "a peer asked again after it came back",
    "a peer that broke its word",
    "a liar asked",
    "samples waited for a peer's answer",
    "the wait for a peer's answer expired",
    "a fault published although the disk hangs",
    "a fault published although the disk refuses",
    "a record written after the disk came back",
    "a new file of the journal",
    "the controller used what a gage should read",
    "the controller did without a cylinder",
    "a cylinder was shut off",
    "a view found a fault when it connected",
    "a view missed transitions for good",
    "a view was cut off",
    "a view asked for what it missed",
    "a module stale",
    "a module in service again",
    "a fault identified",
    "an identification decided",
    "an identification changed",
];

/// Written as what was reached in a world.
impl Serialize for ReachedHistories {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.0.keys())
    }
}

/// What another version calls by other words is left out.
impl<'de> Deserialize<'de> for ReachedHistories {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let words = Vec::<String>::deserialize(deserializer)?;
        let known = SOMETIMES.iter().filter(|what| words.iter().any(|word| word == *what));
        Ok(Self(known.map(|what| (*what, 1)).collect()))
    }
}

impl ReachedHistories {
    /// It happened.
    ///
    /// # Panics
    /// It is not in [`SOMETIMES`].
    pub(crate) fn reach(&mut self, what: &'static str) {
        debug_assert!(SOMETIMES.contains(&what), "`{what}` is not in the list");
        self.0.entry(what).or_insert(1);
    }

    /// Adds another world's.
    pub fn merge(&mut self, other: &Self) {
        for (what, times) in &other.0 {
            *self.0.entry(what).or_default() += times;
        }
    }

    /// In how many worlds something happened.
    #[must_use]
    pub fn times(&self, what: &str) -> u64 {
        self.0.get(what).copied().unwrap_or(0)
    }

    /// What never happened.
    pub fn unreached(&self) -> impl Iterator<Item = &'static str> {
        SOMETIMES.iter().copied().filter(|what| !self.0.contains_key(what))
    }
}
