//! A stop on request: the first signal lets running work finish, the second one ends at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::failure::Failure;

/// Exit code of a program that a second signal ended.
const AT_ONCE: i32 = 130;

/// A flag that is set by the first SIGINT or SIGTERM.
pub(super) fn listen() -> Result<Arc<AtomicBool>, Failure> {
    let stop = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal must find the flag unset here and set it below.
        flag::register_conditional_shutdown(signal, AT_ONCE, Arc::clone(&stop))
            .and_then(|_| flag::register(signal, Arc::clone(&stop)))
            .map_err(|error| Failure::runtime(format!("cannot listen for signals: {error}")))?;
    }
    Ok(stop)
}
