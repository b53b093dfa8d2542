//! What every process shares around its work.
//!
//! | module | what |
//! |---|---|
//! | [`runtime`], [`shutdown`], [`opening`], [`exit`] | start, request to end, session meanwhile, exit code |
//! | [`environment`] | variables that a process runs better with; as many connections as the system allows |
//! | [`logging`] | to the journal of systemd or to standard error; clients that Zenoh refuses are logged, too |
//! | [`supervision`] | readiness, status, watchdog heartbeat |
//! | [`health`] | the same and metrics over HTTP |
//! | [`clock`], [`occurrences`] | times in messages; what happens often, logged seldom |

pub mod clock;
pub mod environment;
pub mod exit;
pub mod health;
pub mod logging;
pub mod occurrences;
pub mod opening;
pub mod runtime;
pub mod shutdown;
pub mod supervision;
