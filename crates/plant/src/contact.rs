//! A bad contact, which opens and closes by chance.
//!
//! It is closed and open by turns, each time for an exponentially distributed time. It also opens and
//! closes between two samples; a sample meets it as it then is.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Exp1};

/// The contact in the lead of one gage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    /// Mean times closed and open, in steps.
    closed_steps: f64,
    open_steps: f64,
    open: bool,
    /// How long it stays so from the next sample on, in steps; if not positive, it switches before.
    left_steps: f64,
}

impl Contact {
    /// One that opens at the next sample; mean times closed and open \[s\].
    pub(crate) fn new(closed_s: f64, open_s: f64, step_s: f64) -> Self {
        Self {
            closed_steps: closed_s / step_s,
            open_steps: open_s / step_s,
            open: false,
            left_steps: 0.0,
        }
    }

    /// Whether it is open in this sample. Moves on to the next.
    pub(crate) fn is_open(&mut self, generator: &mut ChaCha8Rng) -> bool {
        while self.left_steps <= 0.0 {
            self.open = !self.open;
            let mean = if self.open { self.open_steps } else { self.closed_steps };
            let time: f64 = Exp1.sample(generator);
            self.left_steps += mean * time;
        }
        self.left_steps -= 1.0;
        self.open
    }
}
