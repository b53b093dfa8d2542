//! What is to be written, on its way to the thread that writes it. The thread that publishes waits until the disk has it,
//! but not for ever: a fault is on the disk first, unless the disk is broken.
//!
//! The time limit is that of the oldest record that the disk has not answered for. So a disk that hangs holds up the
//! first batch of records, and none after it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Condvar, Mutex, MutexGuard};
use vocabulary::JournalStatus;

use super::record::Record;
use super::snapshot::Snapshot;
use super::watch_file::Watch;

/// A disk that has not answered for this long hangs.
const DEADLINE: Duration = Duration::from_secs(1);
/// Records that may wait for a disk that hangs. Of those before them, what they say of the present state is kept.
const MAX_WAITING: usize = 4096;

/// What is written in one go.
#[derive(Debug, Default)]
pub(super) struct Batch {
    pub(super) records: Vec<Record>,
    /// How far the module had watched when it handed these records in.
    pub(super) watch: Option<Watch>,
    /// Of records that found no room, and how many they were.
    pub(super) dropped: (Snapshot, u64),
}

/// The queue: anybody hands in and waits, one thread writes.
#[derive(Debug)]
struct Queue {
    state: Mutex<State>,
    /// Something was handed in, or nothing will be any more.
    handed_in: Condvar,
    /// The disk has answered.
    answered: Condvar,
}

#[derive(Debug, Default)]
struct State {
    waiting: VecDeque<Record>,
    /// When the oldest of them was handed in.
    waiting_since: Option<Instant>,
    watch: Option<Watch>,
    dropped: Snapshot,
    dropped_count: u64,
    /// Since when the thread has been writing, and when the oldest record that it is writing was handed in.
    writing_since: Option<Instant>,
    oldest_written: Option<Instant>,
    /// Records handed in so far; of these, so many the disk has answered for, and so many it has.
    handed_in: u64,
    taken: u64,
    answered: u64,
    durable: u64,
    status: JournalStatus,
    /// That the disk hangs has been logged.
    hang_told: bool,
    /// Nothing will be handed in any more.
    closed: bool,
}

impl State {
    fn hand_in(&mut self, records: Vec<Record>, watch: Option<Watch>, now: Instant) {
        if !records.is_empty() {
            self.waiting_since.get_or_insert(now);
        }
        self.handed_in += records.len() as u64;
        self.waiting.extend(records);
        self.watch = watch.or(self.watch.take());
        while self.waiting.len() > MAX_WAITING {
            let Some(record) = self.waiting.pop_front() else { break };
            if let Ok(text) = record.to_text() {
                self.dropped.note(record, text);
            }
            self.dropped_count += 1;
        }
    }

    fn take(&mut self, now: Instant) -> Batch {
        self.taken = self.handed_in;
        self.oldest_written = self.waiting_since.take();
        self.writing_since = Some(now);
        Batch {
            records: std::mem::take(&mut self.waiting).into(),
            watch: self.watch.take(),
            dropped: (std::mem::take(&mut self.dropped), std::mem::take(&mut self.dropped_count)),
        }
    }

    fn settle(&mut self, durable: bool, status: JournalStatus, now: Instant) {
        self.answered = self.taken;
        if durable {
            self.durable = self.taken;
        }
        self.oldest_written = None;
        self.status = status;
        if std::mem::take(&mut self.hang_told) {
            let hung = self.writing_since.map_or(Duration::ZERO, |since| now.duration_since(since));
            tracing::info!("journal: the disk answers again, after {:.1} s", hung.as_secs_f64());
        }
        self.writing_since = None;
    }

    /// When those who wait for the disk wait no longer.
    fn deadline(&self) -> Option<Instant> {
        self.oldest_written.or(self.waiting_since).map(|since| since + DEADLINE)
    }

    fn tell_hang(&mut self) {
        if !std::mem::replace(&mut self.hang_told, true) {
            tracing::error!(
                "journal: the disk has not answered for {DEADLINE:?}; faults are published without \
                 it, and a restart now would forget them"
            );
        }
    }

    fn status(&self, now: Instant) -> JournalStatus {
        let mut status = self.status.clone();
        let hung = self.writing_since.map(|since| now.saturating_duration_since(since));
        if let Some(hung) = hung.filter(|hung| *hung >= DEADLINE) {
            status.problem = Some(format!("the disk has hung for {} s", hung.as_secs()));
        }
        status.unsaved += self.handed_in - self.answered - self.dropped_count;
        status.lost += self.dropped_count;
        status
    }
}

impl Queue {
    /// Every change of the state is complete before the lock is released.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock()
    }
}

/// The three ends of a queue that begins with these records.
pub(super) fn queue(
    first: Vec<Record>,
    status: JournalStatus,
) -> (Submission, Outlet, JournalBoard) {
    let mut state = State { status, ..State::default() };
    state.hand_in(first, None, Instant::now());
    let queue = Arc::new(Queue {
        state: Mutex::new(state),
        handed_in: Condvar::new(),
        answered: Condvar::new(),
    });
    (Submission(Arc::clone(&queue)), Outlet(Arc::clone(&queue)), JournalBoard(queue))
}

/// Hands records in. The writing thread ends when this is gone, and everything is written.
#[derive(Debug)]
pub(crate) struct Submission(Arc<Queue>);

impl Submission {
    /// Hands in records, and how far the module has watched by now; does not wait. Returns the ticket to wait for the disk
    /// with.
    pub(crate) fn hand_in(&self, records: Vec<Record>, watch: Option<Watch>) -> u64 {
        let mut state = self.0.state();
        state.hand_in(records, watch, Instant::now());
        self.0.handed_in.notify_one();
        state.handed_in
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        self.0.state().closed = true;
        self.0.handed_in.notify_one();
    }
}

/// Where the writing thread takes from.
#[derive(Debug)]
pub(super) struct Outlet(Arc<Queue>);

impl Outlet {
    /// What there is to be written, waited for; after `retry` at the latest, if that is given. `None` when nothing more
    /// will come.
    pub(super) fn take(&self, retry: Option<Duration>) -> Option<Batch> {
        let mut state = self.0.state();
        let end = retry.map(|retry| Instant::now() + retry);
        while state.waiting.is_empty() && state.watch.is_none() {
            if state.closed {
                return None;
            }
            let left = end.map(|end| end.saturating_duration_since(Instant::now()));
            match left {
                Some(left) if left.is_zero() => break,
                Some(left) => drop(self.0.handed_in.wait_for(&mut state, left)),
                None => self.0.handed_in.wait(&mut state),
            }
        }
        Some(state.take(Instant::now()))
    }

    /// The disk has answered: whether it has everything so far, and how the journal is.
    pub(super) fn settle(&self, durable: bool, status: &JournalStatus) {
        self.0.state().settle(durable, status.clone(), Instant::now());
        self.0.answered.notify_all();
    }
}

/// How the journal is, and whether it has what was handed in.
#[derive(Debug, Clone)]
pub(crate) struct JournalBoard(Arc<Queue>);

impl JournalBoard {
    /// At present.
    pub(crate) fn read(&self) -> JournalStatus {
        self.0.state().status(Instant::now())
    }

    /// Waits until the disk has answered for everything that was handed in by the time of a ticket, unless it hangs.
    /// Returns whether it has all of it.
    pub(crate) fn wait_for(&self, ticket: u64) -> bool {
        let mut state = self.0.state();
        while state.answered < ticket {
            let left = state.deadline().map(|end| end.saturating_duration_since(Instant::now()));
            let Some(left) = left.filter(|left| !left.is_zero()) else {
                state.tell_hang();
                break;
            };
            self.0.answered.wait_for(&mut state, left);
        }
        state.durable >= ticket
    }

    /// Whether the disk has everything that was handed in.
    pub(crate) fn has_all(&self) -> bool {
        let state = self.0.state();
        state.durable == state.handed_in
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn changes(steps: std::ops::Range<u64>) -> Vec<Record> {
        let change = |step| vocabulary::Change::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
        steps.map(|step| Record::Change { run: RunId(1), change: change(step) }).collect()
    }

    fn empty() -> (Submission, Outlet, JournalBoard) {
        queue(Vec::new(), JournalStatus::default())
    }

    #[test]
    fn whoever_hands_in_waits_for_the_answer_and_learns_it() {
        for durable in [true, false] {
            let (submission, outlet, board) = empty();
            let writing = std::thread::spawn(move || {
                while let Some(batch) = outlet.take(None) {
                    assert_eq!(batch.records.len(), 3);
                    outlet.settle(durable, &JournalStatus::default());
                }
            });
            assert_eq!(board.wait_for(submission.hand_in(changes(0..3), None)), durable);
            assert_eq!(board.has_all(), durable);
            drop(submission);
            writing.join().unwrap();
        }
    }

    #[test]
    fn a_disk_that_hangs_holds_up_the_first_batch_and_none_after_it() {
        let (submission, outlet, board) = empty();
        let start = Instant::now();
        assert!(!board.wait_for(submission.hand_in(changes(0..2), None)));
        assert!(start.elapsed() >= DEADLINE);
        let taken = outlet.take(None).unwrap();
        let second = Instant::now();
        for step in 2..50 {
            assert!(!board.wait_for(submission.hand_in(changes(step..step + 1), None)));
        }
        assert!(second.elapsed() < DEADLINE, "{:?}", second.elapsed());
        assert_eq!((taken.records.len(), board.read().unsaved), (2, 50));
        // The first are there, the rest is not.
        outlet.settle(true, &JournalStatus::default());
        assert!(!board.has_all());
        assert_eq!(outlet.take(None).unwrap().records.len(), 48);
        outlet.settle(true, &JournalStatus::default());
        assert!(board.has_all() && board.read().unsaved == 0);
    }

    #[test]
    fn that_it_hangs_is_seen_without_its_answer_and_whatever_it_writes() {
        let mut state = State::default();
        let start = Instant::now();
        state.hand_in(Vec::new(), Some(Watch { run: RunId(1), watched: None }), start);
        assert!(state.take(start).watch.is_some());
        assert_eq!(state.status(start + DEADLINE / 2).problem, None);
        let problem = state.status(start + 7 * DEADLINE).problem;
        assert_eq!(problem.as_deref(), Some("the disk has hung for 7 s"));
        state.settle(true, JournalStatus::default(), start + 8 * DEADLINE);
        assert_eq!(state.status(start + 9 * DEADLINE).problem, None);
    }

    #[test]
    fn what_finds_no_room_is_counted_and_its_state_kept() {
        let mut state = State::default();
        let now = Instant::now();
        let room = MAX_WAITING as u64;
        state.hand_in(changes(0..room + 10), None, now);
        let status = state.status(now);
        assert_eq!((status.unsaved, status.lost), (room, 10));
        let Batch { records, dropped: (dropped, count), .. } = state.take(now);
        assert_eq!((records.len(), dropped.texts().count(), count), (MAX_WAITING, 10, 10));
    }
}
