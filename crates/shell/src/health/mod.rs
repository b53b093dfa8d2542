//! Health and metrics over HTTP, on an address that is given for it; without one there is nothing of this.
//!
//! | file | job |
//! |---|---|
//! | `condition` | well or not, and why: `/healthz` and `/readyz` |
//! | `sheet` | `/metrics`: one metric after the other, in the text format of OpenMetrics |
//! | `process` | the metrics of every process |
//! | `address` | where to serve, from file and flags |
//! | `server` | HTTP, on a thread of its own, for a few at a time |
//! | `probe` | the same from outside, for containers without `curl` |
//!
//! Requests are served from published state: nothing here queries the diagnosis, and no client can
//! hold it up.

mod address;
mod condition;
mod probe;
mod process;
mod server;
mod sheet;

pub use address::{HealthFlags, HealthSettings};
pub use condition::{Condition, live};
pub use probe::{ProbeError, ProbeKind, probe};
pub use process::ProcessReport;
pub use server::{HealthAddressError, Listening, Server, Subject};
pub use sheet::{Sheet, render};
