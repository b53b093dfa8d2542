//! Directions of motion, and supports.

use std::fmt;

use serde::{Deserialize, Serialize};

/// A direction in which a node can move or rotate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Direction {
    /// Along the global x axis.
    #[serde(rename = "x")]
    X,
    /// Along the global y axis.
    #[serde(rename = "y")]
    Y,
    /// Upwards.
    #[serde(rename = "z")]
    Z,
    /// About the global x axis.
    #[serde(rename = "rx")]
    RotationX,
    /// About the global y axis.
    #[serde(rename = "ry")]
    RotationY,
    /// About the vertical: twist.
    #[serde(rename = "rz")]
    RotationZ,
}

impl Direction {
    /// All six, translations first.
    pub const ALL: [Direction; 6] = [
        Direction::X,
        Direction::Y,
        Direction::Z,
        Direction::RotationX,
        Direction::RotationY,
        Direction::RotationZ,
    ];

    /// Position in [`Direction::ALL`].
    #[must_use]
    pub fn index(self) -> usize {
        self as usize
    }

    /// True of the three rotations.
    #[must_use]
    pub fn is_rotation(self) -> bool {
        self.index() >= 3
    }
}

/// The name used in files: `x`, `y`, `z`, `rx`, `ry` or `rz`.
impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// The directions in which a node is fixed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Support([bool; 6]);

impl Support {
    /// Not fixed.
    pub const FREE: Support = Support([false; 6]);
    /// Fixed in all six directions.
    pub const CLAMPED: Support = Support([true; 6]);

    /// Whether the node is fixed in this direction.
    #[must_use]
    pub fn holds(&self, direction: Direction) -> bool {
        self.0[direction.index()]
    }

    /// Whether the node is fixed in any direction.
    #[must_use]
    pub fn is_any(&self) -> bool {
        self.0.contains(&true)
    }

    /// The fixed directions, translations first.
    pub fn directions(&self) -> impl Iterator<Item = Direction> + '_ {
        Direction::ALL.into_iter().filter(|&direction| self.holds(direction))
    }
}

impl FromIterator<Direction> for Support {
    fn from_iter<I: IntoIterator<Item = Direction>>(directions: I) -> Self {
        let mut support = Support::FREE;
        for direction in directions {
            support.0[direction.index()] = true;
        }
        support
    }
}
