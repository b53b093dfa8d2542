//! The nodes.

/// A place in the network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Node {
    /// The plant.
    Plant,
    /// The diagnoser of the first module.
    Module1,
    /// The diagnoser of the second module.
    Module2,
    /// The test process itself.
    Observer,
}

impl Node {
    /// All of them; the observer is the last.
    pub const ALL: [Node; 4] = [Node::Plant, Node::Module1, Node::Module2, Node::Observer];

    /// The processes under test.
    pub const DEPLOYED: [Node; 3] = [Node::Plant, Node::Module1, Node::Module2];

    /// Its place in [`Node::ALL`].
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }

    /// Every ordered pair of two nodes.
    pub fn pairs() -> impl Iterator<Item = (Node, Node)> {
        let to_others = |from| Node::ALL.into_iter().map(move |to| (from, to));
        Node::ALL.into_iter().flat_map(to_others).filter(|(from, to)| from != to)
    }

    /// The name of its process in keys and configurations.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Node::Plant => "plant",
            Node::Module1 => "module1",
            Node::Module2 => "module2",
            Node::Observer => "observer",
        }
    }
}
