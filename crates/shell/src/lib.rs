//! Services common to all processes.
//!
//! | module | what |
//! |---|---|
//! | [`runtime`], [`shutdown`], [`opening`], [`exit`] | start, shutdown, opening of the session, exit code |
//! | [`environment`] | recommended environment variables; the limit of open files |
//! | [`logging`] | to the systemd journal or standard error, including clients refused by Zenoh |
//! | [`supervision`] | readiness, status, watchdog heartbeat |
//! | [`health`] | health and metrics over HTTP |
//! | [`clock`] | times in messages |

pub mod clock;
pub mod environment;
pub mod exit;
pub mod health;
pub mod logging;
pub mod opening;
pub mod runtime;
pub mod shutdown;
pub mod supervision;
