//! A process that gets only a share of its processor's time.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use nix::sys::signal::Signal;

use crate::process::{Process, send};

/// How long it runs before it stands still again.
const RUNS: Duration = Duration::from_millis(10);

/// Holds a process back for as long as it lives; the process goes on freely afterwards.
pub struct Throttle {
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Throttle {
    /// Lets the process run for one part of its time in `parts`.
    ///
    /// By stopping it again and again: a busy neighbour would take what a scheduler of the day gives it.
    #[must_use]
    pub fn to_one_part_in(parts: u32, process: &Process) -> Self {
        let over = Arc::new(AtomicBool::new(false));
        let pid = process.pid();
        let stop = Arc::clone(&over);
        let thread = std::thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                send(pid, Signal::SIGSTOP);
                std::thread::sleep(RUNS * (parts - 1));
                send(pid, Signal::SIGCONT);
                std::thread::sleep(RUNS);
            }
        });
        Self { over, thread: Some(thread) }
    }
}

impl Drop for Throttle {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // What went wrong in it is shown by the test that goes on.
            let _ = thread.join();
        }
    }
}
