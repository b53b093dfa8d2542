//! The whole system on virtual time in one process, driven by a seed: a plant, its modules' processes as they run on the
//! module computers ([`process::ModuleProcess`]), their disks, clocks and network, operators, and everything that goes
//! wrong. After each event, and at the end, it is checked what must never happen; what must sometimes happen is counted.
//!
//! | file | what |
//! |---|---|
//! | `setup` | the structure, calibrated and commissioned once |
//! | `scenario` | what happens in a world, drawn from its seed |
//! | `world` | the queue of events; a file each for the structure, the computers, what goes out, queries, disturbances |
//! | `module`, `disk` | a module's computer |
//! | `view` | a view that watches from outside |
//! | `check` | what must never happen |
//! | `coverage`, `notes` | what must sometimes happen |
//! | `trace`, `story` | what happened, in words and as a picture |
//! | `campaign` | many seeds, and the smallest scenario in which something is wrong |
//!
//! Moved here from the daemon is nothing but what waits: the threads' queues, the timeouts of queries, the way to the
//! network and the disk. What they decide is the very code of the processes.

mod campaign;
mod check;
mod coverage;
mod disk;
mod module;
mod notes;
mod scenario;
mod setup;
mod story;
mod trace;
mod view;
mod world;

pub use campaign::{SeedResult, SeedSummary, missing, run, run_all, shrink};
pub use coverage::{ReachedHistories, SOMETIMES};
pub use scenario::{Disturbance, DisturbanceKind, KillMoment, TimedOrder, WorldScenario};
pub use setup::{Setup, SimulationError};
pub use story::svg;
pub use trace::WorldTrace;
pub use world::{Outcome, World};
