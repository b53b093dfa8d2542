//! A laboratory: every process in a network namespace of its own, all joined by one switch in the
//! test process, so that the network between any two of them can be made as bad as wanted.
//!
//! | file | job |
//! |---|---|
//! | `missing` | which facility this machine lacks |
//! | `node` | the nodes |
//! | `names` | names of a laboratory and its parts, and their owner |
//! | `namespace` | a network namespace and its end |
//! | `tap` | a node's network card, whose other end the test process holds |
//! | `impairment` | what happens to frames of one node to another |
//! | `link` | the seeded decision about each frame, and the count of decisions |
//! | `frame` | source and destination of a frame |
//! | `delay_line` | frames that arrive later |
//! | `switch` | frames from card to card |
//! | `program` | the program `ip` |
//!
//! Needs network administration capabilities. Without them a test that wants a laboratory fails and names the facility
//! that is missing; `cargo test` runs none of these tests unless ignored ones are asked for.

mod delay_line;
mod frame;
mod impairment;
mod link;
mod missing;
mod names;
mod namespace;
mod node;
mod program;
mod switch;
mod tap;

use std::net::Ipv4Addr;
use std::process::Command;

pub use impairment::Impairment;
pub use link::Tally;
pub use missing::Missing;
pub use node::Node;

use names::Names;
use namespace::Namespace;
use switch::Switch;

/// Namespaces and the switch between them; all gone when it is dropped.
pub struct Lab {
    names: Names,
    // Before the namespaces: the switch lets go of the cards in them.
    switch: Switch,
    namespaces: Vec<Namespace>,
}

impl Lab {
    /// Sets up a laboratory with a network in perfect order. The seed decides about every frame.
    ///
    /// # Errors
    /// The facility that this machine lacks.
    pub fn start(seed: u64) -> Result<Self, Missing> {
        missing::check()?;
        names::remove_leftovers();
        let (names, observer) = tap::claim()?;
        let inside = || Node::ALL.into_iter().filter(|node| *node != Node::Observer);
        let namespaces: Vec<Namespace> =
            inside().map(|node| Namespace::add(names.namespace(node))).collect::<Result<_, _>>()?;
        let mut cards = Vec::new();
        for (node, namespace) in inside().zip(&namespaces) {
            let card = namespace.enter(|| tap::create(&names, node))?;
            cards.push(card);
        }
        cards.push(observer);
        let switch = Switch::start(cards, seed).map_err(Missing::io("threads of the switch"))?;
        Ok(Self { names, switch, namespaces })
    }

    /// A laboratory.
    ///
    /// # Panics
    /// If this machine cannot have one.
    #[must_use]
    pub fn required(seed: u64) -> Self {
        Self::start(seed).unwrap_or_else(|missing| panic!("no laboratory: {missing}"))
    }

    /// The same.
    ///
    /// # Panics
    /// If this machine cannot have one.
    #[must_use]
    pub fn if_possible(seed: u64) -> Option<Self> {
        Some(Self::required(seed))
    }

    /// The node's address.
    #[must_use]
    pub fn address(&self, node: Node) -> Ipv4Addr {
        self.names.address(node)
    }

    /// A program that will run where the node is. The process that is spawned becomes the program, so
    /// its number is the program's.
    #[must_use]
    pub fn command(&self, node: Node, program: Command) -> Command {
        match self.namespace(node) {
            Some(namespace) => namespace.command(&program),
            None => program,
        }
    }

    /// Does something where the node is; sockets that are made there stay there.
    pub fn inside<T: Send>(&self, node: Node, work: impl FnOnce() -> T + Send) -> T {
        match self.namespace(node) {
            Some(namespace) => namespace.enter(work),
            None => work(),
        }
    }

    /// The observer is the test process and stays where it is.
    fn namespace(&self, node: Node) -> Option<&Namespace> {
        self.namespaces.get(node.index())
    }

    /// Impairs what one node sends to another, from now on.
    pub fn impair(&self, from: Node, to: Node, impairment: Impairment) {
        self.switch.link(from, to).impair(impairment);
    }

    /// Impairs what two nodes send to each other, from now on.
    pub fn impair_between(&self, one: Node, other: Node, impairment: Impairment) {
        self.impair(one, other, impairment);
        self.impair(other, one, impairment);
    }

    /// Everything that is sent from now on arrives at once.
    pub fn heal(&self) {
        for (from, to) in Node::pairs() {
            self.impair(from, to, Impairment::default());
        }
    }

    /// What became of the frames of one node to another so far.
    #[must_use]
    pub fn tally(&self, from: Node, to: Node) -> Tally {
        self.switch.link(from, to).tally()
    }
}
