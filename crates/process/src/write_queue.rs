//! What is to be written to the journal, and for how long a fault waits for the disk before it is published: it is on the
//! disk first, unless the disk is broken.
//!
//! The time limit is that of the oldest record that the disk has not answered for. So a disk that hangs holds up the
//! first batch of records, and none after it.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use vocabulary::JournalStatus;

use crate::record::{JournalRecord, WatchedSteps};

/// A disk that has not answered for this long hangs.
const DEADLINE: Duration = Duration::from_secs(1);
/// Records that may wait for a disk that hangs. What those before them say of the present state is in the
/// [`ComponentStore`](crate::ComponentStore), which a new file begins with.
const MAX_WAITING: usize = 4096;

/// What is written in one go.
#[derive(Debug, Default)]
pub struct WriteBatch {
    /// The records, oldest first.
    pub records: Vec<JournalRecord>,
    /// How far the module had watched when it handed these records in.
    pub watch: Option<WatchedSteps>,
    /// How many records found no room.
    pub dropped: u64,
}

/// Records on their way to the thread that writes them.
#[derive(Debug, Default)]
pub struct WriteQueue {
    waiting: VecDeque<JournalRecord>,
    /// When the oldest of them was handed in.
    waiting_since: Option<Instant>,
    watch: Option<WatchedSteps>,
    dropped: u64,
    /// Since when the thread has been writing, and when the oldest record that it is writing was handed in.
    writing_since: Option<Instant>,
    oldest_written: Option<Instant>,
    /// Records handed in so far; of these, so many the disk has answered for, and so many it has.
    handed_in: u64,
    taken: u64,
    answered: u64,
    durable: u64,
    status: JournalStatus,
    /// That the disk hangs has been noted.
    hang_noted: bool,
}

impl WriteQueue {
    /// A queue that begins with this status of the journal.
    #[must_use]
    pub fn new(status: JournalStatus) -> Self {
        Self { status, ..Self::default() }
    }

    /// Hands in records, and how far the module has watched by now. Returns the ticket by which the disk's answer is known.
    pub fn hand_in(
        &mut self,
        records: impl IntoIterator<Item = JournalRecord>,
        watch: Option<WatchedSteps>,
        now: Instant,
    ) -> u64 {
        let before = self.waiting.len();
        self.waiting.extend(records);
        let more = self.waiting.len() - before;
        if more > 0 {
            self.waiting_since.get_or_insert(now);
        }
        self.handed_in += more as u64;
        self.watch = watch.or(self.watch.take());
        let excess = self.waiting.len().saturating_sub(MAX_WAITING);
        self.waiting.drain(..excess);
        self.dropped += excess as u64;
        self.handed_in
    }

    /// The ticket of the next record.
    #[must_use]
    pub fn next_ticket(&self) -> u64 {
        self.handed_in + 1
    }

    /// Is there nothing to be written?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.watch.is_none()
    }

    /// All that is to be written.
    pub fn take(&mut self, now: Instant) -> WriteBatch {
        self.taken = self.handed_in;
        self.oldest_written = self.waiting_since.take();
        self.writing_since = Some(now);
        WriteBatch {
            records: std::mem::take(&mut self.waiting).into(),
            watch: self.watch.take(),
            dropped: std::mem::take(&mut self.dropped),
        }
    }

    /// The disk has answered: whether it has everything so far, and how the journal is. Returns how long it hung, if that
    /// was noted.
    pub fn settle(
        &mut self,
        durable: bool,
        status: JournalStatus,
        now: Instant,
    ) -> Option<Duration> {
        self.answered = self.taken;
        if durable {
            self.durable = self.taken;
        }
        self.oldest_written = None;
        self.status = status;
        let since = self.writing_since.take();
        let hung = since.map_or(Duration::ZERO, |since| now.duration_since(since));
        std::mem::take(&mut self.hang_noted).then_some(hung)
    }

    /// Whether the disk has what was handed in by the time of a ticket; `None` while that is to be waited for, for as long
    /// as [`left`](Self::left) says.
    #[must_use]
    pub fn answer(&self, ticket: u64, now: Instant) -> Option<bool> {
        let is_over = self.answered >= ticket || self.left(now).is_zero();
        is_over.then(|| self.has(ticket))
    }

    /// How long an answer of the disk is still waited for.
    #[must_use]
    pub fn left(&self, now: Instant) -> Duration {
        let oldest = self.oldest_written.or(self.waiting_since);
        oldest.map_or(Duration::ZERO, |since| (since + DEADLINE).saturating_duration_since(now))
    }

    /// Whether the disk has what was handed in by the time of a ticket.
    #[must_use]
    pub fn has(&self, ticket: u64) -> bool {
        self.durable >= ticket
    }

    /// Notes that the disk hangs, if it has not answered for a ticket. Returns the time limit the first time.
    pub fn note_hang(&mut self, ticket: u64) -> Option<Duration> {
        let hangs = self.answered < ticket;
        (hangs && !std::mem::replace(&mut self.hang_noted, true)).then_some(DEADLINE)
    }

    /// How the journal is.
    #[must_use]
    pub fn status(&self, now: Instant) -> JournalStatus {
        let mut status = self.status.clone();
        let hung = self.writing_since.map(|since| now.saturating_duration_since(since));
        if let Some(hung) = hung.filter(|hung| *hung >= DEADLINE) {
            status.problem = Some(format!("the disk has hung for {} s", hung.as_secs()));
        }
        status.unsaved += self.handed_in - self.answered - self.dropped;
        status.lost += self.dropped;
        status
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vocabulary::{RunId, Step};

    fn changes(steps: std::ops::Range<u64>) -> impl Iterator<Item = JournalRecord> {
        let change = |step| vocabulary::Change::at("sensor/g1".parse().unwrap(), Step(step), 2.0);
        steps.map(move |step| JournalRecord::Change { run: RunId(1), change: change(step) })
    }

    #[test]
    fn the_answer_is_waited_for_and_known_to_all_who_handed_in_before() {
        for durable in [true, false] {
            let (mut queue, now) = (WriteQueue::default(), Instant::now());
            let first = queue.hand_in(changes(0..1), None, now);
            let second = queue.hand_in(changes(1..3), None, now);
            assert_eq!(queue.answer(first, now), None);
            assert_eq!(queue.take(now).records.len(), 3);
            let third = queue.hand_in(changes(3..4), None, now);
            assert_eq!(queue.settle(durable, JournalStatus::default(), now), None);
            assert_eq!(queue.answer(first, now), Some(durable));
            assert_eq!(queue.answer(second, now), Some(durable));
            assert_eq!((queue.answer(third, now), queue.has(third)), (None, false));
        }
    }

    #[test]
    fn a_disk_that_hangs_holds_up_the_first_batch_and_none_after_it() {
        let (mut queue, start) = (WriteQueue::default(), Instant::now());
        let first = queue.hand_in(changes(0..2), None, start);
        assert_eq!(queue.take(start).records.len(), 2);
        assert_eq!(queue.answer(first, start + DEADLINE / 2), None);
        let late = start + DEADLINE;
        assert_eq!(queue.answer(first, late), Some(false));
        assert_eq!((queue.note_hang(first), queue.note_hang(first)), (Some(DEADLINE), None));
        let mut latest = first;
        for step in 2..50 {
            latest = queue.hand_in(changes(step..step + 1), None, late);
            assert_eq!(queue.answer(latest, late), Some(false), "not waited for");
        }
        assert_eq!(queue.status(late).unsaved, 50);
        // The first are there, the rest is not.
        assert_eq!(
            queue.settle(true, JournalStatus::default(), start + 2 * DEADLINE),
            Some(2 * DEADLINE)
        );
        assert!(queue.has(first) && !queue.has(latest));
        assert_eq!(queue.take(late).records.len(), 48);
        assert_eq!(queue.settle(true, JournalStatus::default(), late), None);
        assert!(queue.has(latest) && queue.status(late).unsaved == 0);
    }

    #[test]
    fn that_it_hangs_is_seen_without_its_answer_and_whatever_it_writes() {
        let mut queue = WriteQueue::default();
        let start = Instant::now();
        let _ = queue.hand_in([], Some(WatchedSteps { run: RunId(1), watched: None }), start);
        assert!(queue.take(start).watch.is_some());
        assert_eq!(queue.status(start + DEADLINE / 2).problem, None);
        let problem = queue.status(start + 7 * DEADLINE).problem;
        assert_eq!(problem.as_deref(), Some("the disk has hung for 7 s"));
        let _ = queue.settle(true, JournalStatus::default(), start + 8 * DEADLINE);
        assert_eq!(queue.status(start + 9 * DEADLINE).problem, None);
    }

    #[test]
    fn what_finds_no_room_is_counted() {
        let mut queue = WriteQueue::default();
        let now = Instant::now();
        let room = MAX_WAITING as u64;
        let _ = queue.hand_in(changes(0..room + 10), None, now);
        let status = queue.status(now);
        assert_eq!((status.unsaved, status.lost), (room, 10));
        let batch = queue.take(now);
        assert_eq!((batch.records.len(), batch.dropped), (MAX_WAITING, 10));
    }
}
