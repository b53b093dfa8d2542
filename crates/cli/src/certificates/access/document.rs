//! Zenoh's settings as a document: mutual TLS, explicit endpoints, quick to notice a loss.

use std::io::Write;

use serde::Serialize;
use session::{ACCEPTING_MS, LONGEST_MESSAGE_BYTES, OPENING_MS, wait_before_close_us};

use super::rules::AccessControl;
use crate::failure::Failure;

/// Settings of a process. What is not named here is Zenoh's default.
#[derive(Debug, Serialize)]
pub(super) struct Document {
    mode: &'static str,
    listen: Listen,
    #[serde(skip_serializing_if = "Option::is_none")]
    connect: Option<Connect>,
    scouting: Scouting,
    transport: Transport,
    access_control: AccessControl,
}

#[derive(Debug, Serialize)]
struct Listen {
    endpoints: Vec<String>,
    timeout_ms: u32,
    exit_on_failure: bool,
}

#[derive(Debug, Serialize)]
struct Connect {
    endpoints: Vec<String>,
    timeout_ms: i32,
    exit_on_failure: bool,
    retry: Retry,
}

#[derive(Debug, Serialize)]
struct Retry {
    period_init_ms: u32,
    period_max_ms: u32,
    period_increase_factor: f32,
}

#[derive(Debug, Serialize)]
struct Scouting {
    multicast: Switch,
    gossip: Switch,
}

#[derive(Debug, Serialize)]
struct Switch {
    enabled: bool,
}

#[derive(Debug, Serialize)]
struct Transport {
    unicast: Unicast,
    link: Link,
}

#[derive(Debug, Serialize)]
struct Unicast {
    #[serde(skip_serializing_if = "Option::is_none")]
    max_sessions: Option<u32>,
    open_timeout: u64,
    accept_timeout: u64,
}

#[derive(Debug, Serialize)]
struct Link {
    protocols: [&'static str; 1],
    rx: Receiving,
    tx: Sending,
    tls: Tls,
}

#[derive(Debug, Serialize)]
struct Receiving {
    max_message_size: usize,
}

#[derive(Debug, Serialize)]
struct Sending {
    lease: u32,
    queue: Queue,
}

#[derive(Debug, Serialize)]
struct Queue {
    congestion_control: CongestionControl,
}

#[derive(Debug, Serialize)]
struct CongestionControl {
    block: Block,
}

#[derive(Debug, Serialize)]
struct Block {
    wait_before_close: u64,
}

#[derive(Debug, Serialize)]
struct Tls {
    enable_mtls: bool,
    verify_name_on_connect: bool,
    close_link_on_expiration: bool,
}

impl Document {
    /// A router, to which all others connect; it connects to that place, if there is one.
    pub(super) fn of_router(
        access: AccessControl,
        endpoints: &[String],
        connect: Option<String>,
        lease_ms: u32,
    ) -> Self {
        Self {
            mode: "router",
            listen: listen(endpoints, "tls/127.0.0.1:7447"),
            connect: connect.map(always),
            scouting: scouting(),
            transport: transport(Some(2000), lease_ms),
            access_control: access,
        }
    }

    /// A peer, which connects to every other one.
    pub(super) fn of_peer(access: AccessControl, endpoints: &[String], lease_ms: u32) -> Self {
        Self {
            mode: "peer",
            listen: listen(endpoints, "tls/127.0.0.1:7448"),
            connect: Some(always("tls/127.0.0.1:7447".to_owned())),
            scouting: scouting(),
            transport: transport(None, lease_ms),
            access_control: access,
        }
    }

    /// Writes it as JSON, which JSON5 is too.
    pub(super) fn write(&self, out: &mut impl Write) -> Result<(), Failure> {
        serde_json::to_writer_pretty(&mut *out, self)?;
        writeln!(out)?;
        Ok(out.flush()?)
    }
}

/// On these endpoints, or else on one that is there on every computer.
fn listen(endpoints: &[String], otherwise: &str) -> Listen {
    let endpoints =
        if endpoints.is_empty() { vec![otherwise.to_owned()] } else { endpoints.to_vec() };
    Listen { endpoints, timeout_ms: 0, exit_on_failure: true }
}

/// Connects there, and again whenever the link is lost.
fn always(endpoint: String) -> Connect {
    Connect {
        endpoints: vec![endpoint],
        timeout_ms: -1,
        exit_on_failure: false,
        retry: Retry { period_init_ms: 100, period_max_ms: 500, period_increase_factor: 1.5 },
    }
}

fn scouting() -> Scouting {
    Scouting { multicast: Switch { enabled: false }, gossip: Switch { enabled: false } }
}

/// The figures are those of every other session.
fn transport(max_sessions: Option<u32>, lease_ms: u32) -> Transport {
    let block = Block { wait_before_close: wait_before_close_us(lease_ms) };
    Transport {
        unicast: Unicast { max_sessions, open_timeout: OPENING_MS, accept_timeout: ACCEPTING_MS },
        link: Link {
            protocols: ["tls"],
            rx: Receiving { max_message_size: LONGEST_MESSAGE_BYTES },
            tx: Sending {
                lease: lease_ms,
                queue: Queue { congestion_control: CongestionControl { block } },
            },
            tls: Tls {
                enable_mtls: true,
                verify_name_on_connect: true,
                close_link_on_expiration: true,
            },
        },
    }
}
