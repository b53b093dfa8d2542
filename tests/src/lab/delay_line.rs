//! Frames that arrive later.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Instant;

use parking_lot::{Condvar, Mutex, MutexGuard};

/// Pending frames by due time; the earliest leaves first.
#[derive(Debug)]
pub(super) struct DelayLine {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    under_way: BinaryHeap<Reverse<Parcel>>,
    next_number: u64,
    closed: bool,
}

#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Parcel {
    due: Instant,
    /// Two frames that are due at the same instant keep their order.
    number: u64,
    /// Place of the card that it goes to.
    to: usize,
    frame: Vec<u8>,
}

impl DelayLine {
    pub(super) fn new() -> Self {
        Self { state: Mutex::default(), changed: Condvar::new() }
    }

    pub(super) fn put(&self, due: Instant, to: usize, frame: Vec<u8>) {
        let mut state = self.state();
        let number = state.next_number;
        state.next_number += 1;
        state.under_way.push(Reverse(Parcel { due, number, to, frame }));
        drop(state);
        self.changed.notify_one();
    }

    /// Waits for the next frame that is due; `None` when the line is closed.
    pub(super) fn next(&self) -> Option<(usize, Vec<u8>)> {
        let mut state = self.state();
        loop {
            if state.closed {
                return None;
            }
            let now = Instant::now();
            let due = state.under_way.peek().map(|Reverse(parcel)| parcel.due);
            match due {
                Some(due) if due <= now => {
                    return state.under_way.pop().map(|Reverse(parcel)| (parcel.to, parcel.frame));
                }
                Some(due) => drop(self.changed.wait_until(&mut state, due)),
                None => self.changed.wait(&mut state),
            }
        }
    }

    /// Nothing leaves any more.
    pub(super) fn close(&self) {
        self.state().closed = true;
        self.changed.notify_all();
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn what_is_due_first_leaves_first_and_not_before() {
        let line = DelayLine::new();
        let start = Instant::now();
        for (number, ms) in [(1, 30), (2, 10), (3, 20), (4, 20)] {
            line.put(start + Duration::from_millis(ms), 0, vec![number]);
        }
        let order: Vec<u8> = (0..4).map(|_| line.next().unwrap().1[0]).collect();
        assert_eq!(order, [2, 3, 4, 1]);
        assert!(start.elapsed() >= Duration::from_millis(30));
    }

    #[test]
    fn a_closed_line_ends_a_waiting_receiver() {
        let line = DelayLine::new();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| line.next());
            line.put(Instant::now() + Duration::from_secs(60), 0, vec![1]);
            line.close();
            assert_eq!(waiting.join().unwrap(), None);
        });
    }
}
