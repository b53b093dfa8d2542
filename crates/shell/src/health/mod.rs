//! Health and metrics over HTTP, served only if an address is configured.
//!
//! | file | job |
//! |---|---|
//! | `condition` | healthy or not, and why: `/healthz` and `/readyz` |
//! | `sheet` | `/metrics`: writes metrics in the text format of OpenMetrics |
//! | `process` | the metrics of every process |
//! | `address` | the address from file and flags |
//! | `server` | HTTP on a separate thread, for a limited number of clients |
//! | `probe` | the client side, for containers without `curl` |
//!
//! Requests are answered from published state: they never query the diagnosis, and clients cannot delay it.

mod address;
mod condition;
mod probe;
mod process;
mod server;
mod sheet;

pub use address::{HealthFlags, HealthSettings};
pub use condition::{HealthCondition, live};
pub use probe::{ProbeError, ProbeKind, probe};
pub use process::{ProcessReport, thread_times};
pub use server::{
    HealthAddressError, Listening, Server, Subject, condition_response, metrics_response,
};
pub use sheet::{Sheet, render};
