//! How long the machine kept the test itself waiting: the processes under test were
//! delayed as well, which does not count against them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

const EVERY: Duration = Duration::from_millis(50);

/// The sum of all delays of a thread that does nothing but look at the clock.
#[derive(Clone, Default)]
pub struct Stalls(Arc<Mutex<Duration>>);

impl Stalls {
    /// Starts watching the clock, until dropped.
    #[must_use]
    pub fn watched() -> Self {
        let stalls = Self::default();
        let total = Arc::downgrade(&stalls.0);
        std::thread::spawn(move || {
            let mut last = Instant::now();
            while let Some(total) = total.upgrade() {
                std::thread::sleep(EVERY);
                let now = Instant::now();
                *total.lock() += (now - last).saturating_sub(2 * EVERY);
                last = now;
            }
        });
        stalls
    }

    /// The sum so far.
    #[must_use]
    pub fn total(&self) -> Duration {
        *self.0.lock()
    }
}
