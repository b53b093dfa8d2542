//! The queue of journal records, and how long a fault waits for the disk before it is published: it is durable first,
//! unless the disk fails.
//!
//! The time limit starts with the oldest record that the disk has not confirmed. A hanging disk therefore delays the
//! first batch of records only.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use vocabulary::JournalStatus;

use crate::record::{JournalRecord, WatchedSteps};

/// A disk that does not answer for this long is considered hung.
const DEADLINE: Duration = Duration::from_secs(1);
/// Records that may wait for a hanging disk. The present state that dropped records describe is in the
/// [`ComponentStore`](crate::ComponentStore), with which a new file begins.
const MAX_WAITING: usize = 4096;

/// A batch to be written at once.
#[derive(Debug, Default)]
pub struct WriteBatch {
    /// The records, oldest first.
    pub records: Vec<JournalRecord>,
    /// The steps watched by the module when it queued these records.
    pub watch: Option<WatchedSteps>,
    /// The number of records dropped because the queue was full.
    pub dropped: u64,
}

/// Records queued for the thread that writes them.
#[derive(Debug, Default)]
pub struct WriteQueue {
    waiting: VecDeque<JournalRecord>,
    /// When the oldest of them was queued.
    waiting_since: Option<Instant>,
    watch: Option<WatchedSteps>,
    dropped: u64,
    /// When the present write started, and when the oldest record in it was queued.
    writing_since: Option<Instant>,
    oldest_written: Option<Instant>,
    /// Numbers of records: queued so far, taken for writing, answered by the disk, and durable.
    handed_in: u64,
    taken: u64,
    answered: u64,
    durable: u64,
    status: JournalStatus,
    /// Whether the hang of the disk was reported.
    hang_noted: bool,
}

impl WriteQueue {
    /// A queue with this initial status of the journal.
    #[must_use]
    pub fn new(status: JournalStatus) -> Self {
        Self { status, ..Self::default() }
    }

    /// Queues records, and the steps watched so far. Returns the ticket that tells whether they are durable.
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

    /// Whether there is nothing to write.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.watch.is_none()
    }

    /// Takes everything to be written.
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

    /// Records the result of a write: whether everything up to now is durable, and the status of the journal. Returns
    /// how long the disk hung, if that was reported.
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

    /// Whether everything queued up to a ticket is durable; `None` while the caller should wait, for the time given by
    /// [`left`](Self::left).
    #[must_use]
    pub fn answer(&self, ticket: u64, now: Instant) -> Option<bool> {
        let is_over = self.answered >= ticket || self.left(now).is_zero();
        is_over.then(|| self.has(ticket))
    }

    /// How much longer to wait for the disk.
    #[must_use]
    pub fn left(&self, now: Instant) -> Duration {
        let oldest = self.oldest_written.or(self.waiting_since);
        oldest.map_or(Duration::ZERO, |since| (since + DEADLINE).saturating_duration_since(now))
    }

    /// Whether everything queued up to a ticket is durable.
    #[must_use]
    pub fn has(&self, ticket: u64) -> bool {
        self.durable >= ticket
    }

    /// Records that the disk did not answer for a ticket. Returns the time limit the first time.
    pub fn note_hang(&mut self, ticket: u64) -> Option<Duration> {
        let hangs = self.answered < ticket;
        (hangs && !std::mem::replace(&mut self.hang_noted, true)).then_some(DEADLINE)
    }

    /// The status of the journal.
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
    fn one_answer_resolves_every_earlier_ticket() {
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
