//! What must stand in the environment before the process begins: if something is missing, it begins once
//! more. What is set already stays as it is.
//!
//! - Eight threads for the network's reception, which wait for sockets and read them. Left to itself, the
//!   network's library waits on one thread and reads on two others, so that each message wakes two threads.
//!   And when a link ends with something unsent, it closes the socket in a call that may wait for ten
//!   seconds on one of the threads that read all other links: with two of them, the loss of two links makes
//!   a process deaf. This can be said by an environment variable only.
//! - Memory that goes back where it came from. The C library keeps a pool of memory for every few threads
//!   and gives little of it back, so that a flood of messages leaves a process twice as large. With one pool,
//!   and everything that is not in use given back, it grows by an eighth. With two, it grew now and then by
//!   half: waiting questions hold the buffers that they came in, and what is allocated meanwhile settles
//!   above them.

use std::os::unix::process::CommandExt;
use std::process::Command;

/// The variables with their values. The first is read by the network's library, the others by the GNU C
/// library \[bytes\].
const VARIABLES: [(&str, &str); 4] = [
    ("ZENOH_RUNTIME", "(net: (worker_threads: 8), rx: (handover: net))"),
    ("MALLOC_ARENA_MAX", "1"),
    ("MALLOC_TRIM_THRESHOLD_", "131072"),
    ("MALLOC_MMAP_THRESHOLD_", "131072"),
];

/// Sees to it that everything is there. Returns only if it is, or if that cannot be had.
pub fn provide() {
    let missing = VARIABLES.iter().filter(|(name, _)| std::env::var_os(name).is_none());
    let missing: Vec<_> = missing.collect();
    if missing.is_empty() {
        return;
    }
    let Ok(program) = std::env::current_exe() else { return };
    let mut arguments = std::env::args_os();
    let mut again = Command::new(program);
    if let Some(name) = arguments.next() {
        again.arg0(name);
    }
    for (name, value) in missing {
        again.env(name, value);
    }
    let error = again.args(arguments).exec();
    tracing::debug!("not started with another environment: {error}");
}
