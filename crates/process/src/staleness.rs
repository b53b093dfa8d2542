//! Detects whether samples arrive: without samples, health is unknown.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use vocabulary::words::utc;
use vocabulary::{ComponentPath, ModulePhase};

/// The reason for the unknown state right after the start.
pub const NO_SAMPLE_YET: &str = "no sample received yet";

/// Monitors the arrival of samples and changes of phase.
#[derive(Debug)]
pub struct Staleness {
    stale_after: Duration,
    latest: Option<Instant>,
    stale: bool,
    /// When the latest sample before the silence was diagnosed \[ns since 1970\].
    stale_since_unix_ns: u64,
    published: Option<ModulePhase>,
    /// The components that are not monitored, as published, and when that last changed.
    not_monitored: BTreeMap<ComponentPath, String>,
    changed: Option<Instant>,
}

/// Components that are monitored now and then are reported no more often than this, so that they do not fill the
/// journal.
const REPORT_EVERY: Duration = Duration::from_secs(10);

impl Staleness {
    /// Samples count as missing after this time without one.
    #[must_use]
    pub fn new(stale_after: Duration) -> Self {
        Self {
            stale_after,
            latest: None,
            stale: false,
            stale_since_unix_ns: 0,
            published: None,
            not_monitored: BTreeMap::new(),
            changed: None,
        }
    }

    /// Records that a sample was diagnosed.
    pub fn sample(&mut self, now: Instant) {
        self.latest = Some(now);
        self.stale = false;
    }

    /// Checks whether samples have stopped; returns true the first time.
    pub fn look(&mut self, now: Instant, now_unix_ns: u64) -> bool {
        let age = self.latest.map(|latest| now.duration_since(latest));
        let silent = age.filter(|age| *age >= self.stale_after);
        let begins = silent.filter(|_| !self.stale);
        self.stale = silent.is_some();
        if let Some(age) = begins {
            let age_ns = u64::try_from(age.as_nanos()).unwrap_or(u64::MAX);
            self.stale_since_unix_ns = now_unix_ns.saturating_sub(age_ns);
        }
        begins.is_some()
    }

    /// Whether samples have stopped.
    #[must_use]
    pub fn is_stale(&self) -> bool {
        self.stale
    }

    /// The phase as published.
    #[must_use]
    pub fn phase(&self, diagnosed: ModulePhase) -> ModulePhase {
        if self.stale { ModulePhase::Stale } else { diagnosed }
    }

    /// If `phase` differs from the phase published before, records it as published and returns the former one.
    pub fn change_to(&mut self, phase: ModulePhase) -> Option<Option<ModulePhase>> {
        if self.published == Some(phase) {
            return None;
        }
        // In the new phase nothing has been published of its components.
        self.not_monitored.clear();
        self.changed = None;
        Some(self.published.replace(phase))
    }

    /// If other components are not monitored than published before, records them as published and returns true. Only a
    /// module in service has such components.
    pub fn change_of_monitored(
        &mut self,
        not_monitored: &BTreeMap<ComponentPath, String>,
        now: Instant,
    ) -> bool {
        let is_early =
            self.changed.is_some_and(|changed| now.duration_since(changed) < REPORT_EVERY);
        // The reasons alone may change from one window to the next.
        if is_early || self.not_monitored.keys().eq(not_monitored.keys()) {
            return false;
        }
        (self.not_monitored, self.changed) = (not_monitored.clone(), Some(now));
        true
    }

    /// The reason for this phase.
    #[must_use]
    pub fn reason(&self, phase: ModulePhase, refusals: &RecentRefusals, now: Instant) -> String {
        let without_samples = matches!(phase, ModulePhase::Waiting | ModulePhase::Stale);
        let refused = refusals.present(now, self.stale_after);
        if let Some(refused) = refused.filter(|_| without_samples) {
            return refused;
        }
        match phase {
            ModulePhase::Waiting => NO_SAMPLE_YET.to_owned(),
            ModulePhase::Initialising => {
                "a channel rests on too few samples, or samples are missing".to_owned()
            }
            ModulePhase::InService => "every channel with a signal is watched".to_owned(),
            // A duration would be outdated as soon as it is read.
            ModulePhase::Stale => format!("no sample since {}", utc(self.stale_since_unix_ns)),
        }
    }
}

/// Refusals are counted over periods of this length.
const SPAN: Duration = Duration::from_secs(1);

/// Recently refused samples: the reason for an unknown state.
#[derive(Debug, Default)]
pub struct RecentRefusals(Option<LatestRefusal>);

#[derive(Debug)]
struct LatestRefusal {
    reason: String,
    at: Instant,
    span_began: Instant,
    in_span: u64,
    in_span_before: Option<u64>,
}

impl RecentRefusals {
    /// Records a refused sample.
    pub fn note(&mut self, reason: String, now: Instant) {
        let latest = self.0.get_or_insert_with(|| LatestRefusal::begins(now));
        latest.count(now);
        latest.reason = reason;
    }

    /// The reason for refusals within the last `span`, and their rate per second.
    #[must_use]
    pub fn present(&self, now: Instant, span: Duration) -> Option<String> {
        let latest = self.0.as_ref().filter(|latest| now.duration_since(latest.at) < span)?;
        let LatestRefusal { reason, in_span, in_span_before, .. } = latest;
        let rate = in_span_before.unwrap_or(*in_span);
        Some(format!("samples arrive and are refused: {reason} ({rate} a second)"))
    }
}

impl LatestRefusal {
    fn begins(now: Instant) -> Self {
        Self { reason: String::new(), at: now, span_began: now, in_span: 0, in_span_before: None }
    }

    fn count(&mut self, now: Instant) {
        let spans = now.duration_since(self.span_began).as_nanos() / SPAN.as_nanos();
        if spans > 0 {
            self.in_span_before = (spans == 1).then_some(self.in_span);
            self.span_began = now;
            self.in_span = 0;
        }
        self.in_span += 1;
        self.at = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_begins_once_and_ends_with_a_sample() {
        let limit = Duration::from_millis(500);
        let mut staleness = Staleness::new(limit);
        let start = Instant::now();
        assert!(
            !staleness.look(start + 10 * limit, 0),
            "before the first sample it is waiting, not stale"
        );
        staleness.sample(start);
        assert!(!staleness.look(start + limit / 2, 0));
        assert!(staleness.look(start + limit, 1_500_000_000) && staleness.is_stale());
        assert!(!staleness.look(start + 2 * limit, 2_000_000_000) && staleness.is_stale());
        let (refusals, later) = (RecentRefusals::default(), start + 20 * limit);
        let reason = staleness.reason(ModulePhase::Stale, &refusals, later);
        assert_eq!(reason, "no sample since 1970-01-01T00:00:01.000Z", "true whenever it is read");
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::Stale);
        staleness.sample(start + 3 * limit);
        assert_eq!(staleness.phase(ModulePhase::InService), ModulePhase::InService);
    }

    #[test]
    fn a_phase_is_published_once() {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        assert_eq!(staleness.change_to(ModulePhase::Waiting), Some(None));
        assert_eq!(staleness.change_to(ModulePhase::Waiting), None);
        assert_eq!(staleness.change_to(ModulePhase::Stale), Some(Some(ModulePhase::Waiting)));
    }

    #[test]
    fn other_components_that_are_not_monitored_are_reported_at_most_every_ten_seconds() {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        let start = Instant::now();
        let lost = |names: &[&str]| -> BTreeMap<ComponentPath, String> {
            let why = "it cannot be compared".to_owned();
            names.iter().map(|name| (name.parse().unwrap(), why.clone())).collect()
        };
        let mut is_reported = |names: &[&str], seconds| {
            staleness.change_of_monitored(&lost(names), start + Duration::from_secs(seconds))
        };
        assert!(!is_reported(&[], 0));
        assert!(is_reported(&["m1/sensor/g1"], 1));
        assert!(!is_reported(&["m1/sensor/g1"], 30));
        assert!(is_reported(&["m1/sensor/g1", "m1/sensor/g2"], 30));
        assert!(!is_reported(&[], 31) && !is_reported(&[], 39));
        assert!(is_reported(&[], 40), "its end is reported, too");
    }

    #[test]
    fn a_new_phase_begins_without_components_that_are_not_monitored() {
        let mut staleness = Staleness::new(Duration::from_millis(500));
        let start = Instant::now();
        let lost = BTreeMap::from([("m1/sensor/g1".parse().unwrap(), "why".to_owned())]);
        let _ = staleness.change_to(ModulePhase::InService);
        assert!(staleness.change_of_monitored(&lost, start));
        let _ = staleness.change_to(ModulePhase::Stale);
        let _ = staleness.change_to(ModulePhase::InService);
        assert!(staleness.change_of_monitored(&lost, start), "it is reported again");
        let _ = staleness.change_to(ModulePhase::Stale);
        assert!(
            !staleness.change_of_monitored(&BTreeMap::new(), start),
            "nothing is claimed to be back"
        );
    }

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn the_reason_is_the_latest_and_the_rate_that_of_the_last_second() {
        let mut refusals = RecentRefusals::default();
        let start = Instant::now();
        assert_eq!(refusals.present(start, SPAN), None);
        for ms in 0..1500 {
            refusals.note("wrong number of values".to_owned(), start + ms * MS);
        }
        let now = start + 1500 * MS;
        let expected = "samples arrive and are refused: wrong number of values (1000 a second)";
        assert_eq!(refusals.present(now, 500 * MS).as_deref(), Some(expected));
        assert_eq!(refusals.present(now + 500 * MS, 500 * MS), None, "they have stopped");
    }
}
