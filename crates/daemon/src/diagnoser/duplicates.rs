//! Whether another process runs as the same module, say a forgotten one on another computer, with a state
//! directory of its own. The verdicts of both are right, but an order may reach either of them, and the fault that
//! it acknowledges stays unacknowledged with the other.

use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::{Mutex, MutexGuard};
use vocabulary::Occurrences;
use vocabulary::{ModuleStatus, Topic};
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Locality, Sample};

use diagnosis::messages::Speaker;

/// A predecessor that is about to end may still publish; what goes on for longer than this does not end.
const NOT_ENDING: Duration = Duration::from_secs(3);
/// After this time without a status, or after three of the usual intervals, the other process counts as gone.
const GONE: Duration = Duration::from_secs(10);

/// The statuses that others publish under this module's name.
#[derive(Debug, Clone)]
pub(crate) struct DuplicateWatch(Arc<Mutex<Sightings>>);

impl DuplicateWatch {
    /// With the interval at which statuses come.
    pub(crate) fn new(every: Duration) -> Self {
        Self(Arc::new(Mutex::new(Sightings::new(GONE.max(3 * every)))))
    }

    /// Notes what comes from other sessions.
    pub(crate) async fn watch(
        &self,
        session: &Session,
        speaker: &Speaker,
    ) -> zenoh::Result<Subscriber<()>> {
        let (this, speaker) = (self.clone(), speaker.clone());
        session
            .declare_subscriber(speaker.key(Topic::Status))
            .allowed_origin(Locality::Remote)
            .callback(move |received| this.take(&received, &speaker, Instant::now()))
            .await
    }

    /// Does another process run as this module?
    pub(crate) fn are_there(&self, now: Instant) -> bool {
        self.lock().are_there(now)
    }

    /// Takes a status from another session; an invalid one does not come from a diagnoser and is ignored.
    fn take(&self, received: &Sample, speaker: &Speaker, now: Instant) {
        let Ok(status) = vocabulary::decode::<ModuleStatus>(&received.payload().to_bytes()) else {
            return;
        };
        if status.structure != speaker.structure || status.module != speaker.module {
            return;
        }
        if self.lock().note(now) {
            tracing::warn!(
                its_state_directory = status.journal.directory.as_deref(),
                its_version = %status.software,
                "duplicate diagnoser for this module: stop one of the two processes"
            );
        }
    }

    /// Every change is complete in itself, so a thread that failed has left it in order.
    fn lock(&self) -> MutexGuard<'_, Sightings> {
        self.0.lock()
    }
}

/// A series of statuses of others, one after the other, by whomever.
#[derive(Debug)]
struct Sightings {
    gone_after: Duration,
    /// When the first and the latest of the series came.
    series: Option<(Instant, Instant)>,
    lines: Occurrences,
}

impl Sightings {
    fn new(gone_after: Duration) -> Self {
        Self { gone_after, series: None, lines: Occurrences::default() }
    }

    /// Notes one more; whether that is worth a line in the log.
    fn note(&mut self, now: Instant) -> bool {
        let first = self.ongoing(now).map_or(now, |(first, _)| first);
        self.series = Some((first, now));
        self.are_there(now) && self.lines.note(now).is_some()
    }

    fn are_there(&self, now: Instant) -> bool {
        self.ongoing(now).is_some_and(|(first, latest)| latest.duration_since(first) >= NOT_ENDING)
    }

    fn ongoing(&self, now: Instant) -> Option<(Instant, Instant)> {
        self.series.filter(|(_, latest)| now.duration_since(*latest) < self.gone_after)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is noted each second from the first to the last, and whether each is worth a line.
    fn note(
        sightings: &mut Sightings,
        start: Instant,
        seconds: std::ops::RangeInclusive<u64>,
    ) -> Vec<u64> {
        let worthy = |second: &u64| sightings.note(start + Duration::from_secs(*second));
        seconds.filter(worthy).collect()
    }

    #[test]
    fn a_predecessor_that_ends_is_none() {
        let (mut sightings, start) = (Sightings::new(GONE), Instant::now());
        assert!(note(&mut sightings, start, 0..=2).is_empty());
        for second in 0..100 {
            assert!(!sightings.are_there(start + Duration::from_secs(second)), "{second} s");
        }
        // The next one ends as well.
        assert!(note(&mut sightings, start, 100..=102).is_empty());
        assert!(!sightings.are_there(start + Duration::from_secs(103)));
    }

    #[test]
    fn one_that_goes_on_is_reported_once_a_minute_until_it_is_gone() {
        let (mut sightings, start) = (Sightings::new(GONE), Instant::now());
        assert_eq!(note(&mut sightings, start, 0..=130), [3, 63, 123]);
        assert!(sightings.are_there(start + Duration::from_secs(131)));
        assert!(!sightings.are_there(start + Duration::from_secs(140)));
        assert!(note(&mut sightings, start, 150..=152).is_empty());
    }

    #[test]
    fn one_that_is_started_again_and_again_is_there() {
        let (mut sightings, start) = (Sightings::new(GONE), Instant::now());
        let each = |second| start + Duration::from_secs(second);
        let reported: Vec<u64> =
            [0, 4, 8].into_iter().filter(|s| sightings.note(each(*s))).collect();
        assert_eq!(reported, [4]);
    }
}
