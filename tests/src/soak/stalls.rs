//! How long the machine kept the test itself waiting: what it withholds from the test, it withholds
//! from the processes as well, and that is no fault of theirs.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const EVERY: Duration = Duration::from_millis(50);

/// The sum of all delays of a thread that does nothing but look at the clock.
#[derive(Clone, Default)]
pub struct Stalls(Arc<Mutex<Duration>>);

impl Stalls {
    /// Begins to look at the clock, until nobody wants to know any more.
    #[must_use]
    pub fn watched() -> Self {
        let stalls = Self::default();
        let total = Arc::downgrade(&stalls.0);
        std::thread::spawn(move || {
            let mut last = Instant::now();
            while let Some(total) = total.upgrade() {
                std::thread::sleep(EVERY);
                let now = Instant::now();
                *total.lock().unwrap() += (now - last).saturating_sub(2 * EVERY);
                last = now;
            }
        });
        stalls
    }

    /// The sum so far.
    #[must_use]
    pub fn total(&self) -> Duration {
        *self.0.lock().unwrap()
    }
}
